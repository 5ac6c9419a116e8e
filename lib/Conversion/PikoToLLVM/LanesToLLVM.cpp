// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Access to state by the lanes of a vector.

#include "LoweringContext.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

namespace {

/// Where lanes read or write: one address, from which on they lie one behind
/// the other, or one for each.
struct LaneAddresses {
  Value first, each;
};

template <typename OpT> struct LaneLowering : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  using ContextPattern<OpT>::context;

protected:
  LaneAddresses address(OpBuilder &builder, OpT op,
                        typename OpT::Adaptor adaptor, VectorType lanes) const {
    Location loc = op.getLoc();
    StateView &view = context.view(builder, op, op.getState());
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    FieldAttr field = record.getField(op.getField());
    auto isVector = [](Value index) {
      return isa<VectorType>(index.getType());
    };
    bool isEach = llvm::any_of(adaptor.getIndices(), isVector);
    auto words = VectorType::get(lanes.getShape(), builder.getI64Type());
    auto widen = [&](Value number) {
      return vector::BroadcastOp::create(builder, loc, words, number)
          .getResult();
    };
    // What is the same for all lanes stays scalar.
    Value offset;
    auto combine = [&](auto tag, Value a, Value b) -> Value {
      using Op = decltype(tag);
      if (isVector(a) != isVector(b))
        (isVector(a) ? b : a) = widen(isVector(a) ? b : a);
      return Op::create(builder, loc, a, b);
    };
    for (int64_t dim = adaptor.getIndices().size() - 1; dim >= 0; --dim) {
      Value index = adaptor.getIndices()[dim];
      index = arith::IndexCastOp::create(
          builder, loc,
          isVector(index) ? Type(words) : Type(builder.getI64Type()), index);
      offset =
          offset ? combine(arith::AddIOp(),
                           combine(arith::MulIOp(), offset, view.extents[dim]),
                           index)
                 : index;
    }
    if (offset)
      offset = combine(arith::MulIOp(), offset,
                       createI64(builder, loc, record.getSize()));
    Value base = createFieldAddress(builder, loc, view.data, field,
                                    adaptor.getElements());
    Type pointers =
        LLVM::getVectorType(view.data.getType(), lanes.getNumElements());
    auto addressEach = [&](Value from, Value offsets) {
      return LaneAddresses{
          {},
          LLVM::GEPOp::create(builder, loc, pointers, builder.getI8Type(), from,
                              ArrayRef<LLVM::GEPArg>{offsets})};
    };
    if (isEach)
      return addressEach(base, offset);
    Value first = offset ? LLVM::GEPOp::create(builder, loc, base.getType(),
                                               builder.getI8Type(), base,
                                               ArrayRef<LLVM::GEPArg>{offset})
                               .getResult()
                         : base;
    int64_t stride = op.getConsecutive() ? record.getSize() : 0;
    if (stride == lanes.getElementTypeBitWidth() / 8)
      return {first, {}};
    SmallVector<int64_t> steps;
    for (int64_t lane = 0; lane < lanes.getNumElements(); ++lane)
      steps.push_back(lane * stride);
    return addressEach(
        first, arith::ConstantOp::create(
                   builder, loc, DenseIntElementsAttr::get(words, steps)));
  }
};

struct GatherLowering : LaneLowering<GatherOp> {
  using LaneLowering::LaneLowering;
  LogicalResult
  matchAndRewrite(GatherOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    auto type = cast<VectorType>(op.getResult().getType());
    LaneAddresses from = address(rewriter, op, adaptor, type);
    uint32_t alignment = type.getElementTypeBitWidth() / 8;
    Value none =
        arith::ConstantOp::create(rewriter, loc, rewriter.getZeroAttr(type));
    if (from.first)
      rewriter.replaceOp(
          op, LLVM::MaskedLoadOp::create(rewriter, loc, type, from.first,
                                         adaptor.getMask(), none, alignment));
    else
      rewriter.replaceOp(
          op, LLVM::masked_gather::create(rewriter, loc, type, from.each,
                                          adaptor.getMask(), none, alignment));
    return success();
  }
};

struct ScatterLowering : LaneLowering<ScatterOp> {
  using LaneLowering::LaneLowering;
  LogicalResult
  matchAndRewrite(ScatterOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    auto type = cast<VectorType>(op.getValue().getType());
    LaneAddresses to = address(rewriter, op, adaptor, type);
    uint32_t alignment = type.getElementTypeBitWidth() / 8;
    if (to.first)
      LLVM::MaskedStoreOp::create(rewriter, loc, adaptor.getValue(), to.first,
                                  adaptor.getMask(), alignment);
    else
      LLVM::masked_scatter::create(rewriter, loc, adaptor.getValue(), to.each,
                                   adaptor.getMask(), alignment);
    rewriter.eraseOp(op);
    return success();
  }
};

} // namespace

void piko::populateLanesToLLVMPatterns(const TypeConverter &converter,
                                       RewritePatternSet &patterns,
                                       LoweringContext &context) {
  patterns.add<GatherLowering, ScatterLowering>(converter,
                                                patterns.getContext(), context);
}
