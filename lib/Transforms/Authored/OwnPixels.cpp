// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-own-pixels: finds the one pixel that a stage updates for a primitive,
// and tells the assign phase, so that threads can share a bin by its pixels.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "Piko/Analysis/Repeatable.h"

#include "mlir/Analysis/SliceAnalysis.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/IRMapping.h"

namespace piko {
#define GEN_PASS_DEF_OWNPIXELS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct OwnPixelsPass : piko::impl::OwnPixelsBase<OwnPixelsPass> {
  using OwnPixelsBase::OwnPixelsBase;
  void runOnOperation() override;
  void runOnStage(StageOp stage);
};
} // namespace

/// Adds to `slice` what `value` is computed from, operands first; fails at an
/// operation that cannot be repeated, and says which.
static LogicalResult collectCoordinateSlice(Value value, Value prim,
                                            llvm::SetVector<Operation *> &slice,
                                            Operation *&culprit) {
  if (value == prim)
    return success();
  Operation *op = value.getDefiningOp();
  if (!op) {
    culprit = cast<BlockArgument>(value).getOwner()->getParentOp();
    return failure();
  }
  if (slice.contains(op))
    return success();
  if (!isRepeatable(op)) {
    culprit = op;
    return failure();
  }
  for (Value operand : op->getOperands())
    if (failed(collectCoordinateSlice(operand, prim, slice, culprit)))
      return failure();
  slice.insert(op);
  return success();
}

/// Whether two lists of values are computed by the same operations from the
/// same leaves.
static bool isSameValue(Value a, Value b) {
  if (a == b)
    return true;
  Operation *x = a.getDefiningOp(), *y = b.getDefiningOp();
  return x && y && isRepeatable(x) &&
         x->getNumOperands() == y->getNumOperands() &&
         cast<OpResult>(a).getResultNumber() ==
             cast<OpResult>(b).getResultNumber() &&
         OperationEquivalence::isEquivalentTo(
             x, y, [](Value p, Value q) { return success(isSameValue(p, q)); },
             /*markEquivalent=*/nullptr, OperationEquivalence::IgnoreLocations);
}

/// The stage's assign phase, made if there is none.
static AssignOp getOrCreateAssign(StageOp stage) {
  if (AssignOp assign = stage.getAssign())
    return assign;
  ProcessOp process = stage.getProcess();
  OpBuilder builder(process);
  auto assign = AssignOp::create(builder, stage.getLoc(), FlatSymbolRefAttr(),
                                 IntegerAttr(), IntegerAttr());
  Block &body = assign.getBody().emplaceBlock();
  body.addArgument(process.getBody().getArgument(0).getType(), stage.getLoc());
  builder.setInsertionPointToStart(&body);
  Value zero = arith::ConstantIndexOp::create(builder, stage.getLoc(), 0);
  AssignToOp::create(builder, stage.getLoc(), zero);
  ReturnOp::create(builder, stage.getLoc());
  return assign;
}

void OwnPixelsPass::runOnStage(StageOp stage) {
  ProcessOp process = stage.getProcess();
  if (!process || stage.getTile())
    return;
  // Bins no larger than a tile run on one thread as they are.
  if (llvm::all_of(stage.getBins(),
                   [&](int64_t extent) { return extent && extent <= tile; }))
    return;
  SmallVector<UpdateOp> updates;
  process.walk([&](UpdateOp update) { updates.push_back(update); });
  if (updates.empty())
    return;

  UpdateOp first = updates.front();
  auto refuse = [&](Operation *at, const Twine &why) {
    InFlightDiagnostic remark = first.emitRemark()
                                << "stage '" << getCppName(stage)
                                << "' shares no bin by its pixels";
    remark.attachNote(at->getLoc()) << why;
  };
  if (stage.getTakesList())
    return refuse(process, "the phase takes a list, which may be of primitives "
                           "that update any pixel");
  WalkResult other = process.walk([&](StateAccessOpInterface access) {
    bool isUnknown = (access.getAccessKinds() & StateAccess::updates) &&
                     !isa<UpdateOp>(*access);
    if (isUnknown)
      refuse(access, "it is not known which pixel this updates");
    return isUnknown ? WalkResult::interrupt() : WalkResult::advance();
  });
  if (other.wasInterrupted())
    return;
  for (UpdateOp update : ArrayRef(updates).drop_front())
    for (auto [a, b] :
         llvm::zip(first.getCoordinates(), update.getCoordinates()))
      if (!isSameValue(a, b))
        return refuse(update, "this update may be at another pixel");

  llvm::SetVector<Operation *> slice;
  Operation *culprit = nullptr;
  for (Value coordinate : first.getCoordinates())
    if (failed(collectCoordinateSlice(
            coordinate, process.getBody().getArgument(0), slice, culprit)))
      return refuse(culprit, "the pixel depends on this, not only on the "
                             "primitive's fields and on constants");

  AssignOp assign = getOrCreateAssign(stage);
  Block &body = assign.getBody().front();
  // Before the assignments, which need the owner.
  OpBuilder builder(&body, body.begin());
  IRMapping mapping;
  mapping.map(process.getBody().getArgument(0), body.getArgument(0));
  for (Operation *op : slice)
    builder.clone(*op, mapping);
  SmallVector<Value> coordinates;
  for (Value coordinate : first.getCoordinates())
    coordinates.push_back(mapping.lookupOrDefault(coordinate));
  OwnerOp::create(builder, first.getLoc(), coordinates);
  stage.setTile(tile);
}

void OwnPixelsPass::runOnOperation() {
  if (tile < 1) {
    getOperation().emitError("expected a tile of at least 1 cell, but got ")
        << tile.getValue();
    return signalPassFailure();
  }
  for (auto stage : getOperation().getOps<StageOp>())
    runOnStage(stage);
}
