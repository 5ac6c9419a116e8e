// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-forward-stores))' %s | FileCheck %s

piko.record @V {"x" : f32 at 0, "y" : f32 at 4, "z" : f32[3 : 4] at 8} size 20 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// What was stored is known, and so is what was read, also after a store to
// another field or to another element of an array, and in conditions and loops.
// CHECK-LABEL: piko.kernel @known
// CHECK:         piko.items
// CHECK:         %[[Y:.*]] = piko.load @out[%[[I:.*]] : i32] "y" : f32
// CHECK-NEXT:    piko.store %[[V:.*]], @out[%[[I]] : i32] "x" : f32
// CHECK-NEXT:    piko.store %[[V]], @out[%[[I]] : i32] "z"[%c0] : f32
// CHECK-NEXT:    piko.store %[[Y]], @out[%[[I]] : i32] "z"[%c1] : f32
// CHECK-NEXT:    %[[SUM:.*]] = arith.addf %[[Y]], %[[V]] : f32
// CHECK-NEXT:    %[[POSITIVE:.*]] = arith.cmpf ogt, %[[SUM]], %[[V]] : f32
// CHECK-NEXT:    scf.if %[[POSITIVE]] {
// CHECK-NEXT:      piko.store %[[Y]], @other[%[[I]] : i32] "x" : f32
// CHECK-NEXT:    }
// CHECK-NEXT:    scf.for
// CHECK-NEXT:      piko.store %[[V]], @other[%[[I]] : i32] "y" : f32
// CHECK-NEXT:    }
piko.pipeline @P rank 1 {
  piko.buffer @out : @V
  piko.buffer @other : @V
  piko.buffer @count : @N
  piko.constant @index : @N value [1 : i32]
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @known {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c9 = arith.constant 9 : index
    %i = arith.constant 5 : i32
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%p: !piko.prim<@V>):
        %v = piko.get %p "x" : !piko.prim<@V> -> f32
        %y = piko.load @out[%i : i32] "y" : f32
        piko.store %v, @out[%i : i32] "x" : f32
        piko.store %v, @out[%i : i32] "z"[%c0] : f32
        piko.store %y, @out[%i : i32] "z"[%c1] : f32
        %x = piko.load @out[%i : i32] "x" : f32
        %again = piko.load @out[%i : i32] "y" : f32
        %sum = arith.addf %again, %x : f32
        %z = piko.load @out[%i : i32] "z"[%c0] : f32
        %positive = arith.cmpf ogt, %sum, %z : f32
        scf.if %positive {
          %inside = piko.load @out[%i : i32] "z"[%c1] : f32
          piko.store %inside, @other[%i : i32] "x" : f32
        }
        scf.for %n = %c0 to %c9 step %c1 {
          %inside = piko.load @out[%i : i32] "x" : f32
          piko.store %inside, @other[%i : i32] "y" : f32
        }
      }
    }
  }

  // A store to what may be the same element, one in a condition, one that a later
  // iteration comes after, an atomic operation, and a parallel loop end what is known;
  // each primitive begins anew.
  // CHECK-LABEL: piko.kernel @unknown
  // CHECK:         piko.store %[[V:.*]], @out[%[[I:.*]] : i32] "x" : f32
  // CHECK-NEXT:    piko.store %{{.*}}, @out[%[[J:.*]] : i32] "x" : f32
  // CHECK-NEXT:    piko.load @out[%[[I]] : i32] "x" : f32
  // CHECK-NEXT:    arith.cmpf
  // CHECK-NEXT:    scf.if
  // CHECK-NEXT:      piko.store %{{.*}}, @out[%[[I]] : i32] "x" : f32
  // CHECK-NEXT:    }
  // CHECK-NEXT:    piko.load @out[%[[I]] : i32] "x" : f32
  // CHECK-NEXT:    scf.for
  // CHECK-NEXT:      piko.load @out[%[[I]] : i32] "x" : f32
  // CHECK-NEXT:      piko.store %{{.*}}, @out[%[[I]] : i32] "x" : f32
  // CHECK-NEXT:    }
  // CHECK-NEXT:    piko.load @count[%[[I]] : i32] "n" : i32
  // CHECK-NEXT:    piko.atomic add @count
  // CHECK-NEXT:    piko.load @count[%[[I]] : i32] "n" : i32
  // CHECK-NEXT:    piko.store %{{.*}}, @count
  // CHECK:         piko.load @count[%[[I]] : i32] "n" : i32
  piko.kernel @unknown {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c9 = arith.constant 9 : index
    %i = arith.constant 5 : i32
    %one = arith.constant 1 : i32
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%p: !piko.prim<@V>):
        %v = piko.get %p "x" : !piko.prim<@V> -> f32
        %j = piko.load @index "n" : i32
        piko.store %v, @out[%i : i32] "x" : f32
        piko.store %v, @out[%j : i32] "x" : f32
        %x = piko.load @out[%i : i32] "x" : f32
        %positive = arith.cmpf ogt, %x, %v : f32
        scf.if %positive {
          piko.store %v, @out[%i : i32] "x" : f32
        }
        %after = piko.load @out[%i : i32] "x" : f32
        scf.for %n = %c0 to %c9 step %c1 {
          %inside = piko.load @out[%i : i32] "x" : f32
          piko.store %after, @out[%i : i32] "x" : f32
        }
        %before = piko.load @count[%i : i32] "n" : i32
        piko.atomic add @count[%i : i32] "n", %one : i32
        %again = piko.load @count[%i : i32] "n" : i32
        piko.store %before, @count[%j : i32] "n" : i32
        piko.parallel_for %c9 {
        ^bb0(%k: index):
          piko.sync
          piko.yield
        }
        %last = piko.load @count[%i : i32] "n" : i32
        piko.store %last, @count[%again : i32] "n" : i32
      }
    }
  }
}
