// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Approximations become calls of functions that the target has instructions
// for.

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Conversion/Approximations.h"
#include "Piko/Dialect/Piko/IR/PikoApproximation.h"

using namespace mlir;
using namespace piko;

namespace {
template <typename OpT> struct ApproximationLowering : ContextPattern<OpT> {
  ApproximationLowering(const TypeConverter &converter, MLIRContext *mlir,
                        LoweringContext &context, StringRef kind)
      : ContextPattern<OpT>(converter, mlir, context), kind(kind) {}

  LogicalResult
  matchAndRewrite(OpT op, typename OpT::Adaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Type type = op.getType();
    auto vector = dyn_cast<VectorType>(type);
    if (!type.isF32() &&
        (!vector || vector.getRank() != 1 || vector.isScalable()))
      return op.emitOpError("expected f32 or a vector of one dimension, but "
                            "got ")
             << type;
    std::string name =
        getApproximationName(kind, vector ? vector.getNumElements() : 0);
    rewriter.replaceOpWithNewOp<LLVM::CallOp>(
        op,
        this->context.pureFunction(rewriter, name,
                                   LLVM::LLVMFunctionType::get(type, {type})),
        adaptor.getOperand());
    return success();
  }

private:
  StringRef kind;
};
} // namespace

void piko::populateApproximationsToLLVMPatterns(const TypeConverter &converter,
                                                RewritePatternSet &patterns,
                                                LoweringContext &context) {
  patterns.add<ApproximationLowering<ApproximateReciprocalOp>>(
      converter, patterns.getContext(), context, approximateReciprocal);
  patterns.add<ApproximationLowering<ApproximateRsqrtOp>>(
      converter, patterns.getContext(), context, approximateRsqrt);
  patterns.add<ApproximationLowering<ApproximateSqrtOp>>(
      converter, patterns.getContext(), context, approximateSqrt);
}
