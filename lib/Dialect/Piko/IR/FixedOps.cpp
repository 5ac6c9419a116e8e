// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a pipeline is specialized for.

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
