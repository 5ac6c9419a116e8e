// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An integer division keeps its form, unless its divisor is a constant with
// which it always has a result.
// RUN: piko-opt %s | piko-opt | FileCheck %s
// RUN: piko-opt %s --canonicalize='test-convergence' | FileCheck %s --check-prefix=FOLDED

piko.record @F {"x" : i32 at 0, "y" : i32 at 4, "l" : i64 at 8} size 16 align 8
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %c0 = arith.constant 0 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %l = piko.get %f "l" : !piko.prim<@F> -> i64
      %zero = arith.constant 0 : i32
      %three = arith.constant 3 : i32
      %minus = arith.constant -1 : i32
      // CHECK: %[[Q:.*]] = piko.divide quotient_signed %[[X:.*]], %[[Y:.*]] : i32
      // CHECK-NEXT: piko.store %[[Q]]
      // FOLDED: piko.divide quotient_signed
      %q = piko.divide quotient_signed %x, %y : i32
      piko.store %q, @out[%c0 : index] "x" : i32
      // CHECK: piko.divide of "b" assign remainder_unsigned %{{.*}}, %{{.*}} : i64
      // FOLDED: piko.divide of "b" assign remainder_unsigned
      %r = piko.divide of "b" assign remainder_unsigned %l, %l : i64
      piko.store %r, @out[%c0 : index] "l" : i64
      // FOLDED: arith.divsi
      %by3 = piko.divide quotient_signed %x, %three : i32
      piko.store %by3, @out[%c0 : index] "x" : i32
      // FOLDED: arith.remui
      %mod = piko.divide remainder_unsigned %x, %minus : i32
      piko.store %mod, @out[%c0 : index] "x" : i32
      // FOLDED: piko.divide remainder_signed
      %m = piko.divide remainder_signed %x, %minus : i32
      piko.store %m, @out[%c0 : index] "x" : i32
      // FOLDED: piko.divide quotient_unsigned
      %z = piko.divide quotient_unsigned %x, %zero : i32
      piko.store %z, @out[%c0 : index] "x" : i32
      // What nobody needs is not computed.
      // FOLDED-NOT: piko.divide
      %none = piko.divide quotient_unsigned %y, %x : i32
      piko.return
    }
  }
}
