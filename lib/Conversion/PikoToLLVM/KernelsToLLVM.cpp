// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins, writers and primitives, on the runtime's structs (pikort/abi.h).

#include "LoweringContext.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "WriterPaths.h"

#include "mlir/Conversion/LLVMCommon/MemRefBuilder.h"
#include "mlir/Conversion/LLVMCommon/TypeConverter.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

// Byte offsets of the members of pikoir_input, pikoir_unit and pikoir_call.
namespace layout {
constexpr int64_t items = 0, order = 16, offsets = 24, units = 32,
                  unitCount = 40, tiles = 48, calls = 56;
constexpr int64_t cellBegin = 0, cellEnd = 8, begin = 16, end = 24,
                  unitSize = 32;
constexpr int64_t callBin = 0, callBegin = 8, callEnd = 16, callSize = 24;
} // namespace layout

namespace {

template <typename OpT> struct Lowering : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  using ContextPattern<OpT>::context;

  static Type pointer(OpBuilder &builder) {
    return LLVM::LLVMPointerType::get(builder.getContext());
  }
  Value loadI64(OpBuilder &builder, Location loc, Value base,
                int64_t offset) const {
    return createLoad(builder, loc, builder.getI64Type(),
                      createOffset(builder, loc, base, offset),
                      context.tags.input());
  }
  /// A member of the pikoir_input.
  Value number(OpBuilder &builder, Value bins, int64_t offset) const {
    return context.member(builder, bins, offset, builder.getI64Type());
  }
  Value array(OpBuilder &builder, Value bins, int64_t offset) const {
    return context.member(builder, bins, offset, pointer(builder));
  }
  /// The address of entry `index` of an array.
  static Value entry(OpBuilder &builder, Location loc, Value array, Value index,
                     int64_t size) {
    Value bytes =
        arith::MulIOp::create(builder, loc, toI64(builder, loc, index),
                              createI64(builder, loc, size));
    return createOffset(builder, loc, array, bytes);
  }
};

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
                  source ? "pikoir_begin_source" : "pikoir_begin",
                  pointer(rewriter),
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
    auto number = function->getAttrOfType<IntegerAttr>(numberAttrName);
    bool source = function->hasAttr(sourceAttrName);
    Location loc = op.getLoc();
    Value status =
        context
            .call(
                rewriter, loc, source ? "pikoir_end_source" : "pikoir_end",
                rewriter.getI32Type(),
                {context.frame(op), createI32(rewriter, loc, number.getInt())})
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
    rewriter.replaceOp(
        op, toIndex(rewriter, loc,
                    number(rewriter, adaptor.getBins(), layout::unitCount)));
    return success();
  }
};

struct UnitCellsLowering : Lowering<UnitCellsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(UnitCellsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value units = array(rewriter, adaptor.getBins(), layout::units);
    Value unit =
        entry(rewriter, loc, units, adaptor.getUnit(), layout::unitSize);
    Value first = loadI64(rewriter, loc, unit, layout::cellBegin);
    Value last = loadI64(rewriter, loc, unit, layout::cellEnd);
    rewriter.replaceOp(
        op, {toIndex(rewriter, loc, first), toIndex(rewriter, loc, last)});
    return success();
  }
};

struct CellRangeLowering : Lowering<CellRangeOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(CellRangeOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value bins = adaptor.getBins();
    Value units = array(rewriter, bins, layout::units);
    Value unit =
        entry(rewriter, loc, units, adaptor.getUnit(), layout::unitSize);
    Value offsets = array(rewriter, bins, layout::offsets);
    Value cell = entry(rewriter, loc, offsets, adaptor.getCell(), 8);
    Value begin =
        arith::MaxSIOp::create(rewriter, loc, loadI64(rewriter, loc, cell, 0),
                               loadI64(rewriter, loc, unit, layout::begin));
    Value end =
        arith::MinSIOp::create(rewriter, loc, loadI64(rewriter, loc, cell, 8),
                               loadI64(rewriter, loc, unit, layout::end));
    rewriter.replaceOp(
        op, {toIndex(rewriter, loc, begin), toIndex(rewriter, loc, end)});
    return success();
  }
};

struct CellBinLowering : Lowering<CellBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(CellBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value tiles = toIndex(rewriter, loc,
                          number(rewriter, adaptor.getBins(), layout::tiles));
    rewriter.replaceOpWithNewOp<arith::DivUIOp>(op, adaptor.getCell(), tiles);
    return success();
  }
};

/// The address of a pikoir_call.
static Value callEntry(ConversionPatternRewriter &rewriter, Location loc,
                       LoweringContext &context, Value bins, Value call) {
  Value calls = context.member(rewriter, bins, layout::calls, bins.getType());
  Value bytes =
      arith::MulIOp::create(rewriter, loc, toI64(rewriter, loc, call),
                            createI64(rewriter, loc, layout::callSize));
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
    Value begin = loadI64(rewriter, loc, call, layout::callBegin);
    Value end = loadI64(rewriter, loc, call, layout::callEnd);
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
    Value bin = loadI64(rewriter, loc, call, layout::callBin);
    rewriter.replaceOp(op, toIndex(rewriter, loc, bin));
    return success();
  }
};

/// What takes the address of a primitive.
template <typename OpT> struct PositionLowering : Lowering<OpT> {
  using Lowering<OpT>::Lowering, Lowering<OpT>::array, Lowering<OpT>::pointer,
      Lowering<OpT>::entry;

  Value address(OpT op, typename OpT::Adaptor adaptor,
                ConversionPatternRewriter &rewriter) const {
    Location loc = op.getLoc();
    Value bins = adaptor.getBins();
    Value position = toI64(rewriter, loc, adaptor.getPosition());
    Value order = array(rewriter, bins, layout::order);
    Value null = LLVM::ZeroOp::create(rewriter, loc, pointer(rewriter));
    Value ordered = LLVM::ICmpOp::create(rewriter, loc, LLVM::ICmpPredicate::ne,
                                         order, null);
    auto choice = scf::IfOp::create(
        rewriter, loc, ordered,
        [&](OpBuilder &builder, Location loc) {
          Value item = createLoad(builder, loc, builder.getI32Type(),
                                  entry(builder, loc, order, position, 4),
                                  this->context.tags.input());
          Value wide =
              arith::ExtUIOp::create(builder, loc, builder.getI64Type(), item);
          scf::YieldOp::create(builder, loc, wide);
        },
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(builder, loc, position);
        });
    Value items = array(rewriter, bins, layout::items);
    RecordOp record = this->context.record(op.getBins().getType().getRecord());
    return entry(rewriter, loc, items, choice.getResult(0), record.getSize());
  }
};

struct ItemLowering : PositionLowering<ItemOp> {
  using PositionLowering::PositionLowering;
  LogicalResult
  matchAndRewrite(ItemOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(op, address(op, adaptor, rewriter));
    return success();
  }
};

struct PrefetchItemLowering : PositionLowering<PrefetchItemOp> {
  using PositionLowering::PositionLowering;
  LogicalResult
  matchAndRewrite(PrefetchItemOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    createPrefetch(
        rewriter, op.getLoc(), address(op, adaptor, rewriter),
        context.record(op.getBins().getType().getRecord()).getSize());
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

struct OpenWriterLowering : Lowering<OpenWriterOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(OpenWriterOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto function = op->getParentOfType<func::FuncOp>();
    auto number = function->getAttrOfType<IntegerAttr>(numberAttrName);
    int64_t subject = op.getStage() ? context.stageNumber(op, *op.getStage())
                                    : number.getInt();
    Location loc = op.getLoc();
    rewriter.replaceOp(
        op,
        context.call(rewriter, loc,
                     function->hasAttr(sourceAttrName) ? "pikoir_open_source"
                                                       : "pikoir_open",
                     pointer(rewriter),
                     {context.frame(op), createI32(rewriter, loc, subject),
                      toI64(rewriter, loc, adaptor.getUnit())}));
    return success();
  }
};

struct LocalBinLowering : Lowering<LocalBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(LocalBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value port = createI32(rewriter, loc, op.getPort());
    Value bins = context
                     .call(rewriter, loc, "pikoir_begin_local",
                           pointer(rewriter), {adaptor.getSource(), port})
                     .getResult();
    rewriter.inlineBlockBefore(op.getBodyBlock(), op, bins);
    context.call(rewriter, loc, "pikoir_end_local", Type(),
                 {adaptor.getSource(), port});
    rewriter.eraseOp(op);
    return success();
  }
};

/// An operation that is a call with the writer for its argument.
template <typename OpT, const char *const *name>
struct WriterCallLowering : Lowering<OpT> {
  using Lowering<OpT>::Lowering;
  LogicalResult
  matchAndRewrite(OpT op, typename OpT::Adaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    this->context.call(rewriter, op.getLoc(), *name, Type(),
                       adaptor.getWriter());
    rewriter.eraseOp(op);
    return success();
  }
};
constexpr const char *closeName = "pikoir_close";
constexpr const char *deferEndName = "pikoir_defer_end";

struct NextLowering : Lowering<NextOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(NextOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    createNext(rewriter, op.getLoc(), context, adaptor.getWriter());
    rewriter.eraseOp(op);
    return success();
  }
};

/// An operation that is a call with the writer and a number for its arguments.
template <typename OpT, const char *const *name>
struct WriterNumberLowering : Lowering<OpT> {
  using Lowering<OpT>::Lowering;
  LogicalResult
  matchAndRewrite(OpT op, typename OpT::Adaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Value number = toI64(rewriter, op.getLoc(), adaptor.getOperands().back());
    this->context.call(rewriter, op.getLoc(), *name, Type(),
                       {adaptor.getWriter(), number});
    rewriter.eraseOp(op);
    return success();
  }
};
constexpr const char *deferBeginName = "pikoir_defer_begin";
constexpr const char *deferIterationName = "pikoir_defer_iteration";
constexpr const char *scratchReleaseName = "pikoir_scratch_release";

struct ScratchMarkLowering : Lowering<ScratchMarkOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ScratchMarkOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(
        op, context.call(rewriter, op.getLoc(), "pikoir_scratch_mark",
                         rewriter.getI64Type(), adaptor.getWriter()));
    return success();
  }
};

struct ScratchLowering : Lowering<ScratchOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ScratchOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value size = toI64(rewriter, loc, adaptor.getSize());
    Value memory = context
                       .call(rewriter, loc, "pikoir_scratch", pointer(rewriter),
                             {adaptor.getWriter(), size})
                       .getResult();
    Value null = LLVM::ZeroOp::create(rewriter, loc, pointer(rewriter));
    Value granted = LLVM::ICmpOp::create(rewriter, loc, LLVM::ICmpPredicate::ne,
                                         memory, null);
    // As the conversion of memrefs will see it.
    auto bytes = cast<MemRefType>(op.getBytes().getType());
    LLVMTypeConverter types(rewriter.getContext());
    auto descriptor =
        MemRefDescriptor::poison(rewriter, loc, types.convertType(bytes));
    descriptor.setAllocatedPtr(rewriter, loc, memory);
    descriptor.setAlignedPtr(rewriter, loc, memory);
    descriptor.setConstantOffset(rewriter, loc, 0);
    descriptor.setSize(rewriter, loc, 0, size);
    descriptor.setConstantStride(rewriter, loc, 0, 1);
    Value memref = UnrealizedConversionCastOp::create(rewriter, loc, bytes,
                                                      Value(descriptor))
                       .getResult(0);
    rewriter.replaceOp(op, {memref, granted});
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
            .call(rewriter, loc, "pikoir_begin_schedule", rewriter.getI64Type(),
                  {context.frame(op), createI32(rewriter, loc, number)})
            .getResult();
    // The kernel's status is that of what it says about the bins.
    auto function = op->getParentOfType<func::FuncOp>();
    Operation *end = function.getBody().front().getTerminator();
    {
      OpBuilder::InsertionGuard guard(rewriter);
      rewriter.setInsertionPoint(end);
      Value status = context
                         .call(rewriter, loc, "pikoir_status",
                               rewriter.getI32Type(), context.frame(op))
                         .getResult();
      rewriter.modifyOpInPlace(end, [&] { end->setOperand(0, status); });
    }
    rewriter.replaceOp(op, toIndex(rewriter, loc, bins));
    return success();
  }
};

struct ScheduleBinLowering : Lowering<ScheduleBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ScheduleBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    int32_t number = context.stageNumber(op, op.getStage());
    Value everyBin = arith::ExtUIOp::create(
        rewriter, loc, rewriter.getI32Type(), adaptor.getEveryBin());
    context.call(rewriter, loc, "pikoir_schedule_bin", Type(),
                 {context.frame(op), createI32(rewriter, loc, number),
                  toI64(rewriter, loc, adaptor.getBin()), adaptor.getKind(),
                  adaptor.getTileSplit(), adaptor.getBatch(), everyBin});
    rewriter.eraseOp(op);
    return success();
  }
};

struct AppendLowering : Lowering<AppendOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(AppendOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    RecordOp record = context.record(op.getPrim().getType().getRecord());
    Value room =
        createAppend(rewriter, loc, context, adaptor.getWriter(), op.getPort());
    SmallVector<ArrayAttr> tags; // of each number
    for (auto field : record.getFields().getAsRange<FieldAttr>())
      tags.append(field.getElementCount(),
                  context.tags.primitive(record.getSymName(), field.getName()));
    for (auto [value, offset, tag] :
         llvm::zip(adaptor.getValues(), record.getElementOffsets(), tags))
      createStore(rewriter, loc, value,
                  createOffset(rewriter, loc, room, offset), tag);
    rewriter.replaceOp(op, room);
    return success();
  }
};

struct PlaceLowering : Lowering<AppendBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(AppendBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value cell = toI64(rewriter, loc, adaptor.getBin());
    StageOp stage = context.stage(op, op.getStageAttr());
    if (adaptor.getTile()) {
      int32_t number = context.stageNumber(op, op.getStage());
      for (int64_t dim = 0, e = stage.getBins().size(); dim < e; ++dim)
        cell = arith::MulIOp::create(
            rewriter, loc, cell,
            context.query(rewriter, op, "pikoir_cell_grid", number, dim));
      cell = arith::AddIOp::create(rewriter, loc, cell,
                                   toI64(rewriter, loc, adaptor.getTile()));
    }
    if (op.getPort() && isLocal(op))
      createLocalPlace(rewriter, loc, context, adaptor.getWriter(),
                       *op.getPort(), cell);
    else if (op.getPort())
      createPlace(rewriter, loc, context, adaptor.getWriter(), *op.getPort(),
                  cell);
    else
      context.call(rewriter, loc, "pikoir_place_source", Type(),
                   {adaptor.getWriter(), cell});
    rewriter.eraseOp(op);
    return success();
  }

private:
  /// Whether the edge is local, or each of them if several may be meant.
  bool isLocal(AppendBinOp op) const {
    bool isLocal = false;
    PipelineOp pipeline = context.numbers(op).pipeline;
    for (auto edge : pipeline.getOps<EdgeOp>()) {
      if (edge.getPort() != *op.getPort() ||
          edge.getConsumerAttr() != op.getStageAttr())
        continue;
      if (!edge.getLocal())
        return false;
      isLocal = true;
    }
    return isLocal;
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
    Value extent = context.query(
        rewriter, op, op.getTiles() ? "pikoir_cell_grid" : "pikoir_grid",
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
        context.query(rewriter, op, "pikoir_domain", std::nullopt, op.getDim());
    rewriter.replaceOp(op, toIndex(rewriter, op.getLoc(), extent));
    return success();
  }
};

struct ThreadsLowering : Lowering<ThreadsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ThreadsOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(op,
                       context.call(rewriter, op.getLoc(), "pikoir_threads",
                                    rewriter.getI32Type(), context.frame(op)));
    return success();
  }
};

} // namespace

void piko::populateKernelToLLVMPatterns(const TypeConverter &converter,
                                        RewritePatternSet &patterns,
                                        LoweringContext &context) {
  patterns.add<OpenBinsLowering, CloseBinsLowering, UnitCountLowering,
               UnitCellsLowering, CellRangeLowering, CellBinLowering,
               CallRangeLowering, CallBinLowering, ItemLowering,
               PrefetchItemLowering, NoItemLowering, ToAddressLowering,
               FromAddressLowering, OpenWriterLowering, LocalBinLowering,
               WriterCallLowering<CloseWriterOp, &closeName>, NextLowering,
               WriterCallLowering<DeferEndOp, &deferEndName>,
               WriterNumberLowering<DeferBeginOp, &deferBeginName>,
               WriterNumberLowering<DeferIterationOp, &deferIterationName>,
               WriterNumberLowering<ScratchReleaseOp, &scratchReleaseName>,
               ScratchMarkLowering, ScratchLowering, BeginScheduleLowering,
               ScheduleBinLowering, AppendLowering, PlaceLowering, GetLowering,
               GridLowering, DomainLowering, ThreadsLowering>(
      converter, patterns.getContext(), context);
}
