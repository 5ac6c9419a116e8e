// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=64},piko-to-grids,piko-form-program,convert-piko-to-scf),convert-piko-to-llvm,canonicalize,cse)' | FileCheck %s
// What a thread emits goes to its append buffer, and where that is full to another piece
// of memory; a flush says in a directory what the threads of a block have. All of that is
// C++ (pikort/grid_log.h), which kernels call until they are LLVM IR.

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
// A record of port 0 of the kernel's own stage, and the bucket that it is put into.
// CHECK:           %[[RECORD:.*]] = piko.gpu.call "pikoir_grid_append"(%[[LOG]], %[[BOX]], %c1_i64, %c0_i64, %c0_i32, %c0_i32, %c-1_i32, %c4_i64)
// CHECK:           llvm.store %{{.*}}, %[[RECORD]] {{.*}}: i32
// CHECK:           %[[BUCKET:.*]] = piko.gpu.call "pikoir_grid_append"(%[[LOG]], %[[BOX]], %c1_i64, %c0_i64, %c1_i32, %c0_i32, %c-1_i32, %c8_i64)
// CHECK:           llvm.store %{{.*}}, %[[BUCKET]] : i64
// The flush of a round, by all 64 threads.
// CHECK:           piko.gpu.call "pikoir_grid_flush"(%[[LOG]], %[[BOX]], %c1_i64, %c0_i32, %{{.*}}, %[[CELLS]], %c64_i32)
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
