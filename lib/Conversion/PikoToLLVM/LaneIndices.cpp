// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "LaneIndices.h"

#include "LoweringContext.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

SmallVector<Value> piko::extractIndices(CodeBuilder at, Value index) {
  OpBuilder &builder = at.builder;
  Location loc = at.loc;
  auto type = cast<VectorType>(index.getType());
  int64_t lanes = type.getNumElements();
  SmallVector<Value> indices;
  if (type.getElementType().isIndex()) {
    index = arith::IndexCastOp::create(builder, loc,
                                       type.clone(builder.getI64Type()), index);
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
