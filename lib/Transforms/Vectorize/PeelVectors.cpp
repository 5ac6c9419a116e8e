// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-peel-vectors: where masks cost, the last vector of a loop, which need
// not be full, is peeled off. All vectors before it have no mask.

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"

namespace piko {
#define GEN_PASS_DEF_PEELVECTORS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct PeelVectorsPass : piko::impl::PeelVectorsBase<PeelVectorsPass> {
  using PeelVectorsBase::PeelVectorsBase;
  void runOnOperation() override;
};

} // namespace

/// The loop of vectors whose mask says which lanes of the last one there are;
/// null where that is all that there is.
static scf::ForOp getLoop(arith::CmpIOp mask, int64_t mostLanes) {
  auto loop = dyn_cast<scf::ForOp>(mask->getParentOp());
  auto type = dyn_cast<VectorType>(mask.getType());
  if (!loop || !type || loop.getNumResults() > 0 ||
      type.getNumElements() > mostLanes ||
      getConstantIntValue(loop.getStep()) != type.getNumElements())
    return {};
  return loop;
}

/// Whether there is a row to load or to store, and not so much besides that the
/// code would be the greater cost.
static bool pays(scf::ForOp loop) {
  constexpr int64_t most = 400;
  int64_t operations = 0;
  bool hasRow = false;
  loop.walk([&](Operation *op) {
    ++operations;
    auto gather = dyn_cast<GatherOp>(op);
    auto scatter = dyn_cast<ScatterOp>(op);
    hasRow |= (gather && gather.getConsecutive()) ||
              (scatter && scatter.getConsecutive());
  });
  return hasRow && operations <= most;
}

/// Where full vectors end: what is left then is less than one.
static Value createFullEnd(OpBuilder &builder, scf::ForOp loop, int64_t lanes) {
  Location loc = loop.getLoc();
  Type type = loop.getUpperBound().getType();
  auto constant = [&](int64_t value) -> Value {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(type, value));
  };
  Value first = loop.getLowerBound(), end = loop.getUpperBound();
  // How many there are may be more than is positive.
  Value isAny = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                      first, end);
  Value count = arith::SubIOp::create(builder, loc, end, first);
  count = arith::SelectOp::create(builder, loc, isAny, count, constant(0));
  Value full = arith::AndIOp::create(builder, loc, count, constant(-lanes));
  return arith::AddIOp::create(builder, loc, first, full);
}

static void peel(scf::ForOp loop, arith::CmpIOp mask) {
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  auto type = cast<VectorType>(mask.getType());
  Value end = createFullEnd(builder, loop, type.getNumElements());
  IRMapping copies;
  auto full = cast<scf::ForOp>(builder.clone(*loop, copies));
  full.setUpperBound(end);
  Operation *copied = copies.lookup(mask.getResult()).getDefiningOp();
  builder.setInsertionPoint(copied);
  copied->replaceAllUsesWith(arith::ConstantOp::create(
      builder, loc, DenseElementsAttr::get(type, true)));
  copied->erase();
  builder.setInsertionPoint(loop);
  Value isAny = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                      end, loop.getUpperBound());
  auto last = scf::IfOp::create(builder, loc, isAny, /*withElseRegion=*/false);
  loop.getInductionVar().replaceAllUsesWith(end);
  loop.getBody()->getTerminator()->erase();
  Block *body = last.thenBlock();
  body->getOperations().splice(body->getTerminator()->getIterator(),
                               loop.getBody()->getOperations());
  loop.erase();
}

void PeelVectorsPass::runOnOperation() {
  SmallVector<arith::CmpIOp> masks;
  getOperation().walk([&](arith::CmpIOp op) {
    if (op->hasAttr(marks::lastLanes))
      masks.push_back(op);
  });
  // Inner loops first: copies have them as they are then.
  for (arith::CmpIOp mask : llvm::reverse(masks)) {
    mask->removeAttr(marks::lastLanes);
    if (scf::ForOp loop = getLoop(mask, mostLanes); loop && pays(loop))
      peel(loop, mask);
  }
}
