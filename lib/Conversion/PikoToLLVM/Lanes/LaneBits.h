// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Masks of lanes as bits of a number.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEBITS_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEBITS_H

#include "PikoToLLVM/LoweringContext.h"

namespace piko {

/// A bit of an i64 for each lane of a mask, the lowest for the first.
mlir::Value createBits(mlir::OpBuilder &builder, mlir::Location loc,
                       mlir::Value mask);
/// So many bytes if the lane has its bit, or 0.
mlir::Value createLaneOffset(mlir::OpBuilder &builder, mlir::Location loc,
                             mlir::Value bits, int64_t lane, int64_t bytes);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEBITS_H
