// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How the iterations of a parallel loop run as lanes of vectors.

#ifndef PIKO_LIB_TRANSFORMS_ITERATIONLANES_H
#define PIKO_LIB_TRANSFORMS_ITERATIONLANES_H

#include "Piko/Analysis/Uniformity.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/DenseSet.h"

namespace piko {

/// What an operation of an iteration becomes.
enum class LaneForm {
  Uniform,   ///< the same for all lanes: stays scalar
  Vector,    ///< the same operation on vectors
  Access,    ///< a gather or a scatter, of state or of an array
  Private,   ///< an array with a column for each lane
  Structure, ///< control flow, by predication
  Lazy,      ///< no number: made again where a lane needs it
  Serial,    ///< lane by lane
  Ordered    ///< lane by lane, from the first of its kind to the last
};

/// Operations of a block that run lane by lane, in the order of iterations.
struct OrderedGroup {
  mlir::Operation *first = nullptr, *last = nullptr;

  explicit operator bool() const { return first; }
  bool contains(mlir::Operation *op) const;
};

class IterationLanes {
public:
  /// Of a loop without barriers whose iterations are independent.
  explicit IterationLanes(mlir::scf::ForOp loop);

  /// Why the loop stays as it is, and where; `at` is null if it need not.
  struct Refusal {
    mlir::Operation *at = nullptr;
    std::string why;
  };
  const Refusal &getRefusal() const { return refusal; }
  /// How many operations vectors do, and how many lanes do one by one; those of
  /// inner loops count more.
  struct Cost {
    int64_t vectors = 0, serial = 0;
    int64_t computations = 0; ///< Of the first, those that are no access.
    /// Whether vectors save more than lane by lane costs.
    bool isWorthwhile() const { return vectors >= 6 + 2 * serial; }
  };
  Cost getCost() const;

  mlir::scf::ForOp getLoop() const { return loop; }
  bool isVarying(mlir::Value value) const {
    return uniformity.isVarying(value);
  }
  /// Whether a value is the iteration's number and what is the same for all.
  bool isLinear(mlir::Value value) const;
  /// Whether an array belongs to an iteration.
  bool isPrivate(mlir::Value array) const { return privates.contains(array); }
  /// Whether an operation reads an array, or state, that no iteration changes.
  bool readsFixed(mlir::Operation *op) const;
  LaneForm getForm(mlir::Operation *op) const;
  /// Whether a side of a condition is short, and may be computed for nothing.
  bool isCheap(mlir::Region &region) const;
  const OrderedGroup &getOrdered() const { return ordered; }

private:
  void refuse(mlir::Operation *at, const llvm::Twine &why) {
    if (!refusal.at)
      refusal = {at, why.str()};
  }
  void findArrays();
  void findSharedPixels();
  void findOrdered();
  void checkCarried();
  bool isAccess(mlir::Operation *op) const;
  bool isSum(mlir::Value value) const;
  bool isFixed(mlir::Value value) const;

  mutable mlir::scf::ForOp loop; // whose accessors are not const
  Uniformity uniformity;
  Refusal refusal;
  llvm::DenseSet<mlir::Value> privates, changed; // arrays
  /// Images that iterations change at pixels which may be the same.
  llvm::DenseSet<mlir::Attribute> shared;
  llvm::DenseSet<mlir::Attribute> written; // state
  OrderedGroup ordered;
};

/// Whether vectors have elements of this type.
bool isNumber(mlir::Type type);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_ITERATIONLANES_H
