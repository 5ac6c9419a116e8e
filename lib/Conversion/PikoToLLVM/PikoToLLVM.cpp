// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-llvm: for each pipeline,
//   1. write NAME.setup and NAME.run, from its program;
//   2. make a function of each kernel;
//   3. convert the operations in them, and drop the pipeline.

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"

#include "mlir/Dialect/ControlFlow/IR/ControlFlow.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/SCF/Transforms/Patterns.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "llvm/ADT/SetVector.h"

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
    registry.insert<cf::ControlFlowDialect, math::MathDialect>();
  }
  void runOnOperation() override;
  LogicalResult convert(PipelineOp pipeline, LoweringContext &context);
};

} // namespace

namespace {
struct SelectLowering : OpConversionPattern<arith::SelectOp> {
  using OpConversionPattern::OpConversionPattern;
  LogicalResult
  matchAndRewrite(arith::SelectOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOpWithNewOp<arith::SelectOp>(op, adaptor.getOperands());
    return success();
  }
};

/// A primitive that a branch does not give.
struct PoisonLowering : OpConversionPattern<ub::PoisonOp> {
  using OpConversionPattern::OpConversionPattern;
  LogicalResult
  matchAndRewrite(ub::PoisonOp op, OpAdaptor,
                  ConversionPatternRewriter &rewriter) const override {
    rewriter.replaceOpWithNewOp<ub::PoisonOp>(
        op, typeConverter->convertType(op.getType()), op.getValue());
    return success();
  }
};
} // namespace

static LogicalResult checkSubject(KernelOp kernel) {
  auto opened = kernel.getOps<OpenBinsOp>();
  auto schedules = kernel.getOps<BeginScheduleOp>();
  if (std::distance(opened.begin(), opened.end()) +
          std::distance(schedules.begin(), schedules.end()) ==
      1)
    return success();
  return kernel.emitOpError("expected to open the bins of one stage or "
                            "source, or to begin one schedule");
}

/// Numbers the loops that a kernel holds in two versions without gaps, which
/// those have left that were found to do nothing.
static void numberMappings(KernelOp kernel) {
  SmallVector<TakesVectorsOp> loops;
  kernel.walk([&](TakesVectorsOp op) { loops.push_back(op); });
  llvm::sort(loops, [](TakesVectorsOp a, TakesVectorsOp b) {
    return a.getNumber() < b.getNumber();
  });
  llvm::DenseMap<int64_t, int64_t> numbers; // by the old ones
  for (auto [number, op] : llvm::enumerate(loops)) {
    numbers[op.getNumber()] = int64_t(number);
    op.setNumber(number);
    if (!op.getWithin())
      continue;
    if (auto outer = numbers.find(*op.getWithin()); outer != numbers.end())
      op.setWithin(outer->second);
    else
      op.removeWithinAttr();
  }
}

/// Which stage or source a kernel's function is for: the runtime is told at its
/// end, where the bins are no longer at hand.
static void noteSubject(func::FuncOp function, const PipelineNumbers &numbers) {
  Builder builder(function.getContext());
  for (auto bins : function.getOps<OpenBinsOp>()) {
    int64_t stage = numbers.stages.lookup(bins.getStageAttr().getAttr());
    function->setAttr(marks::number, builder.getI64IntegerAttr(
                                         bins.getSource().value_or(stage)));
    if (bins.getSource())
      function->setAttr(marks::source, builder.getUnitAttr());
  }
}

/// Says where hardly any lane fails: calls there, one lane after the other, are
/// in a loop, so that LLVM does not see it, and spills registers in front.
static void expectSuccess(func::FuncOp function) {
  llvm::SetVector<Operation *> choices;
  function.walk([&](Operation *op) {
    Operation *repeated = op->getParentOp();
    if (op->hasTrait<Failure>() && isa<scf::WhileOp>(repeated) &&
        isa<scf::IfOp>(repeated->getParentOp()))
      choices.insert(repeated->getParentOp());
  });
  for (Operation *op : choices) {
    auto choice = cast<scf::IfOp>(op);
    if (!choice.getCondition().getDefiningOp<vector::ReductionOp>() ||
        choice.getNumResults() > 0 || choice.elseBlock())
      continue;
    OpBuilder builder(choice);
    Value never = arith::ConstantIntOp::create(builder, choice.getLoc(), 0, 1);
    choice.getConditionMutable().assign(LLVM::ExpectOp::create(
        builder, choice.getLoc(), choice.getCondition(), never));
  }
}

LogicalResult ConvertPikoToLLVMPass::convert(PipelineOp pipeline,
                                             LoweringContext &context) {
  WalkResult phase = pipeline.walk([](Operation *op) {
    auto schedule = dyn_cast<ScheduleOp>(op);
    bool isDynamic = schedule && !schedule.getBody().empty();
    if (!isa<AssignOp, ProcessOp>(op) && !isDynamic)
      return WalkResult::advance();
    op->emitError("expected the machine level, but got a phase");
    return WalkResult::interrupt();
  });
  if (phase.wasInterrupted())
    return failure();
  for (auto kernel : pipeline.getOps<KernelOp>())
    if (failed(checkSubject(kernel)))
      return failure();
  ProgramOp program = getProgram(pipeline);
  if (!program)
    return pipeline.emitError("expected a piko.program, which "
                              "piko-form-program makes");
  for (auto kernel : pipeline.getOps<KernelOp>())
    numberMappings(kernel);
  PipelineNumbers numbers(pipeline);
  func::FuncOp setup = createProgram(numbers, context);
  SmallVector<func::FuncOp> functions, again;
  llvm::DenseSet<Attribute> cyclic;
  program.walk([&](LaunchOp launch) {
    if (launch->getParentOfType<WavesOp>() ||
        launch->getParentOfType<RoundsOp>())
      cyclic.insert(launch.getKernelAttr().getAttr());
  });
  program.erase();
  for (auto kernel : llvm::to_vector(pipeline.getOps<KernelOp>())) {
    functions.push_back(context.outline(kernel, numbers));
    functions.back()->moveBefore(setup);
    noteSubject(functions.back(), numbers);
    if (cyclic.contains(kernel.getSymNameAttr()))
      again.push_back(functions.back());
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
  converter.addConversion([](PrivateCopyType type) -> Type {
    return LLVM::LLVMPointerType::get(type.getContext());
  });
  ConversionTarget target(getContext());
  target.addIllegalDialect<PikoDialect>();
  // A kernel for a GPU keeps it until it is outlined.
  target.addLegalOp<DeviceCallOp>();
  // Of other dialects' accesses only they themselves could make code.
  target.markUnknownOpDynamicallyLegal(
      [](Operation *op) { return !isa<StateAccessOpInterface>(op); });
  target.addDynamicallyLegalOp<arith::SelectOp, ub::PoisonOp>(
      [&](Operation *op) { return converter.isLegal(op); });
  RewritePatternSet patterns(&getContext());
  // Primitives are chosen, and carried around loops, like numbers.
  scf::populateSCFStructuralTypeConversionsAndLegality(converter, patterns,
                                                       target);
  patterns.add<SelectLowering, PoisonLowering>(converter, &getContext());
  populateKernelToLLVMPatterns(converter, patterns, context);
  populateWriterToLLVMPatterns(converter, patterns, context);
  populateEmissionsToLLVMPatterns(converter, patterns, context);
  populateStateToLLVMPatterns(converter, patterns, context);
  populateLanesToLLVMPatterns(converter, patterns, context);
  populateRunsToLLVMPatterns(converter, patterns, context);
  populateRecordsToLLVMPatterns(converter, patterns, context);
  populateChecksToLLVMPatterns(converter, patterns, context);
  populateCountsToLLVMPatterns(converter, patterns, context);
  populateApproximationsToLLVMPatterns(converter, patterns, context);
  populateRowReductionsToLLVMPatterns(converter, patterns, context);
  populateReductionsToLLVMPatterns(converter, patterns, context);
  populateSelectionsToLLVMPatterns(converter, patterns, context);
  populateTilesToLLVMPatterns(converter, patterns, context);
  populateGridToLLVMPatterns(converter, patterns, context);
  FrozenRewritePatternSet frozen(std::move(patterns));
  for (func::FuncOp function : functions)
    expectSuccess(function);
  for (func::FuncOp function : functions)
    if (failed(applyPartialConversion(function, target, frozen)))
      return failure();
  for (func::FuncOp function : functions)
    branchInSaturatingCasts(function);
  for (func::FuncOp function : functions)
    outlineVersions(function);
  for (func::FuncOp function : again)
    outlineUnits(function);
  for (func::FuncOp function : functions)
    for (StringRef name : {marks::number, marks::source})
      function->removeAttr(name);
  pipeline.erase();
  return success();
}

void ConvertPikoToLLVMPass::runOnOperation() {
  ModuleOp module = getOperation();
  OpBuilder builder(module.getBodyRegion());
  SmallVector<PipelineOp> pipelines(module.getOps<PipelineOp>());
  if (!pipelines.empty()) {
    // What a kernel works on after an error.
    constexpr int64_t words = sizeof(pikoir_input) / sizeof(int64_t);
    auto type = LLVM::LLVMArrayType::get(builder.getI64Type(), words);
    LLVM::GlobalOp::create(builder, module.getLoc(), type, /*isConstant=*/true,
                           LLVM::Linkage::Internal, "piko.no_input",
                           builder.getZeroAttr(RankedTensorType::get(
                               words, builder.getI64Type())));
  }
  LoweringContext context(module);
  for (PipelineOp pipeline : pipelines)
    if (failed(convert(pipeline, context)))
      return signalPassFailure();
  for (auto record : llvm::to_vector(module.getOps<RecordOp>()))
    record.erase();
}
