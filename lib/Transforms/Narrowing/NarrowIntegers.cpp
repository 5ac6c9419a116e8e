// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-narrow-integers: signs and values of affine functions of a pixel in 32
// bits, where a test before the loop finds that they fit.

#include "Narrowing/Narrower.h"
#include "Vectorize/Analysis/Lanes.h"

#include "Piko/Transforms/Passes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

namespace piko {
#define GEN_PASS_DEF_NARROWINTEGERS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct NarrowIntegersPass : piko::impl::NarrowIntegersBase<NarrowIntegersPass> {
  using NarrowIntegersBase::NarrowIntegersBase;
  void runOnOperation() override;
};

} // namespace

/// Moves out of a loop what it reads of local arrays that it does not change,
/// at places that are known.
static void hoistLoads(scf::ForOp loop) {
  SmallVector<memref::LoadOp> loads;
  loop.walk([&](memref::LoadOp load) {
    auto array = load.getMemRef().getDefiningOp<memref::AllocaOp>();
    if (!array || loop->isAncestor(array))
      return;
    bool isInside =
        llvm::all_of(llvm::zip(load.getIndices(), array.getType().getShape()),
                     [](auto pair) {
                       std::optional<int64_t> at =
                           getConstantIntValue(std::get<0>(pair));
                       return at && *at >= 0 && *at < std::get<1>(pair);
                     });
    bool isRead = llvm::all_of(array->getUsers(), [&](Operation *user) {
      return isa<memref::LoadOp>(user) ||
             (isa<memref::StoreOp>(user) && !loop->isAncestor(user));
    });
    if (isInside && isRead)
      loads.push_back(load);
  });
  for (memref::LoadOp load : loads) {
    for (Value index : load.getIndices())
      if (!loop.isDefinedOutsideOfLoop(index))
        index.getDefiningOp()->moveBefore(loop);
    load->moveBefore(loop);
  }
}

void NarrowIntegersPass::runOnOperation() {
  if (laneCount < 0) {
    getOperation().emitError("expected at least 0 lanes, but got ")
        << int64_t(laneCount);
    return signalPassFailure();
  }
  SmallVector<scf::ForOp> rows;
  getOperation().walk([&](scf::ForOp loop) {
    // Loops that stay scalar gain nothing.
    bool mayBeLanes =
        !isOverBox(loop) || hasSpecifiedLanes(loop, LaneMapping::Iterations);
    if (loop->hasAttr(marks::lanes) && !loop->hasAttr(marks::mapping) &&
        mayBeLanes)
      rows.push_back(loop);
  });
  for (scf::ForOp row : rows) {
    // So that what is the same for all pixels stands before.
    hoistLoads(row);
    moveLoopInvariantCode(cast<LoopLikeOpInterface>(row.getOperation()));
    if (auto parent = dyn_cast<LoopLikeOpInterface>(row->getParentOp())) {
      if (auto rows = dyn_cast<scf::ForOp>(row->getParentOp()))
        hoistLoads(rows);
      moveLoopInvariantCode(parent);
    }
    Narrower(row, laneCount).narrow();
  }
}
