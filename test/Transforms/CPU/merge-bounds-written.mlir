// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-merge-bounds))' %s | FileCheck %s

piko.record @V {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8} size 12 align 4

// Fields that nothing in between writes are read under one test, and those that
// nothing in between reads are written after one.
// CHECK-LABEL: piko.kernel @merged
// CHECK:         %[[XY:.*]]:2 = scf.if %[[INSIDE:.*]] -> (f32, f32) {
// CHECK-NEXT:      piko.load checked @out[%[[I:.*]] : i32] "x" : f32
// CHECK-NEXT:      piko.load checked @out[%[[I]] : i32] "y" : f32
// CHECK:         %[[SUM:.*]] = arith.addf %[[XY]]#0, %[[XY]]#1 : f32
// CHECK-NEXT:    scf.if %[[INSIDE]] {
// CHECK-NEXT:      piko.store %[[XY]]#0, checked @out[%[[I]] : i32] "z" : f32
// CHECK-NEXT:      piko.store %[[SUM]], checked @out[%[[I]] : i32] "x" : f32
// CHECK-NEXT:    } else {
// CHECK-NEXT:      piko.fail @a in %{{.*}} outside @out(%{{.*}})
// CHECK-NEXT:    }
piko.pipeline @P rank 1 {
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @merged {
    %c0 = arith.constant 0 : index
    %i = arith.constant 5 : i32
    %zero = arith.constant 0.0 : f32
    %at = arith.index_cast %i : i32 to index
    %n = piko.extent @out[0]
    %inside = arith.cmpi ult, %at, %n : index
    %x = scf.if %inside -> (f32) {
      %0 = piko.load checked @out[%i : i32] "x" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
      scf.yield %zero : f32
    }
    scf.if %inside {
      piko.store %x, checked @out[%i : i32] "z" : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
    }
    %y = scf.if %inside -> (f32) {
      %0 = piko.load checked @out[%i : i32] "y" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
      scf.yield %zero : f32
    }
    %sum = arith.addf %x, %y : f32
    scf.if %inside {
      piko.store %sum, checked @out[%i : i32] "x" : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
    }
  }

  // A read after a write of the field, perhaps of another element, stays there,
  // and the write before it; so does a write that is followed by another
  // test, whose error might come first.
  // CHECK-LABEL: piko.kernel @left
  // CHECK:         scf.if %[[INSIDE:.*]] {
  // CHECK-NEXT:      piko.store %{{.*}}, checked @out[%[[I:.*]] : i32] "x" : f32
  // CHECK-NEXT:    } else {
  // CHECK:         scf.if %[[INSIDE]] -> (f32) {
  // CHECK-NEXT:      piko.load checked @out[%[[I]] : i32] "x" : f32
  // CHECK:         scf.if %[[INSIDE]] {
  // CHECK-NEXT:      piko.store %{{.*}}, checked @out[%[[I]] : i32] "y" : f32
  // CHECK-NEXT:    } else {
  // CHECK:         scf.if %[[OTHER:.*]] {
  // CHECK-NEXT:      piko.store %{{.*}}, checked @out[%[[J:.*]] : i32] "z" : f32
  // CHECK-NEXT:    } else {
  // CHECK:         scf.if %[[INSIDE]] {
  // CHECK-NEXT:      piko.store %{{.*}}, checked @out[%[[I]] : i32] "z" : f32
  // CHECK-NEXT:    } else {
  piko.kernel @left {
    %c0 = arith.constant 0 : index
    %i = arith.constant 5 : i32
    %j = arith.constant 6 : i32
    %zero = arith.constant 0.0 : f32
    %at = arith.index_cast %i : i32 to index
    %other = arith.index_cast %j : i32 to index
    %n = piko.extent @out[0]
    %inside = arith.cmpi ult, %at, %n : index
    %otherInside = arith.cmpi ult, %other, %n : index
    scf.if %inside {
      piko.store %zero, checked @out[%i : i32] "x" : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
    }
    %x = scf.if %inside -> (f32) {
      %0 = piko.load checked @out[%i : i32] "x" : f32
      scf.yield %0 : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
      scf.yield %zero : f32
    }
    scf.if %inside {
      piko.store %x, checked @out[%i : i32] "y" : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
    }
    scf.if %otherInside {
      piko.store %x, checked @out[%j : i32] "z" : f32
    } else {
      piko.fail @a in %c0 outside @out(%other)
    }
    scf.if %inside {
      piko.store %x, checked @out[%i : i32] "z" : f32
    } else {
      piko.fail @a in %c0 outside @out(%at)
    }
  }
}
