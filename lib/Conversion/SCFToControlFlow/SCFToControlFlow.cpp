// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Structured control flow to branches, in time that grows with the text.

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Conversion/SCFToControlFlow/SCFToControlFlow.h"
#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Iterators.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Rewrite/PatternApplicator.h"

#include <algorithm>
#include <cmath>

namespace piko {
#define GEN_PASS_DEF_CONVERTSCFTOCONTROLFLOWINREVERSE
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

/// Says how likely the first way of a branch is, as LLVM does.
static void setWeights(Operation *terminator, double first) {
  constexpr double all = 1 << 20;
  auto weigh = [&](double part) {
    return int32_t(std::clamp(std::round(part * all), 1.0, all));
  };
  if (auto branch = dyn_cast<cf::CondBranchOp>(terminator))
    branch.setBranchWeights(ArrayRef<int32_t>{weigh(first), weigh(1 - first)});
}

/// The block at whose end is the branch that is made of an operation.
static Block *getDecidingBlock(Operation *op) {
  if (auto loop = dyn_cast<scf::WhileOp>(op))
    return &loop.getBefore().back();
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return loop.getBody();
  return op->getBlock();
}

namespace {
struct ConvertSCFToControlFlowInReverse
    : piko::impl::ConvertSCFToControlFlowInReverseBase<
          ConvertSCFToControlFlowInReverse> {
  void runOnOperation() override {
    RewritePatternSet patterns(&getContext());
    populateSCFToControlFlowConversionPatterns(patterns);
    FrozenRewritePatternSet frozen(std::move(patterns));
    PatternApplicator applicator(frozen);
    applicator.applyDefaultCostModel();
    PatternRewriter rewriter(&getContext());
    // A loop of one kind may become one of another.
    for (llvm::SmallVector<Operation *> found = collect(); !found.empty();
         found = collect())
      for (Operation *op : found) {
        rewriter.setInsertionPoint(op);
        Block *deciding = getDecidingBlock(op);
        auto likely = op->getAttrOfType<FloatAttr>(marks::probability);
        if (succeeded(applicator.matchAndRewrite(op, rewriter))) {
          if (likely)
            setWeights(deciding->getTerminator(), likely.getValueAsDouble());
          continue;
        }
        op->emitOpError("has no form of branches");
        return signalPassFailure();
      }
  }

  /// Structured control flow, the last in a block first: what is after it is
  /// then no more than a branch and what follows up to the next.
  llvm::SmallVector<Operation *> collect() {
    llvm::SmallVector<Operation *> found;
    getOperation()->walk<WalkOrder::PreOrder, ReverseIterator>(
        [&](Operation *op) {
          if (isa<scf::ExecuteRegionOp, scf::ForOp, scf::ForallOp, scf::IfOp,
                  scf::IndexSwitchOp, scf::ParallelOp, scf::WhileOp>(op))
            found.push_back(op);
        });
    return found;
  }
};
} // namespace
