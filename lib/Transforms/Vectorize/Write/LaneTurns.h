// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What one lane after the other does, and what vectors emit for all of them.

#ifndef PIKO_LIB_TRANSFORMS_LANETURNS_H
#define PIKO_LIB_TRANSFORMS_LANETURNS_H

#include "Vectorize/Write/LaneMemory.h"

namespace piko {

class LaneTurns : protected LaneMemory {
public:
  /// The loops over lanes, each of which has what one lane does alone.
  llvm::ArrayRef<mlir::scf::WhileOp> getTurnLoops() const { return turnLoops; }

protected:
  using LaneMemory::LaneMemory;

  /// Runs [first, last] for one active lane after the other.
  void writeSerial(mlir::Operation *first, mlir::Operation *last);

  // After all that vectors do.
  /// Makes masks of who comes to what is late.
  void createMasks();
  /// Has a group run then.
  void delay(const OrderedGroup &group);
  void writeLate();

private:
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
  void writeLateTurns(llvm::ArrayRef<Turn> late);
  /// Whether the writers count primitives, of a turn that only goes to the next
  /// one.
  std::optional<mlir::Value> writeIsCounted(const Turn &turn);
  void useColumns(mlir::Operation *copy, mlir::Value lane);
  /// What of [first, last] is not yet computed.
  llvm::SmallVector<mlir::Operation *> findRest(mlir::Operation *first,
                                                mlir::Operation *last) const;

  // Emissions of all lanes.
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

  llvm::DenseMap<mlir::Operation *, mlir::Value> masks; ///< of groups: slots
  llvm::SmallVector<Turn> late;
  llvm::SmallVector<mlir::scf::WhileOp> turnLoops;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANETURNS_H
