// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reciprocals and square roots by the approximations that processors have
// instructions for.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATIONOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATIONOPS_TD

include "Piko/Dialect/Piko/IR/PikoBase.td"

/// As an operation of `arith`: of a float, or of each one of a vector.
class Piko_ApproximationOp<string mnemonic> : Piko_Op<mnemonic, [
    Pure, SameOperandsAndResultType, Elementwise, Scalarizable, Vectorizable,
    Tensorizable]> {
  let arguments = (ins FloatLike:$operand);
  let results = (outs FloatLike:$result);
  let assemblyFormat = "$operand attr-dict `:` type($result)";
  let hasVerifier = 1;
}

def Piko_ApproximateReciprocalOp : Piko_ApproximationOp<"approximate_reciprocal"> {
  let summary = "1 / x, within 4 ULP";
  let description = [{
    The target writes it as what its instruction approximates (`vrcp14ps`,
    `rcpps`, `rcp.approx`) and one step of Newton's method, or as a division where
    it has none. It gives the same for a number as for one of a vector. Of 0 it is
    infinite, of an infinity 0, both with the sign of the operand, and of a NaN
    NaN. Denormals may count as 0, operands and results alike.

    ```mlir
    %r = piko.approximate_reciprocal %z : f32
    %s = piko.approximate_reciprocal %values : vector<16xf32>
    ```
  }];
}

def Piko_ApproximateRsqrtOp : Piko_ApproximationOp<"approximate_rsqrt"> {
  let summary = "1 / sqrt(x), within 4 ULP";
  let description = [{
    See `piko.approximate_reciprocal`. Of a number below 0 it is NaN.

    ```mlir
    %r = piko.approximate_rsqrt %z : f32
    ```
  }];
}

def Piko_ApproximateSqrtOp : Piko_ApproximationOp<"approximate_sqrt"> {
  let summary = "sqrt(x), within 4 ULP";
  let description = [{
    See `piko.approximate_reciprocal`: x times the approximation of 1 / sqrt(x).
    0, of either sign, and infinity are their own roots.

    ```mlir
    %r = piko.approximate_sqrt %z : f32
    ```
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATIONOPS_TD
