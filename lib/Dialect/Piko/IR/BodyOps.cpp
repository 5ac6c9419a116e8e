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
    SmallVector<Value> values;
    if (auto emit = get.getPrim().getDefiningOp<EmissionOpInterface>())
      values = emit.getNumbers();
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

/// That an emission is where it may be, and does what it has to.
static LogicalResult verifyEmissionPlace(EmissionOpInterface emission) {
  if (!emission->getParentOfType<ProcessOp>() &&
      !emission->getParentOfType<BinsOp>())
    return emission->emitOpError("expected to be inside a process phase");
  if (emission->getParentOfType<UpdateOp>())
    return emission->emitOpError("expected to be outside an update, which may "
                                 "return what decides about it");
  if (wouldOpBeTriviallyDead(emission))
    return emission->emitOpError(
        "expected an effect, because it emits, but it says that it has none");
  for (Value number : emission.getNumbers())
    if (!llvm::is_contained(emission->getOperands(), number))
      return emission->emitOpError(
          "expected the numbers that it emits to be its operands");
  return success();
}

LogicalResult piko::detail::verifyEmission(Operation *op) {
  auto emission = cast<EmissionOpInterface>(op);
  if (failed(verifyEmissionPlace(emission)))
    return failure();
  StageOp stage =
      op->getParentOfType<ProcessOp>() ? getPhaseStage(op) : getKernelStage(op);
  if (!stage)
    return success(); // the phase reports it
  int64_t port = emission.getPort(), ports = stage.getOutputs().size();
  if (port < 0 || port >= ports)
    return op->emitOpError("expected a port below ")
           << ports << ", which is how many stage '" << getCppName(stage)
           << "' has, but got " << port;
  auto name = cast<FlatSymbolRefAttr>(stage.getOutputs()[port]);
  RecordOp record = lookupRecord(op, name);
  if (!record)
    return success(); // the stage reports it
  SmallVector<Type> types = record.getElementTypes();
  SmallVector<Value> numbers = emission.getNumbers();
  if (TypeRange(types) != TypeRange(ValueRange(numbers)))
    return op->emitOpError("expected the numbers of record ")
           << name << ", " << types.size() << " of types (" << types
           << "), but got (" << TypeRange(ValueRange(numbers)) << ")";
  auto prim = emission.getPrim()
                  ? dyn_cast<PrimType>(emission.getPrim().getType())
                  : PrimType();
  if (prim && prim.getRecord() != name)
    return op->emitOpError("expected a result of record ")
           << name << ", but got " << prim.getRecord();
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
