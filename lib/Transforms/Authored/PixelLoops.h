// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Nests of counted loops that may be over pixels.

#ifndef PIKO_LIB_TRANSFORMS_PIXELLOOPS_H
#define PIKO_LIB_TRANSFORMS_PIXELLOOPS_H

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Analysis/CountedLoop.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/SetVector.h"

namespace piko {

/// A loop of a nest over pixels.
struct LoopOverPixels : CountedLoop {
  Refusal refusal; ///< Why it is not as simple as that.
};

/// The number that is made one of at least 32 bits by sign.
mlir::Value stripWidening(mlir::Value value);
/// The coordinates of an access to an image; none of any other operation.
mlir::ValueRange getPixel(mlir::Operation *op);

class PixelLoops {
public:
  /// Whether a loop is the outermost of a nest of `rank` loops that count. What
  /// is in the way of an uplift then is said by `getRefusal`.
  bool find(mlir::Operation *outer, int64_t rank);
  const Refusal &getRefusal() const { return refusal; }

  unsigned getRank() const { return loops.size(); }
  /// x is the innermost.
  const LoopOverPixels &getLoop(unsigned dim) const { return loops[dim]; }
  llvm::ArrayRef<LoopOverPixels> getLoops() const { return loops; }
  const LoopOverPixels &getOuter() const { return loops.back(); }
  mlir::Value getCounter(unsigned dim) const { return loops[dim].counter; }
  mlir::Block *getBody() const { return loops.front().body; }

  /// The one test around all that the body does, or null.
  mlir::scf::IfOp findGuard() const;
  /// Whether the counters are the coordinates of an access in the body.
  bool accessesPixels() const;
  /// What makes an iteration depend on others, if something does.
  Refusal checkIterations();

  /// Adds to `slice` what a value is computed from inside the loops; false if
  /// that differs between iterations or cannot be moved in front.
  bool collectInvariant(mlir::Value value,
                        llvm::SetVector<mlir::Operation *> &slice) const;

private:
  void checkSpine();
  void checkBounds();
  bool isOwnPixel(mlir::ValueRange coordinates) const;
  Refusal checkOperation(mlir::Operation *op) const;
  Refusal checkAccess(mlir::Operation *op) const;
  Refusal checkArray(mlir::Operation *op, mlir::Value array) const;
  void refuse(mlir::Operation *at, const llvm::Twine &why) {
    if (!refusal.at)
      refusal = {at, why.str()};
  }

  llvm::SmallVector<LoopOverPixels, 2> loops; // x first
  Refusal refusal;
  /// State that iterations change, and arrays that they store to.
  llvm::DenseMap<mlir::StringAttr, mlir::Operation *> changed;
  llvm::DenseSet<mlir::Value> stored;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_PIXELLOOPS_H
