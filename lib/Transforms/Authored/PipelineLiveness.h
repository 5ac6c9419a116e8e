// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What of a pipeline can be observed: in its state, or as an error.

#ifndef PIKO_LIB_TRANSFORMS_PIPELINELIVENESS_H
#define PIKO_LIB_TRANSFORMS_PIPELINELIVENESS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "llvm/ADT/MapVector.h"

namespace piko {

/// The stages, operations and fields of a pipeline of the authored level that
/// what can be observed depends on: the least set that holds all effects and
/// with each operation what it is computed from, through control flow, private
/// arrays and edges. So what only feeds itself around a cycle is not in it.
class PipelineLiveness {
public:
  explicit PipelineLiveness(PipelineOp pipeline);

  bool isLive(StageOp stage) const { return liveStages.contains(stage); }
  /// Operations that are not terminators, in the process and assign phases.
  bool isLive(mlir::Operation *op) const { return liveOps.contains(op); }
  /// Whether the stage reads the field of its primitives.
  bool isLive(StageOp stage, FieldAttr field) const {
    return liveFields.contains({stage, field});
  }

  llvm::ArrayRef<StageOp> producersOf(StageOp stage) const;

private:
  /// What reaches a stage along an edge.
  struct Input {
    StageOp producer;
    int64_t port;
  };

  void markStage(StageOp stage);
  void markOp(mlir::Operation *op);
  void markValue(mlir::Value value);
  void markValues(mlir::ValueRange values) {
    for (mlir::Value value : values)
      markValue(value);
  }
  void markField(StageOp stage, FieldAttr field);
  /// What flows into a result or an argument of control flow.
  void markIncoming(mlir::Operation *op, mlir::Region *region, unsigned number);
  void markUsersOfMemory(mlir::Value memory);
  void visit(mlir::Operation *op);

  llvm::DenseMap<mlir::Operation *, llvm::SmallVector<Input>> inputs;
  llvm::DenseMap<mlir::Operation *, llvm::SmallVector<StageOp>> producers;
  llvm::DenseMap<std::pair<mlir::Operation *, int64_t>,
                 llvm::SmallVector<EmissionOpInterface>>
      emits;
  llvm::DenseSet<mlir::Operation *> liveStages, liveOps;
  llvm::DenseSet<mlir::Value> liveValues;
  llvm::DenseSet<std::pair<mlir::Operation *, mlir::Attribute>> liveFields;
  llvm::SmallVector<mlir::Operation *> worklist;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_PIPELINELIVENESS_H
