// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An integer division goes under a test of whether it has a result; otherwise
// the stage is reported, and 0 taken.
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,convert-piko-to-scf),canonicalize,cse)' %s | FileCheck %s
// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu %s | FileCheck %s --check-prefix=LLVM

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// CHECK-LABEL: piko.kernel @kernel_a
// CHECK-DAG: %[[ZERO:.*]] = arith.constant 0 : i32
// CHECK-DAG: %[[LEAST:.*]] = arith.constant -2147483648 : i32
// CHECK-DAG: %[[MINUS:.*]] = arith.constant -1 : i32
// CHECK: %[[X:.*]] = piko.get %{{.*}} "x"
// CHECK: %[[Y:.*]] = piko.get %{{.*}} "y"
// CHECK: %[[ANY:.*]] = arith.cmpi ne, %[[Y]], %[[ZERO]]
// CHECK: %[[A:.*]] = arith.cmpi ne, %[[X]], %[[LEAST]]
// CHECK: %[[B:.*]] = arith.cmpi ne, %[[Y]], %[[MINUS]]
// CHECK: %[[FITS:.*]] = arith.ori %[[A]], %[[B]]
// CHECK: %[[OK:.*]] = arith.andi %[[ANY]], %[[FITS]]
// CHECK: scf.if %[[OK]] -> (i32) {
// CHECK-NEXT: %[[Q:.*]] = arith.divsi %[[X]], %[[Y]]
// CHECK-NEXT: scf.yield %[[Q]]
// CHECK-NEXT: } else {
// CHECK-NEXT: %[[BIN:.*]] = piko.storage.bucket_bin
// CHECK-NEXT: piko.fail_divide @a in %[[BIN]]
// CHECK-NEXT: scf.yield %[[ZERO]]
// An unsigned quotient always fits.
// CHECK: scf.if %[[ANY]] -> (i32) {
// CHECK-NEXT: arith.remui %[[X]], %[[Y]]
// CHECK: piko.fail_divide @a of "b"{{$}}

// LLVM: %[[CODE:.*]] = arith.constant 23 : i32
// LLVM: llvm.call @pikoir_fail(
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %c0 = arith.constant 0 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %q = piko.divide quotient_signed %x, %y : i32
      piko.store %q, @out[%c0 : index] "x" : i32
      %r = piko.divide of "b" assign remainder_unsigned %x, %y : i32
      piko.store %r, @out[%c0 : index] "y" : i32
      piko.return
    }
  }
}
