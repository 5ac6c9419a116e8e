// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Primitives and bins.

#include "FieldAccess.h"
#include "StageUses.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"

using namespace mlir;
using namespace piko;

LogicalResult GetOp::verifySymbolUses(SymbolTableCollection &) {
  FlatSymbolRefAttr record = getPrim().getType().getRecord();
  if (failed(verifyFieldAccess(*this, record, getField(), getElements().size(),
                               getResult().getType())))
    return failure();
  return verifyElement(*this, record, getField(), getElements());
}

namespace {
/// A field of what was just emitted is the value that was emitted.
struct ForwardEmitted : OpRewritePattern<GetOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(GetOp get,
                                PatternRewriter &rewriter) const override {
    ValueRange values;
    if (auto emit = get.getPrim().getDefiningOp<EmitOp>())
      values = emit.getValues();
    else if (auto append = get.getPrim().getDefiningOp<AppendOp>())
      values = append.getValues();
    else
      return rewriter.notifyMatchFailure(get, "not of an emitted primitive");
    RecordOp record = lookupRecord(get, get.getPrim().getType().getRecord());
    int64_t at = 0;
    for (auto field : record.getFields().getAsRange<FieldAttr>()) {
      if (field.getName() != get.getField()) {
        at += field.getElementCount();
        continue;
      }
      int64_t element = 0;
      for (auto [index, count] :
           llvm::zip(get.getElements(), field.getCounts())) {
        APInt constant;
        if (!matchPattern(index, m_ConstantInt(&constant)))
          return rewriter.notifyMatchFailure(get, "the index is not constant");
        if (constant.getSExtValue() < 0 || constant.getSExtValue() >= count)
          return rewriter.notifyMatchFailure(get, "the index is out of range");
        element = element * count + constant.getSExtValue();
      }
      rewriter.replaceOp(get, values[at + element]);
      return success();
    }
    return failure();
  }
};
} // namespace

Speculation::Speculatability GetOp::getSpeculatability() {
  if (getElements().empty())
    return Speculation::Speculatable;
  RecordOp record = lookupRecord(*this, getPrim().getType().getRecord());
  if (!record) // not in a module yet
    return Speculation::NotSpeculatable;
  FieldAttr field = record.getField(getField());
  for (auto [element, count] : llvm::zip(getElements(), field.getCounts())) {
    APInt index;
    if (!matchPattern(element, m_ConstantInt(&index)) || index.uge(count))
      return Speculation::NotSpeculatable;
  }
  return Speculation::Speculatable;
}

void GetOp::getCanonicalizationPatterns(RewritePatternSet &patterns,
                                        MLIRContext *context) {
  patterns.add<ForwardEmitted>(context);
}

Value DivideOp::createUnchecked(OpBuilder &builder) {
  Value a = getLhs(), b = getRhs();
  switch (getKind()) {
  case DivisionKind::QuotientS:
    return arith::DivSIOp::create(builder, getLoc(), a, b);
  case DivisionKind::QuotientU:
    return arith::DivUIOp::create(builder, getLoc(), a, b);
  case DivisionKind::RemainderS:
    return arith::RemSIOp::create(builder, getLoc(), a, b);
  case DivisionKind::RemainderU:
    return arith::RemUIOp::create(builder, getLoc(), a, b);
  }
  llvm_unreachable("all kinds are handled");
}

/// A division by a constant that always has a result needs no test.
LogicalResult DivideOp::canonicalize(DivideOp divide,
                                     PatternRewriter &rewriter) {
  APInt divisor;
  if (!matchPattern(divide.getRhs(), m_ConstantInt(&divisor)) ||
      divisor.isZero() || (divide.isSigned() && divisor.isAllOnes()))
    return rewriter.notifyMatchFailure(divide, "it may have no result");
  rewriter.replaceOp(divide, divide.createUnchecked(rewriter));
  return success();
}

LogicalResult ListAtOp::verify() {
  if (getPrim().getType().getRecord() != getList().getType().getRecord())
    return emitOpError("expected a primitive of record ")
           << getList().getType().getRecord() << ", but got "
           << getPrim().getType().getRecord();
  return success();
}

LogicalResult EmitOp::verify() {
  bool isPhase = (*this)->getParentOfType<ProcessOp>();
  if (!isPhase && !(*this)->getParentOfType<BinsOp>())
    return emitOpError("expected to be inside a process phase");
  if ((*this)->getParentOfType<UpdateOp>())
    return emitOpError("expected to be outside an update");
  StageOp stage = isPhase ? getPhaseStage(*this) : getKernelStage(*this);
  if (!stage)
    return success(); // the phase reports it
  if (getPort() >= int64_t(stage.getOutputs().size()))
    return emitOpError("expected a port below ")
           << stage.getOutputs().size() << ", which is how many stage '"
           << getCppName(stage) << "' has, but got " << getPort();
  auto name = cast<FlatSymbolRefAttr>(stage.getOutputs()[getPort()]);
  RecordOp record = lookupRecord(*this, name);
  if (!record)
    return success(); // the stage reports it
  SmallVector<Type> types = record.getElementTypes();
  if (types != getValues().getTypes())
    return emitOpError("expected the numbers of record ")
           << name << ", " << types.size() << " of types (" << types
           << "), but got (" << getValues().getTypes() << ")";
  if (getPrim() && getPrim().getType().getRecord() != name)
    return emitOpError("expected a result of record ")
           << name << ", but got " << getPrim().getType().getRecord();
  return success();
}

//===----------------------------------------------------------------------===//
// Bins
//===----------------------------------------------------------------------===//

LogicalResult piko::verifyRank(Operation *op, size_t coordinates) {
  PipelineOp pipeline = getPipeline(op);
  if (pipeline && int64_t(coordinates) != pipeline.getRank())
    return op->emitOpError("expected ")
           << pipeline.getRank()
           << " coordinates, the rank of the pipeline, but got " << coordinates;
  return success();
}

/// A dimension is one of the pipeline's.
static LogicalResult verifyDim(Operation *op, int64_t dim) {
  PipelineOp pipeline = getPipeline(op);
  if (pipeline && dim >= pipeline.getRank())
    return op->emitOpError("expected a dimension below ")
           << pipeline.getRank() << ", the rank of the pipeline, but got "
           << dim;
  return success();
}

LogicalResult BinLoOp::verify() { return verifyDim(*this, getDim()); }
LogicalResult BinHiOp::verify() { return verifyDim(*this, getDim()); }
LogicalResult DomainOp::verify() { return verifyDim(*this, getDim()); }

LogicalResult GridOp::verify() {
  if (getDim() < 0)
    return emitOpError("expected a dimension of at least 0, but got ")
           << getDim();
  return verifyDim(*this, getDim());
}

LogicalResult BinAtOp::verify() {
  return verifyRank(*this, getCoordinates().size());
}
