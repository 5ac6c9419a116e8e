// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Rows of elements that lanes reduce to a private copy.

#include "PikoToLLVM/KernelLowering.h"
#include "PikoToLLVM/Lanes/LaneAddresses.h"
#include "PikoToLLVM/Lanes/LaneBits.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

namespace {

struct ReduceRowLowering : Lowering<ReduceRowOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(ReduceRowOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    Value data = context.member(rewriter, adaptor.getCopy(),
                                PIKO_RUNTIME_MEMBER(pikoir_private, data));
    Value null = LLVM::ZeroOp::create(rewriter, loc, data.getType());
    Value given = LLVM::ICmpOp::create(rewriter, loc, LLVM::ICmpPredicate::ne,
                                       data, null);
    scf::IfOp::create(
        rewriter, loc, given,
        [&](OpBuilder &then, Location loc) {
          createChanges(then, op, adaptor, data);
          createNotes(then, op, adaptor);
          scf::YieldOp::create(then, loc);
        },
        [&](OpBuilder &otherwise, Location loc) {
          createLocked(otherwise, op, adaptor);
          scf::YieldOp::create(otherwise, loc);
        });
    rewriter.eraseOp(op);
    return success();
  }

private:
  static VectorType getType(ReduceRowOp op) {
    return cast<VectorType>(op.getValue().getType());
  }
  RecordOp getRecord(ReduceRowOp op) const {
    return context.record(getStateRecord(context.state(op, op.getState())));
  }

  /// Where the first lane's number is, from the state's first byte or a copy's.
  Value getFirst(OpBuilder &builder, ReduceRowOp op, OpAdaptor adaptor,
                 Value data) const {
    RecordOp record = getRecord(op);
    Value base = createFieldAddress(builder, op.getLoc(), data,
                                    record.getField(op.getField()),
                                    adaptor.getElements());
    Value offset = computeLaneOffset(
        builder, op.getLoc(), context.view(builder, op, op.getState()),
        adaptor.getIndices(), record.getSize(), getType(op).getNumElements());
    return LLVM::GEPOp::create(builder, op.getLoc(), base.getType(),
                               builder.getI8Type(), base,
                               ArrayRef<LLVM::GEPArg>{offset});
  }

  void createChanges(OpBuilder &builder, ReduceRowOp op, OpAdaptor adaptor,
                     Value data) const {
    Location loc = op.getLoc();
    VectorType type = getType(op);
    uint32_t alignment = type.getElementTypeBitWidth() / 8;
    LaneAddresses at =
        createLaneAddresses(builder, loc, getFirst(builder, op, adaptor, data),
                            /*offset=*/{}, getRecord(op).getSize(), type);
    Value mask = adaptor.getMask();
    Value none =
        arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
    Value old;
    if (at.first)
      old = LLVM::MaskedLoadOp::create(builder, loc, type, at.first, mask, none,
                                       alignment);
    else
      old = LLVM::masked_gather::create(builder, loc, type, at.each, mask, none,
                                        alignment);
    Value changed =
        createChange(builder, loc, op.getKind(), old, adaptor.getValue());
    if (at.first)
      LLVM::MaskedStoreOp::create(builder, loc, changed, at.first, mask,
                                  alignment);
    else
      LLVM::masked_scatter::create(builder, loc, changed, at.each, mask,
                                   alignment);
  }

  /// Notes that the runs of the first lane in the mask, of the last one, and
  /// what is between are changed.
  void createNotes(OpBuilder &builder, ReduceRowOp op,
                   OpAdaptor adaptor) const {
    Location loc = op.getLoc();
    Value bits = createBits(builder, loc, adaptor.getMask());
    Value zero = createI64(builder, loc, 0);
    Value any = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                      bits, zero);
    auto changed = scf::IfOp::create(builder, loc, any, /*withElse=*/false);
    OpBuilder inside = changed.getThenBodyBuilder();
    Value dirty = context.member(inside, adaptor.getCopy(),
                                 PIKO_RUNTIME_MEMBER(pikoir_private, dirty));
    Value number = computeLaneOffset(
        inside, loc, context.view(inside, op, op.getState()),
        adaptor.getIndices(), /*size=*/1, getType(op).getNumElements());
    Value shift = createI64(inside, loc, getRunShift(getRecord(op)));
    auto getRun = [&](Value lane) -> Value {
      return toIndex(inside, loc,
                     arith::ShRUIOp::create(
                         inside, loc,
                         arith::AddIOp::create(inside, loc, number, lane),
                         shift));
    };
    Value first = math::CountTrailingZerosOp::create(inside, loc, bits);
    Value last = arith::SubIOp::create(
        inside, loc, createI64(inside, loc, 63),
        math::CountLeadingZerosOp::create(inside, loc, bits));
    Value one = arith::ConstantIndexOp::create(inside, loc, 1);
    Value end = arith::AddIOp::create(inside, loc, getRun(last), one);
    scf::ForOp::create(
        inside, loc, getRun(first), end, one, ValueRange(),
        [&](OpBuilder &each, Location loc, Value run, ValueRange) {
          createStore(each, loc, arith::ConstantIntOp::create(each, loc, 1, 8),
                      createOffset(each, loc, dirty, toI64(each, loc, run)),
                      context.tags.dirty());
          scf::YieldOp::create(each, loc);
        });
  }

  /// Each lane by itself.
  void createLocked(OpBuilder &builder, ReduceRowOp op,
                    OpAdaptor adaptor) const {
    Location loc = op.getLoc();
    Value data = context.view(builder, op, op.getState()).data;
    Value first = getFirst(builder, op, adaptor, data);
    Value bits = createBits(builder, loc, adaptor.getMask());
    Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
    Value one = arith::ConstantIndexOp::create(builder, loc, 1);
    Value count = arith::ConstantIndexOp::create(builder, loc,
                                                 getType(op).getNumElements());
    scf::ForOp::create(
        builder, loc, zero, count, one, ValueRange(),
        [&](OpBuilder &each, Location loc, Value lane, ValueRange) {
          Value number = toI64(each, loc, lane);
          Value bit = arith::AndIOp::create(
              each, loc, arith::ShRUIOp::create(each, loc, bits, number),
              createI64(each, loc, 1));
          Value isHere =
              arith::CmpIOp::create(each, loc, arith::CmpIPredicate::ne, bit,
                                    createI64(each, loc, 0));
          auto here = scf::IfOp::create(each, loc, isHere, /*withElse=*/false);
          OpBuilder inside = here.getThenBodyBuilder();
          Value bytes = arith::MulIOp::create(
              inside, loc, number,
              createI64(inside, loc, getRecord(op).getSize()));
          // Not inbounds: the first lane may be outside.
          Value at = LLVM::GEPOp::create(inside, loc, first.getType(),
                                         inside.getI8Type(), first,
                                         ArrayRef<LLVM::GEPArg>{bytes});
          // The value says nothing of what others have written.
          LLVM::AtomicRMWOp::create(
              inside, loc, toAtomicBinOp(op.getKind()), at,
              vector::ExtractOp::create(inside, loc, adaptor.getValue(), lane),
              LLVM::AtomicOrdering::monotonic);
          scf::YieldOp::create(each, loc);
        });
  }
};

} // namespace

void piko::populateRowReductionsToLLVMPatterns(const TypeConverter &converter,
                                               RewritePatternSet &patterns,
                                               LoweringContext &context) {
  patterns.add<ReduceRowLowering>(converter, patterns.getContext(), context);
}
