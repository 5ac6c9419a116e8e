// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Instrument/Counters.h"

#include "Piko/Dialect/Piko/IR/PikoApproximation.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

int32_t Counters::create(Location loc, CounterKind kind, StringAttr stage,
                         IntegerAttr port, FlatSymbolRefAttr state,
                         std::optional<int32_t> inside) {
  auto builder = OpBuilder::atBlockBegin(pipeline.getBodyBlock());
  for (Operation &op : *pipeline.getBodyBlock())
    if (isa<CounterOp>(op))
      builder.setInsertionPointAfter(&op);
  CounterOp::create(
      builder, loc, builder.getI32IntegerAttr(number),
      CounterKindAttr::get(builder.getContext(), kind), stage, port, state,
      inside ? builder.getI32IntegerAttr(*inside) : IntegerAttr());
  return number++;
}

int32_t Counters::add(Location loc, CounterKind kind, StringAttr stage,
                      std::optional<int32_t> inside) {
  return create(loc, kind, stage, {}, {}, inside);
}

int32_t Counters::getEmissions(Location loc, StringAttr stage, int64_t port) {
  auto [known, isNew] = ports.try_emplace({stage, port}, number);
  if (isNew)
    create(loc, CounterKind::Emissions, stage,
           Builder(pipeline.getContext()).getI64IntegerAttr(port), {}, {});
  return known->second;
}

int32_t Counters::getAccesses(Location loc, CounterKind kind, StringAttr stage,
                              FlatSymbolRefAttr state) {
  auto [known, isNew] =
      accesses.try_emplace({stage, state, static_cast<int32_t>(kind)}, number);
  if (isNew)
    create(loc, kind, stage, {}, state, {});
  return known->second;
}

int32_t Counters::getEffects(Location loc, StringAttr stage, int32_t loop) {
  auto [known, isNew] = effects.try_emplace(loop, number);
  if (isNew)
    add(loc, CounterKind::Effects, stage, loop);
  return known->second;
}

/// Whether it computes nothing of its own.
static bool isCopy(Operation *op) {
  return isa<arith::ConstantOp, arith::SelectOp, arith::IndexCastOp,
             arith::IndexCastUIOp, arith::ExtSIOp, arith::ExtUIOp,
             arith::TruncIOp, arith::BitcastOp>(op);
}

Type piko::getComputedType(Operation *op) {
  bool computes =
      isa<arith::ArithDialect, math::MathDialect>(op->getDialect()) ||
      isa<vector::FMAOp, ApproximateReciprocalOp, ApproximateRsqrtOp,
          ApproximateSqrtOp>(op);
  if (!computes || isCopy(op) || op->getNumResults() != 1)
    return {};
  auto isFloat = [](Type type) {
    return isa<FloatType>(getElementTypeOrSelf(type));
  };
  Type result = op->getResult(0).getType();
  if (isFloat(result) || op->getNumOperands() == 0)
    return result;
  Type operand = op->getOperand(0).getType();
  if (isFloat(operand))
    return operand;
  return getElementTypeOrSelf(operand).isInteger(1) ? Type() : operand;
}
