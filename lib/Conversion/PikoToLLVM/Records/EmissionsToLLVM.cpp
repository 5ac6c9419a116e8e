// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lanes emit: their records are transposed into pieces of 16 bytes, and
// stored lane by lane where the number of records before them says. What a lane
// stores that emits nothing, the next one writes over: no branch tells them
// apart.

#include "PikoToLLVM/KernelLowering.h"
#include "PikoToLLVM/Lanes/LaneBits.h"
#include "PikoToLLVM/Records/RecordPieces.h"
#include "PikoToLLVM/Records/WriterPaths.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "pikort/emission.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

Value piko::createBits(OpBuilder &builder, Location loc, Value mask) {
  int64_t lanes = cast<VectorType>(mask.getType()).getNumElements();
  Type word = builder.getIntegerType(lanes);
  Value bits = vector::ExtractOp::create(
      builder, loc,
      vector::BitCastOp::create(builder, loc, VectorType::get({1}, word), mask),
      ArrayRef<int64_t>{0});
  return arith::ExtUIOp::create(builder, loc, builder.getI64Type(), bits);
}

Value piko::createLaneOffset(OpBuilder &builder, Location loc, Value bits,
                             int64_t lane, int64_t bytes) {
  Value bit = arith::AndIOp::create(
      builder, loc,
      arith::ShRUIOp::create(builder, loc, bits, createI64(builder, loc, lane)),
      createI64(builder, loc, 1));
  return arith::MulIOp::create(builder, loc, bit,
                               createI64(builder, loc, bytes));
}

namespace {

/// The records of lanes as pieces.
class LaneRecords {
public:
  LaneRecords(OpBuilder &builder, Location loc, LoweringContext &context,
              RecordOp record, ValueRange values);
  void store(int64_t lane, Value address);
  /// All vectors, one after the other.
  void storeVectors(Value address);

private:
  /// Word `i` of each lane's record.
  Value makeWord(int64_t i, RecordOp record, ValueRange values);
  void store(Value value, Value address);
  /// What a number has of a word, in its place there.
  Value getPart(Value number, int64_t offset, int64_t word);

  OpBuilder &builder;
  Location loc;
  ArrayAttr tag;
  VectorType words;
  /// Vector i of a piece has those of lanes i, i + 4, ...
  SmallVector<std::array<Value, pieceWords>> pieces;
};

} // namespace

LaneRecords::LaneRecords(OpBuilder &builder, Location loc,
                         LoweringContext &context, RecordOp record,
                         ValueRange values)
    : builder(builder), loc(loc), tag(context.tags.record()),
      words(cast<VectorType>(values.front().getType())
                .clone(builder.getI32Type())) {
  for (int64_t begin = 0; begin < record.getSize(); begin += pieceSize) {
    std::array<Value, pieceWords> rows;
    for (int64_t i = 0; i < pieceWords; ++i)
      rows[i] = makeWord(begin / wordSize + i, record, values);
    pieces.push_back(transposeBlocks(builder, loc, rows));
  }
}

Value LaneRecords::getPart(Value number, int64_t offset, int64_t word) {
  auto type = cast<VectorType>(number.getType());
  int64_t bytes = type.getElementTypeBitWidth() / 8;
  auto bits = type.clone(builder.getIntegerType(8 * bytes));
  if (type != bits)
    number = arith::BitcastOp::create(builder, loc, bits, number);
  auto shift = [&](auto tag, Value value, int64_t by) -> Value {
    using Op = decltype(tag);
    auto vector = cast<VectorType>(value.getType());
    auto amount = DenseElementsAttr::get(
        vector, builder.getIntegerAttr(vector.getElementType(), 8 * by));
    return by == 0 ? value
                   : Op::create(builder, loc, value,
                                arith::ConstantOp::create(builder, loc, amount))
                         .getResult();
  };
  int64_t begin = offset - word * wordSize;
  if (bytes < wordSize)
    return shift(arith::ShLIOp(),
                 arith::ExtUIOp::create(builder, loc, words, number), begin);
  if (bytes == wordSize)
    return number;
  return arith::TruncIOp::create(builder, loc, words,
                                 shift(arith::ShRUIOp(), number, -begin));
}

Value LaneRecords::makeWord(int64_t i, RecordOp record, ValueRange values) {
  Value word;
  for (auto [value, offset] : llvm::zip(values, record.getElementOffsets())) {
    int64_t bytes =
        cast<VectorType>(value.getType()).getElementTypeBitWidth() / 8;
    if (offset >= (i + 1) * wordSize || offset + bytes <= i * wordSize)
      continue;
    Value part = getPart(value, offset, i);
    word = word ? arith::OrIOp::create(builder, loc, word, part).getResult()
                : part;
  }
  if (!word) // It pads.
    word = arith::ConstantOp::create(builder, loc, builder.getZeroAttr(words));
  return word;
}

void LaneRecords::store(Value value, Value address) {
  LLVM::StoreOp::create(builder, loc, value, address, wordSize)
      .setTBAATags(tag);
}

void LaneRecords::store(int64_t lane, Value address) {
  for (auto [i, piece] : llvm::enumerate(pieces)) {
    Value vector = piece[lane % pieceWords];
    SmallVector<int64_t> mine;
    for (int64_t word = 0; word < pieceWords; ++word)
      mine.push_back(lane / pieceWords * pieceWords + word);
    Value part = vector::ShuffleOp::create(builder, loc, vector, vector, mine);
    store(part, createOffset(builder, loc, address, int64_t(i) * pieceSize));
  }
}

void LaneRecords::storeVectors(Value address) {
  int64_t offset = 0;
  for (const auto &piece : pieces)
    for (Value vector : piece) {
      store(vector, createOffset(builder, loc, address, offset));
      offset += words.getNumElements() * wordSize;
    }
}

namespace {

struct LaneAppendLowering : Lowering<LaneAppendOp> {
  using Lowering::Lowering;

  LogicalResult
  matchAndRewrite(LaneAppendOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    int64_t lanes =
        cast<VectorType>(op.getMasks().front().getType()).getNumElements();
    LaneEmissions emissions{int64_t(op.getPort()), lanes, {}, {}};
    Value any;
    for (Value mask : adaptor.getMasks()) {
      emissions.bits.push_back(createBits(rewriter, loc, mask));
      any =
          any ? arith::OrIOp::create(rewriter, loc, any, emissions.bits.back())
                    .getResult()
              : emissions.bits.back();
    }
    CodeBuilder code(rewriter, loc);
    code.when(
        code.compare(CodeBuilder::P::ne, any, createI64(rewriter, loc, 0)),
        [&] {
          storeRecords(rewriter, op, adaptor, emissions);
          commit(rewriter, op, adaptor, emissions);
        });
    rewriter.eraseOp(op);
    return success();
  }

private:
  void storeRecords(OpBuilder &builder, LaneAppendOp op, OpAdaptor adaptor,
                    const LaneEmissions &emissions) const {
    Location loc = op.getLoc();
    RecordOp record = context.record(op.getRecordAttr());
    size_t numbers = record.getElementOffsets().size();
    SmallVector<LaneRecords> records;
    for (size_t i = 0; i < emissions.bits.size(); ++i)
      records.emplace_back(builder, loc, context, record,
                           adaptor.getValues().slice(i * numbers, numbers));
    // The last piece may go beyond the last record.
    int64_t beyond = llvm::divideCeil(pieceSize, record.getSize());
    int64_t most = emissions.lanes * int64_t(records.size()) + beyond;
    Value at =
        context
            .call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_reserve_inline),
                  {adaptor.getWriter(), createI32(builder, loc, emissions.port),
                   createI64(builder, loc, most)})
            .getResult();
    for (int64_t lane = 0; lane < emissions.lanes; ++lane)
      for (auto [one, bits] : llvm::zip(records, emissions.bits)) {
        one.store(lane, at);
        at = createOffset(
            builder, loc, at,
            createLaneOffset(builder, loc, bits, lane, record.getSize()));
      }
  }

  void commit(OpBuilder &builder, LaneAppendOp op, OpAdaptor adaptor,
              LaneEmissions &emissions) const {
    Location loc = op.getLoc();
    if (!op.getStage())
      return createAppendLanes(builder, loc, context, adaptor.getWriter(),
                               emissions);
    auto words = VectorType::get({emissions.lanes}, builder.getI64Type());
    auto toWords = [&](Value lanes) -> Value {
      return arith::IndexCastOp::create(builder, loc, words, lanes);
    };
    for (Value bin : adaptor.getBins())
      emissions.buckets.push_back(toWords(bin));
    if (!adaptor.getTiles().empty()) {
      CodeBuilder code(builder, loc);
      Value tiles = vector::BroadcastOp::create(
          builder, loc, words,
          createTileCount(builder, op, op.getStageAttr(), context));
      for (auto [bucket, tile] :
           llvm::zip(emissions.buckets, adaptor.getTiles()))
        bucket = code.add(code.mul(bucket, tiles), toWords(tile));
    }
    createPlaceLanes(builder, loc, context, adaptor.getWriter(), emissions,
                     isLocalEdge(op, op.getPort(), op.getStageAttr(), context));
  }
};

/// Where the bytes of a memref are.
Value createPointer(OpBuilder &builder, Location loc, Value memory) {
  Value address =
      memref::ExtractAlignedPointerAsIndexOp::create(builder, loc, memory);
  return LLVM::IntToPtrOp::create(
      builder, loc, LLVM::LLVMPointerType::get(builder.getContext()),
      toI64(builder, loc, address));
}

/// A vector of a piece of four lanes after the other: lane i has its part in
/// vector i % 4, as that which follows those of i / 4 others.
struct StoreRecordsLowering : Lowering<StoreRecordsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(StoreRecordsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    RecordOp record = context.record(op.getRecordAttr());
    LaneRecords(rewriter, loc, context, record, adaptor.getValues())
        .storeVectors(createPointer(rewriter, loc, op.getMemory()));
    rewriter.eraseOp(op);
    return success();
  }
};

struct AppendRecordLowering : Lowering<AppendRecordOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(AppendRecordOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    RecordOp record = context.record(op.getPrim().getType().getRecord());
    Value room =
        context
            .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_append_inline),
                  {adaptor.getWriter(), createI32(rewriter, loc, op.getPort())})
            .getResult();
    CodeBuilder code(rewriter, loc);
    Value lane = toI64(rewriter, loc, op.getLane());
    Value group = arith::ShRUIOp::create(rewriter, loc, lane,
                                         createI64(rewriter, loc, 2));
    Value vector = code.both(lane, createI64(rewriter, loc, pieceWords - 1));
    int64_t vectorSize = op.getLanes() * wordSize;
    Value from = createOffset(
        rewriter, loc, createPointer(rewriter, loc, op.getMemory()),
        code.add(code.mul(vector, createI64(rewriter, loc, vectorSize)),
                 code.mul(group, createI64(rewriter, loc, pieceSize))));
    for (int64_t begin = 0; begin < record.getSize(); begin += pieceSize) {
      int64_t size = std::min(pieceSize, record.getSize() - begin);
      auto copy = LLVM::MemcpyOp::create(
          rewriter, loc, createOffset(rewriter, loc, room, begin),
          createOffset(rewriter, loc, from, begin * op.getLanes()),
          createI64(rewriter, loc, size), /*isVolatile=*/false);
      copy.setTBAATags(context.tags.record());
    }
    rewriter.replaceOp(op, room);
    return success();
  }
};

} // namespace

void piko::populateEmissionsToLLVMPatterns(const TypeConverter &converter,
                                           RewritePatternSet &patterns,
                                           LoweringContext &context) {
  patterns.add<LaneAppendLowering, StoreRecordsLowering, AppendRecordLowering>(
      converter, patterns.getContext(), context);
}
