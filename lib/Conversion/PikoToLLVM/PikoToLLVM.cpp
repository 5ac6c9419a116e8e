// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-llvm: for each pipeline,
//   1. make a function of each kernel;
//   2. convert the operations in them;
//   3. write NAME.setup and NAME.run, and drop the pipeline.

#include "LoweringContext.h"

#include "mlir/Dialect/ControlFlow/IR/ControlFlow.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTPIKOTOLLVM
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ConvertPikoToLLVMPass
    : piko::impl::ConvertPikoToLLVMBase<ConvertPikoToLLVMPass> {
  void getDependentDialects(DialectRegistry &registry) const override {
    ConvertPikoToLLVMBase::getDependentDialects(registry);
    registry.insert<cf::ControlFlowDialect>();
  }
  void runOnOperation() override;
  LogicalResult convert(PipelineOp pipeline, LoweringContext &context);
};

} // namespace

/// Which stage or source a kernel's function is for: the runtime is told at its
/// end, where the bins are no longer at hand.
static void noteSubject(func::FuncOp function, const PipelineNumbers &numbers) {
  for (auto bins : function.getOps<OpenBinsOp>()) {
    Builder builder(function.getContext());
    int64_t number = bins.getSource()
                         ? *bins.getSource()
                         : numbers.stages.lookup(bins.getStageAttr().getAttr());
    function->setAttr("piko.number", builder.getI64IntegerAttr(number));
    if (bins.getSource())
      function->setAttr("piko.source", builder.getUnitAttr());
  }
}

LogicalResult ConvertPikoToLLVMPass::convert(PipelineOp pipeline,
                                             LoweringContext &context) {
  WalkResult phase = pipeline.walk([](Operation *op) {
    if (!isa<AssignOp, ProcessOp>(op))
      return WalkResult::advance();
    op->emitError("expected the resolved level, but got a phase");
    return WalkResult::interrupt();
  });
  if (phase.wasInterrupted())
    return failure();
  PipelineNumbers numbers(pipeline);
  SmallVector<func::FuncOp> functions;
  for (auto kernel : llvm::to_vector(pipeline.getOps<KernelOp>())) {
    functions.push_back(context.outline(kernel, numbers));
    noteSubject(functions.back(), numbers);
    kernel.erase();
  }

  TypeConverter converter;
  converter.addConversion([](Type type) { return type; });
  converter.addConversion([](PrimType type) -> Type {
    return LLVM::LLVMPointerType::get(type.getContext());
  });
  converter.addConversion([](BinsType type) -> Type {
    return LLVM::LLVMPointerType::get(type.getContext());
  });
  converter.addConversion([](WriterType type) -> Type {
    return LLVM::LLVMPointerType::get(type.getContext());
  });
  ConversionTarget target(getContext());
  target.addIllegalDialect<PikoDialect>();
  target.markUnknownOpDynamicallyLegal([](Operation *) { return true; });
  RewritePatternSet patterns(&getContext());
  populateKernelToLLVMPatterns(converter, patterns, context);
  populateStateToLLVMPatterns(converter, patterns, context);
  FrozenRewritePatternSet frozen(std::move(patterns));
  for (func::FuncOp function : functions)
    if (failed(applyPartialConversion(function, target, frozen)))
      return failure();
  for (func::FuncOp function : functions) {
    function->removeAttr("piko.number");
    function->removeAttr("piko.source");
  }
  createProgram(numbers, functions, context);
  pipeline.erase();
  return success();
}

void ConvertPikoToLLVMPass::runOnOperation() {
  ModuleOp module = getOperation();
  OpBuilder builder(module.getBodyRegion());
  SmallVector<PipelineOp> pipelines(module.getOps<PipelineOp>());
  if (!pipelines.empty()) {
    // The size of pikoir_input: what a kernel works on after an error.
    auto type = LLVM::LLVMArrayType::get(builder.getI64Type(), 7);
    LLVM::GlobalOp::create(
        builder, module.getLoc(), type, /*isConstant=*/true,
        LLVM::Linkage::Internal, "piko.no_input",
        builder.getZeroAttr(RankedTensorType::get(7, builder.getI64Type())));
  }
  LoweringContext context(module);
  for (PipelineOp pipeline : pipelines)
    if (failed(convert(pipeline, context)))
      return signalPassFailure();
  for (auto record : llvm::to_vector(module.getOps<RecordOp>()))
    record.erase();
}
