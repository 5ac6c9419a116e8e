// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stream compaction that a text writes itself: a loop that appends to lists,
// `if (test) list[count++] = i`. Appends.cpp finds such loops, and has copies
// of them push; Pushes.cpp is about what pushes.

#ifndef PIKO_TRANSFORMS_STORAGE_APPENDS_H
#define PIKO_TRANSFORMS_STORAGE_APPENDS_H

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// A loop that hands on nothing, and what it was made with, before the
/// original.
struct PushLoop {
  mlir::scf::ForOp loop;
  mlir::Operation *original = nullptr;
  /// What preceded the original, and all that was made; null: nothing.
  mlir::Operation *before = nullptr;
  /// Instead of the results of the loop that it was made of.
  llvm::SmallVector<mlir::Value> results;
  /// What stands around it for them, in order.
  llvm::SmallVector<mlir::Operation *> helpers;

  /// Undoes all of it: the original stays.
  void erase();
};

/// A copy before a loop, as one that counts, where the loop hands on no more
/// than how long lists are, or nothing: the copy pushes to these
/// (`piko.storage.push`), so that iterations depend on one another in nothing
/// else. Null where the loop hands on something else, or reads a list or its
/// length: `refusal` says where, if the loop appends.
std::optional<PushLoop> copyAsPushes(mlir::Operation *loop,
                                     std::optional<mlir::Location> &refusal);

/// Lets lists have room behind them for a vector, where that is the only loop
/// that fills them, once.
void padLists(mlir::scf::ForOp loop, int64_t laneCount);

/// Says why a loop that appends was refused.
void explainNoPushes(mlir::InFlightDiagnostic &remark, mlir::Location refusal);

/// Loads and stores again.
void expandPushes(mlir::scf::ForOp loop);

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_APPENDS_H
