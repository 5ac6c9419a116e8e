// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-hoist-loads: what decides in each iteration of a loop whether there is
// another one, and no iteration changes, is read once before it.

#include "Piko/Transforms/Passes.h"
#include "Support/StateAccess.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

namespace piko {
#define GEN_PASS_DEF_HOISTLOADS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct HoistLoadsPass : piko::impl::HoistLoadsBase<HoistLoadsPass> {
  void runOnOperation() override;

private:
  bool hoist(scf::WhileOp loop, const llvm::DenseSet<StringAttr> &written);
};

} // namespace

/// A number that has no index cannot fail to be there.
static bool isFixed(LoadOp load, const llvm::DenseSet<StringAttr> &written) {
  return load.getIndices().empty() && load.getElements().empty() &&
         !load.getTile() && !written.contains(load.getStateAttr().getAttr());
}

/// Whether anything has left the loop, of what it does at least once.
bool HoistLoadsPass::hoist(scf::WhileOp loop,
                           const llvm::DenseSet<StringAttr> &written) {
  SmallVector<LoadOp> fixed;
  for (LoadOp load : loop.getBeforeBody()->getOps<LoadOp>())
    if (isFixed(load, written))
      fixed.push_back(load);
  for (LoadOp load : fixed)
    load->moveBefore(loop);
  if (!fixed.empty())
    moveLoopInvariantCode(cast<LoopLikeOpInterface>(loop.getOperation()));
  return !fixed.empty();
}

void HoistLoadsPass::runOnOperation() {
  SmallVector<Operation *> changed;
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
    kernel.walk([&](scf::WhileOp loop) { // inner ones first
      if (hoist(loop, written))
        changed.push_back(loop);
    });
  }
  if (changed.empty())
    return;
  // Such loops hand on what they have read.
  RewritePatternSet patterns(&getContext());
  scf::WhileOp::getCanonicalizationPatterns(patterns, &getContext());
  (void)applyOpPatternsGreedily(changed, std::move(patterns));
}
