// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The log of a grid, and memory of its blocks, on pikort/grid.h. A thread puts
// entries into its append buffer, which is one of its own; where that is full
// it takes another piece of memory. BlockOutput.cpp is about what the block
// does.

#include "PikoToLLVM/GPU/GridLog.h"

#include "PikoToLLVM/GPU/GridCode.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

using namespace mlir;
using namespace piko;

// Byte offsets of the members of pikoir_entry, pikoir_piece and pikoir_log.
namespace layout {
constexpr int64_t number = offsetof(pikoir_entry, number),
                  header = sizeof(pikoir_entry);
constexpr int64_t kind = offsetof(pikoir_piece, kind),
                  pieceHeader = sizeof(pikoir_piece);
constexpr int64_t cursor = offsetof(pikoir_log, cursor),
                  limit = offsetof(pikoir_log, limit),
                  spare = offsetof(pikoir_log, spare);
} // namespace layout

static Value loadMember(GridCode &code, Value log, int64_t offset) {
  return LLVM::LoadOp::create(
      code.builder, code.loc, code.i64(),
      createOffset(code.builder, code.loc, log, offset));
}

Value piko::getSpare(GridCode &code, Value log) {
  return loadMember(code, log, layout::spare);
}

Value GridCode::take(Value log, Value bytes, int64_t kind) {
  Value mine =
      LLVM::AtomicRMWOp::create(builder, loc, LLVM::AtomicBinOp::add,
                                createOffset(builder, loc, log, layout::cursor),
                                bytes, LLVM::AtomicOrdering::monotonic);
  Value fits =
      compare(P::sle, add(mine, bytes), loadMember(*this, log, layout::limit));
  return choose(
      fits,
      [&] {
        store(bytes, mine);
        store(constant(kind), mine, layout::kind);
        return mine;
      },
      [&] { return constant(0); });
}

/// Of 64 bits.
static Value shuffle(GridCode &code, Value mask, Value value, Value lane) {
  Location loc = code.loc;
  OpBuilder &builder = code.builder;
  auto half = [&](Value number) {
    Value word = arith::TruncIOp::create(builder, loc, code.i32(), number);
    return code.extend(code.intrinsic(
        "llvm.nvvm.shfl.sync.idx.i32",
        {mask, word, lane, createI32(builder, loc, /*clamp=*/31)}));
  };
  Value by = code.constant(32);
  Value low = half(value);
  Value high = half(arith::ShRUIOp::create(builder, loc, value, by));
  return code.either(low, arith::ShLIOp::create(builder, loc, high, by));
}

Value GridCode::takeForLanes(Value log, int64_t bytes) {
  Value mask = intrinsic("llvm.nvvm.activemask");
  Value below = both(mask, intrinsic("llvm.nvvm.read.ptx.sreg.lanemask.lt"));
  Value rank = extend(math::CtPopOp::create(builder, loc, below));
  Value first = math::CountTrailingZerosOp::create(builder, loc, mask);
  Value zero = constant(0);
  Value piece = choose(
      compare(P::eq, rank, zero),
      [&] {
        Value lanes = extend(math::CtPopOp::create(builder, loc, mask));
        Value all = add(mul(lanes, constant(bytes)),
                        constant(layout::pieceHeader + 63));
        return take(log, both(all, constant(-64)), PIKOIR_PIECE_MEMORY);
      },
      [&] { return zero; });
  piece = shuffle(*this, mask, piece, first);
  Value mine = add(add(piece, constant(layout::pieceHeader)),
                   mul(rank, constant(bytes)));
  return select(compare(P::ne, piece, zero), mine, zero);
}

/// Bytes and kind, or number and stage, as eight bytes.
static Value pack(GridCode &code, int64_t low, int64_t high) {
  return code.constant(
      int64_t(uint64_t(uint32_t(low)) | (uint64_t(high) << 32)));
}

/// More memory for an append buffer, with an entry of `size` bytes at its
/// front: the entry's address, or that of memory that nobody reads. What comes
/// first is for a record and where it goes, as most threads have no more, and
/// taken by all lanes of a warp together: an atomic each would make them wait
/// for each other.
static Value extendAppendBuffer(GridCode &code, Value log, Value words,
                                int64_t base, int64_t size) {
  using P = GridCode::P;
  constexpr int64_t least = 512, others = 6 * layout::header;
  int64_t single = size + others + layout::header;
  Value zero = code.constant(0), header = code.constant(layout::header);
  Value cursor = code.get(words, base + PIKOIR_APPEND_CURSOR);
  Value isNew = code.compare(P::eq, cursor, zero);
  int64_t need = llvm::alignTo(
      std::max(least, layout::pieceHeader + size + layout::header), 64);
  Value before = code.get(words, base + PIKOIR_APPEND_BYTES);
  Value more = arith::MaxUIOp::create(
      code.builder, code.loc, code.add(before, before), code.constant(need));
  Value pieceHeader = code.constant(layout::pieceHeader);
  Value first = code.choose(
      isNew, [&] { return code.takeForLanes(log, single); },
      [&] {
        Value piece = code.take(log, more, PIKOIR_PIECE_MEMORY);
        return code.select(code.compare(P::ne, piece, zero),
                           code.add(piece, pieceHeader), zero);
      });
  return code.choose(
      code.compare(P::ne, first, zero),
      [&] {
        code.when(isNew,
                  [&] { code.set(first, words, base + PIKOIR_APPEND_BEGIN); });
        code.when(code.compare(P::ne, cursor, zero), [&] {
          code.store(pack(code, layout::header, PIKOIR_ENTRY_LINK), cursor);
          code.store(first, cursor, layout::number);
        });
        code.set(code.add(first, code.constant(size)), words,
                 base + PIKOIR_APPEND_CURSOR);
        Value room = code.select(isNew, code.constant(single),
                                 code.sub(more, pieceHeader));
        code.set(code.sub(code.add(first, room), header), words,
                 base + PIKOIR_APPEND_LIMIT);
        // Twice as much is a multiple of 64.
        code.set(
            code.select(isNew, code.constant(llvm::alignTo(single, 32)), more),
            words, base + PIKOIR_APPEND_BYTES);
        return first;
      },
      [&] { return getSpare(code, log); });
}

Value piko::createEntry(OpBuilder &builder, Operation *op,
                        const GridContext &grid, EntryKind kind, int64_t number,
                        int64_t bytes, int64_t stage, int64_t buffer) {
  GridCode code(builder, op->getLoc());
  int64_t size = llvm::alignTo(layout::header + bytes, layout::header);
  int64_t base = buffer * PIKOIR_APPEND_WORDS;
  Value cursor = code.get(grid.buffers, base + PIKOIR_APPEND_CURSOR);
  Value end = code.add(cursor, code.constant(size));
  Value fits = code.compare(GridCode::P::sle, end,
                            code.get(grid.buffers, base + PIKOIR_APPEND_LIMIT));
  Value entry = code.choose(
      fits,
      [&] {
        code.set(end, grid.buffers, base + PIKOIR_APPEND_CURSOR);
        return cursor;
      },
      [&] {
        return extendAppendBuffer(code, grid.log, grid.buffers, base, size);
      });
  code.store(pack(code, size, int64_t(kind)), entry);
  code.store(pack(code, number, stage), entry, layout::number);
  if (buffer != 0)
    code.set(entry, grid.buffers, base + PIKOIR_APPEND_LAST);
  return code.at(code.add(entry, code.constant(layout::header)));
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

/// The words of an append buffer for errors, of which there may have been none:
/// their address, or 0 where there is no memory.
static Value openErrorBuffer(GridCode &code, const GridContext &grid) {
  using P = GridCode::P;
  constexpr int64_t bytes =
      llvm::alignTo(layout::pieceHeader + 8 * PIKOIR_APPEND_WORDS, 64);
  Value known = code.get(grid.buffers, PIKOIR_APPEND_BEGIN);
  return code.choose(
      code.compare(P::ne, known, code.constant(0)), [&] { return known; },
      [&] {
        Value zero = code.constant(0);
        Value piece =
            code.take(grid.log, code.constant(bytes), PIKOIR_PIECE_MEMORY);
        Value isThere = code.compare(P::ne, piece, zero);
        Value words = code.add(piece, code.constant(layout::pieceHeader));
        code.when(isThere, [&] {
          for (int64_t word = 0; word < PIKOIR_APPEND_WORDS; ++word)
            code.store(zero, words, 8 * word);
          code.set(words, grid.buffers, PIKOIR_APPEND_BEGIN);
        });
        return code.select(isThere, words, zero);
      });
}

/// Words at an address.
static Value viewWords(GridCode &code, Value address) {
  OpBuilder &builder = code.builder;
  auto bytesType = MemRefType::get({ShapedType::kDynamic}, builder.getI8Type());
  Value bytes = createBytes(builder, code.loc, code.at(address),
                            code.constant(8 * PIKOIR_APPEND_WORDS), bytesType);
  return memref::ViewOp::create(
      builder, code.loc, MemRefType::get({PIKOIR_APPEND_WORDS}, code.i64()),
      bytes, code.index(0), ValueRange());
}

/// An entry for an error; its payload.
static Value createErrorRoom(GridCode &code, Operation *op,
                             const GridContext &grid, int32_t place) {
  constexpr int64_t bytes = 4 * 8;
  if (!grid.forErrors)
    return createEntry(code.builder, op, grid, EntryKind::Error, place, bytes);
  Value words = openErrorBuffer(code, grid);
  Value isThere = code.compare(GridCode::P::ne, words, code.constant(0));
  return code.at(code.choose(
      isThere,
      [&]() -> Value {
        GridContext inLog = grid;
        inLog.buffers = viewWords(code, words);
        Value payload = createEntry(code.builder, op, inLog, EntryKind::Error,
                                    place, bytes);
        return LLVM::PtrToIntOp::create(code.builder, code.loc, code.i64(),
                                        payload);
      },
      [&] { return getSpare(code, grid.log); }));
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
  GridCode code(builder, loc);
  Value payload = createErrorRoom(code, op, *grid, place);
  SmallVector<Value> words{bin ? toI64(builder, loc, bin)
                               : createI64(builder, loc, -1)};
  llvm::append_range(words, numbers);
  words.resize(3, createI64(builder, loc, 0));
  words.push_back(code.get(grid->buffers, PIKOIR_APPEND_POSITION));
  for (auto [i, word] : llvm::enumerate(words))
    LLVM::StoreOp::create(builder, loc, word,
                          createOffset(builder, loc, payload, 8 * i));
  auto tells = LLVM::StoreOp::create(
      builder, loc, createI64(builder, loc, 1),
      createOffset(builder, loc, grid->log, offsetof(pikoir_log, errors)));
  tells->setAttr(marks::fails, builder.getUnitAttr());
  return true;
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

/// The address of what a unit's launches say to each other.
Value getRestAddress(GridCode &code, Value log, Value unit) {
  Value units = code.load(code.i64(), log, offsetof(pikoir_log, units));
  Value mine = code.mul(toI64(code.builder, code.loc, unit),
                        code.constant(sizeof(pikoir_unit_log)));
  return code.add(code.add(units, mine),
                  code.constant(offsetof(pikoir_unit_log, rest)));
}

struct RestLowering : ContextPattern<RestOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(RestOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    GridCode code(rewriter, op.getLoc());
    Value at = getRestAddress(code, adaptor.getLog(), adaptor.getUnit());
    rewriter.replaceOp(
        op, toIndex(rewriter, op.getLoc(), code.load(code.i64(), at)));
    return success();
  }
};

struct LeaveRestLowering : ContextPattern<LeaveRestOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(LeaveRestOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    GridCode code(rewriter, op.getLoc());
    Value at = getRestAddress(code, adaptor.getLog(), adaptor.getUnit());
    Value position = toI64(rewriter, op.getLoc(), adaptor.getPosition());
    code.store(code.add(position, code.constant(1)), at);
    rewriter.eraseOp(op);
    return success();
  }
};

struct TakeUnitsLowering : ContextPattern<TakeUnitsOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(TakeUnitsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    int64_t launch = op.getRest() ? 1 : 0;
    Value taken =
        createOffset(rewriter, loc, adaptor.getLog(),
                     offsetof(pikoir_log, taken) + launch * sizeof(int64_t));
    Value first =
        LLVM::AtomicRMWOp::create(rewriter, loc, LLVM::AtomicBinOp::add, taken,
                                  toI64(rewriter, loc, adaptor.getCount()),
                                  LLVM::AtomicOrdering::monotonic);
    rewriter.replaceOp(op, toIndex(rewriter, loc, first));
    return success();
  }
};

struct AllocateLowering : ContextPattern<AllocateOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(AllocateOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    GridCode code(rewriter, loc);
    // What is too large, or negative, must not wrap.
    Value most = code.constant(int64_t(1) << 48);
    Value size = arith::MinUIOp::create(
        rewriter, loc, toI64(rewriter, loc, adaptor.getSize()), most);
    size = code.both(code.add(size, code.constant(2 * layout::pieceHeader - 1)),
                     code.constant(-layout::pieceHeader));
    Value piece = code.take(adaptor.getLog(), size, PIKOIR_PIECE_MEMORY);
    Value bytes = code.add(piece, code.constant(layout::pieceHeader));
    Value none = code.compare(GridCode::P::eq, piece, code.constant(0));
    rewriter.replaceOp(op,
                       toIndex(rewriter, loc, code.select(none, piece, bytes)));
    return success();
  }
};

struct BytesAtLowering : ContextPattern<BytesAtOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(BytesAtOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    GridCode code(rewriter, loc);
    Value memory = code.at(toI64(rewriter, loc, adaptor.getAddress()));
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
           AppendBuffersLowering, RestLowering, LeaveRestLowering,
           TakeUnitsLowering, AllocateLowering, BytesAtLowering>(
          converter, patterns.getContext(), context);
  populateBlockOutputPatterns(converter, patterns, context);
}
