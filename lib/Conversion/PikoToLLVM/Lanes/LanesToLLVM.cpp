// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Access to state and to primitives by the lanes of a vector.

#include "PikoToLLVM/KernelLowering.h"
#include "PikoToLLVM/Lanes/LaneAddresses.h"
#include "PikoToLLVM/Lanes/LaneIndices.h"
#include "PikoToLLVM/Records/RecordPieces.h"
#include "PikoToLLVM/Records/RecordRows.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Conversion/Permutations.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

namespace {

/// The word of its records that an access to a row of them is to.
struct RowWord {
  Value first; ///< the address of the first record
  int64_t size, number;
};

template <typename OpT> struct LaneLowering : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  using ContextPattern<OpT>::context;

protected:
  std::optional<RowWord> findRowWord(OpBuilder &builder, OpT op,
                                     typename OpT::Adaptor adaptor,
                                     VectorType lanes) const {
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    int64_t offset = record.getField(op.getField()).getOffset();
    if (!op.getConsecutive() || !op.getElements().empty() ||
        lanes.getElementTypeBitWidth() != 32 || offset % wordSize != 0 ||
        !isRecordRow(lanes.getNumElements(), record.getSize(), /*fields=*/1))
      return std::nullopt;
    StateView &view = context.view(builder, op, op.getState());
    Value start =
        computeLaneOffset(builder, op.getLoc(), view, adaptor.getIndices(),
                          record.getSize(), lanes.getNumElements());
    return RowWord{createOffset(builder, op.getLoc(), view.data, start),
                   record.getSize(), offset / wordSize};
  }

  LaneAddresses address(OpBuilder &builder, OpT op,
                        typename OpT::Adaptor adaptor, VectorType lanes) const {
    Location loc = op.getLoc();
    StateView &view = context.view(builder, op, op.getState());
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    FieldAttr field = record.getField(op.getField());
    Value offset = computeLaneOffset(builder, loc, view, adaptor.getIndices(),
                                     record.getSize(), lanes.getNumElements());
    return createLaneAddresses(
        builder, loc,
        createFieldAddress(builder, loc, view.data, field,
                           adaptor.getElements()),
        offset, op.getConsecutive() ? record.getSize() : 0, lanes);
  }
};

struct GatherLowering : LaneLowering<GatherOp> {
  using LaneLowering::LaneLowering;
  LogicalResult
  matchAndRewrite(GatherOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    auto type = cast<VectorType>(op.getResult().getType());
    if (std::optional<RowWord> word =
            findRowWord(rewriter, op, adaptor, type)) {
      RecordRow row(rewriter, loc, word->first, word->size, adaptor.getMask(),
                    isa<BufferOp>(context.state(op, op.getState())));
      rewriter.replaceOpWithNewOp<vector::BitCastOp>(
          op, type, row.read({word->number}).front());
      return success();
    }
    LaneAddresses from = address(rewriter, op, adaptor, type);
    uint32_t alignment = type.getElementTypeBitWidth() / 8;
    Value none =
        arith::ConstantOp::create(rewriter, loc, rewriter.getZeroAttr(type));
    if (from.first)
      rewriter.replaceOp(
          op, LLVM::MaskedLoadOp::create(rewriter, loc, type, from.first,
                                         adaptor.getMask(), none, alignment));
    else
      rewriter.replaceOp(
          op, LLVM::masked_gather::create(rewriter, loc, type, from.each,
                                          adaptor.getMask(), none, alignment));
    return success();
  }
};

struct ScatterLowering : LaneLowering<ScatterOp> {
  using LaneLowering::LaneLowering;
  LogicalResult
  matchAndRewrite(ScatterOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    auto type = cast<VectorType>(op.getValue().getType());
    if (std::optional<RowWord> word =
            findRowWord(rewriter, op, adaptor, type)) {
      SmallVector<Value> words(word->size / wordSize);
      words[word->number] = vector::BitCastOp::create(
          rewriter, loc, type.clone(rewriter.getI32Type()), adaptor.getValue());
      RecordRow(rewriter, loc, word->first, word->size, adaptor.getMask(),
                isa<BufferOp>(context.state(op, op.getState())))
          .write(words);
      rewriter.eraseOp(op);
      return success();
    }
    LaneAddresses to = address(rewriter, op, adaptor, type);
    uint32_t alignment = type.getElementTypeBitWidth() / 8;
    constexpr uint32_t leastScattered = 4;
    if (to.first)
      LLVM::MaskedStoreOp::create(rewriter, loc, adaptor.getValue(), to.first,
                                  adaptor.getMask(), alignment);
    else if (alignment >= leastScattered)
      LLVM::masked_scatter::create(rewriter, loc, adaptor.getValue(), to.each,
                                   adaptor.getMask(), alignment);
    else
      storeNarrow(rewriter, op, adaptor, to.each, alignment);
    rewriter.eraseOp(op);
    return success();
  }

private:
  /// There is no scatter of fewer than 32 bits: LLVM has a branch for each
  /// lane, which all of them do not need.
  void storeNarrow(ConversionPatternRewriter &rewriter, ScatterOp op,
                   OpAdaptor adaptor, Value addresses,
                   uint32_t alignment) const {
    Location loc = op.getLoc();
    Value value = adaptor.getValue(), mask = adaptor.getMask();
    Value all = vector::ReductionOp::create(rewriter, loc,
                                            vector::CombiningKind::AND, mask);
    Value words = findWords(op);
    std::optional<SharedIndex> split;
    auto lower = [&](Value value) { return rewriter.getRemappedValue(value); };
    if (words)
      split = splitIndex({rewriter, loc}, words, op, lower);
    Value index = words ? lower(words) : words;
    Value data = context.view(rewriter, op, op.getState()).data;
    Type element = cast<VectorType>(value.getType()).getElementType();
    auto storeAll = [&](OpBuilder &builder, Location loc) {
      SmallVector<Value> places =
          index ? addressLanes({builder, loc}, data, element, index, split)
                : SmallVector<Value>();
      int64_t lanes = cast<VectorType>(mask.getType()).getNumElements();
      for (int64_t lane = 0; lane < lanes; ++lane) {
        Value to =
            index ? places[lane]
                  : LLVM::ExtractElementOp::create(
                        builder, loc, addresses, createI64(builder, loc, lane));
        LLVM::StoreOp::create(
            builder, loc, vector::ExtractOp::create(builder, loc, value, lane),
            to, alignment);
      }
      scf::YieldOp::create(builder, loc);
    };
    auto storeSome = [&](OpBuilder &builder, Location loc) {
      LLVM::masked_scatter::create(builder, loc, value, addresses, mask,
                                   alignment);
      scf::YieldOp::create(builder, loc);
    };
    scf::IfOp::create(rewriter, loc, all, storeAll, storeSome);
  }

  /// The address of each lane's element.
  static SmallVector<Value>
  addressLanes(CodeBuilder at, Value data, Type element, Value index,
               const std::optional<SharedIndex> &split) {
    auto address = [&](Value from, Value index) -> Value {
      return LLVM::GEPOp::create(at.builder, at.loc, data.getType(), element,
                                 from, ArrayRef<LLVM::GEPArg>{index});
    };
    SmallVector<Value> places;
    for (Value own : extractIndices(at, split ? split->lanes : index)) {
      Value place = address(data, own);
      places.push_back(split ? address(place, split->shared) : place);
    }
    return places;
  }

  /// The index of 32 bits that elements of one number have; or null.
  Value findWords(ScatterOp op) const {
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    auto type = cast<VectorType>(op.getValue().getType());
    constexpr int64_t byteBits = 8;
    if (op.getIndices().size() != 1 || op.getConsecutive() ||
        record.getSize() * byteBits != type.getElementTypeBitWidth())
      return {};
    auto cast = op.getIndices().front().getDefiningOp<arith::IndexCastOp>();
    auto words = cast ? dyn_cast<VectorType>(cast.getIn().getType()) : nullptr;
    return words && words.getElementType().isInteger(32) ? cast.getIn()
                                                         : Value();
  }
};

/// Positions, or those from one on, as numbers of 64 bits.
Value countPositions(CodeBuilder at, Value position, VectorType words) {
  Location loc = at.loc;
  if (isa<VectorType>(position.getType()))
    return arith::IndexCastOp::create(at.builder, loc, words, position);
  Value first = toI64(at.builder, loc, position);
  auto steps = llvm::to_vector(llvm::seq<int64_t>(0, words.getNumElements()));
  return at.add(vector::BroadcastOp::create(at.builder, loc, words, first),
                arith::ConstantOp::create(
                    at.builder, loc, DenseIntElementsAttr::get(words, steps)));
}

struct LaneItemsLowering : Lowering<LaneItemsOp> {
  using Lowering::Lowering;

  /// The numbers of the primitives at positions of bins that have an order.
  Value readOrder(CodeBuilder at, Value order, Value position, Value mask,
                  VectorType words) const {
    OpBuilder &builder = at.builder;
    auto type = VectorType::get(words.getShape(), builder.getI32Type());
    constexpr uint32_t size = sizeof(uint32_t);
    Value none =
        arith::ConstantOp::create(builder, at.loc, builder.getZeroAttr(type));
    Value numbers;
    if (isa<VectorType>(position.getType()))
      numbers = LLVM::masked_gather::create(
          builder, at.loc, type,
          LLVM::GEPOp::create(
              builder, at.loc,
              LLVM::getVectorType(order.getType(), words.getNumElements()),
              type.getElementType(), order,
              ArrayRef<LLVM::GEPArg>{countPositions(at, position, words)}),
          mask, none, size);
    else
      numbers = LLVM::MaskedLoadOp::create(
          builder, at.loc, type, entry(builder, at.loc, order, position, size),
          mask, none, size);
    return arith::ExtUIOp::create(builder, at.loc, words, numbers);
  }

  /// Asks for primitives that lie after those of the lanes: gathers of one
  /// field after the other are not foreseen as a stream.
  void prefetch(OpBuilder &builder, Location loc, Value items, Value position,
                int64_t lanes, int64_t size) const {
    constexpr int64_t vectorsAhead = 4, largest = 1024;
    if (isa<VectorType>(position.getType()) || lanes * size > largest)
      return;
    CodeBuilder at(builder, loc);
    Value first =
        at.mul(toI64(builder, loc, position), createI64(builder, loc, size));
    for (int64_t i = 0; i < lanes * size; i += lineSize) {
      Value offset = at.add(
          first, createI64(builder, loc, vectorsAhead * lanes * size + i));
      createPrefetch(builder, loc, createOffset(builder, loc, items, offset),
                     1);
    }
  }

  LogicalResult
  matchAndRewrite(LaneItemsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    CodeBuilder at(rewriter, loc);
    Value bins = adaptor.getBins(), position = adaptor.getPosition();
    auto words =
        VectorType::get(cast<VectorType>(op.getResult().getType()).getShape(),
                        rewriter.getI64Type());
    Value order = context.member(rewriter, bins, layout::order);
    RecordOp record = context.record(op.getBins().getType().getRecord());
    Value items = context.member(rewriter, bins, layout::items);
    auto numbers = scf::IfOp::create(
        rewriter, loc, isOrdered(rewriter, loc, order),
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(builder, loc,
                               readOrder({builder, loc}, order, position,
                                         adaptor.getMask(), words));
        },
        [&](OpBuilder &builder, Location loc) {
          prefetch(builder, loc, items, position, words.getNumElements(),
                   record.getSize());
          scf::YieldOp::create(builder, loc,
                               countPositions({builder, loc}, position, words));
        });
    items =
        LLVM::PtrToIntOp::create(rewriter, loc, rewriter.getI64Type(), items);
    auto splat = [&](Value number) {
      return vector::BroadcastOp::create(rewriter, loc, words, number);
    };
    Value size = createI64(rewriter, loc, record.getSize());
    rewriter.replaceOpWithNewOp<arith::IndexCastOp>(
        op, op.getResult().getType(),
        at.add(at.mul(numbers.getResult(0), splat(size)), splat(items)));
    return success();
  }
};

struct LaneGetLowering : Lowering<LaneGetOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(LaneGetOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    auto type = cast<VectorType>(op.getResult().getType());
    auto words = VectorType::get(type.getShape(), rewriter.getI64Type());
    Value addresses = arith::IndexCastOp::create(rewriter, loc, words,
                                                 adaptor.getAddresses());
    addresses = LLVM::IntToPtrOp::create(
        rewriter, loc,
        LLVM::getVectorType(pointer(rewriter), type.getNumElements()),
        addresses);
    RecordOp record = context.record(op.getRecordAttr());
    addresses = createFieldAddress(rewriter, loc, addresses,
                                   record.getField(op.getField()),
                                   adaptor.getElements());
    Value none =
        arith::ConstantOp::create(rewriter, loc, rewriter.getZeroAttr(type));
    rewriter.replaceOp(
        op, LLVM::masked_gather::create(rewriter, loc, type, addresses,
                                        adaptor.getMask(), none,
                                        type.getElementTypeBitWidth() / 8));
    return success();
  }
};

struct LaneElementsLowering : Lowering<LaneElementsOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(LaneElementsOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    StateView &view = context.view(rewriter, op, op.getState());
    RecordOp record =
        context.record(getStateRecord(context.state(op, op.getState())));
    auto type = cast<VectorType>(op.getAddresses().getType());
    auto words = VectorType::get(type.getShape(), rewriter.getI64Type());
    auto widen = [&](Value number) -> Value {
      return isa<VectorType>(number.getType())
                 ? number
                 : vector::BroadcastOp::create(rewriter, loc, words, number)
                       .getResult();
    };
    Value offset = computeLaneOffset(rewriter, loc, view, adaptor.getIndices(),
                                     record.getSize(), type.getNumElements());
    if (op.getConsecutive()) {
      SmallVector<int64_t> steps;
      for (int64_t lane = 0; lane < type.getNumElements(); ++lane)
        steps.push_back(lane * record.getSize());
      offset =
          CodeBuilder(rewriter, loc)
              .add(widen(offset),
                   arith::ConstantOp::create(
                       rewriter, loc, DenseIntElementsAttr::get(words, steps)));
    }
    Value first = LLVM::PtrToIntOp::create(rewriter, loc, rewriter.getI64Type(),
                                           view.data);
    rewriter.replaceOpWithNewOp<arith::IndexCastOp>(
        op, type, CodeBuilder(rewriter, loc).add(widen(offset), widen(first)));
    return success();
  }
};

/// Permutations move bits: what has a lane, as integers of bytes.
template <class Op> struct MoveLowering : Lowering<Op> {
  using Lowering<Op>::Lowering;

  static Value toBits(OpBuilder &builder, Location loc, Value value,
                      VectorType bits) {
    auto type = cast<VectorType>(value.getType());
    if (type == bits)
      return value;
    if (type.getElementType().isIndex())
      return arith::IndexCastOp::create(builder, loc, bits, value);
    if (type.getElementType().isInteger())
      return arith::ExtUIOp::create(builder, loc, bits, value);
    return arith::BitcastOp::create(builder, loc, bits, value);
  }
  static Value fromBits(OpBuilder &builder, Location loc, Value bits,
                        VectorType type) {
    if (type == bits.getType())
      return bits;
    if (type.getElementType().isIndex())
      return arith::IndexCastOp::create(builder, loc, type, bits);
    if (type.getElementType().isInteger())
      return arith::TruncIOp::create(builder, loc, type, bits);
    return arith::BitcastOp::create(builder, loc, type, bits);
  }

  /// Calls the function of this name that does so by `how`.
  void replace(Op op, Value vector, Value how, StringRef prefix,
               ConversionPatternRewriter &rewriter) const {
    Location loc = op.getLoc();
    auto type = cast<VectorType>(op.getType());
    Type element = type.getElementType();
    unsigned width = element.isIndex() ? 64 : element.getIntOrFloatBitWidth();
    constexpr unsigned byteSize = 8;
    width = std::max(width, byteSize);
    VectorType bits = type.clone(rewriter.getIntegerType(width));
    LLVM::LLVMFuncOp function = this->context.pureFunction(
        rewriter, getMoveName(prefix, type.getNumElements(), width),
        LLVM::LLVMFunctionType::get(bits, {bits, how.getType()}));
    Value moved = LLVM::CallOp::create(
                      rewriter, loc, function,
                      ValueRange{toBits(rewriter, loc, vector, bits), how})
                      .getResult();
    rewriter.replaceOp(op, fromBits(rewriter, loc, moved, type));
  }
};

struct PermuteLowering : MoveLowering<PermuteOp> {
  using MoveLowering::MoveLowering;
  LogicalResult
  matchAndRewrite(PermuteOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    replace(op, adaptor.getVector(), adaptor.getLanes(), permutationPrefix,
            rewriter);
    return success();
  }
};

struct CompressLowering : MoveLowering<CompressOp> {
  using MoveLowering::MoveLowering;
  LogicalResult
  matchAndRewrite(CompressOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    replace(op, adaptor.getVector(), adaptor.getMask(), compressionPrefix,
            rewriter);
    return success();
  }
};

} // namespace

void piko::populateLanesToLLVMPatterns(const TypeConverter &converter,
                                       RewritePatternSet &patterns,
                                       LoweringContext &context) {
  patterns.add<CompressLowering, GatherLowering, LaneElementsLowering,
               LaneGetLowering, LaneItemsLowering, PermuteLowering,
               ScatterLowering>(converter, patterns.getContext(), context);
}
