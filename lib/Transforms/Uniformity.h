// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which values are the same in all iterations of a parallel loop.

#ifndef PIKO_LIB_TRANSFORMS_UNIFORMITY_H
#define PIKO_LIB_TRANSFORMS_UNIFORMITY_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

bool isBarrier(mlir::Operation *op);

/// Moves out of a loop what all its iterations share; returns the loop.
ParallelForOp hoistInvariants(ParallelForOp parallel);

/// The first place inside an operation where the iterations of the enclosing
/// loop meet; null if they do not.
mlir::Operation *findBarrier(mlir::Operation *op);

/// Values that may differ between the iterations of a resolved loop. All
/// iterations are taken to agree on the control flow around barriers: where
/// they may not, the loop that is made of it compares them.
class Uniformity {
public:
  explicit Uniformity(ParallelForOp loop);

  bool isVarying(mlir::Value value) const { return varying.contains(value); }
  /// A value that takes the place of another.
  void replace(mlir::Value from, mlir::Value to) {
    if (isVarying(from))
      varying.insert(to);
  }

private:
  /// Marks what an operation defines; returns whether anything is new.
  bool visit(mlir::Operation *op);
  bool visitControlFlow(mlir::Operation *op);
  bool mark(mlir::Value value, bool isVarying) {
    return isVarying && varying.insert(value).second;
  }
  bool anyVarying(mlir::ValueRange values) const {
    return llvm::any_of(values, [&](mlir::Value v) { return isVarying(v); });
  }
  /// Marks each of `targets` that takes a varying value of `sources`.
  bool flow(mlir::ValueRange sources, mlir::ValueRange targets,
            bool alsoVarying);

  llvm::DenseSet<mlir::Value> varying;
  llvm::DenseSet<mlir::Attribute> written; ///< State that the kernel writes.
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_UNIFORMITY_H
