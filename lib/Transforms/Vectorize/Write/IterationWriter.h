// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Writes a loop whose iterations run as lanes.

#ifndef PIKO_LIB_TRANSFORMS_ITERATIONWRITER_H
#define PIKO_LIB_TRANSFORMS_ITERATIONWRITER_H

#include "Vectorize/Write/LaneTurns.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

namespace piko {

/// Operations and control flow, on top of the layers that know values
/// (LaneValues), memory (LaneMemory) and turns (LaneTurns).
class IterationWriter : public LaneTurns {
public:
  explicit IterationWriter(const IterationLanes &lanes) : LaneTurns(lanes) {}

  /// Writes the loop before the builder's place.
  void write(mlir::OpBuilder::InsertPoint place);

private:
  // Operations.
  void writeBlock(mlir::Block &block);
  void writeOperation(mlir::Operation *op);
  void writeUniform(mlir::Operation *op);
  void writeVector(mlir::Operation *op);
  mlir::Value divideAsFloats(mlir::Operation *division, mlir::Value dividend,
                             mlir::Value divisor);
  /// Whether the product is one that it has written.
  bool writeLinearProduct(mlir::arith::MulIOp product);
  /// Whether it compares an index with an extent, which it has written.
  bool writeInside(mlir::arith::CmpIOp compare);
  void writeOrdered(const OrderedGroup &group);

  // Where lanes meet.
  void writeBarrier(mlir::Operation *op);
  void writeReduce(ReduceOp reduce);
  /// In the order that piko.reduce has.
  llvm::SmallVector<mlir::Value> combineLanes(ReduceOp reduce);
  llvm::SmallVector<mlir::Value>
  combine(mlir::Block &body, mlir::ValueRange left, mlir::ValueRange right);
  void writeScan(ScanOp scan);
  void writeSort(SortOp sort);

  // Control flow.
  /// The lanes that have something to do, where so many iterations are left.
  mlir::Value writeActive(mlir::Value left);
  void writeStructure(mlir::Operation *op);
  void writeIf(mlir::scf::IfOp choice);
  /// Which lanes do not yet leave a turn that only some go on with.
  mlir::Value writeWaiting(mlir::Value goesOn);
  void writeElect(ElectOp elect);
  void writeVote(VoteOp vote);
  void writeSwitch(mlir::scf::IndexSwitchOp choice);
  void writeFor(mlir::scf::ForOp inner);
  void writeVaryingFor(mlir::scf::ForOp inner);
  void writeWhile(mlir::scf::WhileOp inner);
  void writeVaryingWhile(mlir::scf::WhileOp inner);
  /// What a region yields for these lanes, under a branch around it, as
  /// results `like` these are carried.
  llvm::SmallVector<mlir::Value>
  writeSide(mlir::Region &region, mlir::Value mask, mlir::ValueRange like);
  /// Runs the body of a region whose control flow is the same for all lanes.
  void writeShared(mlir::Region &from, mlir::Block *to, mlir::ValueRange like);

  // Collapsed loops.
  /// A nest whose turns lanes share: see IterationLanes::getNest.
  void writeNest(mlir::scf::ForOp loop);
  /// The turns of the lanes, side by side; each loop's turns are counted.
  void writePairs(llvm::ArrayRef<mlir::scf::ForOp> nest,
                  llvm::ArrayRef<mlir::Value> counts);
  /// How many turns each lane makes, at most too many.
  mlir::Value countTurns(mlir::scf::ForOp inner);
  /// The lane whose turn stands at a place, for each of the places.
  mlir::Value findLane(mlir::Value ends, mlir::Value place);
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_ITERATIONWRITER_H
