// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a block does with the append buffers of its threads. A round:
//   1. threads meet, and go on if one of them has something;
//   2. they vote whether they have, and a sum over warps gives each its place:
//      the order is that of threads;
//   3. one thread takes room for the directory, in which each says what it has;
//   4. records of a local edge are copied after those that the block has;
//      where they come to follows from a sum of their numbers.

#include "PikoToLLVM/GPU/GridCode.h"
#include "PikoToLLVM/GPU/GridLog.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

using namespace mlir;
using namespace piko;

/// After the numbers of warps: what one thread tells the others.
static constexpr int64_t told = warpSize;

namespace {

class BlockOutput {
public:
  BlockOutput(OpBuilder &builder, FlushOp op, Value sharedWords,
              GridContext &grid)
      : code{builder, op.getLoc()}, unit(op.getUnit()),
        sharedWords(sharedWords), grid(grid),
        launch(op->getParentOfType<gpu::LaunchOp>()),
        threads(*getConstantIntValue(launch.getBlockSizeX())) {}
  void publish();
  void keep(int64_t buffer, int64_t recordBytes);

private:
  void publish(Value has, Value begin, Value cursor);
  void keepRecords(Value mine, int64_t buffer, int64_t size);
  using P = GridCode::P;

  Value lanesOfWarp() {
    return createI32(code.builder, code.loc,
                     threads >= warpSize ? -1 : (int64_t(1) << threads) - 1);
  }
  /// How many of the threads below are meant; `has` is a number of 1 bit.
  Value countBelow(Value has, Value &total);
  Value sumBelow(Value number, Value &total);
  /// The sum of the warps' numbers below; of each warp one lane is the writer.
  /// After a barrier: what was said in the last round has been read.
  Value sumOfWarps(Value ofWarp, Value isWriter, Value &total);
  void when(Value condition, llvm::function_ref<void()> body) {
    code.when(condition, body);
  }
  Value isFirst() { return code.compare(P::eq, thread(), code.constant(0)); }
  Value thread() {
    return arith::IndexCastOp::create(code.builder, code.loc, code.i64(),
                                      launch.getThreadIds().x);
  }
  // What lives as long as the kernel has 32 bits.
  Value narrowThread() {
    return arith::IndexCastOp::create(code.builder, code.loc, code.i32(),
                                      launch.getThreadIds().x);
  }
  Value number(int64_t value) {
    return createI32(code.builder, code.loc, value);
  }
  Value lane() { return code.both(narrowThread(), number(warpSize - 1)); }
  void link(Value directory);
  Value getWord(int64_t which);
  void reserveRecords(Value kept, Value most, int64_t base, int64_t size);
  void copyRecords(Value from, Value end, Value to, int64_t size);
  void copyBytes(Value from, Value to, int64_t size);

  GridCode code;
  Value unit, sharedWords;
  GridContext &grid;
  gpu::LaunchOp launch;
  int64_t threads;
};

} // namespace

Value BlockOutput::sumOfWarps(Value ofWarp, Value isWriter, Value &total) {
  OpBuilder &builder = code.builder;
  Location loc = code.loc;
  Value warp = arith::DivUIOp::create(builder, loc, narrowThread(),
                                      createI32(builder, loc, warpSize));
  Value place = toIndex(builder, loc, warp);
  when(isWriter, [&] {
    memref::StoreOp::create(builder, loc, ofWarp, sharedWords, place);
  });
  code.barrier();
  int64_t warps = std::max<int64_t>(1, threads / warpSize);
  auto loop = scf::ForOp::create(
      builder, loc, code.index(0), code.index(warps), code.index(1),
      ValueRange{code.constant(0), code.constant(0)});
  {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(loop.getBody());
    Value number = memref::LoadOp::create(builder, loc, sharedWords,
                                          loop.getInductionVar());
    Value other = arith::IndexCastOp::create(builder, loc, code.i32(),
                                             loop.getInductionVar());
    Value isBelow = code.compare(P::ult, other, warp);
    Value below = code.select(isBelow, number, code.constant(0));
    scf::YieldOp::create(
        builder, loc,
        ValueRange{code.add(loop.getRegionIterArg(0), below),
                   code.add(loop.getRegionIterArg(1), number)});
  }
  total = loop.getResult(1);
  return loop.getResult(0);
}

Value BlockOutput::countBelow(Value has, Value &total) {
  Value votes =
      code.intrinsic("llvm.nvvm.vote.ballot.sync", {lanesOfWarp(), has});
  Value below = code.intrinsic("llvm.nvvm.read.ptx.sreg.lanemask.lt");
  Value rank =
      math::CtPopOp::create(code.builder, code.loc, code.both(votes, below));
  Value all = math::CtPopOp::create(code.builder, code.loc, votes);
  Value isFirst = code.compare(P::eq, lane(), number(0));
  Value before = sumOfWarps(code.extend(all), isFirst, total);
  return code.add(before, code.extend(rank));
}

Value BlockOutput::sumBelow(Value number, Value &total) {
  Value narrow = lane();
  Value sum =
      arith::TruncIOp::create(code.builder, code.loc, code.i32(), number);
  int64_t lanes = std::min(threads, warpSize);
  for (int64_t distance = 1; distance < lanes; distance *= 2) {
    Value by = createI32(code.builder, code.loc, distance);
    Value other =
        code.intrinsic("llvm.nvvm.shfl.sync.idx.i32",
                       {lanesOfWarp(), sum, code.sub(narrow, by),
                        createI32(code.builder, code.loc, warpSize - 1)});
    Value has = code.compare(P::uge, narrow, by);
    Value zero = createI32(code.builder, code.loc, 0);
    sum = code.add(sum, code.select(has, other, zero));
  }
  Value wide = code.extend(sum);
  Value isLast =
      code.compare(P::eq, narrow, createI32(code.builder, code.loc, lanes - 1));
  Value before = sumOfWarps(wide, isLast, total);
  return code.add(before, code.sub(wide, number));
}

//===----------------------------------------------------------------------===//
// The directory
//===----------------------------------------------------------------------===//

/// Appends a directory to the unit's.
void BlockOutput::link(Value directory) {
  constexpr int64_t next = offsetof(pikoir_piece, next),
                    first = offsetof(pikoir_unit_log, first),
                    last = offsetof(pikoir_unit_log, last);
  Value number = toI64(code.builder, code.loc, unit);
  code.store(number, directory, offsetof(pikoir_piece, unit));
  code.store(code.constant(0), directory, next);
  Value units = code.load(code.i64(), grid.log, offsetof(pikoir_log, units));
  Value mine =
      code.add(units, code.mul(number, code.constant(sizeof(pikoir_unit_log))));
  Value before = code.load(code.i64(), code.at(mine), last);
  Value isFirst = code.compare(P::eq, before, code.constant(0));
  code.store(directory,
             code.select(isFirst, code.add(mine, code.constant(first)),
                         code.add(before, code.constant(next))));
  code.store(directory, mine, last);
}

/// Of the log's append buffer.
Value BlockOutput::getWord(int64_t which) {
  if (!grid.forErrors)
    return code.get(grid.buffers, which);
  Value words = code.get(grid.buffers, PIKOIR_APPEND_BEGIN);
  Value none = code.constant(0);
  return code.choose(
      code.compare(P::ne, words, none),
      [&] {
        return code.load(code.i64(), code.add(words, code.constant(8 * which)));
      },
      [&] { return none; });
}

void BlockOutput::publish() {
  Value begin = getWord(PIKOIR_APPEND_BEGIN);
  Value cursor = getWord(PIKOIR_APPEND_CURSOR);
  Value has = code.compare(P::ne, begin, cursor);
  when(code.meetAny(has), [&] { publish(has, begin, cursor); });
}

void BlockOutput::publish(Value has, Value begin, Value cursor) {
  constexpr int64_t header = sizeof(pikoir_piece), span = sizeof(pikoir_span);
  Value total;
  Value place = countBelow(has, total);
  when(isFirst(), [&] {
    Value bytes = code.mul(total, code.constant(span));
    bytes = code.both(code.add(bytes, code.constant(2 * header - 1)),
                      code.constant(-header));
    Value piece = code.take(grid.log, bytes, PIKOIR_PIECE_DIRECTORY);
    when(code.compare(P::ne, piece, code.constant(0)), [&] {
      code.store(total, piece, offsetof(pikoir_piece, spans));
      link(piece);
    });
    code.set(piece, sharedWords, told);
  });
  code.barrier();
  when(has, [&] {
    Value piece = code.get(sharedWords, told);
    when(code.compare(P::ne, piece, code.constant(0)), [&] {
      Value at = code.add(code.add(piece, code.constant(header)),
                          code.mul(place, code.constant(span)));
      code.store(begin, at, offsetof(pikoir_span, begin));
      code.store(cursor, at, offsetof(pikoir_span, end));
    });
    if (grid.forErrors)
      code.store(cursor, code.get(grid.buffers, PIKOIR_APPEND_BEGIN),
                 8 * PIKOIR_APPEND_BEGIN);
    else
      code.set(cursor, grid.buffers, PIKOIR_APPEND_BEGIN);
  });
}

//===----------------------------------------------------------------------===//
// Local edges
//===----------------------------------------------------------------------===//

/// Copies bytes of the same alignment.
void BlockOutput::copyBytes(Value from, Value to, int64_t size) {
  int64_t word = size & -size;
  word = std::min<int64_t>(word, 8);
  Type type = code.builder.getIntegerType(8 * word);
  code.forEach(
      code.index(0), code.index(size / word), code.index(1), [&](Value i) {
        Value offset =
            code.mul(toI64(code.builder, code.loc, i), code.constant(word));
        code.store(code.load(type, code.add(from, offset)),
                   code.add(to, offset));
      });
}

/// What was placed between two places of an append buffer.
void BlockOutput::copyRecords(Value from, Value end, Value to, int64_t size) {
  OpBuilder &builder = code.builder;
  Location loc = code.loc;
  constexpr int64_t header = sizeof(pikoir_entry);
  auto loop = scf::WhileOp::create(
      builder, loc, TypeRange{code.i64(), code.i64()}, ValueRange{from, to},
      [&](OpBuilder &, Location, ValueRange at) {
        scf::ConditionOp::create(builder, loc, code.compare(P::ne, at[0], end),
                                 at);
      },
      [&](OpBuilder &, Location, ValueRange at) {
        Value entry = at[0];
        Value bytes = code.extend(code.load(code.i32(), entry));
        Value kind = code.extend(code.load(
            code.i32(),
            code.add(entry, code.constant(offsetof(pikoir_entry, kind)))));
        Value isLink =
            code.compare(P::eq, kind, code.constant(PIKOIR_ENTRY_LINK));
        Value isKept =
            code.compare(P::eq, kind, code.constant(PIKOIR_ENTRY_KEPT));
        when(isKept, [&] {
          copyBytes(code.add(entry, code.constant(header)), at[1], size);
        });
        Value next = code.choose(
            isLink,
            [&] {
              return code.load(code.i64(),
                               code.add(entry, code.constant(offsetof(
                                                   pikoir_entry, number))));
            },
            [&] { return code.add(entry, bytes); });
        Value copied =
            code.select(isKept, code.constant(size), code.constant(0));
        scf::YieldOp::create(builder, loc,
                             ValueRange{next, code.add(at[1], copied)});
      });
  (void)loop;
}

/// Room for so many records; the last told is whether there is.
void BlockOutput::reserveRecords(Value kept, Value most, int64_t base,
                                 int64_t size) {
  OpBuilder &builder = code.builder;
  Value bytes = code.mul(most, code.constant(size));
  Value old = code.get(kept, base + PIKOIR_LOCAL_RECORDS);
  Value room = code.get(kept, base + PIKOIR_LOCAL_ROOM);
  Value count = code.get(kept, base + PIKOIR_LOCAL_COUNT);
  Value isSmall = code.compare(P::ugt, bytes, room);
  code.barrier();
  when(isFirst(), [&] {
    code.set(code.constant(1), sharedWords, told);
    when(isSmall, [&] {
      constexpr int64_t header = sizeof(pikoir_piece);
      Value more = code.add(bytes, bytes);
      more = code.both(code.add(more, code.constant(2 * header - 1)),
                       code.constant(-header));
      Value piece = code.take(grid.log, more, PIKOIR_PIECE_MEMORY);
      Value has = code.compare(P::ne, piece, code.constant(0));
      code.set(code.extend(has), sharedWords, told);
      when(has, [&] {
        code.set(code.add(piece, code.constant(header)), kept,
                 base + PIKOIR_LOCAL_RECORDS);
        code.set(code.sub(more, code.constant(header)), kept,
                 base + PIKOIR_LOCAL_ROOM);
      });
    });
  });
  code.barrier();
  Value now = code.get(kept, base + PIKOIR_LOCAL_RECORDS);
  when(code.compare(P::ne, old, now), [&] {
    Value end = toIndex(builder, code.loc, count);
    code.forEach(
        launch.getThreadIds().x, end, launch.getBlockSizeX(), [&](Value i) {
          Value offset =
              code.mul(toI64(builder, code.loc, i), code.constant(size));
          copyBytes(code.add(old, offset), code.add(now, offset), size);
        });
  });
}

void BlockOutput::keepRecords(Value mine, int64_t buffer, int64_t size) {
  int64_t words = buffer * PIKOIR_APPEND_WORDS;
  int64_t base = (buffer - 1) * PIKOIR_LOCAL_WORDS;
  Value kept = grid.kept, total;
  Value below = sumBelow(mine, total);
  Value count = code.get(kept, base + PIKOIR_LOCAL_COUNT);
  Value most = code.add(count, total);
  reserveRecords(kept, most, base, size);
  Value has =
      code.compare(P::ne, code.get(sharedWords, told), code.constant(0));
  when(has, [&] {
    Value to = code.add(code.get(kept, base + PIKOIR_LOCAL_RECORDS),
                        code.mul(code.add(count, below), code.constant(size)));
    copyRecords(code.get(grid.buffers, words + PIKOIR_APPEND_BEGIN),
                code.get(grid.buffers, words + PIKOIR_APPEND_CURSOR), to, size);
  });
  code.barrier();
  when(code.both(has, isFirst()),
       [&] { code.set(most, kept, base + PIKOIR_LOCAL_COUNT); });
  code.barrier();
}

void BlockOutput::keep(int64_t buffer, int64_t size) {
  int64_t words = buffer * PIKOIR_APPEND_WORDS;
  Value zero = code.constant(0);
  Value mine = code.get(grid.buffers, words + PIKOIR_APPEND_KEPT);
  when(code.meetAny(code.compare(P::ne, mine, zero)),
       [&] { keepRecords(mine, buffer, size); });
  code.set(code.get(grid.buffers, words + PIKOIR_APPEND_CURSOR), grid.buffers,
           words + PIKOIR_APPEND_BEGIN);
  code.set(zero, grid.buffers, words + PIKOIR_APPEND_KEPT);
}

void piko::createKeep(OpBuilder &builder, Location loc, const GridContext &grid,
                      int64_t buffer) {
  GridCode code(builder, loc);
  int64_t words = buffer * PIKOIR_APPEND_WORDS;
  Value last = code.get(grid.buffers, words + PIKOIR_APPEND_LAST);
  Value kind = code.add(last, code.constant(offsetof(pikoir_entry, kind)));
  Value is = createI32(builder, loc, PIKOIR_ENTRY_KEPT);
  Value isNew = code.compare(GridCode::P::ne, code.load(code.i32(), kind), is);
  code.when(isNew, [&] {
    code.store(is, kind);
    Value count = code.get(grid.buffers, words + PIKOIR_APPEND_KEPT);
    code.set(code.add(count, code.constant(1)), grid.buffers,
             words + PIKOIR_APPEND_KEPT);
  });
}

Value piko::createLocalBins(OpBuilder &builder, Operation *op,
                            const GridContext &grid, int64_t buffer) {
  GridCode code(builder, op->getLoc());
  auto pointer = LLVM::LLVMPointerType::get(builder.getContext());
  Value input;
  {
    auto launch = op->getParentOfType<gpu::LaunchOp>();
    OpBuilder entry = OpBuilder::atBlockBegin(&launch.getBody().front());
    Value bytes = createI64(entry, code.loc, sizeof(pikoir_input));
    input = LLVM::AllocaOp::create(entry, code.loc, pointer, entry.getI8Type(),
                                   bytes, /*alignment=*/8);
  }
  auto store = [&](Value value, int64_t offset) {
    LLVM::StoreOp::create(builder, code.loc, value,
                          createOffset(builder, code.loc, input, offset));
  };
  int64_t base = (buffer - 1) * PIKOIR_LOCAL_WORDS;
  store(code.get(grid.kept, base + PIKOIR_LOCAL_RECORDS),
        offsetof(pikoir_input, items));
  store(code.constant(0), offsetof(pikoir_input, order));
  // Its members are read after this.
  return createOffset(builder, code.loc, input, code.constant(0));
}

namespace {

struct FlushLowering : ContextPattern<FlushOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(FlushOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    GridContext &grid = *context.grid(op);
    BlockOutput output(rewriter, op, adaptor.getWords(), grid);
    output.publish();
    for (auto [i, edge] : llvm::enumerate(grid.locals))
      output.keep(i + 1, grid.recordBytes[i]);
    rewriter.eraseOp(op);
    return success();
  }
};

} // namespace

void piko::populateBlockOutputPatterns(const TypeConverter &converter,
                                       RewritePatternSet &patterns,
                                       LoweringContext &context) {
  patterns.add<FlushLowering>(converter, patterns.getContext(), context);
}
