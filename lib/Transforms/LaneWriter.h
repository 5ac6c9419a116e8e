// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Writes what runs ahead of a loop over primitives: reads into arrays, and
// computation in vectors.

#ifndef PIKO_LIB_TRANSFORMS_LANEWRITER_H
#define PIKO_LIB_TRANSFORMS_LANEWRITER_H

#include "LanePlan.h"

#include "mlir/IR/IRMapping.h"
#include "llvm/ADT/MapVector.h"

namespace piko {

/// How many primitives run ahead: enough for many vectors, so few that what is
/// kept stays in the nearest cache.
constexpr int64_t laneBlockSize = 64;
/// Numbers of 32 bits in the widest vectors there are; where they are narrower,
/// LLVM takes several.
constexpr int64_t laneCount = 16;

/// The type of a vector of these numbers.
mlir::VectorType getVectorType(mlir::Type type);

/// Arrays that keep a value for each primitive of a block.
class LaneSlots {
public:
  /// Puts the arrays in front of a loop.
  explicit LaneSlots(mlir::scf::ForOp loop)
      : loc(loop.getLoc()), arrays(loop) {}

  bool contains(mlir::Value value) const { return slots.contains(value); }
  /// Adds an array for a value of the original loop.
  void add(mlir::Value value) { slots[value] = create(value.getType()); }
  /// An array that is of no value of the original loop.
  mlir::Value create(mlir::Type type);
  mlir::Value get(mlir::Value value) const { return slots.lookup(value); }
  const llvm::MapVector<mlir::Value, mlir::Value> &getAll() const {
    return slots;
  }

  void store(mlir::OpBuilder &builder, mlir::Value value, mlir::Value slot,
             mlir::Value place) const;
  mlir::Value load(mlir::OpBuilder &builder, mlir::Value slot,
                   mlir::Value place, mlir::Type type) const;

private:
  mlir::Location loc;
  mlir::OpBuilder arrays;
  llvm::MapVector<mlir::Value, mlir::Value> slots;
};

/// Writes the loop that reads.
class FetchWriter {
public:
  FetchWriter(mlir::OpBuilder &builder, StageOp stage,
              const LanePlanner &planner, mlir::Value iteration)
      : builder(builder), loc(planner.getLoop().getLoc()), stage(stage),
        planner(planner) {
    mapping.map(planner.getLoop().getInductionVar(), iteration);
  }

  /// The value of this primitive.
  mlir::Value get(mlir::Value value);
  /// Does for this primitive what an operation does, and what leads to it.
  void repeat(mlir::Operation *op);
  /// All of `loads` read the same element: one test holds for all.
  void getElement(llvm::ArrayRef<LoadOp> loads);
  /// Whether all reads were inside of their buffers; null if none was tested.
  mlir::Value getInside() const { return inside; }

private:
  mlir::OpBuilder &builder;
  mlir::Location loc;
  StageOp stage;
  const LanePlanner &planner;
  mlir::IRMapping mapping;
  mlir::Value inside;
};

/// Writes the loop that computes in vectors.
class VectorWriter {
public:
  /// Takes what was read from `slots`, and adds arrays of what else is read.
  VectorWriter(mlir::OpBuilder &builder, StageOp stage,
               const LanePlanner &planner, LaneSlots &slots, mlir::Value begin,
               mlir::Value count, mlir::Value place, mlir::Value outside)
      : builder(builder), top(place.getParentBlock()),
        loc(planner.getLoop().getLoc()), stage(stage), planner(planner),
        slots(slots), begin(begin), count(count), place(place),
        outside(outside) {}

  /// Computes what a plan computes, whatever the conditions around it say.
  void write(const LanePlan &plan);
  /// The values of these primitives.
  mlir::Value get(mlir::Value value);
  /// The lanes that came to a rare side of a condition; null if none could.
  mlir::Value getRare() const { return rare; }

private:
  void writeOperations(mlir::Block &block);
  void writeOperation(mlir::Operation *op);
  void writeCondition(mlir::scf::IfOp choice);
  void writeLoop(mlir::scf::WhileOp loop);
  /// The loop where a lane needs it, and zeros where none does.
  void writeLoopIfNeeded(mlir::scf::WhileOp loop);
  void writeUniform(mlir::Operation *op);
  /// A read of the same element for all.
  void writeUniform(LoadOp load);
  void giveUp(mlir::Value lanes);
  /// The lanes that have a primitive, and have read it.
  mlir::Value getPresent();
  /// What `write` does is for these lanes alone.
  void writeFor(mlir::Value lanes, llvm::function_ref<void()> write);
  mlir::Value getUniform(mlir::Value value);
  /// A value as a variable or result of a loop carries it: one for all lanes or
  /// for each. Behind the last comes what `rare` is.
  llvm::SmallVector<mlir::Value> getFor(mlir::ValueRange variables,
                                        mlir::ValueRange values);
  llvm::SmallVector<mlir::Type> getTypesFor(mlir::ValueRange variables);
  void set(mlir::ValueRange variables, mlir::ValueRange carried);
  mlir::Value splat(mlir::Value scalar);
  mlir::Value zeros(mlir::Type type);
  mlir::Value invert(mlir::Value mask);
  /// Both masks, where the other one may be poison unless the first is true.
  mlir::Value both(mlir::Value mask, mlir::Value other);

  mlir::OpBuilder &builder;
  mlir::Block *top;
  mlir::Location loc;
  StageOp stage;
  const LanePlanner &planner;
  LaneSlots &slots;
  mlir::Value begin, count, place;
  mlir::Value outside; // an array: whether a primitive read outside of a buffer
  mlir::IRMapping vectors, scalars;
  mlir::Value present; // null if nothing asked yet
  mlir::Value active;  // null: all
  mlir::Value rare;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEWRITER_H
