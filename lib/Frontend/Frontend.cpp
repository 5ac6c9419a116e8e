//===- Frontend.cpp - From C++ to the piko dialect ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Frontend/Frontend.h"

#include "Cleanup.h"
#include "ModuleBuilder.h"
#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Wiring.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/ControlFlow/IR/ControlFlow.h"
#include "mlir/Dialect/Func/IR/FuncOps.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/Dominance.h"
#include "mlir/IR/Verifier.h"
#include "mlir/Transforms/CSE.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"

using namespace piko;
using llvm::failed;
using llvm::failure;

static void loadDialects(mlir::MLIRContext &context) {
  context.loadDialect<PikoDialect, mlir::arith::ArithDialect,
                      mlir::cf::ControlFlowDialect, mlir::func::FuncDialect,
                      mlir::math::MathDialect, mlir::memref::MemRefDialect,
                      mlir::scf::SCFDialect, mlir::ub::UBDialect>();
}

/// Folds what the lifting of branches left.
static void canonicalize(mlir::ModuleOp module) {
  mlir::MLIRContext *context = module.getContext();
  mlir::RewritePatternSet patterns(context);
  for (mlir::Dialect *dialect : context->getLoadedDialects())
    dialect->getCanonicalizationPatterns(patterns);
  for (mlir::RegisteredOperationName op : context->getRegisteredOperations())
    op.getCanonicalizationPatterns(patterns, context);
  (void)mlir::applyPatternsGreedily(module, std::move(patterns));
  mlir::IRRewriter rewriter(context);
  mlir::DominanceInfo dominance(module);
  mlir::eliminateCommonSubExpressions(rewriter, dominance, module);
}

static mlir::OwningOpRef<mlir::ModuleOp> translate(const ParseRequest &request,
                                                   mlir::MLIRContext &context) {
  loadDialects(context);
  std::unique_ptr<ParsedUnit> unit = parseUnit(request, context);
  if (!unit)
    return nullptr;
  MemoryMap memory(unit->pipeline, unit->markers, unit->module->getDataLayout(),
                   *unit->llvmContext);
  if (!cleanUp(*unit, memory, context) || !readWiring(*unit, memory, context))
    return nullptr;
  mlir::OwningOpRef<mlir::ModuleOp> module =
      buildModule(*unit, memory, context);
  if (!module)
    return nullptr;
  canonicalize(*module);
  if (failed(mlir::verify(*module)))
    return nullptr;
  return module;
}

mlir::OwningOpRef<mlir::ModuleOp>
piko::translateCppToPiko(llvm::StringRef file, const FrontendOptions &options,
                         mlir::MLIRContext &context) {
  return translate({file.str(), std::nullopt, options, ParseGoal::CompilePipe},
                   context);
}

mlir::OwningOpRef<mlir::ModuleOp>
piko::translateCppToPiko(llvm::StringRef name, llvm::StringRef text,
                         const FrontendOptions &options,
                         mlir::MLIRContext &context) {
  return translate({name.str(), text.str(), options, ParseGoal::CompilePipe},
                   context);
}

llvm::FailureOr<std::vector<std::string>>
piko::listPipes(llvm::StringRef file, const FrontendOptions &options,
                mlir::MLIRContext &context) {
  std::unique_ptr<ParsedUnit> unit = parseUnit(
      {file.str(), std::nullopt, options, ParseGoal::ListPipes}, context);
  if (!unit)
    return failure();
  return std::move(unit->pipes);
}

llvm::FailureOr<PipelineDescription>
piko::describePipe(llvm::StringRef file, const FrontendOptions &options,
                   mlir::MLIRContext &context) {
  loadDialects(context);
  std::unique_ptr<ParsedUnit> unit = parseUnit(
      {file.str(), std::nullopt, options, ParseGoal::DescribePipe}, context);
  if (!unit)
    return failure();
  MemoryMap memory(unit->pipeline, unit->markers, unit->module->getDataLayout(),
                   *unit->llvmContext);
  if (!cleanUp(*unit, memory, context) || !readWiring(*unit, memory, context))
    return failure();
  return std::move(unit->pipeline);
}
