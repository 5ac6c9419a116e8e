// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-merge-bounds))' %s | FileCheck %s

piko.record @V {"x" : f32 at 0, "y" : f32 at 4, "z" : f32[3 : 4] at 8} size 20 align 4
piko.record @Wide {"x" : f32 at 0, "y" : f32 at 64} size 68 align 4

// Four reads of an element under one test, with the error of the first; what
// stands between stays behind, and one that a condition guards is read along. A
// read of another element, one of what the kernel changes, and one in a condition
// of a record that is larger than a line of the cache keep their tests.
// CHECK-LABEL: piko.kernel @k
// CHECK:         %[[XYZ:.*]]:4 = scf.if %[[INSIDE:.*]] -> (f32, f32, f32, f32) {
// CHECK-NEXT:      %[[X:.*]] = piko.load checked @mesh[%[[I:.*]] : i32] "x" : f32
// CHECK-NEXT:      %[[Y:.*]] = piko.load checked @mesh[%[[I]] : i32] "y" : f32
// CHECK-NEXT:      %[[Z:.*]] = piko.load checked @mesh[%[[I]] : i32] "z"[%{{.*}}] : f32
// CHECK-NEXT:      %[[W:.*]] = piko.load checked @mesh[%[[I]] : i32] "y" : f32
// CHECK-NEXT:      scf.yield %[[X]], %[[Y]], %[[Z]], %[[W]] : f32, f32, f32, f32
// CHECK-NEXT:    } else {
// CHECK-NEXT:      piko.fail
// CHECK-NEXT:      scf.yield %[[ZERO:.*]], %[[ZERO]], %[[ZERO]], %[[ZERO]]
// CHECK-NEXT:    }
// CHECK-NEXT:    %[[SQUARE:.*]] = arith.mulf %[[XYZ]]#0, %[[XYZ]]#0 : f32
// CHECK-NEXT:    %[[OTHER:.*]] = arith.cmpi ult
// CHECK-NEXT:    scf.if %[[OTHER]] -> (f32) {
// CHECK-NEXT:      piko.load checked @mesh
// CHECK:         arith.addf %[[SQUARE]], %[[XYZ]]#1
// CHECK:         arith.addf %{{.*}}, %[[XYZ]]#2
// CHECK:         scf.if %{{.*}} {
// CHECK-NEXT:      piko.store %[[XYZ]]#3, checked @out
// CHECK:         scf.if %[[INSIDE]] -> (f32) {
// CHECK-NEXT:      piko.load checked @out
// CHECK:         scf.if %[[INSIDE]] -> (f32) {
// CHECK-NEXT:      piko.load checked @out
// CHECK:         scf.if %[[INSIDE]] -> (f32) {
// CHECK-NEXT:      piko.load checked @wide
// CHECK:         scf.if %{{.*}} {
// CHECK-NEXT:      scf.if %[[INSIDE]] -> (f32) {
// CHECK-NEXT:        piko.load checked @wide
piko.pipeline @P rank 1 {
  piko.buffer @mesh : @V
  piko.buffer @out : @V
  piko.buffer @wide : @Wide
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c2 = arith.constant 2 : index
    %i = arith.constant 5 : i32
    %zero = arith.constant 0.0 : f32
    %at = arith.index_cast %i : i32 to index
    %n = piko.extent @mesh[0]
    %inside = arith.cmpi ult, %at, %n : index
    %x = scf.if %inside -> (f32) {
      %0 = piko.load checked @mesh[%i : i32] "x" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @mesh(%at)
      scf.yield %zero : f32
    }
    %square = arith.mulf %x, %x : f32
    %otherInside = arith.cmpi ult, %c2, %n : index
    %other = scf.if %otherInside -> (f32) {
      %0 = piko.load checked @mesh[%c2 : index] "x" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @mesh(%c2)
      scf.yield %zero : f32
    }
    %y = scf.if %inside -> (f32) {
      %0 = piko.load checked @mesh[%i : i32] "y" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @mesh(%at)
      scf.yield %zero : f32
    }
    %sum = arith.addf %square, %y : f32
    %z = scf.if %inside -> (f32) {
      %0 = piko.load checked @mesh[%i : i32] "z"[%c2] : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @mesh(%at)
      scf.yield %zero : f32
    }
    %all = arith.addf %sum, %z : f32
    %isMore = arith.cmpf ogt, %all, %other : f32
    scf.if %isMore {
      %w = scf.if %inside -> (f32) {
        %0 = piko.load checked @mesh[%i : i32] "y" : f32
        scf.yield %0 : f32
      } else {
        piko.fail @a in %c0 outside @mesh(%at)
        scf.yield %zero : f32
      }
      piko.store %w, checked @out[%c0 : index] "x" : f32
    }
    %u = scf.if %inside -> (f32) {
      %0 = piko.load checked @out[%i : i32] "x" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
      scf.yield %zero : f32
    }
    piko.store %u, checked @out[%c2 : index] "y" : f32
    %v = scf.if %inside -> (f32) {
      %0 = piko.load checked @out[%i : i32] "y" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
      scf.yield %zero : f32
    }
    piko.store %v, checked @out[%c2 : index] "x" : f32
    %a = scf.if %inside -> (f32) {
      %0 = piko.load checked @wide[%i : i32] "x" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @wide(%at)
      scf.yield %zero : f32
    }
    %isPositive = arith.cmpf ogt, %a, %zero : f32
    scf.if %isPositive {
      %b = scf.if %inside -> (f32) {
        %0 = piko.load checked @wide[%i : i32] "y" : f32
        scf.yield %0 : f32
      } else {
        piko.fail @a in %c0 outside @wide(%at)
        scf.yield %zero : f32
      }
      piko.store %b, checked @out[%c0 : index] "y" : f32
    }
  }
}
