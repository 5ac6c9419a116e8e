// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-compact-loops),canonicalize,cse)' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-compact-loops),canonicalize,cse)' %s 2>&1 >/dev/null | FileCheck %s --check-prefix=REMARKS

// The remarks are at the tests.
// REMARKS: {{[0-9]+}}:7: remark: stage 'tests': process puts off what passes this test, to do it together
// REMARKS: remark: stage 'little': process does what passes this test without delay
// REMARKS: note: too little is computed behind it: expected at least 32 operations, but got 0
// REMARKS-NOT: stage 'again'

piko.record @F {"at" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @Pixel {"z" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.image @depth : @Pixel rank 1
  piko.image @color : @Pixel rank 1
  piko.source @tests
  piko.source @little
  piko.source @again

  // The work goes behind the tests of a block, for what passed.
  // CHECK:       piko.kernel @kernel_tests
  // CHECK-DAG:     %[[LIST:.*]] = memref.alloca() : memref<64xindex>
  // CHECK-DAG:     %[[COUNT:.*]] = memref.alloca() : memref<1xindex>
  // CHECK-DAG:     %[[NEAREST:.*]] = memref.alloca() : memref<64xf32>
  // CHECK:         scf.for %[[B:.*]] = %{{.*}} to %{{.*}} step %c64
  // CHECK:           memref.store %c0, %[[COUNT]][%c0]
  // CHECK:           scf.for %[[I:.*]] = %[[B]] to
  // CHECK:             %[[PASSED:.*]]:2 = piko.update @depth
  // CHECK:             scf.if %[[PASSED]]#0
  // CHECK-NEXT:          %[[N:.*]] = memref.load %[[COUNT]][%c0]
  // CHECK-NEXT:          memref.store %[[I]], %[[LIST]][%[[N]]]
  // CHECK-NEXT:          memref.store %[[PASSED]]#1, %[[NEAREST]][%[[N]]]
  // CHECK-NEXT:          %[[N1:.*]] = arith.addi %[[N]], %c1
  // CHECK-NEXT:          memref.store %[[N1]], %[[COUNT]][%c0]
  // CHECK:           } {piko.lanes}
  // CHECK:           %[[END:.*]] = memref.load %[[COUNT]][%c0]
  // CHECK:           scf.for %[[J:.*]] = %c0 to %[[END]] step %c1
  // CHECK:             %[[K:.*]] = memref.load %[[LIST]][%[[J]]]
  // CHECK:             memref.load %[[NEAREST]][%[[J]]]
  // CHECK:             piko.storage.item %{{.*}}[%[[K]]]
  // CHECK:             scf.while
  // CHECK:             piko.update @color
  // CHECK:           } {piko.lanes}
  piko.stage @tests bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %at = piko.get %f "at" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %at : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %at = piko.get %f "at" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %c0 = arith.constant 0 : i32
      %c1 = arith.constant 1 : i32
      %n = arith.constant 9 : i32
      %passed, %old = piko.update @depth[%at : i32] {
      ^bb0(%d: f32):
        %less = arith.cmpf olt, %z, %d : f32
        %new = arith.select %less, %z, %d : f32
        piko.yield[%new : f32] results[%less, %d : i1, f32]
      } -> i1, f32
      scf.if %passed {
        %sum:2 = scf.while (%s = %old, %k = %c0) : (f32, i32) -> (f32, i32) {
          %more = arith.cmpi slt, %k, %n : i32
          scf.condition(%more) %s, %k : f32, i32
        } do {
        ^bb0(%s: f32, %k: i32):
          %0 = arith.mulf %s, %z : f32
          %1 = arith.addf %0, %s : f32
          %2 = arith.mulf %1, %z : f32
          %3 = arith.addf %2, %s : f32
          %4 = arith.mulf %3, %s : f32
          %5 = arith.addi %k, %c1 : i32
          scf.yield %4, %5 : f32, i32
        }
        piko.update @color[%at : i32] {
        ^bb0(%c: f32):
          piko.yield[%sum#0 : f32]
        }
      }
      piko.return
    }
  }

  // Too little for vectors.
  // CHECK:       piko.kernel @kernel_little
  // CHECK-NOT:     memref
  piko.stage @little bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %at = piko.get %f "at" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %at : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %at = piko.get %f "at" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %passed = piko.update @depth[%at : i32] {
      ^bb0(%d: f32):
        %less = arith.cmpf olt, %z, %d : f32
        %new = arith.select %less, %z, %d : f32
        piko.yield[%new : f32] results[%less : i1]
      } -> i1
      scf.if %passed {
        piko.update @color[%at : i32] {
        ^bb0(%c: f32):
          piko.yield[%z : f32]
        }
      }
      piko.return
    }
  }

  // The work writes what the test of the next primitive reads.
  // CHECK:       piko.kernel @kernel_again
  // CHECK-NOT:     memref
  piko.stage @again bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %at = piko.get %f "at" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %at : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %at = piko.get %f "at" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %c0 = arith.constant 0 : i32
      %c1 = arith.constant 1 : i32
      %n = arith.constant 9 : i32
      %passed = piko.update @depth[%at : i32] {
      ^bb0(%d: f32):
        %less = arith.cmpf olt, %z, %d : f32
        %new = arith.select %less, %z, %d : f32
        piko.yield[%new : f32] results[%less : i1]
      } -> i1
      scf.if %passed {
        %sum:2 = scf.while (%s = %z, %k = %c0) : (f32, i32) -> (f32, i32) {
          %more = arith.cmpi slt, %k, %n : i32
          scf.condition(%more) %s, %k : f32, i32
        } do {
        ^bb0(%s: f32, %k: i32):
          %0 = arith.mulf %s, %z : f32
          %1 = arith.addf %0, %s : f32
          %2 = arith.mulf %1, %z : f32
          %3 = arith.addf %2, %s : f32
          %4 = arith.mulf %3, %s : f32
          %5 = arith.addi %k, %c1 : i32
          scf.yield %4, %5 : f32, i32
        }
        piko.update @depth[%at : i32] {
        ^bb0(%d: f32):
          piko.yield[%sum#0 : f32]
        }
      }
      piko.return
    }
  }
}
