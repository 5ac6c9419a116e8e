// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-vectorize: writes as vectors what piko-plan-vectors has decided for, by
// predication.

#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

namespace piko {
#define GEN_PASS_DEF_VECTORIZE
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct VectorizePass : piko::impl::VectorizeBase<VectorizePass> {
  using VectorizeBase::VectorizeBase;
  void runOnOperation() override;
  LogicalResult write(scf::ForOp loop, int64_t laneCount);
};

} // namespace

LogicalResult VectorizePass::write(scf::ForOp loop, int64_t laneCount) {
  if (!llvm::is_contained({4, 8, 16, 32}, laneCount))
    return loop.emitError("expected a plan of 4, 8, 16 or 32 lanes, but got ")
           << laneCount;
  WalkResult nested = loop.getBody()->walk([&](Operation *op) {
    if (!op->hasAttr(marks::vectorLanes))
      return WalkResult::advance();
    op->emitError("expected no plan in a loop that is planned to be vectors");
    return WalkResult::interrupt();
  });
  if (nested.wasInterrupted())
    return failure();
  IterationLanes lanes(loop, laneCount);
  if (const IterationLanes::Refusal &refusal = lanes.getRefusal(); refusal.at) {
    InFlightDiagnostic error =
        loop.emitError("a loop is planned to be vectors, but ") << refusal.why;
    if (refusal.at != loop)
      error.attachNote(refusal.at->getLoc()) << "here";
    return error;
  }
  IterationWriter writer(lanes);
  writer.write(OpBuilder(loop).saveInsertionPoint());
  if (marksTurns)
    for (scf::WhileOp turns : writer.getTurnLoops())
      turns->setAttr(marks::turns, UnitAttr::get(&getContext()));
  loop.erase();
  return success();
}

void VectorizePass::runOnOperation() {
  SmallVector<std::pair<scf::ForOp, int64_t>> loops;
  WalkResult walked =
      getOperation().walk<WalkOrder::PreOrder>([&](Operation *op) {
        auto count = op->getAttrOfType<IntegerAttr>(marks::vectorLanes);
        if (!count)
          return WalkResult::advance();
        auto loop = dyn_cast<scf::ForOp>(op);
        if (!loop) {
          op->emitError("expected a plan of an scf.for, but this is ")
              << op->getName();
          return WalkResult::interrupt();
        }
        loops.emplace_back(loop, count.getInt());
        return WalkResult::skip();
      });
  if (walked.wasInterrupted())
    return signalPassFailure();
  for (auto [loop, count] : loops)
    if (failed(write(loop, count)))
      return signalPassFailure();
}
