// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Into which bins assign phases put their primitives.

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "StageUses.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

using namespace mlir;
using namespace piko;

static LogicalResult verifyInAssign(Operation *op) {
  if (!op->getParentOfType<AssignOp>())
    return op->emitOpError("expected to be inside an assign phase");
  return success();
}

LogicalResult AssignToOp::verify() { return verifyInAssign(*this); }
LogicalResult AssignAllOp::verify() { return verifyInAssign(*this); }

LogicalResult AssignPreviousOp::verify() {
  if (failed(verifyInAssign(*this)))
    return failure();
  StageOp stage = getPhaseStage(*this);
  if (!stage)
    return success(); // the phase reports it
  FlatSymbolRefAttr name = FlatSymbolRefAttr::get(stage.getSymNameAttr());
  PipelineOp pipeline = getPipeline(*this);
  for (auto source : pipeline.getOps<SourceOp>())
    if (source.getStageAttr() == name)
      return emitOpError("expected a previous stage, but stage '")
             << getCppName(stage) << "' has a source";
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    if (edge.getConsumerAttr() != name)
      continue;
    auto producer = lookupInPipeline<StageOp>(*this, edge.getProducerAttr());
    if (producer && producer.getBins() != stage.getBins())
      return emitOpError("expected stage '")
             << getCppName(producer) << "' to have bins of the same size as '"
             << getCppName(stage) << "', [" << stage.getBins() << "], but got ["
             << producer.getBins() << "]";
  }
  return success();
}

LogicalResult AssignBoxOp::verify() {
  if (failed(verifyInAssign(*this)) ||
      failed(verifyRank(*this, getLo().size())))
    return failure();
  return verifyRank(*this, getHi().size());
}

LogicalResult OwnerOp::verify() {
  if (failed(verifyInAssign(*this)))
    return failure();
  return verifyRank(*this, getCoordinates().size());
}

//===----------------------------------------------------------------------===//
// Bins
//===----------------------------------------------------------------------===//

void AssignToOp::buildBins(OpBuilder &builder, Operation *, Value,
                           PutInBin put) {
  put(builder, getBin());
}

void AssignPreviousOp::buildBins(OpBuilder &builder, Operation *,
                                 Value previous, PutInBin put) {
  put(builder, previous);
}
bool AssignPreviousOp::keepsBin() { return true; }
bool AssignPreviousOp::canFail() { return false; }

void AssignAllOp::buildBins(OpBuilder &builder, Operation *stage, Value,
                            PutInBin put) {
  BinArithmetic bins(builder, getLoc(), cast<StageOp>(stage));
  auto loop = scf::ForOp::create(builder, getLoc(), bins.constant(0),
                                 bins.binCount(), bins.constant(1));
  OpBuilder inside = OpBuilder::atBlockBegin(loop.getBody());
  put(inside, loop.getInductionVar());
}
bool AssignAllOp::canFail() { return false; }

void AssignBoxOp::buildBins(OpBuilder &builder, Operation *stage, Value,
                            PutInBin put) {
  BinArithmetic(builder, getLoc(), cast<StageOp>(stage))
      .forEachBinIn(
          getLo(), getHi(),
          [&](OpBuilder &inside, Value bin, ValueRange) { put(inside, bin); });
}
bool AssignBoxOp::canFail() { return false; }
