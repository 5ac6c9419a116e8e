// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Writers, what is emitted to them, and scratch memory, on the runtime's
// structs (pikort/abi.h).

#include "PikoToLLVM/GPU/GridLog.h"
#include "PikoToLLVM/KernelLowering.h"
#include "PikoToLLVM/Records/WriterPaths.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "pikort/emission.h"

using namespace mlir;
using namespace piko;

bool piko::isLocalEdge(Operation *op, int64_t port, FlatSymbolRefAttr stage,
                       LoweringContext &context) {
  bool isLocal = false;
  PipelineOp pipeline = context.numbers(op).pipeline;
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    if (edge.getPort() != port || edge.getConsumerAttr() != stage)
      continue;
    if (!edge.getLocal())
      return false;
    isLocal = true;
  }
  return isLocal;
}

Value piko::createTileCount(OpBuilder &builder, Operation *op,
                            FlatSymbolRefAttr stage, LoweringContext &context) {
  int32_t number = context.stageNumber(op, stage.getValue());
  Value count;
  for (int64_t dim = 0, e = context.stage(op, stage).getBins().size(); dim < e;
       ++dim) {
    Value size = context.query(
        builder, op, PIKO_RUNTIME_FUNCTION(pikoir_tile_grid), number, dim);
    count = count ? arith::MulIOp::create(builder, op->getLoc(), count, size)
                        .getResult()
                  : size;
  }
  return count;
}

namespace {

struct OpenWriterLowering : Lowering<OpenWriterOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(OpenWriterOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto function = op->getParentOfType<func::FuncOp>();
    auto number = function->getAttrOfType<IntegerAttr>(marks::number);
    int64_t subject = op.getStage() ? context.stageNumber(op, *op.getStage())
                                    : number.getInt();
    Location loc = op.getLoc();
    rewriter.replaceOp(
        op, context.call(rewriter, loc,
                         function->hasAttr(marks::source)
                             ? PIKO_RUNTIME_FUNCTION(pikoir_open_source)
                             : PIKO_RUNTIME_FUNCTION(pikoir_open),
                         {context.frame(op), createI32(rewriter, loc, subject),
                          toI64(rewriter, loc, adaptor.getUnit())}));
    return success();
  }
};

struct TakesVectorsLowering : Lowering<TakesVectorsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(TakesVectorsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(
        op, context.test(rewriter, op.getLoc(),
                         PIKO_RUNTIME_FUNCTION(pikoir_takes_vectors_inline),
                         {adaptor.getWriter(),
                          createI64(rewriter, op.getLoc(), op.getNumber())}));
    return success();
  }
};

/// One iteration has nobody to wait for.
struct ElectLowering : Lowering<ElectOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ElectOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Value always = LLVM::ConstantOp::create(rewriter, op.getLoc(),
                                            rewriter.getI1Type(), true);
    rewriter.replaceOp(op, {adaptor.getCondition(), always});
    return success();
  }
};

struct VoteLowering : Lowering<VoteOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(VoteOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(op, adaptor.getCondition());
    return success();
  }
};

struct LocalBinLowering : Lowering<LocalBinOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(LocalBinOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    if (GridContext *grid = context.grid(op)) {
      int64_t stage = getLogStage(op, op.getSource(), context);
      Value bins = createLocalBins(
          rewriter, op, *grid, findAppendBuffer(*grid, stage, op.getPort()));
      rewriter.inlineBlockBefore(op.getBodyBlock(), op, bins);
      rewriter.eraseOp(op);
      return success();
    }
    Value port = createI32(rewriter, loc, op.getPort());
    Value bins =
        context
            .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_begin_local),
                  {adaptor.getSource(), port})
            .getResult();
    rewriter.inlineBlockBefore(op.getBodyBlock(), op, bins);
    context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_end_local),
                 {adaptor.getSource(), port});
    rewriter.eraseOp(op);
    return success();
  }
};

/// An operation that is a call with the writer for its argument.
template <typename OpT, const RuntimeFunction &function>
struct WriterCallLowering : Lowering<OpT> {
  using Lowering<OpT>::Lowering;
  LogicalResult
  matchAndRewrite(OpT op, typename OpT::Adaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    this->context.call(rewriter, op.getLoc(), function, adaptor.getWriter());
    rewriter.eraseOp(op);
    return success();
  }
};
constexpr RuntimeFunction closeWriter = PIKO_RUNTIME_FUNCTION(pikoir_close);
constexpr RuntimeFunction reorderEnd =
    PIKO_RUNTIME_FUNCTION(pikoir_reorder_end);

struct NextLowering : Lowering<NextOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(NextOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    if (GridContext *grid = context.grid(op))
      createEntry(rewriter, op, *grid, EntryKind::Next, /*number=*/0,
                  /*bytes=*/0, getLogStage(op, op.getWriter(), context));
    else if (op->getParentOfType<func::FuncOp>()->hasAttr(marks::source))
      context.call(rewriter, op.getLoc(),
                   PIKO_RUNTIME_FUNCTION(pikoir_next_source_inline),
                   adaptor.getWriter());
    else
      context.call(rewriter, op.getLoc(),
                   PIKO_RUNTIME_FUNCTION(pikoir_next_inline),
                   adaptor.getWriter());
    rewriter.eraseOp(op);
    return success();
  }
};

struct IsCountedLowering : Lowering<IsCountedOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(IsCountedOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(
        op, context.test(rewriter, op.getLoc(),
                         PIKO_RUNTIME_FUNCTION(pikoir_is_counted_inline),
                         adaptor.getWriter()));
    return success();
  }
};

/// An operation that is a call with the writer and a number for its arguments.
template <typename OpT, const RuntimeFunction &function>
struct WriterNumberLowering : Lowering<OpT> {
  using Lowering<OpT>::Lowering;
  LogicalResult
  matchAndRewrite(OpT op, typename OpT::Adaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Value number = toI64(rewriter, op.getLoc(), adaptor.getOperands().back());
    this->context.call(rewriter, op.getLoc(), function,
                       {adaptor.getWriter(), number});
    rewriter.eraseOp(op);
    return success();
  }
};
constexpr RuntimeFunction reorderBegin =
    PIKO_RUNTIME_FUNCTION(pikoir_reorder_begin);
constexpr RuntimeFunction reorderIteration =
    PIKO_RUNTIME_FUNCTION(pikoir_reorder_iteration);
constexpr RuntimeFunction scratchRelease =
    PIKO_RUNTIME_FUNCTION(pikoir_scratch_release);

struct ScratchMarkLowering : Lowering<ScratchMarkOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ScratchMarkOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(op,
                       context.call(rewriter, op.getLoc(),
                                    PIKO_RUNTIME_FUNCTION(pikoir_scratch_mark),
                                    adaptor.getWriter()));
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
    Value memory =
        context
            .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_scratch),
                  {adaptor.getWriter(), size})
            .getResult();
    Value null = LLVM::ZeroOp::create(rewriter, loc, pointer(rewriter));
    Value granted = LLVM::ICmpOp::create(rewriter, loc, LLVM::ICmpPredicate::ne,
                                         memory, null);
    Value memref = createBytes(rewriter, loc, memory, size,
                               cast<MemRefType>(op.getBytes().getType()));
    rewriter.replaceOp(op, {memref, granted});
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
    int64_t port = op.getPort();
    Value room;
    if (GridContext *grid = context.grid(op)) {
      int64_t stage = getLogStage(op, op.getWriter(), context);
      int64_t buffer = findAppendBuffer(*grid, stage, port);
      room = createEntry(rewriter, op, *grid, EntryKind::Record, port,
                         record.getSize(), stage, buffer);
      if (buffer && !grid->placed[buffer - 1])
        createKeep(rewriter, loc, *grid, buffer);
    } else {
      room =
          context
              .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_append_inline),
                    {adaptor.getWriter(), createI32(rewriter, loc, port)})
              .getResult();
    }
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
    Value bucket = toI64(rewriter, loc, adaptor.getBin());
    if (adaptor.getTile()) {
      Value tiles = createTileCount(rewriter, op, op.getStageAttr(), context);
      bucket = arith::AddIOp::create(
          rewriter, loc, arith::MulIOp::create(rewriter, loc, bucket, tiles),
          toI64(rewriter, loc, adaptor.getTile()));
    }
    if (GridContext *grid = context.grid(op)) {
      int64_t port = op.getPort().value_or(0);
      int64_t from = getLogStage(op, op.getWriter(), context);
      if (int64_t buffer = findAppendBuffer(*grid, from, port)) {
        createKeep(rewriter, loc, *grid, buffer);
      } else {
        Value entry = createEntry(rewriter, op, *grid, EntryKind::Bucket, port,
                                  /*bytes=*/8, from);
        LLVM::StoreOp::create(rewriter, loc, bucket, entry);
      }
    } else {
      bool isLocal = op.getPort() &&
                     isLocalEdge(op, *op.getPort(), op.getStageAttr(), context);
      // A source's buckets are those of its only port.
      context.call(rewriter, loc,
                   isLocal ? PIKO_RUNTIME_FUNCTION(pikoir_place_local_inline)
                           : PIKO_RUNTIME_FUNCTION(pikoir_place_inline),
                   {adaptor.getWriter(),
                    createI32(rewriter, loc, op.getPort().value_or(0)),
                    bucket});
    }
    rewriter.eraseOp(op);
    return success();
  }
};

} // namespace

void piko::populateWriterToLLVMPatterns(const TypeConverter &converter,
                                        RewritePatternSet &patterns,
                                        LoweringContext &context) {
  patterns
      .add<OpenWriterLowering, ElectLowering, VoteLowering,
           TakesVectorsLowering, LocalBinLowering,
           WriterCallLowering<CloseWriterOp, closeWriter>, NextLowering,
           IsCountedLowering, WriterCallLowering<ReorderEndOp, reorderEnd>,
           WriterNumberLowering<ReorderBeginOp, reorderBegin>,
           WriterNumberLowering<ReorderIterationOp, reorderIteration>,
           WriterNumberLowering<ScratchReleaseOp, scratchRelease>,
           ScratchMarkLowering, ScratchLowering, AppendLowering, PlaceLowering>(
          converter, patterns.getContext(), context);
}
