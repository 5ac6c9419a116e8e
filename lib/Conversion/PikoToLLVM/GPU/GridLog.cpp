// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The log of a grid, and memory of its blocks: calls of what kernels have
// inline of the runtime (pikort/grid_log.h).

#include "PikoToLLVM/GPU/GridLog.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"
#include "pikort/grid_log.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"

using namespace mlir;
using namespace piko;

/// Addresses are pointers, or memrefs.
static DeviceCallOp callInline(OpBuilder &builder, Location loc,
                               const RuntimeFunction &function,
                               ValueRange arguments) {
  assert(arguments.size() == function.count && "as in pikort/grid_log.h");
  Type result;
  if (function.result != ABIType::None)
    result = convertType(builder.getContext(), function.result);
  return DeviceCallOp::create(builder, loc, result, function.name, arguments);
}

/// Words between one word of an append buffer and the next one.
static Value createStride(OpBuilder &builder, Location loc,
                          const GridContext &grid) {
  auto strides = cast<MemRefType>(grid.buffers.getType()).getStridesAndOffset();
  return createI64(builder, loc, strides.first.front());
}

Value piko::createEntry(OpBuilder &builder, Operation *op,
                        const GridContext &grid, EntryKind kind, int64_t number,
                        int64_t bytes, int64_t stage, int64_t buffer) {
  Location loc = op->getLoc();
  return callInline(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_grid_append),
                    {grid.log, grid.buffers, createStride(builder, loc, grid),
                     createI64(builder, loc, buffer),
                     createI32(builder, loc, int64_t(kind)),
                     createI32(builder, loc, number),
                     createI32(builder, loc, stage),
                     createI64(builder, loc, bytes)})
      .getResult();
}

void piko::createKeep(OpBuilder &builder, Location loc, const GridContext &grid,
                      int64_t buffer) {
  callInline(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_grid_keep),
             {grid.buffers, createStride(builder, loc, grid),
              createI64(builder, loc, buffer)});
}

int64_t piko::getLogStage(Operation *op, Value log, LoweringContext &context) {
  auto other = log.getDefiningOp<LogOfOp>();
  return other ? context.stageNumber(op, other.getStage()) : -1;
}

int64_t piko::findAppendBuffer(const GridContext &grid, int64_t stage,
                               int64_t port) {
  for (auto [i, edge] : llvm::enumerate(grid.locals))
    if (edge == std::pair<int64_t, int64_t>(stage, port))
      return i + 1;
  return 0;
}

bool piko::createErrorEntry(OpBuilder &builder, Operation *op,
                            LoweringContext &context, StringRef function,
                            int32_t stage, std::optional<StringRef> name,
                            Value bin, int32_t number,
                            ArrayRef<Value> numbers) {
  auto launch = op->getParentOfType<gpu::LaunchOp>();
  GridContext *grid = context.grid(op);
  // What is checked is told to the runtime while the grid runs, and so are its
  // errors: it knows which primitive they are about.
  PipelineOp pipeline = context.numbers(op).pipeline;
  if (!grid || !pipeline.getOps<CheckRecordOp>().empty())
    return false;
  Location loc = op->getLoc();
  int32_t place = context.nextPlace(launch);
  {
    OpBuilder host(launch);
    int32_t which = function == PIKO_RUNTIME_FUNCTION(pikoir_fail).name
                        ? PIKOIR_PLACE_FAIL
                    : function == PIKO_RUNTIME_FUNCTION(pikoir_fail_index).name
                        ? PIKOIR_PLACE_INDEX
                        : PIKOIR_PLACE_BARRIER;
    Value text =
        name ? context.text(host, loc, *name)
             : LLVM::ZeroOp::create(
                   host, loc, LLVM::LLVMPointerType::get(host.getContext()));
    context.call(host, loc, PIKO_RUNTIME_FUNCTION(pikoir_log_place),
                 {context.frame(launch), grid->log, createI32(host, loc, place),
                  createI32(host, loc, which), createI32(host, loc, stage),
                  text, createI32(host, loc, number)});
  }
  SmallVector<Value> words{bin ? toI64(builder, loc, bin)
                               : createI64(builder, loc, -1)};
  llvm::append_range(words, numbers);
  words.resize(3, createI64(builder, loc, 0));
  auto fails = callInline(
      builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_grid_fail),
      {grid->log, grid->buffers, createStride(builder, loc, *grid),
       createI32(builder, loc, grid->forErrors), createI32(builder, loc, place),
       words[0], words[1], words[2]});
  fails->setAttr(marks::fails, builder.getUnitAttr());
  return true;
}

Value piko::createLocalBins(OpBuilder &builder, Operation *op,
                            const GridContext &grid, int64_t buffer) {
  Location loc = op->getLoc();
  auto pointer = LLVM::LLVMPointerType::get(builder.getContext());
  Value input;
  {
    auto launch = op->getParentOfType<gpu::LaunchOp>();
    OpBuilder entry = OpBuilder::atBlockBegin(&launch.getBody().front());
    Value bytes = createI64(entry, loc, sizeof(pikoir_input));
    input = LLVM::AllocaOp::create(entry, loc, pointer, entry.getI8Type(),
                                   bytes, /*alignment=*/8);
  }
  auto store = [&](Value value, int64_t offset) {
    LLVM::StoreOp::create(builder, loc, value,
                          createOffset(builder, loc, input, offset));
  };
  int64_t base = (buffer - 1) * PIKOIR_LOCAL_WORDS;
  Value records =
      arith::ConstantIndexOp::create(builder, loc, base + PIKOIR_LOCAL_RECORDS);
  Value zero = createI64(builder, loc, 0);
  store(memref::LoadOp::create(builder, loc, grid.kept, records),
        offsetof(pikoir_input, items));
  store(zero, offsetof(pikoir_input, order));
  // Its members are read after this.
  return createOffset(builder, loc, input, zero);
}

static int32_t getLogFlags(func::FuncOp function) {
  return function->hasAttr(marks::source) ? PIKOIR_LOG_SOURCE : 0;
}

namespace {

struct OpenLogLowering : ContextPattern<OpenLogOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(OpenLogOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto function = op->getParentOfType<func::FuncOp>();
    auto number = function->getAttrOfType<IntegerAttr>(marks::number);
    Location loc = op.getLoc();
    rewriter.replaceOp(
        op, context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_log_open),
                         {context.frame(op),
                          createI32(rewriter, loc, number.getInt()),
                          createI32(rewriter, loc, getLogFlags(function))}));
    return success();
  }
};

struct BlockCountLowering : ContextPattern<BlockCountOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(BlockCountOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto function = op->getParentOfType<func::FuncOp>();
    auto number = function->getAttrOfType<IntegerAttr>(marks::number);
    Location loc = op.getLoc();
    Value blocks =
        context
            .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_blocks),
                  {context.frame(op), createI32(rewriter, loc, number.getInt()),
                   createI32(rewriter, loc, getLogFlags(function)),
                   toI64(rewriter, loc, adaptor.getThreads())})
            .getResult();
    rewriter.replaceOp(op, toIndex(rewriter, loc, blocks));
    return success();
  }
};

struct CloseLogLowering : ContextPattern<CloseLogOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(CloseLogOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    context.call(rewriter, op.getLoc(), PIKO_RUNTIME_FUNCTION(pikoir_log_close),
                 {context.frame(op), adaptor.getLog()});
    rewriter.eraseOp(op);
    return success();
  }
};

struct LogOfLowering : ContextPattern<LogOfOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(LogOfOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOp(op, adaptor.getLog());
    return success();
  }
};

struct AppendBuffersLowering : ContextPattern<AppendBuffersOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(AppendBuffersOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto function = op->getParentOfType<func::FuncOp>();
    int64_t head = function->getAttrOfType<IntegerAttr>(marks::number).getInt();
    GridContext grid;
    grid.log = adaptor.getLog();
    grid.buffers = adaptor.getState();
    grid.kept = adaptor.getKept();
    grid.forErrors = op.getForErrors();
    for (auto [i, port] :
         llvm::enumerate(op.getPorts().value_or(ArrayRef<int64_t>()))) {
      auto producer = cast<FlatSymbolRefAttr>((*op.getProducers())[i]);
      int64_t stage = context.stageNumber(op, producer.getValue());
      grid.locals.push_back({stage == head ? -1 : stage, port});
      auto outputs = context.stage(op, producer).getOutputs();
      grid.recordBytes.push_back(
          context.record(cast<FlatSymbolRefAttr>(outputs[port])).getSize());
      bool isPlaced = false;
      PipelineOp pipeline = context.numbers(op).pipeline;
      for (auto edge : pipeline.getOps<EdgeOp>())
        if (edge.getProducerAttr() == producer && edge.getPort() == port)
          isPlaced = context.stage(op, edge.getConsumerAttr()).getPlaced();
      grid.placed.push_back(isPlaced);
    }
    context.noteGrid(op, std::move(grid));
    rewriter.eraseOp(op);
    return success();
  }
};

/// An operation that is a call with the log and numbers for its arguments.
template <typename OpT, const RuntimeFunction &function>
struct LogCallLowering : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  LogicalResult
  matchAndRewrite(OpT op, typename OpT::Adaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    SmallVector<Value> arguments;
    for (Value operand : adaptor.getOperands())
      arguments.push_back(operand.getType().isIndex()
                              ? toI64(rewriter, loc, operand)
                              : operand);
    auto call = callInline(rewriter, loc, function, arguments);
    if (op->getNumResults() == 0)
      rewriter.eraseOp(op);
    else
      rewriter.replaceOp(op, toIndex(rewriter, loc, call.getResult()));
    return success();
  }
};
constexpr RuntimeFunction rest = PIKO_RUNTIME_FUNCTION(pikoir_grid_rest),
                          leaveRest =
                              PIKO_RUNTIME_FUNCTION(pikoir_grid_leave_rest),
                          allocate =
                              PIKO_RUNTIME_FUNCTION(pikoir_grid_allocate);

struct TakeUnitsLowering : ContextPattern<TakeUnitsOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(TakeUnitsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value launch = createI32(rewriter, loc, op.getRest() ? 1 : 0);
    auto call = callInline(
        rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_grid_take_units),
        {adaptor.getLog(), launch, toI64(rewriter, loc, adaptor.getCount())});
    rewriter.replaceOp(op, toIndex(rewriter, loc, call.getResult()));
    return success();
  }
};

struct FlushLowering : ContextPattern<FlushOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(FlushOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    const GridContext &grid = *context.grid(op);
    auto launch = op->getParentOfType<gpu::LaunchOp>();
    Value stride = createStride(rewriter, loc, grid);
    Value threads =
        createI32(rewriter, loc, *getConstantIntValue(launch.getBlockSizeX()));
    callInline(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_grid_flush),
               {grid.log, grid.buffers, stride,
                createI32(rewriter, loc, grid.forErrors),
                toI64(rewriter, loc, adaptor.getUnit()), adaptor.getWords(),
                threads});
    for (auto [i, bytes] : llvm::enumerate(grid.recordBytes))
      callInline(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_grid_flush_local),
                 {grid.log, grid.buffers, stride,
                  createI64(rewriter, loc, i + 1), grid.kept,
                  createI64(rewriter, loc, bytes), adaptor.getWords(),
                  threads});
    rewriter.eraseOp(op);
    return success();
  }
};

struct BytesAtLowering : ContextPattern<BytesAtOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(BytesAtOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    // What is in a log is in global memory.
    constexpr unsigned global = 1;
    Value inGlobal = LLVM::IntToPtrOp::create(
        rewriter, loc, LLVM::LLVMPointerType::get(getContext(), global),
        toI64(rewriter, loc, adaptor.getAddress()));
    Value memory = LLVM::AddrSpaceCastOp::create(
        rewriter, loc, LLVM::LLVMPointerType::get(getContext()), inGlobal);
    rewriter.replaceOp(op, createBytes(rewriter, loc, memory,
                                       toI64(rewriter, loc, adaptor.getSize()),
                                       op.getBytes().getType()));
    return success();
  }
};

} // namespace

void piko::populateGridToLLVMPatterns(const TypeConverter &converter,
                                      RewritePatternSet &patterns,
                                      LoweringContext &context) {
  patterns
      .add<OpenLogLowering, BlockCountLowering, CloseLogLowering, LogOfLowering,
           AppendBuffersLowering, LogCallLowering<RestOp, rest>,
           LogCallLowering<LeaveRestOp, leaveRest>,
           LogCallLowering<AllocateOp, allocate>, TakeUnitsLowering,
           FlushLowering, BytesAtLowering>(converter, patterns.getContext(),
                                           context);
}
