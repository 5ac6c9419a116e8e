// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,canonicalize,cse))' --split-input-file %s | FileCheck %s

// An array that is filled before the lanes' loop is the same for all of
// them. Lanes that are still in a loop are at one place of it, so that what
// stands there is one number, and what it leads to is loaded once.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Ordered
// CHECK:         %[[ORDER:.*]] = memref.alloca() : memref<8xindex>
// CHECK:         scf.while (%{{.*}} = %{{.*}}, %{{.*}} = %{{.*}}) : ({{.*}}vector<16xi1>{{.*}})
// CHECK:         } do {
// CHECK:           %[[PLACE:.*]] = memref.load %[[ORDER]][%{{.*}}] : memref<8xindex>
// CHECK-NEXT:      %[[LIGHT:.*]] = piko.load checked @lights[%[[PLACE]] : index] "z" : f32
// CHECK-NOT:     piko.cpu.gather @lights
piko.pipeline @Ordered rank 1 {
  piko.buffer @in : @V
  piko.buffer @lights : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c8 = arith.constant 8 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %order = memref.alloca() : memref<8xindex>
      scf.for %i = %c0 to %c8 step %c1 {
        %from = arith.subi %c8, %i : index
        memref.store %from, %order[%i] : memref<8xindex>
      }
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "z" : f32
        %end:2 = scf.while (%i = %c0, %sum = %v) : (index, f32) -> (index, f32) {
          %more = arith.cmpf ogt, %sum, %v : f32
          scf.condition(%more) %i, %sum : index, f32
        } do {
        ^bb0(%i: index, %sum: f32):
          %place = memref.load %order[%i] : memref<8xindex>
          %light = piko.load checked @lights[%place : index] "z" : f32
          %product = arith.mulf %light, %v : f32
          %less = arith.subf %sum, %product : f32
          %next = arith.addi %i, %c1 : index
          scf.yield %next, %less : index, f32
        }
        piko.store %end#1, checked @out[%x : index] "z" : f32
      } {piko.lanes}
    }
  }
}

// -----

// One that the loop changes holds what each lane has put there.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Changed
// CHECK:         %[[LAST:.*]] = memref.alloca() : memref<8xf32>
// CHECK:         vector.gather %[[LAST]]
// CHECK:         vector.scatter %[[LAST]]
piko.pipeline @Changed rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c8 = arith.constant 8 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %last = memref.alloca() : memref<8xf32>
      scf.for %x = %c0 to %n step %c1 {
        %own = arith.remui %x, %c8 : index
        %before = memref.load %last[%own] : memref<8xf32>
        %v = piko.load checked @in[%x : index] "z" : f32
        %sum = arith.addf %before, %v : f32
        memref.store %sum, %last[%own] : memref<8xf32>
        piko.store %sum, checked @out[%x : index] "z" : f32
      } {piko.lanes}
    }
  }
}
