// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How the edges of a pipeline are joined: in which order lineages begin, which
// primitives carry keys, and how wide these are.

#ifndef PIKO_ANALYSIS_PROGRAMPLAN_H
#define PIKO_ANALYSIS_PROGRAMPLAN_H

#include "Piko/Analysis/StageGraph.h"

namespace piko {

/// What leads to a stage: a `piko.source` or a `piko.edge`.
struct PlannedEdge {
  mlir::Operation *op;
  int producer; ///< -1 = a source.
  int port;
  int consumer;
  bool local = false; ///< The consumer runs in the producer's kernel.
  bool permute =
      false;        ///< What it brings need not be in the order of emission.
  int64_t keys = 0; ///< Words of its primitives' keys.
};

/// Of a run that several ranks share: the edges that lead from several of them
/// to others, and the stages that several run.
struct RankedEdges {
  const llvm::DenseSet<mlir::Operation *> *exchanged = nullptr;
  const llvm::DenseSet<mlir::Operation *> *divided = nullptr;
};

class ProgramPlan {
public:
  /// At the kernels level or below.
  explicit ProgramPlan(PipelineOp pipeline, RankedEdges ranked = {});

  /// A cycle of stages that do not collect, or one stage.
  int getLoop(int stage) const { return loops.nodeOf[stage]; }
  bool isLoop(int loop) const { return loops.cyclic[loop]; }
  llvm::ArrayRef<int> getLoopStages(int loop) const {
    return loops.nodes[loop];
  }
  int getComponent(int stage) const { return components.nodeOf[stage]; }
  size_t getComponentCount() const { return components.nodes.size(); }
  bool isCyclic(int component) const { return components.cyclic[component]; }
  llvm::ArrayRef<int> getComponentStages(int component) const {
    return components.nodes[component];
  }
  /// Whether some edges lead from one stage to another.
  bool isReached(int from, int to) const { return reach[from][to]; }
  /// What leads to a stage, sources first, in order.
  llvm::SmallVector<const PlannedEdge *> getInputs(int stage) const;
  /// Whether several edges lead into a stage, or into its loop, whose order is
  /// not irrelevant.
  bool merges(int stage) const;

  const StageGraph graph;
  llvm::SmallVector<PlannedEdge> edges; ///< Sources first.
  /// Components in the order in which their lineages begin; fewer than all
  /// where stages wait for each other.
  llvm::SmallVector<int> order;
  llvm::SmallVector<int64_t> keeps; ///< Words of the keys of a stage's items.
  llvm::SmallVector<int64_t> loopKeys; ///< Of what comes into a loop.

private:
  void findEdges(PipelineOp pipeline);
  void findBinned(PipelineOp pipeline);
  void findGathers();
  /// Whether what an edge brings reaches its bins in the order of lineage, and
  /// no more shows, as long as it comes so into the producer's bins.
  bool keepsBinOrder(const PlannedEdge &edge) const;
  bool needsBinOrderOnly(const PlannedEdge &edge) const;
  /// Whether an edge is merged by keys for the sake of ranks.
  bool mergesRanks(const PlannedEdge &edge) const;
  bool isDivided(int stage) const;
  void findKeyed();
  void findWidths();
  bool isInsideLoop(const PlannedEdge &edge) const;
  /// How many edges lead into a stage, or into its loop; those from one loop to
  /// one stage count once, as the loop orders what leaves it.
  int countInputs(int stage) const;
  /// The width of the keys of what comes to a stage, or into its loop.
  int64_t &widthAt(int stage);

  const NodeGraph components, loops;
  const RankedEdges ranked;
  llvm::SmallVector<bool> ordered; ///< Stages whose order of primitives shows.
  llvm::SmallVector<bool> placed;  ///< Those that have bins.
  llvm::SmallVector<bool> keepsBins; ///< What comes stays in the bin before.
  llvm::SmallVector<bool> binOrder;  ///< Order shows within a bin alone.
  llvm::SmallVector<llvm::SmallVector<bool>> reach;
};

} // namespace piko

#endif // PIKO_ANALYSIS_PROGRAMPLAN_H
