// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Writes a loop whose iterations run as lanes.

#ifndef PIKO_LIB_TRANSFORMS_ITERATIONWRITER_H
#define PIKO_LIB_TRANSFORMS_ITERATIONWRITER_H

#include "Vectorize/Analysis/IterationLanes.h"
#include "Vectorize/Analysis/Lanes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/IRMapping.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"

namespace piko {

class IterationWriter {
public:
  explicit IterationWriter(const IterationLanes &lanes)
      : lanes(lanes), laneCount(lanes.getLaneCount()), loop(lanes.getLoop()),
        loc(loop.getLoc()), builder(loop) {}

  /// Writes the loop before the builder's place.
  void write(mlir::OpBuilder::InsertPoint place);
  /// The loops over lanes, each of which has what one lane does alone.
  llvm::ArrayRef<mlir::scf::WhileOp> getTurnLoops() const { return turnLoops; }

private:
  mlir::VectorType getVectorType(mlir::Type type) const {
    return piko::getVectorType(type, laneCount);
  }

  // Values.
  /// The lanes' values of a value of the original loop.
  mlir::Value get(mlir::Value value);
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
  mlir::Value splat(mlir::Value scalar);
  mlir::Value zeros(mlir::Type type);
  mlir::Value invert(mlir::Value mask);
  /// The first mask where the second one holds, which may be poison elsewhere.
  mlir::Value both(mlir::Value mask, mlir::Value other);
  mlir::Value any(mlir::Value mask);
  /// Values where the mask holds, and others elsewhere.
  mlir::Value choose(mlir::Value mask, mlir::Value yes, mlir::Value no);

  // Operations.
  void writeBlock(mlir::Block &block);
  void writeOperation(mlir::Operation *op);
  void writeUniform(mlir::Operation *op);
  void writeVector(mlir::Operation *op);
  /// The same operation on vectors.
  mlir::Operation *createVector(mlir::Operation *op, mlir::ValueRange operands);
  mlir::Value divideAsFloats(mlir::Operation *division, mlir::Value dividend,
                             mlir::Value divisor);
  /// Whether the product is one that it has written.
  bool writeLinearProduct(mlir::arith::MulIOp product);
  /// Whether it compares an index with an extent, which it has written.
  bool writeInside(mlir::arith::CmpIOp compare);
  void writeAccess(mlir::Operation *op);
  void writeLimited(LoadOp load, mlir::Value limited);
  /// Whether lanes access one element after the other.
  bool isRowOf(mlir::ValueRange indices) const;
  /// Where lanes access state, of type index: of a row, the first place.
  llvm::SmallVector<mlir::Value> getPlaces(mlir::ValueRange indices);
  /// Reads of fields of one element, of which this is the first one, that are
  /// written together; or none.
  llvm::SmallVector<LoadOp> findFields(mlir::Operation *first) const;
  void writeFields(llvm::ArrayRef<LoadOp> loads);
  /// Places as those of the first active lane, and whether others differ.
  std::pair<llvm::SmallVector<mlir::Value>, mlir::Value>
  compareWithFirst(mlir::ValueRange places);
  void writePrefetch(PrefetchOp prefetch);
  void writeArrayAccess(mlir::Operation *op);
  void writePrivateAccess(mlir::Operation *op);
  void writeShortArrayAccess(mlir::Operation *op, mlir::Value index);
  mlir::Value readRow(mlir::Value columns, mlir::Value row);
  void writeRow(mlir::Value columns, mlir::Value row, mlir::Value mask,
                mlir::Value value);
  void writeItemAccess(mlir::Operation *op);
  /// The place of an index in the lanes' columns of an array.
  mlir::Value getColumns(mlir::Value index);
  void writePrivate(mlir::memref::AllocaOp array);

  // Where lanes meet.
  void writeBarrier(mlir::Operation *op);
  void writeReduce(ReduceOp reduce);
  /// In the order that piko.reduce has.
  llvm::SmallVector<mlir::Value> combineLanes(ReduceOp reduce);
  llvm::SmallVector<mlir::Value>
  combine(mlir::Block &body, mlir::ValueRange left, mlir::ValueRange right);
  void writeScan(ScanOp scan);
  void writeSort(SortOp sort);
  /// Vectors with the lanes of others, and a constant mask.
  llvm::SmallVector<mlir::Value> shuffle(mlir::ValueRange values,
                                         llvm::ArrayRef<int64_t> from);
  mlir::Value createMask(llvm::function_ref<bool(int64_t)> holds);
  llvm::SmallVector<mlir::Value> getAll(mlir::ValueRange values);

  // Control flow.
  /// The lanes that have something to do, where so many iterations are left.
  mlir::Value writeActive(mlir::Value left);
  void writeStructure(mlir::Operation *op);
  void writeIf(mlir::scf::IfOp choice);
  /// Which lanes do not yet leave a turn that only some go on with.
  mlir::Value writeWaiting(mlir::Value goesOn);
  void writeSwitch(mlir::scf::IndexSwitchOp choice);
  void writeFor(mlir::scf::ForOp inner);
  void writeVaryingFor(mlir::scf::ForOp inner);
  /// A nest whose turns lanes share: see IterationLanes::getNest.
  void writeNest(mlir::scf::ForOp loop);
  /// The turns of the lanes, side by side; each loop's turns are counted.
  void writePairs(llvm::ArrayRef<mlir::scf::ForOp> nest,
                  llvm::ArrayRef<mlir::Value> counts);
  /// How many turns each lane makes, at most too many.
  mlir::Value countTurns(mlir::scf::ForOp inner);
  /// The lane whose turn stands at a place, for each of the places.
  mlir::Value findLane(mlir::Value ends, mlir::Value place);
  /// For each lane the value of another.
  mlir::Value permute(mlir::Value value, mlir::Value from);
  /// 32-bit integers of all lanes.
  mlir::Value number(int64_t value);
  void writeWhile(mlir::scf::WhileOp inner);
  void writeVaryingWhile(mlir::scf::WhileOp inner);
  /// What a region yields for these lanes, under a branch around it, as
  /// results `like` these are carried.
  llvm::SmallVector<mlir::Value>
  writeSide(mlir::Region &region, mlir::Value mask, mlir::ValueRange like);
  /// Runs the body of a region whose control flow is the same for all lanes.
  void writeShared(mlir::Region &from, mlir::Block *to, mlir::ValueRange like);

  // Changes that wait in a list.
  struct Staged {
    mlir::Value count;                                ///< an array of one
    llvm::MapVector<mlir::Value, mlir::Value> values; ///< arrays
  };
  void writePrivateRow(AtomicOp atomic);
  bool canStage(mlir::Operation *op);
  Staged &getStaged(AtomicOp atomic);
  void writeStaged(AtomicOp atomic);
  void writeFlush(AtomicOp atomic, const Staged &list, mlir::Value count);
  /// After the loop.
  void writeLastFlushes();

  // Lane by lane.
  /// What one lane does, and where it finds what that takes.
  struct Turn {
    llvm::SmallVector<mlir::Operation *> ops;
    llvm::SmallVector<mlir::Operation *> made; ///< again, before them
    llvm::MapVector<mlir::Value, mlir::Value> varying, uniform; ///< slots
    llvm::MapVector<mlir::Operation *, mlir::Value> records;    ///< memory
    mlir::Value mask; ///< of what is late: a slot of the lanes' bits
  };
  /// Keeps what [first, last] takes.
  Turn prepareTurn(mlir::Operation *first, mlir::Operation *last, bool isLate);
  mlir::IRMapping writeTurn(const Turn &turn, mlir::Value lane);
  /// A loop over lanes, given by a bit for each.
  void writeTurns(mlir::Value bits,
                  llvm::function_ref<void(mlir::Value lane)> write);
  /// What has a bit for each lane.
  mlir::Type getWord();
  mlir::Value getBits(mlir::Value mask);
  /// Runs [first, last] for one active lane after the other.
  void writeSerial(mlir::Operation *first, mlir::Operation *last);
  void writeOrdered(const OrderedGroup &group);
  void createMasks();
  void writeLate();
  void writeLateTurns(llvm::ArrayRef<Turn> late);
  /// Whether the writers count primitives, of a turn that only goes to the next
  /// one.
  std::optional<mlir::Value> writeIsCounted(const Turn &turn);
  void useColumns(mlir::Operation *copy, mlir::Value lane);

  // Emissions of all lanes, after all.
  void writeEmissions(const PortEmissions &port);
  mlir::Value writeAreFew();
  /// The turn that emits a record.
  const Turn &findTurn(LaneRecord record) const;
  llvm::SmallVector<Turn> findOtherTurns() const;
  /// What lanes have of a value that a turn takes.
  mlir::Value getTurnValue(const Turn &turn, mlir::Value value);
  /// The lanes that take a turn.
  mlir::Value loadMask(const Turn &turn);
  /// The records that lanes will emit, in memory.
  mlir::Value writeRecords(AppendOp append);

  /// What of [first, last] is not yet computed.
  llvm::SmallVector<mlir::Operation *> findRest(mlir::Operation *first,
                                                mlir::Operation *last) const;
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
  llvm::DenseMap<mlir::Value, mlir::Value> columns; ///< of private arrays
  mlir::Value active;
  bool paired = false; ///< Lanes are not the loop's turns, one after the other.
  llvm::DenseMap<mlir::Operation *, mlir::Value> masks; ///< of groups: slots
  llvm::SmallVector<Turn> late;
  llvm::MapVector<mlir::Operation *, Staged> staged;
  llvm::SmallVector<mlir::scf::WhileOp> turnLoops;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_ITERATIONWRITER_H
