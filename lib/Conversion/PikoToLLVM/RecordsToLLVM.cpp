// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lanes that read several fields of a record each: loads of 16 bytes, of one
// lane each, whose words are then transposed. A gather loads each word alone.

#include "KernelLowering.h"
#include "RecordPieces.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

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

private:
  Value gather(size_t i);
  Value shuffle(Value a, Value b, ArrayRef<int64_t> mask) {
    return vector::ShuffleOp::create(builder, loc, a, b, mask);
  }
  /// The words of lanes i, i + 4, ..., one piece behind the other.
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

SmallVector<Value> RecordReader::readPieces(ArrayRef<int64_t> pieces) {
  auto pieceType = VectorType::get({pieceWords}, builder.getI32Type());
  Type pointer = LLVM::LLVMPointerType::get(builder.getContext());
  SmallVector<Value> places;
  for (int64_t lane = 0; lane < lanes; ++lane) {
    Value place = vector::ExtractOp::create(builder, loc, addresses, lane);
    places.push_back(LLVM::IntToPtrOp::create(builder, loc, pointer, place));
  }
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

struct LaneGetFieldsLowering : Lowering<LaneGetFieldsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(LaneGetFieldsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value mask = adaptor.getMask();
    auto words = VectorType::get(cast<VectorType>(mask.getType()).getShape(),
                                 rewriter.getI64Type());
    Value addresses = arith::IndexCastOp::create(rewriter, loc, words,
                                                 adaptor.getAddresses());
    RecordOp record = context.record(op.getRecordAttr());
    SmallVector<FieldAttr> fields;
    bool areWords = true;
    for (auto [name, type] : llvm::zip(op.getFields(), op.getResultTypes())) {
      fields.push_back(record.getField(cast<StringAttr>(name).getValue()));
      areWords &= cast<VectorType>(type).getElementTypeBitWidth() == 32 &&
                  fields.back().getOffset() % wordSize == 0;
    }
    SmallVector<int64_t> pieces;
    if (areWords && words.getNumElements() % pieceWords == 0)
      pieces = planPieces(fields, record.getSize());
    if (pieces.empty()) {
      rewriter.replaceOp(op, RecordReader(rewriter, loc, addresses, mask,
                                          fields, op.getResultTypes())
                                 .gather());
      return success();
    }
    rewriter.replaceOp(op, RecordReader(rewriter, loc,
                                        chooseReadable(rewriter, loc, addresses,
                                                       mask, record.getSize()),
                                        mask, fields, op.getResultTypes())
                               .readPieces(pieces));
    return success();
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

} // namespace

void piko::populateRecordsToLLVMPatterns(const TypeConverter &converter,
                                         RewritePatternSet &patterns,
                                         LoweringContext &context) {
  patterns.add<LaneGetFieldsLowering>(converter, patterns.getContext(),
                                      context);
}
