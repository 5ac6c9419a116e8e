// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lanes have of the values of a loop, and vectors made of that.

#ifndef PIKO_LIB_TRANSFORMS_LANEVALUES_H
#define PIKO_LIB_TRANSFORMS_LANEVALUES_H

#include "Vectorize/Analysis/IterationLanes.h"
#include "Vectorize/Analysis/Lanes.h"

#include "mlir/IR/Builders.h"
#include "mlir/IR/IRMapping.h"

namespace piko {

/// The lowest layer of what writes a loop as lanes: it knows the lanes' values,
/// but no operation. Each value of an iteration is a scalar, where it is the
/// same for all lanes, or a vector.
class LaneValues {
protected:
  explicit LaneValues(const IterationLanes &lanes)
      : lanes(lanes), laneCount(lanes.getLaneCount()), loop(lanes.getLoop()),
        loc(loop.getLoc()), builder(loop) {}

  mlir::VectorType getVectorType(mlir::Type type) const {
    return piko::getVectorType(type, laneCount);
  }

  // Vectors and masks.
  mlir::Value splat(mlir::Value scalar);
  mlir::Value zeros(mlir::Type type);
  /// 32-bit integers of all lanes.
  mlir::Value number(int64_t value);
  mlir::Value invert(mlir::Value mask);
  /// The first mask where the second one holds, which may be poison elsewhere.
  mlir::Value both(mlir::Value mask, mlir::Value other);
  mlir::Value any(mlir::Value mask);
  /// Values where the mask holds, and others elsewhere.
  mlir::Value choose(mlir::Value mask, mlir::Value yes, mlir::Value no);
  mlir::Value createMask(llvm::function_ref<bool(int64_t)> holds);
  /// The mask of so many lanes, an integer of 32 bits, from the first on.
  mlir::Value getFirstLanes(mlir::Value count);
  /// What has a bit for each lane.
  mlir::Type getWord();
  mlir::Value getBits(mlir::Value mask);
  /// The mask of the lanes whose bits a word has.
  mlir::Value getMask(mlir::Value word);
  /// For each lane the value of another.
  mlir::Value permute(mlir::Value value, mlir::Value from);
  /// Vectors with the lanes of others.
  llvm::SmallVector<mlir::Value> shuffle(mlir::ValueRange values,
                                         llvm::ArrayRef<int64_t> from);

  // What lanes have of a value.
  /// The lanes' values of a value of the original loop.
  mlir::Value get(mlir::Value value);
  llvm::SmallVector<mlir::Value> getAll(mlir::ValueRange values);
  /// The value of all lanes.
  mlir::Value getUniform(mlir::Value value) const {
    return scalars.lookupOrDefault(value);
  }
  /// A value as control flow carries it: a scalar where it is uniform.
  mlir::Value getCarried(mlir::Value value) {
    return lanes.isVarying(value) ? get(value) : getUniform(value);
  }
  mlir::Type getCarriedType(mlir::Value value) const;
  /// `like` says whether lanes differ.
  mlir::Value getCarriedAs(mlir::Value like, mlir::Value value) {
    return lanes.isVarying(like) ? get(value) : getUniform(value);
  }
  void setCarried(mlir::Value value, mlir::Value carried);
  /// A linear value of the first lane.
  mlir::Value getFirst(mlir::Value value);
  /// The same operation on vectors.
  mlir::Operation *createVector(mlir::Operation *op, mlir::ValueRange operands);

  // Slots: memory that holds a value of each lane.
  mlir::Value createSlot(mlir::Type type);
  void storeSlot(mlir::Value value, mlir::Value slot, mlir::Value at);
  mlir::Value loadSlot(mlir::Value slot, mlir::Value at, mlir::Type type);

  const IterationLanes &lanes;
  const int64_t laneCount;
  mlir::scf::ForOp loop;
  mlir::Location loc;
  mlir::OpBuilder builder;
  mlir::Operation *outermost = nullptr; ///< Arrays stand before it.
  mlir::IRMapping vectors, scalars, firsts;
  mlir::Value active;  ///< The mask of the lanes that come here.
  bool paired = false; ///< Lanes are not the loop's turns, one after the other.
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEVALUES_H
