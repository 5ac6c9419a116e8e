// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=64},piko-to-grids,piko-form-program,convert-piko-to-scf),convert-piko-to-llvm,canonicalize,cse)' | FileCheck %s
// What a thread emits goes to its append buffer, and where that is full to another piece
// of memory; a flush says in a directory what the threads of a block have.

piko.record @F {"x" : i32 at 0} size 4 align 4

// CHECK-LABEL: func.func private @P.kernel_start
// CHECK-SAME:        (%[[FRAME:.*]]: !llvm.ptr)
// CHECK:         %[[BINS:.*]] = llvm.select
// CHECK:         %[[BLOCKS:.*]] = llvm.call @pikoir_blocks(%[[FRAME]], %c0_i32, %c0_i32, %c64_i64)
// CHECK:         %[[LOG:.*]] = llvm.call @pikoir_log_open(%[[FRAME]], %c0_i32, %c0_i32)
// CHECK:         gpu.launch blocks(%[[BLOCK:[a-z0-9]+]], {{.*}} threads(%[[T:[a-z0-9]+]],
// CHECK-SAME:        workgroup(%[[CELLS:[a-z0-9]+]] :
// The host does not know how many units there are.
// CHECK:           %[[COUNT:.*]] = llvm.getelementptr inbounds %[[BINS]][40]
// CHECK:           llvm.load %[[COUNT]]
// CHECK:           %[[BOX:.*]] = memref.alloca() : memref<7xi64>
// An entry of 32 bytes: its header and the record.
// CHECK:           %[[CURSOR:.*]] = memref.load %[[BOX]][%c1]
// CHECK:           %[[END:.*]] = arith.addi %[[CURSOR]], %c32_i64
// CHECK:           %[[LIMIT:.*]] = memref.load %[[BOX]][%c2]
// CHECK:           %[[FITS:.*]] = arith.cmpi sle, %[[END]], %[[LIMIT]]
// CHECK:           %[[ENTRY:.*]] = scf.if %[[FITS]] -> (i64) {
// CHECK-NEXT:        memref.store %[[END]], %[[BOX]][%c1]
// CHECK-NEXT:        scf.yield %[[CURSOR]]
// CHECK:           } else {
// Twice as much as before, and a link to it from where the last one ends. What comes
// first, the lanes of a warp that are active take by one atomic of the lowest.
// CHECK:             %[[NEW:.*]] = arith.cmpi eq, %{{.*}}, %c0_i64
// CHECK:             %[[BEFORE:.*]] = memref.load %[[BOX]][%c3]
// CHECK:             %[[TWICE:.*]] = arith.addi %[[BEFORE]], %[[BEFORE]]
// CHECK:             %[[BYTES:.*]] = arith.maxui %[[TWICE]], %c512_i64
// CHECK:             %[[FIRST:.*]] = scf.if %[[NEW]] -> (i64) {
// CHECK:               %[[ACTIVE:.*]] = llvm.call_intrinsic "llvm.nvvm.activemask"
// CHECK:               %[[LANE:.*]] = math.cttz %[[ACTIVE]]
// CHECK:               scf.if
// CHECK:                 %[[LANES:.*]] = math.ctpop %[[ACTIVE]]
// CHECK:                 llvm.atomicrmw add
// CHECK-COUNT-2:       llvm.call_intrinsic "llvm.nvvm.shfl.sync.idx.i32"(%[[ACTIVE]], %{{.*}}, %[[LANE]], %c31_i32)
// CHECK:             } else {
// CHECK:               llvm.atomicrmw add %{{.*}}, %[[BYTES]] monotonic
// CHECK:             memref.store %[[FIRST]], %[[BOX]][%c0]
// CHECK:             llvm.store %[[FIRST]], %{{.*}} : i64
// The record stands after the header.
// CHECK:           %[[AT:.*]] = arith.addi %[[ENTRY]], %c16_i64
// CHECK:           %[[GLOBAL:.*]] = llvm.inttoptr %[[AT]] : i64 to !llvm.ptr<1>
// CHECK:           %[[RECORD:.*]] = llvm.addrspacecast %[[GLOBAL]] : !llvm.ptr<1> to !llvm.ptr
// CHECK:           llvm.store %{{.*}}, %[[RECORD]] {{.*}}: i32
// CHECK:           scf.for
//
// The flush of a round: threads that have something vote, and a sum over the two
// warps gives each its place.
// CHECK:           %[[BEGIN:.*]] = memref.load %[[BOX]][%c0]
// CHECK:           %[[NOW:.*]] = memref.load %[[BOX]][%c1]
// CHECK:           %[[HAS:.*]] = arith.cmpi ne, %[[BEGIN]], %[[NOW]]
// CHECK:           %[[ANY:.*]] = llvm.call_intrinsic "llvm.nvvm.barrier.cta.red.or.aligned.all"(%c0_i32, %[[HAS]])
// CHECK:           scf.if %[[ANY]] {
// CHECK:           %[[VOTES:.*]] = llvm.call_intrinsic "llvm.nvvm.vote.ballot.sync"(%c-1_i32, %[[HAS]])
// CHECK:           %[[BELOW:.*]] = llvm.call_intrinsic "llvm.nvvm.read.ptx.sreg.lanemask.lt"
// CHECK:           %[[MASKED:.*]] = arith.andi %[[VOTES]], %[[BELOW]]
// CHECK:           %[[RANK:.*]] = math.ctpop %[[MASKED]]
// CHECK:           gpu.barrier
// CHECK:           %[[SUMS:.*]]:2 = scf.for %{{.*}} = %c0 to %c2
// One reservation for the block: a header, and 16 bytes for each of these threads.
// CHECK:             %[[SPANS:.*]] = arith.muli %[[SUMS]]#1, %c16_i64
// CHECK:             llvm.atomicrmw add
// After the unit's last directory, or as its first.
// CHECK:               %[[UNITS:.*]] = llvm.getelementptr inbounds %[[LOG]][24]
// CHECK:               llvm.load %[[UNITS]]
// CHECK:               arith.muli %{{.*}}, %c24_i64
// CHECK:               arith.select
// CHECK:             memref.store %{{.*}}, %[[CELLS]][%c32]
// CHECK:           gpu.barrier
// CHECK:           scf.if %[[HAS]] {
// CHECK:             llvm.store %[[BEGIN]]
// CHECK:             llvm.store %[[NOW]]
// CHECK:             memref.store %[[NOW]], %[[BOX]][%c0]
// CHECK:         llvm.call @pikoir_log_close(%[[FRAME]], %[[LOG]])
piko.pipeline @P rank 1 {
  piko.source @start
  piko.edge @start[0] -> @last
  piko.stage @start bins [8] threads 64 placed : @F -> [@F] {}
  piko.stage @last bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @source_0_start {
    piko.items of @start source 0 {
    ^bb0(%f: !piko.prim<@F>):
      %bin = arith.constant 0 : index
      piko.place %f of @start in %bin : !piko.prim<@F>
    }
  }
  piko.kernel @kernel_start {
    piko.bins of @start {
    ^bb0(%bin: index):
      piko.items of @start {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        piko.place %p of @last in %bin : !piko.prim<@F>
      }
    }
  }
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}
