// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loop merging: a nest of loops as one, each turn of which makes an iteration
// of the innermost loop, or takes a step of one around it.

#ifndef PIKO_LIB_TRANSFORMS_MERGELOOPS_H
#define PIKO_LIB_TRANSFORMS_MERGELOOPS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// A loop of a nest, and how often it is expected to iterate each time.
struct NestedLoop {
  mlir::Operation *loop = nullptr; ///< an scf.for or an scf.while
  double iterations = 1;
};

/// Of the loops inside of another, under conditions alone, for which a
/// predicate holds, the one in which most is written; null if there is none
/// that can be merged with what is around it.
mlir::Operation *
findMergeable(mlir::Operation *outer,
              llvm::function_ref<bool(mlir::Operation *)> mayPart);

/// Replaces a nest, from the outermost loop, each found by findMergeable() in
/// the one before, by one loop that does the same in the same order. In each
/// turn, `piko.cpu.elect` says which lanes make an iteration. What is seldom
/// changed is in arrays, which are made at the beginning of a block.
mlir::scf::WhileOp mergeLoops(llvm::ArrayRef<NestedLoop> nest,
                              mlir::Block *arrays);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_MERGELOOPS_H
