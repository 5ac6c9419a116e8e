// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The log of a grid, and memory of its blocks, on pikort/grid.h. The threads of
// a warp that add an entry together take room for it by one atomic operation.

#include "GridLog.h"

#include "pikort/grid.h"

#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "mlir/Conversion/LLVMCommon/MemRefBuilder.h"
#include "mlir/Conversion/LLVMCommon/TypeConverter.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

// Byte offsets of the members of pikoir_entry and pikoir_log.
namespace layout {
constexpr int64_t bytes = offsetof(pikoir_entry, bytes),
                  kind = offsetof(pikoir_entry, kind),
                  unit = offsetof(pikoir_entry, unit),
                  order = offsetof(pikoir_entry, order),
                  header = sizeof(pikoir_entry);
constexpr int64_t cursor = offsetof(pikoir_log, cursor),
                  limit = offsetof(pikoir_log, limit),
                  spare = offsetof(pikoir_log, spare);
} // namespace layout
static_assert(int(EntryKind::Record) == PIKOIR_ENTRY_RECORD &&
              int(EntryKind::Cell) == PIKOIR_ENTRY_CELL &&
              int(EntryKind::Next) == PIKOIR_ENTRY_NEXT &&
              int(EntryKind::Error) == PIKOIR_ENTRY_ERROR &&
              int(EntryKind::Memory) == PIKOIR_ENTRY_MEMORY);

namespace {

/// Writes what a thread does.
struct ThreadCode {
  OpBuilder &builder;
  Location loc;

  Type i32() { return builder.getI32Type(); }
  Type i64() { return builder.getI64Type(); }
  Type pointer() { return LLVM::LLVMPointerType::get(builder.getContext()); }
  Value load(Value base, int64_t offset) {
    return LLVM::LoadOp::create(builder, loc, i64(),
                                createOffset(builder, loc, base, offset));
  }
  void store(Value value, Value base, int64_t offset) {
    LLVM::StoreOp::create(builder, loc, value,
                          createOffset(builder, loc, base, offset));
  }
  Value constant(int64_t value) { return createI64(builder, loc, value); }
  Value intrinsic(StringRef name, ValueRange arguments = {}) {
    return LLVM::CallIntrinsicOp::create(builder, loc, i32(),
                                         builder.getStringAttr(name), arguments)
        .getResults();
  }
  Value add(Value a, Value b) {
    return arith::AddIOp::create(builder, loc, a, b);
  }
  Value mul(Value a, Value b) {
    return arith::MulIOp::create(builder, loc, a, b);
  }
  Value bitAnd(Value a, Value b) {
    return arith::AndIOp::create(builder, loc, a, b);
  }
  Value extend(Value a) {
    return arith::ExtUIOp::create(builder, loc, i64(), a);
  }
  Value compare(arith::CmpIPredicate predicate, Value a, Value b) {
    return arith::CmpIOp::create(builder, loc, predicate, a, b);
  }
  Value addTo(Value log, Value bytes) {
    return LLVM::AtomicRMWOp::create(
        builder, loc, LLVM::AtomicBinOp::add,
        createOffset(builder, loc, log, layout::cursor), bytes,
        LLVM::AtomicOrdering::monotonic);
  }
  Value shuffle(Value mask, Value value, Value lane) {
    return intrinsic("llvm.nvvm.shfl.sync.idx.i32",
                     {mask, value, lane, createI32(builder, loc, 31)});
  }
  Value shuffleWide(Value mask, Value value, Value lane);
  /// The address of so many bytes for each thread that comes here.
  Value reserve(Value log, int64_t bytes, bool isAlone);
  Value reserveTogether(Value log, int64_t bytes);
};

} // namespace

Value ThreadCode::shuffleWide(Value mask, Value value, Value lane) {
  Value half = constant(32);
  Value low = arith::TruncIOp::create(builder, loc, i32(), value);
  Value high = arith::TruncIOp::create(
      builder, loc, i32(), arith::ShRUIOp::create(builder, loc, value, half));
  low = extend(shuffle(mask, low, lane));
  high = extend(shuffle(mask, high, lane));
  return arith::OrIOp::create(builder, loc, low,
                              arith::ShLIOp::create(builder, loc, high, half));
}

/// By one atomic operation of all threads of a warp that are active.
Value ThreadCode::reserveTogether(Value log, int64_t bytes) {
  Value mask = intrinsic("llvm.nvvm.activemask");
  Value below = intrinsic("llvm.nvvm.read.ptx.sreg.lanemask.lt");
  Value rank = math::CtPopOp::create(builder, loc, bitAnd(mask, below));
  Value count = math::CtPopOp::create(builder, loc, mask);
  Value isLeader =
      compare(arith::CmpIPredicate::eq, rank, createI32(builder, loc, 0));
  auto taken = scf::IfOp::create(
      builder, loc, isLeader,
      [&](OpBuilder &inside, Location) {
        ThreadCode code{inside, loc};
        Value all = code.mul(code.extend(count), code.constant(bytes));
        scf::YieldOp::create(inside, loc, code.addTo(log, all));
      },
      [&](OpBuilder &inside, Location) {
        scf::YieldOp::create(inside, loc, createI64(inside, loc, 0));
      });
  Value leader = math::CountTrailingZerosOp::create(builder, loc, mask);
  Value first = shuffleWide(mask, taken.getResult(0), leader);
  return add(first, mul(extend(rank), constant(bytes)));
}

Value ThreadCode::reserve(Value log, int64_t bytes, bool isAlone) {
  Value mine =
      isAlone ? addTo(log, constant(bytes)) : reserveTogether(log, bytes);
  Value fits = compare(arith::CmpIPredicate::sle, add(mine, constant(bytes)),
                       load(log, layout::limit));
  return arith::SelectOp::create(builder, loc, fits, mine,
                                 load(log, layout::spare));
}

/// Whether one thread of a block is here.
static bool isAlone(Operation *op) {
  for (; !isa<gpu::LaunchOp>(op); op = op->getParentOp())
    if (op->hasAttr(firstAttrName))
      return true;
  return false;
}

Value piko::createEntry(OpBuilder &builder, Operation *op, const Grid &grid,
                        EntryKind kind, int64_t number, int64_t bytes) {
  Location loc = op->getLoc();
  ThreadCode code{builder, loc};
  int64_t size = llvm::alignTo(layout::header + bytes, layout::header);
  Value entry = LLVM::IntToPtrOp::create(
      builder, loc, code.pointer(), code.reserve(grid.log, size, isAlone(op)));
  code.store(code.constant(size), entry, layout::bytes);
  code.store(code.constant(int64_t(kind) | (number << 32)), entry,
             layout::kind);
  auto launch = op->getParentOfType<gpu::LaunchOp>();
  code.store(toI64(builder, loc, launch.getBlockIds().x), entry, layout::unit);
  for (int64_t i = 0; i < 4; ++i) {
    Value at = arith::ConstantIndexOp::create(builder, loc, i);
    Value now = memref::LoadOp::create(builder, loc, grid.order, at);
    code.store(now, entry, layout::order + 8 * i);
    if (i != 3)
      continue;
    Value next = code.add(now, code.constant(1));
    memref::StoreOp::create(builder, loc, next, grid.order, at);
  }
  return createOffset(builder, loc, entry, layout::header);
}

bool piko::createErrorEntry(OpBuilder &builder, Operation *op,
                            LoweringContext &context, StringRef function,
                            int32_t stage, std::optional<StringRef> name,
                            Value bin, int32_t code, ArrayRef<Value> numbers) {
  auto launch = op->getParentOfType<gpu::LaunchOp>();
  Grid *grid = context.grid(op);
  if (!grid)
    return false;
  Location loc = op->getLoc();
  int32_t place = grid->places++;
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
                 {grid->log, createI32(host, loc, place),
                  createI32(host, loc, which), createI32(host, loc, stage),
                  text, createI32(host, loc, code)});
  }
  Value payload =
      createEntry(builder, op, *grid, EntryKind::Error, place, 3 * 8);
  ThreadCode thread{builder, loc};
  SmallVector<Value> words{bin ? toI64(builder, loc, bin)
                               : thread.constant(-1)};
  llvm::append_range(words, numbers);
  words.resize(3, thread.constant(0));
  for (auto [i, word] : llvm::enumerate(words))
    thread.store(word, payload, 8 * i);
  return true;
}

namespace {

struct OpenLogLowering : ContextPattern<OpenLogOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(OpenLogOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    auto function = op->getParentOfType<func::FuncOp>();
    auto number = function->getAttrOfType<IntegerAttr>(numberAttrName);
    Location loc = op.getLoc();
    rewriter.replaceOp(
        op,
        context.call(
            rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_log_open),
            {context.frame(op), createI32(rewriter, loc, number.getInt()),
             createI32(rewriter, loc,
                       function->hasAttr(sourceAttrName) ? PIKOIR_LOG_SOURCE
                                                         : 0),
             context.member(rewriter, adaptor.getBins(),
                            PIKO_RUNTIME_MEMBER(pikoir_input, unit_count))}));
    return success();
  }
};

struct CloseLogLowering : ContextPattern<CloseLogOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(CloseLogOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    context.call(rewriter, op.getLoc(), PIKO_RUNTIME_FUNCTION(pikoir_log_close),
                 adaptor.getLog());
    rewriter.eraseOp(op);
    return success();
  }
};

struct LogOrderLowering : ContextPattern<LogOrderOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(LogOrderOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    context.noteGrid(op, {adaptor.getLog(), adaptor.getOrder()});
    rewriter.eraseOp(op);
    return success();
  }
};

struct AllocateLowering : ContextPattern<AllocateOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(AllocateOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    ThreadCode code{rewriter, loc};
    // What is too large, or negative, must not wrap.
    Value most = code.constant(int64_t(1) << 48);
    Value size = arith::MinUIOp::create(
        rewriter, loc, toI64(rewriter, loc, adaptor.getSize()), most);
    size = code.bitAnd(code.add(size, code.constant(2 * layout::header - 1)),
                       code.constant(-layout::header));
    Value mine = code.addTo(adaptor.getLog(), size);
    Value fits = code.compare(arith::CmpIPredicate::sle, code.add(mine, size),
                              code.load(adaptor.getLog(), layout::limit));
    auto granted = scf::IfOp::create(
        rewriter, loc, fits,
        [&](OpBuilder &builder, Location) {
          ThreadCode inside{builder, loc};
          Value entry =
              LLVM::IntToPtrOp::create(builder, loc, inside.pointer(), mine);
          inside.store(size, entry, layout::bytes);
          inside.store(inside.constant(int64_t(EntryKind::Memory)), entry,
                       layout::kind);
          scf::YieldOp::create(
              builder, loc, inside.add(mine, inside.constant(layout::header)));
        },
        [&](OpBuilder &builder, Location) {
          scf::YieldOp::create(builder, loc, createI64(builder, loc, 0));
        });
    rewriter.replaceOp(op, toIndex(rewriter, loc, granted.getResult(0)));
    return success();
  }
};

struct BytesAtLowering : ContextPattern<BytesAtOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(BytesAtOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    auto pointer = LLVM::LLVMPointerType::get(rewriter.getContext());
    Value memory = LLVM::IntToPtrOp::create(
        rewriter, loc, pointer, toI64(rewriter, loc, adaptor.getAddress()));
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
  patterns.add<OpenLogLowering, CloseLogLowering, LogOrderLowering,
               AllocateLowering, BytesAtLowering>(
      converter, patterns.getContext(), context);
}
