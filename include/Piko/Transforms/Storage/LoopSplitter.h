// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A parallel loop with barriers as loops between them.

#ifndef PIKO_TRANSFORMS_STORAGE_LOOPSPLITTER_H
#define PIKO_TRANSFORMS_STORAGE_LOOPSPLITTER_H

#include "Piko/Transforms/Storage/Slots.h"

#include "Piko/Analysis/Uniformity.h"

namespace piko {

/// Moves out of a loop what all its iterations share; returns the loop.
ParallelForOp hoistInvariants(ParallelForOp parallel);

/// Cuts one loop at its barriers. The loop's operations are moved, in order,
/// into *pieces*, loops over all iterations; control flow that holds barriers
/// is made anew around pieces. What is used in another piece than its own, or
/// between pieces, is then sent through slots; between pieces it is the value
/// of iteration 0.
class LoopSplitter {
public:
  /// `writer` takes what the loop emits and has its slots; without one it is
  /// that of the unit around. Where lanes share pieces, they share the loops of
  /// reductions, scans and sorts, too.
  explicit LoopSplitter(ParallelForOp parallel, mlir::Value writer = {},
                        bool isShared = false);

  /// Fails after an error.
  mlir::LogicalResult run();

private:
  /// A loop over all iterations that is made when it is first needed.
  class Piece;
  using Terminate = llvm::function_ref<void(Piece &, mlir::Operation *)>;

  mlir::LogicalResult checkControlFlow();

  // Cutting.
  mlir::scf::ForOp createPiece();
  void split(mlir::Block &block, Piece &piece, Terminate terminate);
  void split(mlir::Operation *op, Piece &piece);
  void splitReduce(ReduceOp op, Piece &piece);
  void splitScan(ScanOp op, Piece &piece);
  void splitSort(SortOp op, Piece &piece);
  void splitGrouped(GroupedOp op, Piece &piece);
  void splitIf(mlir::scf::IfOp op, Piece &piece);
  void splitSwitch(mlir::scf::IndexSwitchOp op, Piece &piece);
  void splitFor(mlir::scf::ForOp op, Piece &piece);
  void splitWhile(mlir::scf::WhileOp op, Piece &piece);
  /// The rest of `splitFor`, inside the new loop.
  void splitForBody(mlir::scf::ForOp op, mlir::scf::ForOp loop,
                    mlir::Value iterationVar, mlir::ValueRange slots);
  /// Where iterations may not agree on a value, compares them. The barrier is
  /// the one that some would miss.
  void compare(mlir::Value value, llvm::StringRef barrier);

  // Values across cuts.
  llvm::SmallVector<mlir::Value> addSlots(mlir::TypeRange types);
  void store(Piece &piece, mlir::ValueRange values, mlir::ValueRange slots);
  /// From now on the values are read from slots.
  void readFrom(mlir::ValueRange values, mlir::ValueRange slots);
  mlir::LogicalResult connect();
  mlir::LogicalResult connectResult(mlir::Value value, mlir::scf::ForOp piece);
  void connectArray(mlir::memref::AllocaOp array, mlir::scf::ForOp piece);
  /// The piece that an operation is in, or null.
  mlir::scf::ForOp pieceOf(mlir::Operation *op) const;
  /// Replaces uses outside `home` by what `read` gives: at the front of a piece
  /// with its iteration, or before the user with iteration 0.
  void replaceUses(
      mlir::Value value, mlir::scf::ForOp home,
      llvm::function_ref<mlir::Value(mlir::OpBuilder &, mlir::Value)> read);

  void orderEmissions();
  /// Lets no piece run any more once iterations have not agreed.
  void stopAtDisagreement();

  ParallelForOp parallel;
  bool isShared;
  mlir::Location loc;
  mlir::OpBuilder builder; ///< Stands where the next piece goes.
  mlir::Value count, writer, zero, one;
  StageOp stage;
  Uniformity uniformity;
  std::optional<Slots> slots;
  llvm::SmallVector<mlir::scf::ForOp> pieces;
  llvm::DenseSet<mlir::Operation *> isPiece;
  llvm::SmallVector<mlir::Operation *> loops; ///< Around pieces.
  llvm::SmallVector<FailBarrierOp> failures;
  /// Values that are read from slots, and copies of iteration 0's.
  llvm::SmallVector<std::pair<mlir::Operation *, mlir::Value>> placeholders;
  llvm::SmallVector<mlir::Operation *> copies;
};

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_LOOPSPLITTER_H
