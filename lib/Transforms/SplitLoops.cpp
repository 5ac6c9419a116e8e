// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-split-loops: parallel loops as loops over their iterations.

#include "LoopSplitter.h"

#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/PatternMatch.h"

namespace piko {
#define GEN_PASS_DEF_SPLITLOOPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct SplitLoopsPass : piko::impl::SplitLoopsBase<SplitLoopsPass> {
  void runOnOperation() override;
};
} // namespace

/// A loop without barriers: its iterations one after the other.
static void convertLoop(ParallelForOp parallel) {
  IRRewriter rewriter(parallel);
  Location loc = parallel.getLoc();
  Value zero = arith::ConstantIndexOp::create(rewriter, loc, 0);
  Value one = arith::ConstantIndexOp::create(rewriter, loc, 1);
  auto loop = scf::ForOp::create(rewriter, loc, zero, parallel.getCount(), one);
  loop->setAttr("piko.lanes", rewriter.getUnitAttr());
  Block *body = parallel.getBodyBlock();
  rewriter.eraseOp(body->getTerminator());
  rewriter.inlineBlockBefore(body, loop.getBody()->getTerminator(),
                             loop.getInductionVar());
  rewriter.eraseOp(parallel);
}

void SplitLoopsPass::runOnOperation() {
  // Those inside others first.
  SmallVector<ParallelForOp> parallels;
  getOperation().walk([&](ParallelForOp op) {
    if (op->getParentOfType<KernelOp>())
      parallels.push_back(op);
  });
  for (ParallelForOp parallel : parallels) {
    ++loops;
    if (!parallel.hasBarriers()) {
      convertLoop(parallel);
      continue;
    }
    LoopSplitter splitter(parallel);
    if (failed(splitter.run()))
      return signalPassFailure();
    ++cuts;
    checks += splitter.getChecks();
  }
}
