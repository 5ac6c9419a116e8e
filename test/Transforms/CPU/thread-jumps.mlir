// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-thread-jumps),canonicalize)' %s | FileCheck %s

piko.record @V {"x" : f32 at 0, "k" : i32 at 4} size 8 align 4

// The depth is computed where the pixel is inside, and the key is written where
// there is one; of the conjunction the left half is first.
// CHECK-LABEL: piko.kernel @nested
// CHECK:         %[[INSIDE:.*]] = arith.cmpi
// CHECK-NEXT:    scf.if %[[INSIDE]] {
// CHECK:           arith.divf
// CHECK:           %[[SEEN:.*]] = arith.cmpf ogt
// CHECK-NEXT:      scf.if %[[SEEN]] {
// CHECK:             %[[KEY:.*]] = arith.addi
// CHECK:             scf.if
// CHECK-NEXT:          piko.atomic max_signed @out[%{{.*}}] "k", %[[KEY]]
piko.pipeline @P rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @nested {
    %at = arith.constant 0 : index
    %zero = arith.constant 0.0 : f32
    %one = arith.constant 1.0 : f32
    %none = arith.constant 0 : i32
    %k = piko.load @in[%at : index] "k" : i32
    %x = piko.load @in[%at : index] "x" : f32
    %isInside = arith.cmpi sgt, %k, %none : i32
    %depth = arith.divf %one, %x : f32
    %isSeen = arith.cmpf ogt, %depth, %zero : f32
    %both = arith.andi %isInside, %isSeen : i1
    %key = scf.if %both -> (i32) {
      %0 = arith.bitcast %depth : f32 to i32
      %1 = arith.addi %0, %k : i32
      scf.yield %1 : i32
    } else {
      scf.yield %none : i32
    }
    %isAny = arith.cmpi ne, %key, %none : i32
    scf.if %isAny {
      piko.atomic max_signed @out[%at : index] "k", %key : i32
    }
  }

  // Little work, work that the other side or the code after needs, and a
  // condition after an effect stay where they are.
  // CHECK-LABEL: piko.kernel @kept
  // CHECK:         %[[LITTLE:.*]] = arith.andi
  // CHECK:         scf.if %[[LITTLE]] {
  // CHECK:         arith.divf
  // CHECK:         %[[BOTH:.*]] = arith.andi
  // CHECK-NEXT:    %[[Q:.*]] = scf.if %[[BOTH]] -> (f32) {
  // CHECK:         piko.store %[[Q]]
  // CHECK:         %[[R:.*]] = scf.if
  // CHECK:         piko.store
  // CHECK:         scf.if
  // CHECK-NEXT:      piko.atomic
  piko.kernel @kept {
    %at = arith.constant 0 : index
    %zero = arith.constant 0.0 : f32
    %one = arith.constant 1.0 : f32
    %none = arith.constant 0 : i32
    %k = piko.load @in[%at : index] "k" : i32
    %x = piko.load @in[%at : index] "x" : f32
    %isInside = arith.cmpi sgt, %k, %none : i32
    %isPositive = arith.cmpf ogt, %x, %zero : f32
    %little = arith.andi %isInside, %isPositive : i1
    scf.if %little {
      piko.atomic max_signed @out[%at : index] "k", %k : i32
    }
    %depth = arith.divf %one, %x : f32
    %isSeen = arith.cmpf ogt, %depth, %zero : f32
    %both = arith.andi %isInside, %isSeen : i1
    %q = scf.if %both -> (f32) {
      %0 = arith.mulf %depth, %depth : f32
      scf.yield %0 : f32
    } else {
      scf.yield %depth : f32
    }
    piko.store %q, @out[%at : index] "x" : f32
    %r = scf.if %isPositive -> (i32) {
      %y = piko.load @in[%at : index] "k" : i32
      scf.yield %y : i32
    } else {
      scf.yield %none : i32
    }
    piko.store %one, @out[%at : index] "x" : f32
    %isAny = arith.cmpi ne, %r, %none : i32
    scf.if %isAny {
      piko.atomic max_signed @out[%at : index] "k", %r : i32
    }
  }

  // The bits of a float that is not 0 are not all 0, shifted or with others. Those
  // of another float may be, of one on the other side of its condition, of one
  // that may be no number, and those that a shift may have lost.
  // CHECK-LABEL: piko.kernel @known
  // CHECK:         scf.if
  // CHECK-NOT:       scf.if
  // CHECK:           piko.atomic max_unsigned @out[%{{.*}}] "k"
  // CHECK:           arith.cmpi ne
  // CHECK-NEXT:      scf.if
  // CHECK:           arith.cmpi ne
  // CHECK-NEXT:      scf.if
  // CHECK:         } else {
  // CHECK:           arith.cmpi ne
  // CHECK-NEXT:      scf.if
  // CHECK:         arith.cmpf une
  // CHECK-NEXT:    scf.if
  // CHECK:           arith.cmpi ne
  // CHECK-NEXT:      scf.if
  piko.kernel @known {
    %at = arith.constant 0 : index
    %zero = arith.constant 0.0 : f32
    %none = arith.constant 0 : i32
    %wide_none = arith.constant 0 : i64
    %c32 = arith.constant 32 : i64
    %c33 = arith.constant 33 : i64
    %k = piko.load @in[%at : index] "k" : i32
    %x = piko.load @in[%at : index] "x" : f32
    %y = arith.addf %x, %x : f32
    %isSeen = arith.cmpf ogt, %x, %zero : f32
    %bits = arith.bitcast %x : f32 to i32
    %wide = arith.extui %bits : i32 to i64
    scf.if %isSeen {
      %high = arith.shli %wide, %c32 : i64
      %low = arith.extui %k : i32 to i64
      %key = arith.ori %high, %low : i64
      %any = arith.cmpi ne, %key, %wide_none : i64
      scf.if %any {
        piko.atomic max_unsigned @out[%at : index] "k", %k : i32
      }
      %lost = arith.shli %wide, %c33 : i64
      %any_lost = arith.cmpi ne, %lost, %wide_none : i64
      scf.if %any_lost {
        piko.atomic max_unsigned @out[%at : index] "k", %k : i32
      }
      %other = arith.bitcast %y : f32 to i32
      %any_other = arith.cmpi ne, %other, %none : i32
      scf.if %any_other {
        piko.atomic max_unsigned @out[%at : index] "k", %k : i32
      }
    } else {
      %any = arith.cmpi ne, %bits, %none : i32
      scf.if %any {
        piko.atomic max_unsigned @out[%at : index] "k", %k : i32
      }
    }
    %isOther = arith.cmpf une, %y, %zero : f32
    scf.if %isOther {
      %other = arith.bitcast %y : f32 to i32
      %any = arith.cmpi ne, %other, %none : i32
      scf.if %any {
        piko.atomic max_unsigned @out[%at : index] "k", %k : i32
      }
    }
  }
}
