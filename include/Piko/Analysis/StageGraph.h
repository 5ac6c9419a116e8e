// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The stages of a pipeline as a graph, and its cycles.

#ifndef PIKO_ANALYSIS_STAGEGRAPH_H
#define PIKO_ANALYSIS_STAGEGRAPH_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

using Lists = llvm::SmallVector<llvm::SmallVector<int>>;

/// The stages of a pipeline in the order in which they were declared, before
/// passes moved them: lineage counts them so.
llvm::SmallVector<StageOp> getDeclaredStages(PipelineOp pipeline);

/// Whether edges lead from a stage back to it.
bool isOnCycle(StageOp stage);

/// Stages as numbers.
struct StageGraph {
  llvm::SmallVector<StageOp> stages;
  /// For each stage its consumers, in port order, and the stages it waits for.
  Lists consumers, waits;

  StageGraph(PipelineOp pipeline, llvm::ArrayRef<StageOp> stages);

  StageOp getStage(int number) const { return stages[number]; }
  int getNumber(StageOp stage) const {
    return numbers.at(stage.getSymNameAttr());
  }
  int getNumber(mlir::FlatSymbolRefAttr stage) const {
    return numbers.at(stage.getAttr());
  }
  /// Which stages can be reached from each, along one edge or more.
  llvm::SmallVector<llvm::SmallVector<bool>> reach() const;
  /// Without the edges to stages that collect, and without waits.
  StageGraph cutAtCollectors() const;

private:
  llvm::DenseMap<mlir::StringAttr, int> numbers;
};

/// The graph with each cycle as one node: nodes are numbered in the order of
/// their first stages.
struct NodeGraph {
  Lists nodes;                    ///< Stages in declaration order.
  llvm::SmallVector<int> nodeOf;  ///< The node of each stage.
  llvm::SmallVector<bool> cyclic; ///< Whether the node is a cycle.
  /// Between different nodes: consumers in port order, and what must have run
  /// before each.
  Lists consumers, producers, waits;

  explicit NodeGraph(const StageGraph &graph);

  /// Nodes so that each comes after what it depends on, and otherwise as
  /// declared; fewer than all where nodes wait for each other.
  llvm::SmallVector<int> declarationOrder() const;
};

} // namespace piko

#endif // PIKO_ANALYSIS_STAGEGRAPH_H
