// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What checking mode tells the runtime, as calls.

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Dialect/Piko/IR/PikoCheck.h"

using namespace mlir;
using namespace piko;

namespace {

template <typename OpT> struct CheckLowering : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  using ContextPattern<OpT>::context;

  /// Calls a function of the runtime with its pipeline and the arguments.
  LLVM::CallOp call(OpBuilder &builder, OpT op, const RuntimeFunction &function,
                    ArrayRef<Value> arguments) const {
    SmallVector<Value> all{context.frame(op)};
    llvm::append_range(all, arguments);
    return context.call(builder, op.getLoc(), function, all);
  }
  Value i32(OpBuilder &builder, OpT op, int64_t v) const {
    return createI32(builder, op.getLoc(), v);
  }
  Value i64(OpBuilder &builder, OpT op, Value v, int64_t otherwise) const {
    return v ? toI64(builder, op.getLoc(), v)
             : createI64(builder, op.getLoc(), otherwise);
  }
  Value place(OpBuilder &builder, OpT op) const {
    return context.place(builder, op);
  }
};

} // namespace

// What is checked is the runtime's by number.
static_assert(int(CheckedAccess::Read) == PIKOIR_CHECK_READ &&
              int(CheckedAccess::Store) == PIKOIR_CHECK_STORE &&
              int(CheckedAccess::Update) == PIKOIR_CHECK_UPDATE &&
              int(CheckedAccess::Atomic) == PIKOIR_CHECK_ATOMIC);
static_assert(int(CheckedLoop::Begin) == PIKOIR_CHECK_BEGIN &&
              int(CheckedLoop::Iteration) == PIKOIR_CHECK_ITERATION &&
              int(CheckedLoop::Barrier) == PIKOIR_CHECK_BARRIER &&
              int(CheckedLoop::End) == PIKOIR_CHECK_END);
static_assert(int(CheckedValue::NaN) == PIKOIR_CHECK_NAN &&
              int(CheckedValue::Unwritten) == PIKOIR_CHECK_UNWRITTEN);

namespace {

struct CheckCallLowering : CheckLowering<CheckCallOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckCallOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_call),
         {i32(rewriter, op, context.stageNumber(op, op.getStage())),
          i64(rewriter, op, adaptor.getBin(), 0),
          i64(rewriter, op, adaptor.getLineage(), PIKOIR_NO_LINEAGE)});
    rewriter.eraseOp(op);
    return success();
  }
};

struct CheckAssignLowering : CheckLowering<CheckAssignOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckAssignOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_assign),
         {i32(rewriter, op, context.stageNumber(op, op.getStage())),
          i64(rewriter, op, adaptor.getLineage(), PIKOIR_NO_LINEAGE)});
    rewriter.eraseOp(op);
    return success();
  }
};

struct CheckEmitLowering : CheckLowering<CheckEmitOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckEmitOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(
        op, call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_emit), {}));
    return success();
  }
};

struct CheckPlaceLowering : CheckLowering<CheckPlaceOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckPlaceOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_place),
         {place(rewriter, op)});
    rewriter.eraseOp(op);
    return success();
  }
};

struct CheckAccessLowering : CheckLowering<CheckAccessOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckAccessOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    int32_t state =
        context.numbers(op).states.lookup(op.getStateAttr().getAttr());
    int64_t kind =
        int64_t(op.getKind()) | (op.getUpdates() ? PIKOIR_CHECK_UPDATES : 0);
    SmallVector<Value> arguments{i32(rewriter, op, state),
                                 i32(rewriter, op, kind)};
    ValueRange indices = adaptor.getIndices();
    for (size_t dim = 0; dim < 4; ++dim)
      arguments.push_back(
          i64(rewriter, op, dim < indices.size() ? indices[dim] : Value(), 0));
    arguments.push_back(place(rewriter, op));
    call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_access), arguments);
    rewriter.eraseOp(op);
    return success();
  }
};

struct CheckLoopLowering : CheckLowering<CheckLoopOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckLoopOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_loop),
         {i32(rewriter, op, int64_t(op.getEvent())),
          i64(rewriter, op, adaptor.getIteration(), 0)});
    rewriter.eraseOp(op);
    return success();
  }
};

struct CheckValueLowering : CheckLowering<CheckValueOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckValueOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    int32_t record =
        context.numbers(op).records.lookup(op.getRecordAttr().getAttr());
    Value flag = arith::ExtUIOp::create(
        rewriter, op.getLoc(), rewriter.getI32Type(), adaptor.getFlag());
    call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_value),
         {flag, i32(rewriter, op, int64_t(op.getKind())),
          i32(rewriter, op, record),
          context.text(rewriter, op.getLoc(), op.getField()),
          place(rewriter, op)});
    rewriter.eraseOp(op);
    return success();
  }
};

struct CheckIndexLowering : CheckLowering<CheckIndexOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckIndexOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Value inside = call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_index),
                        {toI64(rewriter, op.getLoc(), adaptor.getIndex()),
                         createI64(rewriter, op.getLoc(), op.getSize()),
                         place(rewriter, op)})
                       .getResult();
    rewriter.replaceOp(op, toIndex(rewriter, op.getLoc(), inside));
    return success();
  }
};

struct CheckTripLowering : CheckLowering<CheckTripOp> {
  using CheckLowering::CheckLowering;
  LogicalResult
  matchAndRewrite(CheckTripOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Value may = call(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_check_trip),
                     {place(rewriter, op)})
                    .getResult();
    rewriter.replaceOpWithNewOp<arith::TruncIOp>(op, rewriter.getI1Type(), may);
    return success();
  }
};

} // namespace

void piko::populateChecksToLLVMPatterns(const TypeConverter &converter,
                                        RewritePatternSet &patterns,
                                        LoweringContext &context) {
  patterns.add<CheckCallLowering, CheckAssignLowering, CheckEmitLowering,
               CheckPlaceLowering, CheckAccessLowering, CheckLoopLowering,
               CheckValueLowering, CheckIndexLowering, CheckTripLowering>(
      converter, patterns.getContext(), context);
}
