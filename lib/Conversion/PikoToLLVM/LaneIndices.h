// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Indices of lanes that load, or store, one after the other.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEINDICES_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEINDICES_H

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"

namespace piko {

/// The index of each lane, of a vector of 32 bits or of type index, as a number
/// of 64 bits. None is negative.
llvm::SmallVector<mlir::Value> extractIndices(CodeBuilder at,
                                              mlir::Value index);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEINDICES_H
