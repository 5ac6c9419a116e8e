// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What each operation of an iteration becomes where iterations are lanes.

#ifndef PIKO_LIB_TRANSFORMS_LANEFORMS_H
#define PIKO_LIB_TRANSFORMS_LANEFORMS_H

#include "Piko/Analysis/Uniformity.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/DenseSet.h"

namespace piko {

/// What an operation of an iteration becomes.
enum class LaneForm {
  Uniform,   ///< the same for all lanes: stays scalar
  Vector,    ///< the same operation on vectors
  Access,    ///< a gather or a scatter, of state or of an array
  Private,   ///< an array with a column for each lane
  Barrier,   ///< where lanes meet, which they always do
  Structure, ///< control flow, by predication
  Lazy,      ///< no number: made again where a lane needs it
  Serial,    ///< lane by lane
  Ordered    ///< lane by lane, from the first of its kind to the last
};

/// What the operations of an iteration become, each by itself.
class LaneForms {
public:
  /// Why the loop stays as it is, and where; `at` is null if it need not.
  struct Refusal {
    mlir::Operation *at = nullptr;
    std::string why;
  };
  const Refusal &getRefusal() const { return refusal; }
  mlir::scf::ForOp getLoop() const { return loop; }
  /// How many iterations run at once.
  int64_t getLaneCount() const { return laneCount; }
  bool isVarying(mlir::Value value) const {
    return uniformity.isVarying(value);
  }
  /// Whether a value is the iteration's number and what is the same for all.
  bool isLinear(mlir::Value value) const;
  /// The same of a value that grows by one from lane to lane also where it
  /// wraps around: it is not cast from a sum of fewer bits.
  bool isSum(mlir::Value value) const;
  /// Whether an array is so short that lanes access all of it rather than
  /// elements in different places.
  bool isShort(mlir::Value array) const;
  /// Whether an array belongs to an iteration; it has a column for each lane if
  /// it varies.
  bool isPrivate(mlir::Value array) const { return privates.contains(array); }
  /// Whether an operation reads an array, or state, that no iteration changes.
  bool readsFixed(mlir::Operation *op) const;
  LaneForm getForm(mlir::Operation *op) const;
  /// Whether all lanes make the same iterations of an inner loop.
  bool isSharedLoop(mlir::Operation *op) const;
  /// The loops, from the outermost, whose iterations fill vectors together with
  /// the lanes that make them; none if `loop` is not the first of such.
  llvm::SmallVector<mlir::scf::ForOp> getNest(mlir::scf::ForOp loop) const {
    return nests.lookup(loop);
  }
  /// Whether lanes access one element after the other.
  bool isRow(mlir::Operation *op) const;
  /// Whether an operation changes elements side by side of a private copy.
  bool isPrivateRow(mlir::Operation *op) const;
  /// Of a read that is mostly of a row, as its index is linear but for limits,
  /// what must be linear when it runs; else null.
  mlir::Value findLimited(mlir::Operation *op) const;

protected:
  LaneForms(mlir::scf::ForOp loop, int64_t laneCount);
  void refuse(mlir::Operation *at, const llvm::Twine &why) {
    if (!refusal.at)
      refusal = {at, why.str()};
  }
  void findForms();
  /// Gives each lane its own of arrays that they have shared.
  void split(llvm::ArrayRef<mlir::Value> arrays);
  void checkBarriers();

  mutable mlir::scf::ForOp loop; // whose accessors are not const

private:
  void findNests();
  bool canCollapse(mlir::scf::ForOp inner) const;
  void findArrays();
  void findSharedPixels();
  void checkCombination(mlir::Operation *barrier);
  void checkCarried();
  bool isAccess(mlir::Operation *op) const;
  bool isFixed(mlir::Value value) const;
  bool isLimited(mlir::Value value) const;

  int64_t laneCount;
  llvm::SmallVector<Uniformity::Root> roots;
  Uniformity uniformity;
  Refusal refusal;
  llvm::DenseSet<mlir::Value> privates, changed; // arrays
  /// Images that iterations change at pixels which may be the same.
  llvm::DenseSet<mlir::Attribute> shared;
  llvm::DenseSet<mlir::Attribute> written; // state
  llvm::DenseMap<mlir::Operation *, llvm::SmallVector<mlir::scf::ForOp>> nests;
};

/// Whether a side of a condition has the loops of the other one with tests that
/// may fail, for indices that are not all inside.
bool isFallback(mlir::Region &region);

/// Whether an operation is control flow, which predication replaces.
bool isStructure(mlir::Operation *op);

/// Whether it only asks for memory ahead of time: a vector's loads do so
/// themselves.
bool isPrefetch(mlir::Operation *op);

/// Whether a loop is there to ask for memory: not one over primitives, whose
/// lanes read it right away.
bool asksAhead(mlir::scf::ForOp loop);

/// Whether a loop iterates no more often than there are lanes, as one over a
/// strip.
bool isOneVector(mlir::scf::ForOp loop, int64_t laneCount);

/// The name of the array of pixels (`marks::pixels`) that a store changes, or
/// null.
mlir::Attribute getPixels(mlir::memref::StoreOp store);

/// Whether vectors have the operation: functions are exact, or the same for a
/// vector as for a number.
bool hasVectorForm(mlir::Operation *op);
/// Whether it may trap, or takes as long for one lane as for all.
bool isDivision(mlir::Operation *op);
/// Whether it is one of 32 bits for which floats of 64 bits are divided.
bool isDividedAsFloats(mlir::Operation *op);
/// Whether it may trap where its last operand is 0.
bool isIntegerDivision(mlir::Operation *op);

/// Whether lanes have values of this type: numbers, and primitives, of which
/// they have the addresses.
bool isLaneType(mlir::Type type);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEFORMS_H
