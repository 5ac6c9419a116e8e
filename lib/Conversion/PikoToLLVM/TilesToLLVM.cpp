// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Copies of a bin's pixels: the same code changes them and the image, as it
// finds either by an address and a pitch.

#include "PikoToLLVM/KernelLowering.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

namespace {

struct OpenTileLowering : Lowering<OpenTileOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(OpenTileOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    FailureOr<StringAttr> stage = context.kernelStage(op);
    if (failed(stage))
      return failure();
    const PipelineNumbers &numbers = context.numbers(op);
    int32_t number = numbers.states.lookup(op.getImageAttr().getAttr());
    StateView whole = context.whole(rewriter, op, op.getImage());
    Value pays = arith::CmpIOp::create(
        rewriter, loc, arith::CmpIPredicate::sge,
        toI64(rewriter, loc, adaptor.getCount()),
        context.tileLeast(rewriter, op, numbers.stages.lookup(*stage), number));
    auto choice = scf::IfOp::create(
        rewriter, loc, TypeRange{pointer(rewriter), rewriter.getI64Type()},
        pays, /*withElseRegion=*/true);
    {
      OpBuilder::InsertionGuard guard(rewriter);
      rewriter.setInsertionPointToStart(choice.thenBlock());
      Value tile =
          context
              .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_open_tile),
                    {adaptor.getWriter(), createI32(rewriter, loc, number),
                     toI64(rewriter, loc, adaptor.getBin())})
              .getResult();
      Value data =
          load(rewriter, loc, tile, PIKO_RUNTIME_MEMBER(pikoir_tile, data));
      Value pitch =
          load(rewriter, loc, tile, PIKO_RUNTIME_MEMBER(pikoir_tile, pitch));
      scf::YieldOp::create(rewriter, loc, ValueRange{data, pitch});
      rewriter.setInsertionPointToStart(choice.elseBlock());
      scf::YieldOp::create(rewriter, loc, ValueRange{whole.data, whole.pitch});
    }
    context.setTile(op, op.getImage(), choice.getResult(0),
                    choice.getResult(1));
    rewriter.replaceOp(op, pays);
    return success();
  }
};

struct CloseTileLowering : Lowering<CloseTileOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(CloseTileOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    int32_t image =
        context.numbers(op).states.lookup(op.getImageAttr().getAttr());
    auto choice = scf::IfOp::create(rewriter, loc, adaptor.getCopied());
    OpBuilder::InsertionGuard guard(rewriter);
    rewriter.setInsertionPointToStart(choice.thenBlock());
    context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_close_tile),
                 {adaptor.getWriter(), createI32(rewriter, loc, image)});
    // What follows finds the image again.
    StateView whole = context.whole(rewriter, op, op.getImage());
    context.setTile(op, op.getImage(), whole.data, whole.pitch);
    rewriter.eraseOp(op);
    return success();
  }
};

} // namespace

void piko::populateTilesToLLVMPatterns(const TypeConverter &converter,
                                       RewritePatternSet &patterns,
                                       LoweringContext &context) {
  patterns.add<OpenTileLowering, CloseTileLowering>(
      converter, patterns.getContext(), context);
}
