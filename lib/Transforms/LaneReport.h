// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is said to the user about vectors: one verdict for each phase, with the
// loops that it rests on and what is in their way.

#ifndef PIKO_LIB_TRANSFORMS_LANEREPORT_H
#define PIKO_LIB_TRANSFORMS_LANEREPORT_H

#include "LanePlan.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "llvm/ADT/MapVector.h"

namespace piko {

/// The phase that a loop over primitives runs: "process" or "assignBin".
llvm::StringRef getLoopPhase(mlir::scf::ForOp loop);

class LaneReport {
public:
  /// Phases are in the order of their kernels.
  explicit LaneReport(PipelineOp pipeline);
  /// Takes down what becomes of a loop, before it is changed.
  void add(mlir::scf::ForOp loop, const LanePlanner &planner, LaneCost cost,
           bool isVectorized);
  /// Emits the remarks.
  void emit() const;

private:
  struct Note {
    mlir::Location location;
    std::string text;
  };
  struct Verdict {
    StageOp stage;
    llvm::StringRef phase;
    mlir::Location location;
    int64_t loops = 0, vectorized = 0;
    bool isBehindTest = false; ///< what is vectorized
    std::optional<LaneMapping> lanes = std::nullopt;
    llvm::SmallVector<Note> notes = {};
  };
  void add(ListOp list);
  Verdict &getVerdict(mlir::Operation *op, llvm::StringRef phase);
  void addNote(Verdict &verdict, const LaneObstacle &obstacle,
               const LanePlanner &planner);

  llvm::MapVector<std::pair<mlir::Operation *, llvm::StringRef>, Verdict>
      verdicts;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEREPORT_H
