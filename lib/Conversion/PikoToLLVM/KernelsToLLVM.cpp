// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins and primitives, on the runtime's structs (pikort/abi.h).

#include "PikoToLLVM/KernelLowering.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

// More members of pikoir_input, and those of pikoir_unit and pikoir_call.
namespace layout {
constexpr RuntimeMember count = PIKO_RUNTIME_MEMBER(pikoir_input, count),
                        offsets = PIKO_RUNTIME_MEMBER(pikoir_input, offsets),
                        units = PIKO_RUNTIME_MEMBER(pikoir_input, units),
                        unitCount =
                            PIKO_RUNTIME_MEMBER(pikoir_input, unit_count),
                        tiles = PIKO_RUNTIME_MEMBER(pikoir_input, tiles),
                        calls = PIKO_RUNTIME_MEMBER(pikoir_input, calls),
                        clears = PIKO_RUNTIME_MEMBER(pikoir_input, clears),
                        cursors = PIKO_RUNTIME_MEMBER(pikoir_input, cursors);
constexpr RuntimeMember taken = PIKO_RUNTIME_MEMBER(pikoir_cursor, next),
                        lastTaken = PIKO_RUNTIME_MEMBER(pikoir_cursor, end);
constexpr RuntimeMember bucketBegin =
                            PIKO_RUNTIME_MEMBER(pikoir_unit, bucket_begin),
                        bucketEnd =
                            PIKO_RUNTIME_MEMBER(pikoir_unit, bucket_end),
                        begin = PIKO_RUNTIME_MEMBER(pikoir_unit, begin),
                        end = PIKO_RUNTIME_MEMBER(pikoir_unit, end),
                        owner = PIKO_RUNTIME_MEMBER(pikoir_unit, owner);
constexpr RuntimeMember callBin = PIKO_RUNTIME_MEMBER(pikoir_call, bin),
                        callBegin = PIKO_RUNTIME_MEMBER(pikoir_call, begin),
                        callEnd = PIKO_RUNTIME_MEMBER(pikoir_call, end);
constexpr RuntimeMember offset = {0, ABIType::I64}; // an entry of offsets
} // namespace layout

namespace {

struct OpenBinsLowering : Lowering<OpenBinsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(OpenBinsOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    bool source = op.getSource().has_value();
    int32_t number =
        source ? *op.getSource() : context.stageNumber(op, op.getStage());
    Value input =
        context
            .call(rewriter, loc,
                  source ? PIKO_RUNTIME_FUNCTION(pikoir_begin_source)
                         : PIKO_RUNTIME_FUNCTION(pikoir_begin),
                  {context.frame(op), createI32(rewriter, loc, number)})
            .getResult();
    // After an error there is nothing to do; pikoir_end gives its status.
    Value null = LLVM::ZeroOp::create(rewriter, loc, pointer(rewriter));
    Value failed = LLVM::ICmpOp::create(rewriter, loc, LLVM::ICmpPredicate::eq,
                                        input, null);
    Value empty = LLVM::AddressOfOp::create(rewriter, loc, pointer(rewriter),
                                            "piko.no_input");
    rewriter.replaceOpWithNewOp<LLVM::SelectOp>(op, failed, empty, input);
    return success();
  }
};

struct CloseBinsLowering : Lowering<CloseBinsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(CloseBinsOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto function = op->getParentOfType<func::FuncOp>();
    auto number = function->getAttrOfType<IntegerAttr>(marks::number);
    bool source = function->hasAttr(marks::source);
    Location loc = op.getLoc();
    Value status = context
                       .call(rewriter, loc,
                             source ? PIKO_RUNTIME_FUNCTION(pikoir_end_source)
                                    : PIKO_RUNTIME_FUNCTION(pikoir_end),
                             {context.frame(op),
                              createI32(rewriter, loc, number.getInt())})
                       .getResult();
    Operation *end = function.getBody().front().getTerminator();
    rewriter.modifyOpInPlace(end, [&] { end->setOperand(0, status); });
    rewriter.eraseOp(op);
    return success();
  }
};

struct UnitCountLowering : Lowering<UnitCountOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(UnitCountOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    rewriter.replaceOp(op, toIndex(rewriter, loc,
                                   context.member(rewriter, adaptor.getBins(),
                                                  layout::unitCount)));
    return success();
  }
};

struct ClearsLowering : Lowering<ClearsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ClearsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value clears = context.member(rewriter, adaptor.getBins(), layout::clears);
    rewriter.replaceOpWithNewOp<arith::CmpIOp>(
        op, arith::CmpIPredicate::ne, clears, createI64(rewriter, loc, 0));
    return success();
  }
};

struct UnitBucketsLowering : Lowering<UnitBucketsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(UnitBucketsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value units = context.member(rewriter, adaptor.getBins(), layout::units);
    Value unit =
        entry(rewriter, loc, units, adaptor.getUnit(), sizeof(pikoir_unit));
    Value first = load(rewriter, loc, unit, layout::bucketBegin);
    Value last = load(rewriter, loc, unit, layout::bucketEnd);
    rewriter.replaceOp(
        op, {toIndex(rewriter, loc, first), toIndex(rewriter, loc, last)});
    return success();
  }
};

struct ThreadLowering : Lowering<ThreadOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ThreadOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value number =
        context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_thread), {})
            .getResult();
    rewriter.replaceOp(op, toIndex(rewriter, loc, number));
    return success();
  }
};

struct TakeUnitLowering : Lowering<TakeUnitOp> {
  using Lowering::Lowering;

  /// A unit, if it is there and has its home with the thread; else -1.
  Value leaveOthers(OpBuilder &builder, Location loc, OpAdaptor adaptor,
                    Value cursor, Value unit) const {
    Value none = createI64(builder, loc, -1), zero = createI64(builder, loc, 0);
    Value end = load(builder, loc, cursor, layout::lastTaken);
    Value isThere = arith::CmpIOp::create(builder, loc,
                                          arith::CmpIPredicate::slt, unit, end);
    // There is a first one.
    Value at = arith::SelectOp::create(builder, loc, isThere, unit, zero);
    Value units = context.member(builder, adaptor.getBins(), layout::units);
    Value owner = load(builder, loc,
                       entry(builder, loc, units, toIndex(builder, loc, at),
                             sizeof(pikoir_unit)),
                       layout::owner);
    Value thread = arith::IndexCastOp::create(
        builder, loc, builder.getI64Type(), adaptor.getThread());
    Value isOwn = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                        owner, thread);
    Value isBoth = arith::AndIOp::create(builder, loc, isThere, isOwn);
    return arith::SelectOp::create(builder, loc, isBoth, unit, none);
  }
  LogicalResult
  matchAndRewrite(TakeUnitOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value cursor = context.member(rewriter, adaptor.getBins(), layout::cursors);
    if (Value thread = adaptor.getThread())
      cursor = createOffset(
          rewriter, loc,
          entry(rewriter, loc, cursor, thread, sizeof(pikoir_cursor)),
          PIKOIR_CURSOR_HOMES * sizeof(pikoir_cursor));
    Value unit = LLVM::AtomicRMWOp::create(
        rewriter, loc, LLVM::AtomicBinOp::add,
        createOffset(rewriter, loc, cursor, layout::taken.offset),
        createI64(rewriter, loc, 1), LLVM::AtomicOrdering::monotonic);
    if (op.getThread())
      unit = leaveOthers(rewriter, loc, adaptor, cursor, unit);
    rewriter.replaceOp(op, toIndex(rewriter, loc, unit));
    return success();
  }
};

struct NextUnitLowering : Lowering<NextUnitOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(NextUnitOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value next =
        context
            .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_next_unit),
                  {adaptor.getBins()})
            .getResult();
    rewriter.replaceOp(op, toIndex(rewriter, loc, next));
    return success();
  }
};

struct BucketRangeLowering : Lowering<BucketRangeOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(BucketRangeOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value bins = adaptor.getBins();
    Value units = context.member(rewriter, bins, layout::units);
    Value unit =
        entry(rewriter, loc, units, adaptor.getUnit(), sizeof(pikoir_unit));
    Value offsets = context.member(rewriter, bins, layout::offsets);
    Value bucket =
        entry(rewriter, loc, offsets, adaptor.getBucket(), sizeof(int64_t));
    Value begin = arith::MaxSIOp::create(
        rewriter, loc, load(rewriter, loc, bucket, layout::offset),
        load(rewriter, loc, unit, layout::begin));
    Value end = arith::MinSIOp::create(
        rewriter, loc,
        load(rewriter, loc, bucket, layout::offset, sizeof(int64_t)),
        load(rewriter, loc, unit, layout::end));
    rewriter.replaceOp(
        op, {toIndex(rewriter, loc, begin), toIndex(rewriter, loc, end)});
    return success();
  }
};

struct BucketBinLowering : Lowering<BucketBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(BucketBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value tiles =
        toIndex(rewriter, loc,
                context.member(rewriter, adaptor.getBins(), layout::tiles));
    rewriter.replaceOpWithNewOp<arith::DivUIOp>(op, adaptor.getBucket(), tiles);
    return success();
  }
};

/// The address of a pikoir_call.
static Value callEntry(ConversionPatternRewriter &rewriter, Location loc,
                       LoweringContext &context, Value bins, Value call) {
  Value calls = context.member(rewriter, bins, layout::calls);
  Value bytes =
      arith::MulIOp::create(rewriter, loc, toI64(rewriter, loc, call),
                            createI64(rewriter, loc, sizeof(pikoir_call)));
  return createOffset(rewriter, loc, calls, bytes);
}

struct CallRangeLowering : Lowering<CallRangeOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(CallRangeOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value call =
        callEntry(rewriter, loc, context, adaptor.getBins(), adaptor.getCall());
    Value begin = load(rewriter, loc, call, layout::callBegin);
    Value end = load(rewriter, loc, call, layout::callEnd);
    rewriter.replaceOp(
        op, {toIndex(rewriter, loc, begin), toIndex(rewriter, loc, end)});
    return success();
  }
};

struct CallBinLowering : Lowering<CallBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(CallBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value call =
        callEntry(rewriter, loc, context, adaptor.getBins(), adaptor.getCall());
    Value bin = load(rewriter, loc, call, layout::callBin);
    rewriter.replaceOp(op, toIndex(rewriter, loc, bin));
    return success();
  }
};

/// The number of the record at a position.
static Value readOrder(OpBuilder &builder, Location loc,
                       LoweringContext &context, Value order, Value position) {
  Value bytes = arith::MulIOp::create(
      builder, loc, position, createI64(builder, loc, sizeof(uint32_t)));
  Value number = createLoad(builder, loc, builder.getI32Type(),
                            createOffset(builder, loc, order, bytes),
                            context.tags.input());
  return arith::ExtUIOp::create(builder, loc, builder.getI64Type(), number);
}

struct ItemLowering : Lowering<ItemOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ItemOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value bins = adaptor.getBins();
    Value position = toI64(rewriter, loc, adaptor.getPosition());
    Value order = context.member(rewriter, bins, layout::order);
    auto choice = scf::IfOp::create(
        rewriter, loc, isOrdered(rewriter, loc, order),
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(
              builder, loc, readOrder(builder, loc, context, order, position));
        },
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(builder, loc, position);
        });
    Value items = context.member(rewriter, bins, layout::items);
    RecordOp record = context.record(op.getBins().getType().getRecord());
    rewriter.replaceOp(
        op, entry(rewriter, loc, items, choice.getResult(0), record.getSize()));
    return success();
  }
};

struct PrefetchItemLowering : Lowering<PrefetchItemOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(PrefetchItemOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value bins = adaptor.getBins();
    Value order = context.member(rewriter, bins, layout::order);
    // What lies in order the processor foresees.
    auto choice =
        scf::IfOp::create(rewriter, loc, isOrdered(rewriter, loc, order),
                          /*withElseRegion=*/false);
    rewriter.setInsertionPoint(choice.thenBlock()->getTerminator());
    Value last = arith::SubIOp::create(
        rewriter, loc, context.member(rewriter, bins, layout::count),
        createI64(rewriter, loc, 1));
    Value position = arith::MinSIOp::create(
        rewriter, loc, toI64(rewriter, loc, adaptor.getPosition()), last);
    int64_t size = context.record(op.getBins().getType().getRecord()).getSize();
    Value item = readOrder(rewriter, loc, context, order, position);
    Value items = context.member(rewriter, bins, layout::items);
    createPrefetch(rewriter, loc, entry(rewriter, loc, items, item, size),
                   size);
    rewriter.eraseOp(op);
    return success();
  }
};

struct NoItemLowering : Lowering<NoItemOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(NoItemOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOpWithNewOp<LLVM::AddressOfOp>(
        op, pointer(rewriter),
        context.zeros(
            context.record(op.getPrim().getType().getRecord()).getSize()));
    return success();
  }
};

struct ToAddressLowering : Lowering<ToAddressOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ToAddressOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value address = LLVM::PtrToIntOp::create(
        rewriter, loc, rewriter.getI64Type(), adaptor.getPrim());
    rewriter.replaceOp(op, toIndex(rewriter, loc, address));
    return success();
  }
};

struct FromAddressLowering : Lowering<FromAddressOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(FromAddressOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOpWithNewOp<LLVM::IntToPtrOp>(
        op, pointer(rewriter),
        toI64(rewriter, op.getLoc(), adaptor.getAddress()));
    return success();
  }
};

struct BeginScheduleLowering : Lowering<BeginScheduleOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(BeginScheduleOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    int32_t number = context.stageNumber(op, op.getStage());
    Value bins =
        context
            .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_begin_schedule),
                  {context.frame(op), createI32(rewriter, loc, number)})
            .getResult();
    // The kernel's status is that of what it says about the bins.
    auto function = op->getParentOfType<func::FuncOp>();
    Operation *end = function.getBody().front().getTerminator();
    {
      OpBuilder::InsertionGuard guard(rewriter);
      rewriter.setInsertionPoint(end);
      Value status =
          context
              .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_status),
                    context.frame(op))
              .getResult();
      rewriter.modifyOpInPlace(end, [&] { end->setOperand(0, status); });
    }
    rewriter.replaceOp(op, toIndex(rewriter, loc, bins));
    return success();
  }
};

// piko.schedule_bin says so, too.
static_assert(PIKOIR_NO_BATCH == std::numeric_limits<int64_t>::min());

struct ScheduleBinLowering : Lowering<ScheduleBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ScheduleBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    int32_t number = context.stageNumber(op, op.getStage());
    Value everyBin = arith::ExtUIOp::create(
        rewriter, loc, rewriter.getI32Type(), adaptor.getEveryBin());
    context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_schedule_bin),
                 {context.frame(op), createI32(rewriter, loc, number),
                  toI64(rewriter, loc, adaptor.getBin()), adaptor.getKind(),
                  adaptor.getTileSplit(), adaptor.getBatch(), everyBin});
    rewriter.eraseOp(op);
    return success();
  }
};

struct GetLowering : Lowering<GetOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(GetOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    RecordOp record = context.record(op.getPrim().getType().getRecord());
    Value address = createFieldAddress(rewriter, loc, adaptor.getPrim(),
                                       record.getField(op.getField()),
                                       adaptor.getElements());
    rewriter.replaceOp(
        op,
        createLoad(rewriter, loc, op.getResult().getType(), address,
                   context.tags.primitive(record.getSymName(), op.getField())));
    return success();
  }
};

struct GridLowering : Lowering<GridOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(GridOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Value extent =
        context.query(rewriter, op,
                      op.getTiles() ? PIKO_RUNTIME_FUNCTION(pikoir_tile_grid)
                                    : PIKO_RUNTIME_FUNCTION(pikoir_grid),
                      context.stageNumber(op, op.getStage()), op.getDim());
    rewriter.replaceOp(op, toIndex(rewriter, op.getLoc(), extent));
    return success();
  }
};

struct DomainLowering : Lowering<DomainOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(DomainOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Value extent =
        context.query(rewriter, op, PIKO_RUNTIME_FUNCTION(pikoir_domain),
                      std::nullopt, op.getDim());
    rewriter.replaceOp(op, toIndex(rewriter, op.getLoc(), extent));
    return success();
  }
};

struct ThreadsLowering : Lowering<ThreadsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ThreadsOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(op, context.call(rewriter, op.getLoc(),
                                        PIKO_RUNTIME_FUNCTION(pikoir_threads),
                                        context.frame(op)));
    return success();
  }
};

} // namespace

void piko::populateKernelToLLVMPatterns(const TypeConverter &converter,
                                        RewritePatternSet &patterns,
                                        LoweringContext &context) {
  patterns.add<OpenBinsLowering, CloseBinsLowering, UnitCountLowering,
               ClearsLowering, UnitBucketsLowering, BucketRangeLowering,
               BucketBinLowering, CallRangeLowering, CallBinLowering,
               ItemLowering, PrefetchItemLowering, NoItemLowering,
               ToAddressLowering, FromAddressLowering,

               BeginScheduleLowering, ScheduleBinLowering, GetLowering,
               GridLowering, DomainLowering, ThreadsLowering, ThreadLowering,
               TakeUnitLowering, NextUnitLowering>(
      converter, patterns.getContext(), context);
}
