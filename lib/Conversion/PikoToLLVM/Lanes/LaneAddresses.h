// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where the lanes of a vector find their elements of a piece of state.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEADDRESSES_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEADDRESSES_H

#include "PikoToLLVM/LoweringContext.h"

namespace piko {

/// Where lanes read or write: one address, from which on they lie one after
/// the other, or one for each.
struct LaneAddresses {
  mlir::Value first, each;
};

/// How far elements are from the first one, in units of `size`: a vector if
/// indices are, null if there are none.
mlir::Value computeLaneOffset(mlir::OpBuilder &builder, mlir::Location loc,
                              const StateView &view, mlir::ValueRange indices,
                              int64_t size, int64_t lanes);

/// Of numbers of the type of `lanes`, so many bytes after `base`; if that is
/// one offset, each further lane is `stride` bytes after the one before.
LaneAddresses createLaneAddresses(mlir::OpBuilder &builder, mlir::Location loc,
                                  mlir::Value base, mlir::Value offset,
                                  int64_t stride, mlir::VectorType lanes);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEADDRESSES_H
