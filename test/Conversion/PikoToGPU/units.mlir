// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-pre-schedule,piko-eliminate-schedules,piko-form-kernels,piko-form-work,piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' | FileCheck %s --check-prefix=ASKED
// Which block of a grid runs which unit, by what is resolved of the stage's schedule.

// Where nothing is, blocks take units from a counter, and the hardware starts none.
// ASKED-LABEL: piko.kernel @kernel_direct
// ASKED-NOT:     arith.cmpi ule
// ASKED:         piko.gpu.take_units
// ASKED-LABEL: piko.kernel @kernel_balanced
// ASKED-NOT:     arith.cmpi ule
// ASKED:         piko.gpu.take_units
// ASKED-LABEL: piko.kernel @kernel_chunks
// ASKED-NOT:     arith.cmpi ule
// ASKED:         piko.gpu.take_units

piko.record @F {"x" : i32 at 0} size 4 align 4

// Where a source's primitives are placed no schedule is asked: a fixed stride.
// CHECK-LABEL: piko.kernel @source_0_direct
// CHECK:         gpu.launch blocks(%[[B:[a-z0-9]+]], {{[^)]*}}) in (%[[N:[a-z0-9_]+]] =
// CHECK:           scf.for %{{.*}} = %[[B]] to %{{.*}} step %[[N]]
// CHECK-NOT:     piko.gpu.take_units

// The bin's core follows from its unit.
// CHECK-LABEL: piko.kernel @kernel_direct
// CHECK:         gpu.launch blocks(%[[B:[a-z0-9]+]], {{[^)]*}}) in (%[[N:[a-z0-9_]+]] =
// CHECK:           scf.for %{{.*}} = %[[B]] to %{{.*}} step %[[N]]
// CHECK-NOT:     piko.gpu.take_units

// The next unit is that block's which asks first. Blocks without one end at once.
// CHECK-LABEL: piko.kernel @kernel_balanced
// CHECK:         %[[LOG:.*]] = piko.gpu.open_log %[[BINS:.*]] :
// CHECK:         gpu.launch blocks(%[[B:[a-z0-9]+]], {{[^)]*}}) in (%[[N:[a-z0-9_]+]] = {{[^)]*}}) threads(%[[T:[a-z0-9]+]],
// CHECK-SAME:      %[[UNIT:[a-z0-9]+]] : memref<1xi32, #gpu.address_space<workgroup>>, %[[END:[a-z0-9]+]] : memref<1xi32, #gpu.address_space<workgroup>>, %[[SEVERAL:[a-z0-9]+]] : memref<1xi32, #gpu.address_space<workgroup>>) {
// CHECK:           %[[COUNT:.*]] = piko.storage.unit_count %[[BINS]]
// CHECK:           %[[ANY:.*]] = arith.cmpi ult, %[[B]], %[[COUNT]]
// CHECK:           scf.if %[[ANY]] {
// CHECK:             %[[IS_FIRST:.*]] = arith.cmpi eq, %[[T]], %c0
// CHECK:             scf.if %[[IS_FIRST]] {
// None are taken where each block has one; else the more the more there are.
// CHECK:               %[[IS_OWN:.*]] = arith.cmpi ule, %[[COUNT]], %[[N]]
// CHECK:               math.ctlz
// CHECK:               arith.shrui %[[COUNT]]
// CHECK:               %[[MANY:.*]] = arith.select %[[IS_OWN]], %c0_i32
// CHECK:               memref.store %[[MANY]], %[[SEVERAL]][%c0]
// CHECK:             scf.while
// CHECK:               scf.if %[[IS_FIRST]] {
// CHECK:                 %[[BEFORE:.*]] = memref.load %[[UNIT]][%c0]
// CHECK:                 %[[NEXT:.*]] = arith.addi %[[BEFORE]], %c1_i32
// CHECK:                 %[[LIMIT:.*]] = memref.load %[[END]][%c0]
// CHECK:                 %[[HAS:.*]] = arith.cmpi ult, %[[NEXT]], %[[LIMIT]]
// CHECK:                 scf.if %[[HAS]]
// CHECK:                   %[[FIRST:.*]] = piko.gpu.take_units %[[LOG]][%{{.*}}]{{$}}
// CHECK:                   arith.cmpi ult, %[[FIRST]], %[[COUNT]]
// All threads are told after a barrier, and come to another one before the next.
// CHECK:               gpu.barrier
// CHECK-NEXT:          %[[MINE:.*]] = memref.load %[[UNIT]][%c0]
// CHECK-NEXT:          %[[GOES_ON:.*]] = arith.cmpi ne, %[[MINE]], %c-1_i32
// CHECK-NEXT:          scf.condition(%[[GOES_ON]])
// CHECK:             } do {
// CHECK:               piko.storage.unit_buckets
// CHECK:               piko.gpu.flush
// CHECK:               piko.gpu.flush
// CHECK-NEXT:          gpu.barrier
// CHECK-NEXT:          scf.yield

// Chunks of a bin are for all cores: any block takes the next one.
// CHECK-LABEL: piko.kernel @kernel_chunks
// CHECK:         piko.gpu.take_units

// There is one unit.
// CHECK-LABEL: piko.kernel @kernel_one
// CHECK-NOT:     piko.gpu.take_units
// CHECK:         piko.gpu.close_log
piko.pipeline @P rank 1 {
  piko.source @direct
  piko.edge @direct[0] -> @balanced
  piko.edge @balanced[0] -> @chunks
  piko.edge @chunks[0] -> @one
  piko.stage @direct bins [8] threads 32 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule direct_map
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @balanced bins [8] threads 32 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule load_balance
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @chunks bins [8] threads 32 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule all
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @one bins [8] threads 32 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule serialize
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
