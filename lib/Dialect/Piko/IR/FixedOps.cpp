// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a pipeline takes for granted of what the host gives it.

#include "Piko/Dialect/Piko/IR/PikoFixed.h"

using namespace mlir;
using namespace piko;

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoFixedOps.cpp.inc"

LogicalResult FixedOp::verifySymbolUses(SymbolTableCollection &) {
  auto *state = lookupInPipeline<Operation *>(*this, getStateAttr());
  bool isSize = isa_and_nonnull<BufferOp>(state);
  if (!isSize && !isa_and_nonnull<ConstantOp>(state))
    return emitOpError("expected a constant or a buffer, but got ")
           << getStateAttr() << ", which is none";
  if (isSize != !getField())
    return emitOpError("expected ")
           << (isSize ? "no field of a buffer, whose size is fixed"
                      : "a field of a constant");
  if (isSize && !isa<IndexType>(getValue().getType()))
    return emitOpError("expected an index for the size of a buffer, but got ")
           << getValue().getType();
  if (isSize && (getElement() || cast<IntegerAttr>(getValue()).getInt() < 0))
    return emitOpError("expected how many elements a buffer has");
  if (isSize)
    return success();
  FieldAttr field =
      lookupRecord(*this, getStateRecord(state)).getField(*getField());
  if (!field)
    return emitOpError("expected a field of ")
           << getStateAttr() << ", but got '" << *getField()
           << "', which is none";
  if (getElement().has_value() == field.getCounts().empty())
    return emitOpError("expected ")
           << (field.getCounts().empty() ? "no element of a field that is no "
                                           "array"
                                         : "an element of an array");
  int64_t element = getElement().value_or(0);
  if (element < 0 || element >= field.getElementCount())
    return emitOpError("expected an element from 0 to ")
           << field.getElementCount() - 1 << ", but got " << element;
  if (getValue().getType() != field.getType())
    return emitOpError("expected a value of ")
           << field.getType() << ", but got " << getValue().getType();
  return success();
}

uint64_t FixedOp::getBits() {
  if (auto number = dyn_cast<FloatAttr>(getValue()))
    return number.getValue().bitcastToAPInt().getZExtValue();
  return cast<IntegerAttr>(getValue()).getValue().getZExtValue();
}

FlatSymbolRefAttr ContractOp::getRecord() {
  if (FlatSymbolRefAttr buffer = getBufferAttr())
    return lookupInPipeline<BufferOp>(*this, buffer).getRecordAttr();
  auto sources = getPipeline(*this).getOps<SourceOp>();
  SourceOp source = *std::next(sources.begin(), *getSource());
  return lookupInPipeline<StageOp>(*this, source.getStageAttr()).getInputAttr();
}

Operation *ContractOp::findWrite() {
  Operation *found = nullptr;
  getPipeline(*this).walk([&](Operation *op) {
    auto store = dyn_cast<StoreOp>(op);
    auto atomic = dyn_cast<AtomicOp>(op);
    bool writes = (store && store.getStateAttr() == getBufferAttr()) ||
                  (atomic && atomic.getStateAttr() == getBufferAttr());
    if (writes)
      found = op;
    return writes ? WalkResult::interrupt() : WalkResult::advance();
  });
  return found;
}

LogicalResult ContractOp::verifySymbolUses(SymbolTableCollection &) {
  if (getBuffer().has_value() == getSource().has_value())
    return emitOpError("expected a buffer or the number of a source");
  PipelineOp pipeline = getPipeline(*this);
  if (std::optional<int64_t> source = getSource()) {
    auto sources = pipeline.getOps<SourceOp>();
    int64_t count = std::distance(sources.begin(), sources.end());
    if (*source < 0 || *source >= count)
      return emitOpError("expected one of the ")
             << count << " sources, but got " << *source;
    SourceOp of = *std::next(sources.begin(), *source);
    if (!lookupInPipeline<StageOp>(*this, of.getStageAttr()))
      return success(); // an error of the source's
  } else {
    auto buffer = lookupInPipeline<BufferOp>(*this, getBufferAttr());
    if (!buffer || buffer.getPerSource())
      return emitOpError("expected a buffer of the host's, but got ")
             << getBufferAttr() << ", which is none";
    if (Operation *write = findWrite()) {
      InFlightDiagnostic error = emitOpError("expected a buffer that no stage "
                                             "writes, but got ")
                                 << getBufferAttr();
      error.attachNote(write->getLoc()) << "it is written here";
      return error;
    }
  }
  RecordOp record = lookupRecord(*this, getRecord());
  FieldAttr field = record ? record.getField(getField()) : FieldAttr();
  if (!field || !field.getType().isSignlessInteger())
    return emitOpError("expected a field of integers, but got '")
           << getField() << "'";
  if (getTarget().has_value() == getBelow().has_value())
    return emitOpError("expected a buffer that is indexed or a number");
  if (getTarget() && !lookupInPipeline<BufferOp>(*this, getTargetAttr()))
    return emitOpError("expected a buffer that is indexed, but got ")
           << getTargetAttr() << ", which is none";
  if (getBelow() && int64_t(*getBelow()) < 1)
    return emitOpError("expected a number of at least 1, but got ")
           << int64_t(*getBelow());
  return success();
}
