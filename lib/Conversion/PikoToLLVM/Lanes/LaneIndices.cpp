// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "PikoToLLVM/Lanes/LaneIndices.h"

#include "PikoToLLVM/LoweringContext.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

SmallVector<Value> piko::extractIndices(CodeBuilder at, Value index) {
  OpBuilder &builder = at.builder;
  Location loc = at.loc;
  auto type = cast<VectorType>(index.getType());
  int64_t lanes = type.getNumElements();
  SmallVector<Value> indices;
  if (type.getElementType().isIndex())
    index = arith::IndexCastOp::create(builder, loc,
                                       type.clone(builder.getI64Type()), index);
  if (!type.getElementType().isInteger(32)) {
    for (int64_t lane = 0; lane < lanes; ++lane)
      indices.push_back(vector::ExtractOp::create(builder, loc, index, lane));
    return indices;
  }
  // Those of two lanes at once: to extract a number takes two instructions.
  Value pairs = vector::BitCastOp::create(
      builder, loc, VectorType::get({lanes / 2}, builder.getI64Type()), index);
  constexpr int64_t wordBits = 32, low = (int64_t(1) << wordBits) - 1;
  for (int64_t i = 0; i < lanes / 2; ++i) {
    Value pair = vector::ExtractOp::create(builder, loc, pairs, i);
    indices.push_back(at.both(pair, createI64(builder, loc, low)));
    indices.push_back(arith::ShRUIOp::create(
        builder, loc, pair, createI64(builder, loc, wordBits)));
  }
  return indices;
}

namespace {

/// Takes sums and products apart, which are those of 64 bits.
class IndexSplitter {
public:
  IndexSplitter(CodeBuilder at, Operation *loop,
                llvm::function_ref<Value(Value)> lower)
      : at(at), loop(loop), lower(lower) {}

  /// Whether what differs between lanes is fixed, and nothing overflows.
  bool isSplit(Value index) const;
  SharedIndex split(Value index);

private:
  bool isFixed(Value value) const {
    return !loop->isAncestor(value.getParentBlock()->getParentOp());
  }
  static Value getShared(Value value) {
    auto broadcast = value.getDefiningOp<vector::BroadcastOp>();
    return broadcast && !isa<VectorType>(broadcast.getSource().getType())
               ? broadcast.getSource()
               : Value();
  }
  /// A product's factor that all lanes share, and does not change; or null.
  Value getFactor(arith::MulIOp product, unsigned i) const {
    Value factor = getShared(product->getOperand(i));
    return factor && isFixed(factor) ? factor : Value();
  }
  Value add(Value a, Value b) { return a && b ? at.add(a, b) : a ? a : b; }
  /// In 64 bits.
  Value widen(Value value);

  CodeBuilder at;
  Operation *loop;
  llvm::function_ref<Value(Value)> lower;
};

} // namespace

bool IndexSplitter::isSplit(Value index) const {
  if (isFixed(index) || getShared(index))
    return true;
  auto isExact = [](auto op) {
    return bitEnumContainsAll(op.getOverflowFlags(),
                              arith::IntegerOverflowFlags::nsw);
  };
  if (auto sum = index.getDefiningOp<arith::AddIOp>())
    return isExact(sum) && isSplit(sum.getLhs()) && isSplit(sum.getRhs());
  auto product = index.getDefiningOp<arith::MulIOp>();
  return product && isExact(product) &&
         ((getFactor(product, 0) && isSplit(product.getRhs())) ||
          (getFactor(product, 1) && isSplit(product.getLhs())));
}

Value IndexSplitter::widen(Value value) {
  Type wide = at.builder.getI64Type();
  if (auto vector = dyn_cast<VectorType>(value.getType()))
    wide = vector.clone(wide);
  return arith::ExtSIOp::create(at.builder, at.loc, wide, lower(value));
}

SharedIndex IndexSplitter::split(Value index) {
  if (Value shared = getShared(index))
    return {{}, widen(shared)};
  if (isFixed(index))
    return {widen(index), {}};
  if (auto sum = index.getDefiningOp<arith::AddIOp>()) {
    SharedIndex a = split(sum.getLhs()), b = split(sum.getRhs());
    return {add(a.lanes, b.lanes), add(a.shared, b.shared)};
  }
  auto product = index.getDefiningOp<arith::MulIOp>();
  unsigned i = getFactor(product, 0) ? 0 : 1;
  Value factor = widen(getFactor(product, i));
  SharedIndex rest = split(product->getOperand(1 - i));
  if (rest.shared)
    rest.shared = at.mul(rest.shared, factor);
  if (rest.lanes)
    rest.lanes = at.mul(
        rest.lanes, vector::BroadcastOp::create(at.builder, at.loc,
                                                rest.lanes.getType(), factor));
  return rest;
}

std::optional<SharedIndex>
piko::splitIndex(CodeBuilder at, Value index, Operation *user,
                 llvm::function_ref<Value(Value)> lower) {
  auto loop = user->getParentOfType<LoopLikeOpInterface>();
  if (!loop)
    return std::nullopt;
  IndexSplitter splitter(at, loop, lower);
  if (!splitter.isSplit(index))
    return std::nullopt;
  SharedIndex found = splitter.split(index);
  return found.lanes && found.shared ? std::optional(found) : std::nullopt;
}
