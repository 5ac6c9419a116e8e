// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-narrow-integers),canonicalize,cse)' %s | FileCheck %s

piko.record @V {"n" : i64 at 0} size 8 align 8

// The steps are multiples of 256, so the functions are divided by that. What a
// row begins with is carried from the one before.
// CHECK-LABEL: piko.kernel @rectangle
// CHECK:         %[[BASE:.*]] = arith.shrsi %{{.*}}, %c8_i64
// CHECK:         arith.andi
// CHECK:         scf.if %{{.*}} {
// CHECK-NEXT:      scf.for {{.*}} iter_args(%[[ROW:.*]] = %{{.*}}, %[[ROW1:.*]] = %{{.*}}) -> (i32, i32)
// CHECK-NEXT:        scf.for %[[X:.*]] = %{{.*}} to
// CHECK:               arith.addi %[[ROW1]], %{{.*}} : i32
// CHECK:               arith.muli %[[X]], %{{.*}} : i32
// CHECK:               arith.addi %[[ROW]], %{{.*}} : i32
// CHECK:               %[[BITS:.*]] = arith.ori %{{.*}}, %{{.*}} : i32
// CHECK:               arith.cmpi sge, %[[BITS]], %c0_i32 : i32
// CHECK:             arith.addi %[[ROW]], %[[STEP:.*]] : i32
// CHECK:             arith.addi %[[ROW1]], %[[STEP]] : i32
// CHECK:         } else {
// CHECK:           scf.for
// CHECK:             scf.for
// CHECK:               arith.ori %{{.*}} : i64
// CHECK:               arith.cmpi sgt, %{{.*}}, %c-1_i64 : i64
piko.pipeline @P rank 2 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @V -> [] {}
  piko.kernel @rectangle {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %minus = arith.constant -1 : i64
    %c256 = arith.constant 256 : i64
    %c8 = arith.constant 8 : i64
    %n = piko.load @in[%zero : index] "n" : i64
    %stepX = arith.muli %n, %c256 : i64
    %stepY = arith.shli %n, %c8 : i64
    scf.for %y = %lo to %hi step %one : i32 {
      %y64 = arith.extsi %y : i32 to i64
      %py = arith.muli %stepY, %y64 : i64
      scf.for %x = %lo to %hi step %one : i32 {
        %x64 = arith.extsi %x : i32 to i64
        %px = arith.muli %stepX, %x64 : i64
        %e0 = arith.addi %n, %px : i64
        %e1 = arith.addi %e0, %py : i64
        %f1 = arith.subi %py, %px : i64
        %bits = arith.ori %e1, %f1 : i64
        %isInside = arith.cmpi sgt, %bits, %minus : i64
        scf.if %isInside {
          piko.atomic add @out[%zero : index] "n", %n : i64
        }
      } {piko.lanes}
    }
  }

  // What is carried from iteration to iteration is affine, too; a comparison of
  // two functions is the sign of their difference, if neither overflows.
  // CHECK-LABEL: piko.kernel @carried
  // CHECK:         scf.if
  // CHECK:           arith.cmpi sge, %{{.*}}, %c0_i32 : i32
  // CHECK:         } else {
  // CHECK:           arith.cmpi sge, %{{.*}} : i64
  piko.kernel @carried {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %n = piko.load @in[%zero : index] "n" : i64
    %least = piko.load @in[%zero : index] "n" : i64
    %last = scf.for %x = %lo to %hi step %one iter_args(%e = %n) -> (i64) : i32 {
      %isInside = arith.cmpi sge, %e, %least : i64
      scf.if %isInside {
        piko.atomic add @out[%zero : index] "n", %n : i64
      }
      %next = arith.addi %e, %n : i64
      scf.yield %next : i64
    } {piko.lanes}
    piko.store %last, @out[%zero : index] "n" : i64
  }

  // Neither is a product of variables, nor equality, nor a loop that is not for
  // lanes.
  // CHECK-LABEL: piko.kernel @kept
  // CHECK-NOT:     : i32 {{$}}
  // CHECK:         scf.for
  // CHECK-NOT:     scf.if %{{.*}} -> 
  // CHECK:           arith.cmpi sgt, %{{.*}} : i64
  // CHECK:           arith.cmpi eq, %{{.*}} : i64
  // CHECK:         scf.for
  // CHECK:           arith.cmpi sgt, %{{.*}} : i64
  piko.kernel @kept {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %minus = arith.constant -1 : i64
    %n = piko.load @in[%zero : index] "n" : i64
    scf.for %x = %lo to %hi step %one : i32 {
      %x64 = arith.extsi %x : i32 to i64
      %square = arith.muli %x64, %x64 : i64
      %e = arith.subi %square, %n : i64
      %isInside = arith.cmpi sgt, %e, %minus : i64
      %isSame = arith.cmpi eq, %x64, %n : i64
      %both = arith.andi %isInside, %isSame : i1
      scf.if %both {
        piko.atomic add @out[%zero : index] "n", %n : i64
      }
    } {piko.lanes}
    scf.for %x = %lo to %hi step %one : i32 {
      %x64 = arith.extsi %x : i32 to i64
      %e = arith.subi %x64, %n : i64
      %isInside = arith.cmpi sgt, %e, %minus : i64
      scf.if %isInside {
        piko.atomic add @out[%zero : index] "n", %n : i64
      }
    }
  }
}
