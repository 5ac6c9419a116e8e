// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-count-lanes))' %s | FileCheck %s

piko.record @V {"a" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @Lanes
// CHECK-NEXT: piko.counter 0 scalars of "a"
// CHECK-NEXT: piko.counter 1 vectors of "a"
// CHECK-NEXT: piko.counter 2 lanes of "a"
// CHECK-NEXT: piko.counter 3 active_lanes of "a"
piko.pipeline @Lanes rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}

  // Each unit has its sums; a block without a mask uses all of its lanes.
  // CHECK: scf.forall
  // CHECK-NEXT: %[[SUMS:.*]] = memref.alloca() : memref<4xindex>
  // CHECK: %[[X:.*]] = arith.addf %{{.*}} : vector<16xf32>
  // CHECK: scf.if
  // CHECK: arith.mulf
  // CHECK: arith.mulf
  // After the mask, two operations on as many lanes as it has.
  // CHECK: %[[BITS:.*]] = vector.bitcast %{{.*}} : vector<16xi1> to vector<1xi16>
  // CHECK: %[[ONES:.*]] = math.ctpop
  // CHECK: %[[COUNT:.*]] = arith.index_castui %[[ONES]]
  // CHECK: %[[LANES:.*]] = arith.constant 32 : index
  // CHECK: %[[ALL:.*]] = arith.muli %[[COUNT]], %[[LANES]] : index
  // CHECK: %[[WIDTH:.*]] = arith.constant 16 : index
  // CHECK: arith.divui %[[ALL]], %[[WIDTH]] : index
  // CHECK: piko.count 0 by
  // CHECK: piko.count 1 by
  // CHECK: piko.count 2 by
  // CHECK: piko.count 3 by
  piko.kernel @k {
    %x = arith.constant dense<1.0> : vector<16xf32>
    %limit = arith.constant dense<2.0> : vector<16xf32>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %units = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%units) {
      %sum = arith.addf %x, %x : vector<16xf32>
      %mask = arith.cmpf olt, %sum, %limit : vector<16xf32>
      %any = vector.reduction <or>, %mask : vector<16xi1> into i1
      scf.if %any {
        %y = arith.mulf %sum, %x : vector<16xf32>
        %z = arith.mulf %y, %x : vector<16xf32>
      }
    }
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

// What stands in a loop is counted for its line, which two copies share; a loop
// of which no line is known belongs to what is around it.
// CHECK-LABEL: piko.pipeline @Lines
// CHECK-NEXT: piko.counter 0 scalars of "a"{{$}}
// CHECK:      piko.counter 4 scalars of "a" inside 0
// CHECK-NEXT: piko.counter 5 vectors of "a" inside 0
// CHECK-NEXT: piko.counter 6 lanes of "a" inside 0
// CHECK-NEXT: piko.counter 7 active_lanes of "a" inside 0
// CHECK-NOT:  piko.counter 8
piko.pipeline @Lines rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}

  // CHECK: scf.forall
  // CHECK-NEXT: %[[SUMS:.*]] = memref.alloca() : memref<8xindex>
  // CHECK: scf.for
  // CHECK: arith.addf {{.*}} : vector<16xf32>
  // CHECK: %[[VECTORS:.*]] = arith.constant 5 : index
  // CHECK-NEXT: memref.load %[[SUMS]][%[[VECTORS]]]
  // CHECK: scf.for
  // CHECK: arith.mulf {{.*}} : vector<16xf32>
  // CHECK: %[[SAME:.*]] = arith.constant 5 : index
  // CHECK-NEXT: memref.load %[[SUMS]][%[[SAME]]]
  // CHECK: scf.for
  // CHECK: arith.subf {{.*}} : vector<16xf32>
  // CHECK: arith.constant 1 : index
  // CHECK-NEXT: %[[OUTSIDE:.*]] = arith.constant 1 : index
  // CHECK-NEXT: memref.load %[[SUMS]][%[[OUTSIDE]]]
  // CHECK: piko.count 7 by
  piko.kernel @k {
    %x = arith.constant dense<1.0> : vector<16xf32>
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c9 = arith.constant 9 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %units = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%units) {
      scf.for %i = %c0 to %c9 step %c1 {
        %y = arith.addf %x, %x : vector<16xf32>
      } loc("a.cpp":3:5)
      scf.for %i = %c0 to %c9 step %c1 {
        %y = arith.mulf %x, %x : vector<16xf32>
      } loc("a.cpp":3:9)
      scf.for %i = %c0 to %c9 step %c1 {
        %y = arith.subf %x, %x : vector<16xf32>
      } loc(unknown)
    }
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
