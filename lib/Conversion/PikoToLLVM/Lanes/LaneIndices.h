// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Indices of lanes that load, or store, one after the other.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEINDICES_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEINDICES_H

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"

namespace piko {

/// The index of each lane, of a vector of 32 or 64 bits or of type index, as a
/// number of 64 bits. None of 32 is negative.
llvm::SmallVector<mlir::Value> extractIndices(CodeBuilder at,
                                              mlir::Value index);

/// An index as a sum of numbers of 64 bits.
struct SharedIndex {
  mlir::Value lanes;  ///< what does not change in a loop
  mlir::Value shared; ///< what does, but is the same for all lanes
};

/// Finds what an index of 32 bits, none of whose sums and products overflows,
/// is a sum of; nothing if it is none such. Each lane's part of an address is
/// then found once, before the loop that `user` is in. `lower` gives the
/// value that a conversion has for another one.
std::optional<SharedIndex>
splitIndex(CodeBuilder at, mlir::Value index, mlir::Operation *user,
           llvm::function_ref<mlir::Value(mlir::Value)> lower);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_LANEINDICES_H
