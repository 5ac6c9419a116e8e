// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Constants, buffers and images, as memory that the runtime holds.

#include "PikoToLLVM/GPU/GridLog.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

/// The number of an element of a buffer or image; null for a constant, which
/// has no indices.
static Value createElementNumber(OpBuilder &builder, Location loc,
                                 ValueRange indices, const StateView &view) {
  Value index;
  for (int64_t dim = indices.size() - 1; dim >= 0; --dim) {
    Value at = toI64(builder, loc, indices[dim]);
    index =
        index
            ? arith::AddIOp::create(builder, loc,
                                    arith::MulIOp::create(builder, loc, index,
                                                          view.getFactor(dim)),
                                    at)
            : at;
  }
  return index;
}

/// How many bytes it is after the first one.
static Value createElementOffset(OpBuilder &builder, Location loc,
                                 ValueRange indices, const StateView &view,
                                 int64_t size) {
  Value number = createElementNumber(builder, loc, indices, view);
  return number ? arith::MulIOp::create(builder, loc, number,
                                        createI64(builder, loc, size))
                : Value();
}

LLVM::AtomicBinOp piko::toAtomicBinOp(AtomicKind kind) {
  switch (kind) {
  case AtomicKind::Add:
    return LLVM::AtomicBinOp::add;
  case AtomicKind::MinS:
    return LLVM::AtomicBinOp::min;
  case AtomicKind::MaxS:
    return LLVM::AtomicBinOp::max;
  case AtomicKind::MinU:
    return LLVM::AtomicBinOp::umin;
  case AtomicKind::MaxU:
    return LLVM::AtomicBinOp::umax;
  case AtomicKind::And:
    return LLVM::AtomicBinOp::_and;
  case AtomicKind::Or:
    return LLVM::AtomicBinOp::_or;
  case AtomicKind::Xor:
    return LLVM::AtomicBinOp::_xor;
  case AtomicKind::AddF:
    return LLVM::AtomicBinOp::fadd;
  }
  llvm_unreachable("all kinds are handled");
}

namespace {

template <typename OpT> struct StateLowering : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  using ContextPattern<OpT>::context;

  RecordOp record(OpT op) const {
    return context.record(getStateRecord(context.state(op, op.getState())));
  }

  /// The address of the number that an access names, in the state or in a copy
  /// of it.
  Value address(OpBuilder &builder, OpT op, typename OpT::Adaptor adaptor,
                Value copy = {}) const {
    Location loc = op.getLoc();
    StateView &view = context.view(builder, op, op.getState());
    RecordOp record = this->record(op);
    Value element = copy ? copy : view.data;
    if (Value offset = createElementOffset(builder, loc, adaptor.getIndices(),
                                           view, record.getSize()))
      element = createOffset(builder, loc, element, offset);
    return createFieldAddress(builder, loc, element,
                              record.getField(op.getField()),
                              adaptor.getElements());
  }

  ArrayAttr tag(OpT op) const {
    bool isConstant = isa<ConstantOp>(context.state(op, op.getState()));
    return context.tags.state(op.getState(), op.getField(), isConstant);
  }
};

struct LoadLowering : StateLowering<LoadOp> {
  using StateLowering::StateLowering;
  LogicalResult
  matchAndRewrite(LoadOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(op, createLoad(rewriter, op.getLoc(),
                                      op.getResult().getType(),
                                      address(rewriter, op, adaptor), tag(op)));
    return success();
  }
};

struct StoreLowering : StateLowering<StoreOp> {
  using StateLowering::StateLowering;
  LogicalResult
  matchAndRewrite(StoreOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    createStore(rewriter, op.getLoc(), adaptor.getValue(),
                address(rewriter, op, adaptor), tag(op));
    rewriter.eraseOp(op);
    return success();
  }
};

struct AtomicLowering : StateLowering<AtomicOp> {
  using StateLowering::StateLowering;
  LogicalResult
  matchAndRewrite(AtomicOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    if (op.getCopy()) {
      createChoice(rewriter, op, adaptor);
      rewriter.eraseOp(op);
      return success();
    }
    auto old = createLocked(rewriter, op, adaptor);
    if (op.getOld())
      rewriter.replaceOp(op, old);
    else
      rewriter.eraseOp(op);
    return success();
  }

private:
  LLVM::AtomicRMWOp createLocked(OpBuilder &builder, AtomicOp op,
                                 OpAdaptor adaptor) const {
    // The value says nothing of what others have written: monotonic is enough,
    // and the end of the kernel orders it before those that follow.
    auto old = LLVM::AtomicRMWOp::create(
        builder, op.getLoc(), toAtomicBinOp(op.getKind()),
        address(builder, op, adaptor), adaptor.getValue(),
        LLVM::AtomicOrdering::monotonic);
    old.setTbaaAttr(tag(op));
    return old;
  }

  /// In the unit's private copy, if the runtime has given one.
  void createChoice(OpBuilder &builder, AtomicOp op, OpAdaptor adaptor) const {
    Location loc = op.getLoc();
    Value data = context.member(builder, adaptor.getCopy(),
                                PIKO_RUNTIME_MEMBER(pikoir_private, data));
    Value dirty = context.member(builder, adaptor.getCopy(),
                                 PIKO_RUNTIME_MEMBER(pikoir_private, dirty));
    Value null = LLVM::ZeroOp::create(builder, loc, data.getType());
    Value given =
        LLVM::ICmpOp::create(builder, loc, LLVM::ICmpPredicate::ne, data, null);
    scf::IfOp::create(
        builder, loc, given,
        [&](OpBuilder &then, Location loc) {
          createPrivate(then, op, adaptor, data, dirty);
          scf::YieldOp::create(then, loc);
        },
        [&](OpBuilder &otherwise, Location loc) {
          createLocked(otherwise, op, adaptor);
          scf::YieldOp::create(otherwise, loc);
        });
  }

  void createPrivate(OpBuilder &builder, AtomicOp op, OpAdaptor adaptor,
                     Value data, Value dirty) const {
    Location loc = op.getLoc();
    Value at = address(builder, op, adaptor, data);
    Value old = createLoad(builder, loc, op.getValue().getType(), at, tag(op));
    createStore(
        builder, loc,
        createChange(builder, loc, op.getKind(), old, adaptor.getValue()), at,
        tag(op));
    Value run = arith::ShRUIOp::create(
        builder, loc,
        createElementNumber(builder, loc, adaptor.getIndices(),
                            context.view(builder, op, op.getState())),
        createI64(builder, loc, getRunShift(record(op))));
    Value changed = arith::ConstantIntOp::create(builder, loc, 1, 8);
    createStore(builder, loc, changed, createOffset(builder, loc, dirty, run),
                context.tags.dirty());
  }
};

struct PrefetchLowering : ContextPattern<PrefetchOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(PrefetchOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    StateView &view = context.view(rewriter, op, op.getState());
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    Value offset = createElementOffset(rewriter, loc, adaptor.getIndices(),
                                       view, record.getSize());
    // Not inbounds: nothing has tested the indices.
    Value element = LLVM::GEPOp::create(rewriter, loc, view.data.getType(),
                                        rewriter.getI8Type(), view.data,
                                        ArrayRef<LLVM::GEPArg>{offset});
    // Records that divide a line are mostly in one.
    createPrefetch(rewriter, loc, element,
                   lineSize % record.getSize() == 0 ? 1 : record.getSize());
    rewriter.eraseOp(op);
    return success();
  }
};

struct ExtentLowering : ContextPattern<ExtentOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(ExtentOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    StateView &view = context.view(rewriter, op, op.getState());
    rewriter.replaceOp(
        op, toIndex(rewriter, op.getLoc(), view.extents[op.getDim()]));
    return success();
  }
};

/// Up to two coordinates from `begin` on, of 32 bits each, in one number.
static Value packCoordinates(OpBuilder &builder, Location loc,
                             ArrayRef<Value> coordinates, size_t begin) {
  Value packed = createI64(builder, loc, 0);
  for (size_t i = begin; i < std::min(begin + 2, coordinates.size()); ++i) {
    Value low = arith::AndIOp::create(builder, loc, coordinates[i],
                                      createI64(builder, loc, UINT32_MAX));
    Value place = arith::ShLIOp::create(
        builder, loc, low, createI64(builder, loc, 32 * (i - begin)));
    packed = arith::OrIOp::create(builder, loc, packed, place);
  }
  return packed;
}

/// A call of pikoir_fail or its like.
template <typename OpT> struct FailPattern : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  using ContextPattern<OpT>::context;

protected:
  /// Calls it in place of the operation, or adds it to the log of a grid.
  /// `name` is the text that it takes, or null; `code` and `numbers` are its
  /// last arguments.
  void replace(ConversionPatternRewriter &rewriter, OpT op,
               const RuntimeFunction &function, std::optional<StringRef> name,
               Value bin, std::optional<int32_t> code,
               ArrayRef<Value> numbers) const {
    Location loc = op.getLoc();
    int32_t stage = context.stageNumber(op, op.getStage());
    if (!createErrorEntry(rewriter, op, context, function.name, stage, name,
                          bin, code.value_or(0), numbers)) {
      SmallVector<Value> arguments{
          context.frame(op), createI32(rewriter, loc, stage),
          name ? context.text(rewriter, loc, *name)
               : LLVM::ZeroOp::create(
                     rewriter, loc,
                     LLVM::LLVMPointerType::get(rewriter.getContext())),
          bin ? toI64(rewriter, loc, bin) : createI64(rewriter, loc, -1)};
      if (code)
        arguments.push_back(createI32(rewriter, loc, *code));
      llvm::append_range(arguments, numbers);
      context.call(rewriter, loc, function, arguments);
    }
    rewriter.eraseOp(op);
  }
};

struct FailLowering : FailPattern<FailOp> {
  using FailPattern::FailPattern;
  LogicalResult
  matchAndRewrite(FailOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    SmallVector<Value> indices;
    for (Value index : adaptor.getIndices())
      indices.push_back(toI64(rewriter, loc, index));
    if (op.getOutsideBin())
      replace(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_fail), op.getOf(),
              adaptor.getBin(), PIKORT_UPDATE_OUTSIDE,
              {packCoordinates(rewriter, loc, indices, 0),
               packCoordinates(rewriter, loc, indices, 2)});
    else
      failIndex(rewriter, op, indices, adaptor.getBin());
    return success();
  }

private:
  /// Names the first index that is outside, and how many elements there are.
  void failIndex(ConversionPatternRewriter &rewriter, FailOp op,
                 ArrayRef<Value> indices, Value bin) const {
    Location loc = op.getLoc();
    StateView &view = context.view(rewriter, op, op.getState());
    Value index = indices.back(), count = view.extents[indices.size() - 1];
    for (int64_t dim = indices.size() - 2; dim >= 0; --dim) {
      Value outside =
          arith::CmpIOp::create(rewriter, loc, arith::CmpIPredicate::uge,
                                indices[dim], view.extents[dim]);
      index =
          arith::SelectOp::create(rewriter, loc, outside, indices[dim], index);
      count = arith::SelectOp::create(rewriter, loc, outside, view.extents[dim],
                                      count);
    }
    int32_t state =
        context.numbers(op).states.lookup(op.getStateAttr().getAttr());
    replace(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_fail_index), op.getOf(),
            bin, state, {index, count});
  }
};

struct FailListLowering : FailPattern<FailListOp> {
  using FailPattern::FailPattern;
  LogicalResult
  matchAndRewrite(FailListOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    replace(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_fail), std::nullopt,
            adaptor.getBin(), PIKORT_INDEX_OUTSIDE,
            {toI64(rewriter, loc, adaptor.getIndex()),
             toI64(rewriter, loc, adaptor.getSize())});
    return success();
  }
};

struct FailBarrierLowering : FailPattern<FailBarrierOp> {
  using FailPattern::FailPattern;
  LogicalResult
  matchAndRewrite(FailBarrierOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto barrier = op->getAttrOfType<StringAttr>(cppNameAttr);
    replace(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_fail_barrier),
            barrier ? barrier.getValue() : "sync", adaptor.getBin(),
            /*code=*/std::nullopt,
            {toI64(rewriter, op.getLoc(), adaptor.getIteration())});
    return success();
  }
};

struct FailDivideLowering : FailPattern<FailDivideOp> {
  using FailPattern::FailPattern;
  LogicalResult
  matchAndRewrite(FailDivideOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value zero = createI64(rewriter, loc, 0);
    replace(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_fail), op.getOf(),
            adaptor.getBin(), PIKORT_NO_QUOTIENT, {zero, zero});
    return success();
  }
};

} // namespace

void piko::populateStateToLLVMPatterns(const TypeConverter &converter,
                                       RewritePatternSet &patterns,
                                       LoweringContext &context) {
  patterns.add<LoadLowering, StoreLowering, AtomicLowering, ExtentLowering,
               PrefetchLowering, FailLowering, FailListLowering,
               FailBarrierLowering, FailDivideLowering>(
      converter, patterns.getContext(), context);
}
