// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lanes that read, or write, several fields of a record each: loads and stores
// of 16 bytes, of one lane each, whose words are transposed. A gather loads
// each word alone.

#include "PikoToLLVM/KernelLowering.h"
#include "PikoToLLVM/Records/RecordPieces.h"
#include "PikoToLLVM/Records/RecordRows.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

#include <map>

using namespace mlir;
using namespace piko;

std::array<Value, pieceWords>
piko::transposeBlocks(OpBuilder &builder, Location loc,
                      const std::array<Value, pieceWords> &rows) {
  int64_t lanes = cast<VectorType>(rows[0].getType()).getNumElements();
  // Of words p of the first vector and q of the second, in turn or in pairs.
  auto mix = [&](Value a, Value b, std::array<int64_t, 4> block) -> Value {
    SmallVector<int64_t> order;
    for (int64_t group = 0; group < lanes; group += pieceWords)
      for (int64_t word : block)
        order.push_back(word < pieceWords ? group + word
                                          : lanes + group + word - pieceWords);
    return vector::ShuffleOp::create(builder, loc, a, b, order);
  };
  Value low01 = mix(rows[0], rows[1], {0, 4, 1, 5}),
        high01 = mix(rows[0], rows[1], {2, 6, 3, 7}),
        low23 = mix(rows[2], rows[3], {0, 4, 1, 5}),
        high23 = mix(rows[2], rows[3], {2, 6, 3, 7});
  return {mix(low01, low23, {0, 1, 4, 5}), mix(low01, low23, {2, 3, 6, 7}),
          mix(high01, high23, {0, 1, 4, 5}), mix(high01, high23, {2, 3, 6, 7})};
}

namespace {

/// Where pieces of a record begin, in bytes, that have at least two of the
/// fields each. A piece does not go beyond the record.
SmallVector<int64_t> planPieces(ArrayRef<FieldAttr> fields, int64_t size) {
  SmallVector<int64_t> offsets, pieces;
  for (FieldAttr field : fields)
    offsets.push_back(field.getOffset());
  llvm::sort(offsets);
  for (size_t i = 0; i < offsets.size();) {
    int64_t begin = std::min(offsets[i], size - pieceSize);
    size_t next = i;
    while (next < offsets.size() &&
           offsets[next] + wordSize <= begin + pieceSize)
      ++next;
    if (begin < 0 || begin % wordSize != 0 || next == i)
      return {};
    if (next - i > 1)
      pieces.push_back(begin);
    i = next;
  }
  return pieces;
}

/// Where two words side by side begin, if the fields are that.
std::optional<int64_t> findPair(ArrayRef<FieldAttr> fields) {
  if (fields.size() != 2)
    return std::nullopt;
  int64_t a = fields[0].getOffset(), b = fields[1].getOffset();
  return std::abs(a - b) == wordSize ? std::optional(std::min(a, b))
                                     : std::nullopt;
}

/// Code for one access.
class RecordReader {
public:
  RecordReader(OpBuilder &builder, Location loc, Value addresses, Value mask,
               ArrayRef<FieldAttr> fields, TypeRange types)
      : builder(builder), loc(loc), addresses(addresses), mask(mask),
        fields(fields), types(types),
        lanes(cast<VectorType>(mask.getType()).getNumElements()) {}

  SmallVector<Value> gather();
  SmallVector<Value> readPieces(ArrayRef<int64_t> pieces);
  SmallVector<Value> readPair(int64_t begin);

private:
  /// The address of each lane's record.
  SmallVector<Value> getPlaces();
  Value gather(size_t i);
  Value shuffle(Value a, Value b, ArrayRef<int64_t> mask) {
    return vector::ShuffleOp::create(builder, loc, a, b, mask);
  }
  /// The words of lanes i, i + 4, ..., one piece after the other.
  Value join(ArrayRef<Value> parts);
  /// Word `i` of each lane's piece, for all i.
  std::array<Value, pieceWords> transpose(ArrayRef<Value> parts);

  OpBuilder &builder;
  Location loc;
  Value addresses, mask;
  ArrayRef<FieldAttr> fields;
  TypeRange types;
  int64_t lanes;
};

Value RecordReader::gather(size_t i) {
  auto type = cast<VectorType>(types[i]);
  Type pointers = LLVM::getVectorType(
      LLVM::LLVMPointerType::get(builder.getContext()), lanes);
  Value at = createOffset(
      builder, loc, LLVM::IntToPtrOp::create(builder, loc, pointers, addresses),
      fields[i].getOffset());
  Value none =
      arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
  return LLVM::masked_gather::create(builder, loc, type, at, mask, none,
                                     type.getElementTypeBitWidth() / 8);
}

SmallVector<Value> RecordReader::gather() {
  SmallVector<Value> values;
  for (size_t i = 0; i < fields.size(); ++i)
    values.push_back(gather(i));
  return values;
}

Value RecordReader::join(ArrayRef<Value> parts) {
  if (parts.size() == 1)
    return parts.front();
  Value a = join(parts.take_front(parts.size() / 2)),
        b = join(parts.drop_front(parts.size() / 2));
  int64_t words = parts.size() * pieceWords;
  return shuffle(a, b, llvm::to_vector(llvm::seq<int64_t>(0, words)));
}

std::array<Value, pieceWords> RecordReader::transpose(ArrayRef<Value> parts) {
  // Each group of four lanes is a block of 4x4 words.
  std::array<Value, pieceWords> rows;
  for (int64_t i = 0; i < pieceWords; ++i) {
    SmallVector<Value> row;
    for (int64_t lane = i; lane < lanes; lane += pieceWords)
      row.push_back(parts[lane]);
    rows[i] = join(row);
  }
  return transposeBlocks(builder, loc, rows);
}

SmallVector<Value> RecordReader::getPlaces() {
  Type pointer = LLVM::LLVMPointerType::get(builder.getContext());
  SmallVector<Value> places;
  for (int64_t lane = 0; lane < lanes; ++lane) {
    Value place = vector::ExtractOp::create(builder, loc, addresses, lane);
    places.push_back(LLVM::IntToPtrOp::create(builder, loc, pointer, place));
  }
  return places;
}

/// A load of both words for each lane.
SmallVector<Value> RecordReader::readPair(int64_t begin) {
  Type pair = builder.getI64Type();
  Value pairs =
      LLVM::PoisonOp::create(builder, loc, VectorType::get({lanes}, pair));
  for (auto [lane, place] : llvm::enumerate(getPlaces()))
    pairs = vector::InsertOp::create(
        builder, loc,
        LLVM::LoadOp::create(builder, loc, pair,
                             createOffset(builder, loc, place, begin),
                             wordSize),
        pairs, lane);
  Value words = vector::BitCastOp::create(
      builder, loc, VectorType::get({2 * lanes}, builder.getI32Type()), pairs);
  SmallVector<Value> values;
  for (auto [field, type] : llvm::zip(fields, types)) {
    SmallVector<int64_t> order;
    for (int64_t lane = 0; lane < lanes; ++lane)
      order.push_back(2 * lane + (field.getOffset() != begin));
    values.push_back(vector::BitCastOp::create(
        builder, loc, cast<VectorType>(type), shuffle(words, words, order)));
  }
  return values;
}

SmallVector<Value> RecordReader::readPieces(ArrayRef<int64_t> pieces) {
  auto pieceType = VectorType::get({pieceWords}, builder.getI32Type());
  SmallVector<Value> places = getPlaces();
  SmallVector<Value> values(fields.size());
  for (int64_t begin : pieces) {
    SmallVector<Value> parts;
    for (Value place : places)
      parts.push_back(LLVM::LoadOp::create(
          builder, loc, pieceType, createOffset(builder, loc, place, begin),
          wordSize));
    std::array<Value, pieceWords> words = transpose(parts);
    for (auto [i, field] : llvm::enumerate(fields)) {
      int64_t at = field.getOffset() - begin;
      if (!values[i] && at >= 0 && at + wordSize <= pieceSize)
        values[i] = vector::BitCastOp::create(
            builder, loc, cast<VectorType>(types[i]), words[at / wordSize]);
    }
  }
  for (size_t i = 0; i < fields.size(); ++i)
    if (!values[i])
      values[i] = gather(i);
  return values;
}

/// The addresses of lanes as integers of 64 bits.
static Value toIntegers(OpBuilder &builder, Location loc, Value addresses) {
  auto type = cast<VectorType>(addresses.getType());
  return arith::IndexCastOp::create(
      builder, loc, VectorType::get(type.getShape(), builder.getI64Type()),
      addresses);
}

/// The records at consecutive addresses, if they are few words each.
static std::optional<RecordRow> findRow(OpBuilder &builder, Location loc,
                                        const LoweringContext &context,
                                        LaneElementsOp elements,
                                        Value addresses, Value mask,
                                        int64_t size, int64_t fields) {
  int64_t lanes = cast<VectorType>(mask.getType()).getNumElements();
  if (!elements || !elements.getConsecutive() ||
      !isRecordRow(lanes, size, fields))
    return std::nullopt;
  Value first = vector::ExtractOp::create(builder, loc, addresses, 0);
  bool isBuffer = isa<BufferOp>(context.state(elements, elements.getState()));
  return RecordRow(builder, loc,
                   LLVM::IntToPtrOp::create(
                       builder, loc,
                       LLVM::LLVMPointerType::get(builder.getContext()), first),
                   size, mask, isBuffer);
}

struct LaneGetFieldsLowering : Lowering<LaneGetFieldsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(LaneGetFieldsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value mask = adaptor.getMask();
    Value addresses = toIntegers(rewriter, loc, adaptor.getAddresses());
    int64_t laneCount = cast<VectorType>(addresses.getType()).getNumElements();
    RecordOp record = context.record(op.getRecordAttr());
    SmallVector<FieldAttr> fields;
    bool areWords = true;
    for (auto [name, type] : llvm::zip(op.getFields(), op.getResultTypes())) {
      fields.push_back(record.getField(cast<StringAttr>(name).getValue()));
      areWords &= cast<VectorType>(type).getElementTypeBitWidth() == 32 &&
                  fields.back().getOffset() % wordSize == 0;
    }
    LaneElementsOp elements;
    if (areWords)
      elements = op.getAddresses().getDefiningOp<LaneElementsOp>();
    if (std::optional<RecordRow> row =
            findRow(rewriter, loc, context, elements, addresses, mask,
                    record.getSize(), fields.size())) {
      rewriter.replaceOp(op, readRow(rewriter, op, *row, fields));
      return success();
    }
    auto read = [&](OpBuilder &builder) {
      return readEach(builder, op, addresses, mask, fields, areWords,
                      record.getSize());
    };
    auto items = op.getAddresses().getDefiningOp<LaneItemsOp>();
    if (items && areWords && items->getBlock() == op->getBlock() &&
        !isa<VectorType>(items.getPosition().getType()) &&
        (record.getSize() == wordSize ||
         isRecordRow(laneCount, record.getSize(), fields.size())))
      rewriter.replaceOp(op, readItems(rewriter, op, items, mask, fields,
                                       record.getSize(), read));
    else
      rewriter.replaceOp(op, read(rewriter));
    return success();
  }

  /// The fields of records that lie anywhere.
  SmallVector<Value> readEach(OpBuilder &builder, LaneGetFieldsOp op,
                              Value addresses, Value mask,
                              ArrayRef<FieldAttr> fields, bool areWords,
                              int64_t size) const {
    Location loc = op.getLoc();
    int64_t laneCount = cast<VectorType>(addresses.getType()).getNumElements();
    std::optional<int64_t> pair = areWords ? findPair(fields) : std::nullopt;
    SmallVector<int64_t> pieces;
    if (areWords && !pair && laneCount % pieceWords == 0)
      pieces = planPieces(fields, size);
    if (pieces.empty() && !pair)
      return RecordReader(builder, loc, addresses, mask, fields,
                          op.getResultTypes())
          .gather();
    RecordReader reader(builder, loc,
                        chooseReadable(builder, loc, addresses, mask, size),
                        mask, fields, op.getResultTypes());
    return pair ? reader.readPair(*pair) : reader.readPieces(pieces);
  }

  /// Those of primitives at consecutive positions, which lie side by side where
  /// the bins have no order of their own.
  SmallVector<Value> readItems(
      ConversionPatternRewriter &rewriter, LaneGetFieldsOp op,
      LaneItemsOp items, Value mask, ArrayRef<FieldAttr> fields, int64_t size,
      llvm::function_ref<SmallVector<Value>(OpBuilder &)> readEach) const {
    Value bins = rewriter.getRemappedValue(items.getBins()),
          position = rewriter.getRemappedValue(items.getPosition());
    Value order = context.member(rewriter, bins, layout::order),
          first = context.member(rewriter, bins, layout::items);
    return llvm::to_vector_of<Value>(
        scf::IfOp::create(
            rewriter, op.getLoc(), isOrdered(rewriter, op.getLoc(), order),
            [&](OpBuilder &builder, Location loc) {
              scf::YieldOp::create(builder, loc, readEach(builder));
            },
            [&](OpBuilder &builder, Location loc) {
              RecordRow row(builder, loc,
                            entry(builder, loc, first, position, size), size,
                            mask, /*areMostlyAll=*/true);
              scf::YieldOp::create(builder, loc,
                                   readRow(builder, op, row, fields));
            })
            .getResults());
  }

  static SmallVector<Value> readRow(OpBuilder &builder, LaneGetFieldsOp op,
                                    RecordRow &row,
                                    ArrayRef<FieldAttr> fields) {
    SmallVector<int64_t> words;
    for (FieldAttr field : fields)
      words.push_back(field.getOffset() / wordSize);
    SmallVector<Value> values = row.read(words);
    for (auto [value, type] : llvm::zip(values, op.getResultTypes()))
      value = vector::BitCastOp::create(builder, op.getLoc(),
                                        cast<VectorType>(type), value);
    return values;
  }

  /// The addresses, and those of zeros for lanes that have none: loads of all
  /// lanes take no longer than branches around those of some.
  Value chooseReadable(OpBuilder &builder, Location loc, Value addresses,
                       Value mask, int64_t size) const {
    Value all = vector::ReductionOp::create(builder, loc,
                                            vector::CombiningKind::AND, mask);
    auto readable = scf::IfOp::create(
        builder, loc, all,
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(builder, loc, addresses);
        },
        [&](OpBuilder &builder, Location loc) {
          Value zeros = LLVM::AddressOfOp::create(
              builder, loc, pointer(builder), context.zeros(size));
          zeros = LLVM::PtrToIntOp::create(builder, loc, builder.getI64Type(),
                                           zeros);
          zeros = vector::BroadcastOp::create(builder, loc, addresses.getType(),
                                              zeros);
          Value chosen =
              arith::SelectOp::create(builder, loc, mask, addresses, zeros);
          scf::YieldOp::create(builder, loc, chosen);
        });
    return readable.getResult(0);
  }
};

/// Words that lie side by side, at most four.
struct Run {
  int64_t begin; ///< in bytes
  SmallVector<Value> words;
};

/// Code for one access of all lanes.
class RecordWriter {
public:
  RecordWriter(OpBuilder &builder, Location loc, Value addresses, Value mask)
      : builder(builder), loc(loc), addresses(addresses), mask(mask),
        lanes(cast<VectorType>(mask.getType()).getNumElements()) {}

  void scatter(Value value, FieldAttr field);
  void write(ArrayRef<Run> runs);

private:
  void store(Value value, Value place, int64_t offset) {
    LLVM::StoreOp::create(builder, loc, value,
                          createOffset(builder, loc, place, offset), wordSize);
  }
  /// The first three words of a piece; what follows them stays as it is.
  void storeThree(Value piece, Value place, int64_t offset);

  OpBuilder &builder;
  Location loc;
  Value addresses, mask;
  int64_t lanes;
};

void RecordWriter::storeThree(Value piece, Value place, int64_t offset) {
  auto type = VectorType::get({pieceWords}, builder.getI1Type());
  Value three = arith::ConstantOp::create(
      builder, loc,
      DenseElementsAttr::get(type, ArrayRef<bool>{true, true, true, false}));
  LLVM::MaskedStoreOp::create(builder, loc, piece,
                              createOffset(builder, loc, place, offset), three,
                              wordSize);
}

void RecordWriter::scatter(Value value, FieldAttr field) {
  Type pointers = LLVM::getVectorType(
      LLVM::LLVMPointerType::get(builder.getContext()), lanes);
  Value at = createOffset(
      builder, loc, LLVM::IntToPtrOp::create(builder, loc, pointers, addresses),
      field.getOffset());
  int64_t bits = cast<VectorType>(value.getType()).getElementTypeBitWidth();
  LLVM::masked_scatter::create(builder, loc, value, at, mask, bits / 8);
}

/// One lane after the other.
void RecordWriter::write(ArrayRef<Run> runs) {
  auto words = VectorType::get({lanes}, builder.getI32Type());
  Value none =
      arith::ConstantOp::create(builder, loc, builder.getZeroAttr(words));
  SmallVector<std::array<Value, pieceWords>> pieces;
  for (const Run &run : runs) {
    std::array<Value, pieceWords> rows;
    rows.fill(none);
    for (auto [row, word] : llvm::zip(rows, run.words))
      row = vector::BitCastOp::create(builder, loc, words, word);
    pieces.push_back(transposeBlocks(builder, loc, rows));
  }
  for (int64_t lane = 0; lane < lanes; ++lane) {
    Value address = vector::ExtractOp::create(builder, loc, addresses, lane);
    Value place = LLVM::IntToPtrOp::create(
        builder, loc, LLVM::LLVMPointerType::get(builder.getContext()),
        address);
    for (auto [run, piece] : llvm::zip(runs, pieces)) {
      Value vector = piece[lane % pieceWords];
      auto part = [&](int64_t from, int64_t count) -> Value {
        int64_t first = lane / pieceWords * pieceWords + from;
        return vector::ShuffleOp::create(
            builder, loc, vector, vector,
            llvm::to_vector(llvm::seq<int64_t>(first, first + count)));
      };
      int64_t count = run.words.size();
      if (count == 3)
        storeThree(part(0, pieceWords), place, run.begin);
      else
        store(part(0, count), place, run.begin);
    }
  }
}

struct LaneSetFieldsLowering : Lowering<LaneSetFieldsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(LaneSetFieldsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value mask = adaptor.getMask();
    Value addresses = toIntegers(rewriter, loc, adaptor.getAddresses());
    int64_t laneCount = cast<VectorType>(addresses.getType()).getNumElements();
    SmallVector<FieldAttr> fields = getFields(op);
    auto scatterAll = [&](OpBuilder &builder) {
      RecordWriter writer(builder, loc, addresses, mask);
      for (auto [value, field] : llvm::zip(adaptor.getValues(), fields))
        writer.scatter(value, field);
    };
    if (writeRow(rewriter, op, adaptor, addresses, fields)) {
      rewriter.eraseOp(op);
      return success();
    }
    SmallVector<Run> runs;
    if (laneCount % pieceWords == 0)
      runs = planRuns(fields, adaptor.getValues());
    if (runs.size() < fields.size()) {
      Value all = vector::ReductionOp::create(rewriter, loc,
                                              vector::CombiningKind::AND, mask);
      scf::IfOp::create(
          rewriter, loc, all,
          [&](OpBuilder &builder, Location loc) {
            RecordWriter(builder, loc, addresses, mask).write(runs);
            scf::YieldOp::create(builder, loc);
          },
          [&](OpBuilder &builder, Location loc) {
            scatterAll(builder);
            scf::YieldOp::create(builder, loc);
          });
    } else {
      scatterAll(rewriter);
    }
    rewriter.eraseOp(op);
    return success();
  }

private:
  /// Whether the records are a row, whose fields it has written.
  bool writeRow(OpBuilder &builder, LaneSetFieldsOp op, OpAdaptor adaptor,
                Value addresses, ArrayRef<FieldAttr> fields) const {
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    SmallVector<Value> words(record.getSize() / wordSize);
    Type type = VectorType::get(
        cast<VectorType>(addresses.getType()).getShape(), builder.getI32Type());
    for (auto [value, field] : llvm::zip(adaptor.getValues(), fields)) {
      if (cast<VectorType>(value.getType()).getElementTypeBitWidth() != 32 ||
          field.getOffset() % wordSize != 0)
        return false;
      words[field.getOffset() / wordSize] =
          vector::BitCastOp::create(builder, op.getLoc(), type, value);
    }
    std::optional<RecordRow> row =
        findRow(builder, op.getLoc(), context,
                op.getAddresses().getDefiningOp<LaneElementsOp>(), addresses,
                adaptor.getMask(), record.getSize(), fields.size());
    if (row)
      row->write(words);
    return row.has_value();
  }
  SmallVector<FieldAttr> getFields(LaneSetFieldsOp op) const {
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    SmallVector<FieldAttr> fields;
    for (Attribute name : op.getFields())
      fields.push_back(record.getField(cast<StringAttr>(name).getValue()));
    return fields;
  }

  /// As many as there are fields if these are no words.
  static SmallVector<Run> planRuns(ArrayRef<FieldAttr> fields,
                                   ValueRange values) {
    std::map<int64_t, Value> words;
    SmallVector<Run> runs(fields.size());
    for (auto [field, value] : llvm::zip(fields, values)) {
      if (cast<VectorType>(value.getType()).getElementTypeBitWidth() != 32 ||
          field.getOffset() % wordSize != 0)
        return runs;
      words[field.getOffset()] = value;
    }
    runs.clear();
    for (auto [offset, word] : words) {
      bool follows =
          !runs.empty() && runs.back().words.size() < pieceWords &&
          runs.back().begin + int64_t(runs.back().words.size()) * wordSize ==
              offset;
      if (!follows)
        runs.push_back({offset, {}});
      runs.back().words.push_back(word);
    }
    return runs;
  }
};

} // namespace

void piko::populateRecordsToLLVMPatterns(const TypeConverter &converter,
                                         RewritePatternSet &patterns,
                                         LoweringContext &context) {
  patterns.add<LaneGetFieldsLowering, LaneSetFieldsLowering>(
      converter, patterns.getContext(), context);
}
