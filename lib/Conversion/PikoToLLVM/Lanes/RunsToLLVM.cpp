// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lanes that read elements side by side: one load of all for each lane, which
// are brought apart. A gather would load each one alone.

#include "PikoToLLVM/KernelLowering.h"
#include "PikoToLLVM/Lanes/LaneIndices.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

namespace {

struct GatherRunLowering : ContextPattern<GatherRunOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(GatherRunOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    CodeBuilder at(rewriter, op.getLoc());
    Value index = adaptor.getIndex();
    // The first elements are there, as some lane has as many.
    Value first = arith::ConstantOp::create(
        rewriter, op.getLoc(), rewriter.getZeroAttr(index.getType()));
    index = at.select(adaptor.getMask(), index, first);
    auto type = cast<VectorType>(op.getResult(0).getType());
    Value data = context.view(rewriter, op, op.getState()).data;
    Value runs =
        load(at, data, extractIndices(at, index), op.getNumResults(), type);
    rewriter.replaceOp(op, split(at, runs, op.getNumResults(), type));
    return success();
  }

private:
  /// Each lane's elements, as an integer.
  static Value load(CodeBuilder at, Value data, ArrayRef<Value> indices,
                    int64_t count, VectorType type) {
    OpBuilder &builder = at.builder;
    Location loc = at.loc;
    constexpr int64_t byteBits = 8;
    int64_t bits = type.getElementTypeBitWidth();
    Type element = builder.getIntegerType(bits),
         run = builder.getIntegerType(count * bits);
    SmallVector<Value> runs;
    for (Value index : indices) {
      Value address = LLVM::GEPOp::create(builder, loc, data.getType(), element,
                                          data, ArrayRef<LLVM::GEPArg>{index});
      runs.push_back(
          LLVM::LoadOp::create(builder, loc, run, address, bits / byteBits));
    }
    VectorType runsType = VectorType::get({type.getNumElements()}, run);
    return count * bits < wordBits ? packNarrow(at, runs, runsType)
                                   : pack(at, runs, runsType);
  }

  static Value pack(CodeBuilder at, ArrayRef<Value> numbers, VectorType type) {
    Value packed = LLVM::PoisonOp::create(at.builder, at.loc, type);
    for (auto [i, number] : llvm::enumerate(numbers))
      packed = vector::InsertOp::create(at.builder, at.loc, number, packed, i);
    return packed;
  }

  /// To insert a byte takes vectors' units twice; shifts are done elsewhere.
  static Value packNarrow(CodeBuilder at, ArrayRef<Value> numbers,
                          VectorType type) {
    OpBuilder &builder = at.builder;
    Location loc = at.loc;
    constexpr int64_t most = 64;
    int64_t bits = type.getElementTypeBitWidth(),
            together = std::min(most, type.getNumElements() * bits);
    Type wide = builder.getIntegerType(together);
    SmallVector<Value> packed;
    for (auto [i, number] : llvm::enumerate(numbers)) {
      Value part = arith::ExtUIOp::create(builder, loc, wide, number);
      int64_t after = int64_t(i) * bits % together;
      if (after == 0) {
        packed.push_back(part);
        continue;
      }
      Value distance = arith::ConstantOp::create(
          builder, loc, builder.getIntegerAttr(wide, after));
      part = arith::ShLIOp::create(builder, loc, part, distance);
      packed.back() = at.either(packed.back(), part);
    }
    return vector::BitCastOp::create(
        builder, loc, type,
        pack(at, packed, VectorType::get({int64_t(packed.size())}, wide)));
  }

  /// Words of 32 bits of all lanes, of runs of as many bits or more.
  static SmallVector<Value> splitWords(CodeBuilder at, Value runs) {
    auto type = cast<VectorType>(runs.getType());
    int64_t lanes = type.getNumElements(),
            count = type.getElementTypeBitWidth() / wordBits;
    if (count <= 1)
      return {runs};
    Value all = vector::BitCastOp::create(
        at.builder, at.loc,
        VectorType::get({lanes * count}, at.builder.getI32Type()), runs);
    SmallVector<Value> words;
    for (int64_t i = 0; i < count; ++i) {
      SmallVector<int64_t> order;
      for (int64_t lane = 0; lane < lanes; ++lane)
        order.push_back(lane * count + i);
      words.push_back(
          vector::ShuffleOp::create(at.builder, at.loc, all, all, order));
    }
    return words;
  }

  /// The elements of all lanes, first to last.
  static SmallVector<Value> split(CodeBuilder at, Value runs, int64_t count,
                                  VectorType type) {
    OpBuilder &builder = at.builder;
    Location loc = at.loc;
    SmallVector<Value> words = splitWords(at, runs), values;
    auto word = cast<VectorType>(words.front().getType());
    int64_t bits = type.getElementTypeBitWidth(),
            inWord = word.getElementTypeBitWidth() / bits;
    VectorType element = type.clone(builder.getIntegerType(bits));
    for (int64_t i = 0; i < count; ++i) {
      Value value = words[i / inWord];
      if (int64_t after = i % inWord * bits) {
        Value distance = arith::ConstantOp::create(
            builder, loc,
            DenseElementsAttr::get(
                word, builder.getIntegerAttr(word.getElementType(), after)));
        value = arith::ShRUIOp::create(builder, loc, value, distance);
      }
      if (element != word)
        value = arith::TruncIOp::create(builder, loc, element, value);
      values.push_back(element == type ? value
                                       : arith::BitcastOp::create(builder, loc,
                                                                  type, value));
    }
    return values;
  }

  static constexpr int64_t wordBits = 32;
};

} // namespace

void piko::populateRunsToLLVMPatterns(const TypeConverter &converter,
                                      RewritePatternSet &patterns,
                                      LoweringContext &context) {
  patterns.add<GatherRunLowering>(converter, patterns.getContext(), context);
}
