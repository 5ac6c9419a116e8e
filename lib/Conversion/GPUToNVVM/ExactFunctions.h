// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_CONVERSION_GPUTONVVM_EXACTFUNCTIONS_H
#define PIKO_LIB_CONVERSION_GPUTONVVM_EXACTFUNCTIONS_H

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"

namespace piko {

/// Whether an operation has other results in PTX than on a CPU. Of functions,
/// these have instructions that round correctly, or expansions that are exact.
inline bool hasOtherBitsInPTX(mlir::Operation *op) {
  using namespace mlir;
  if (!isa<math::MathDialect>(op->getDialect()))
    return isa<arith::RemFOp>(op);
  return !isa<math::AbsFOp, math::AbsIOp, math::CeilOp, math::CopySignOp,
              math::CountLeadingZerosOp, math::CountTrailingZerosOp,
              math::CtPopOp, math::FloorOp, math::FmaOp, math::RoundOp,
              math::RoundEvenOp, math::SqrtOp, math::TruncOp>(op);
}

} // namespace piko

#endif // PIKO_LIB_CONVERSION_GPUTONVVM_EXACTFUNCTIONS_H
