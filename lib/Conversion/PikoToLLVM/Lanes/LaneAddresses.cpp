// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "PikoToLLVM/Lanes/LaneAddresses.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

Value piko::computeLaneOffset(OpBuilder &builder, Location loc,
                              const StateView &view, ValueRange indices,
                              int64_t size, int64_t lanes) {
  auto words = VectorType::get({lanes}, builder.getI64Type());
  auto isVector = [](Value index) { return isa<VectorType>(index.getType()); };
  auto widen = [&](Value number) {
    return vector::BroadcastOp::create(builder, loc, words, number).getResult();
  };
  // What is the same for all lanes stays scalar.
  Value offset;
  auto combine = [&](auto tag, Value a, Value b) -> Value {
    using Op = decltype(tag);
    if (isVector(a) != isVector(b))
      (isVector(a) ? b : a) = widen(isVector(a) ? b : a);
    return Op::create(builder, loc, a, b);
  };
  for (int64_t dim = indices.size() - 1; dim >= 0; --dim) {
    Value index = indices[dim];
    index = arith::IndexCastOp::create(
        builder, loc,
        isVector(index) ? Type(words) : Type(builder.getI64Type()), index);
    offset =
        offset ? combine(arith::AddIOp(),
                         combine(arith::MulIOp(), offset, view.getFactor(dim)),
                         index)
               : index;
  }
  return offset
             ? combine(arith::MulIOp(), offset, createI64(builder, loc, size))
             : offset;
}

LaneAddresses piko::createLaneAddresses(OpBuilder &builder, Location loc,
                                        Value base, Value offset,
                                        int64_t stride, VectorType lanes) {
  auto words = VectorType::get(lanes.getShape(), builder.getI64Type());
  // Not inbounds: lanes that are not in the mask may be anywhere.
  auto add = [&](Type type, Value from, Value bytes) -> Value {
    return LLVM::GEPOp::create(builder, loc, type, builder.getI8Type(), from,
                               ArrayRef<LLVM::GEPArg>{bytes});
  };
  Type pointers = LLVM::getVectorType(base.getType(), lanes.getNumElements());
  if (offset && isa<VectorType>(offset.getType()))
    return {{}, add(pointers, base, offset)};
  Value first = offset ? add(base.getType(), base, offset) : base;
  if (stride == lanes.getElementTypeBitWidth() / 8)
    return {first, {}};
  SmallVector<int64_t> steps;
  for (int64_t lane = 0; lane < lanes.getNumElements(); ++lane)
    steps.push_back(lane * stride);
  Value each = arith::ConstantOp::create(
      builder, loc, DenseIntElementsAttr::get(words, steps));
  return {{}, add(pointers, first, each)};
}
