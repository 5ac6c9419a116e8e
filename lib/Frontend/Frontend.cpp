//===- Frontend.cpp - From C++ to the piko dialect ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Frontend/Frontend.h"

#include "Cleanup/Cleanup.h"
#include "Import/ModuleBuilder.h"
#include "Import/Wiring.h"
#include "Piko/Dialect/Piko/IR/Canonicalization.h"
#include "Piko/Dialect/Piko/IR/Piko.h"
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
  (void)mlir::applyPatternsGreedily(
      module,
      mlir::FrozenRewritePatternSet(std::move(patterns), getInexactPatterns()));
  mlir::IRRewriter rewriter(context);
  mlir::DominanceInfo dominance(module);
  mlir::eliminateCommonSubExpressions(rewriter, dominance, module);
}

/// A pipeline whose graph is known and whose phases are not yet translated.
struct PipelineFile::Unit {
  Unit(std::unique_ptr<ParsedUnit> unit, mlir::MLIRContext &context)
      : parsed(std::move(unit)),
        memory(parsed->pipeline, parsed->markers,
               parsed->module->getDataLayout(), *parsed->llvmContext) {
    isRead = cleanUp(*parsed, memory, context) &&
             readWiring(*parsed, memory, context);
  }

  mlir::OwningOpRef<mlir::ModuleOp> translate(mlir::MLIRContext &context) {
    if (!isRead)
      return nullptr;
    mlir::OwningOpRef<mlir::ModuleOp> module =
        buildModule(*parsed, memory, context);
    if (!module)
      return nullptr;
    canonicalize(*module);
    if (failed(mlir::verify(*module)))
      return nullptr;
    return module;
  }

  std::unique_ptr<ParsedUnit> parsed;
  MemoryMap memory;
  bool isRead = false;
};

PipelineFile::PipelineFile(mlir::MLIRContext &context) : context(context) {}
PipelineFile::~PipelineFile() = default;

std::unique_ptr<PipelineFile>
PipelineFile::parse(llvm::StringRef file, const FrontendOptions &options,
                    mlir::MLIRContext &context) {
  ParseGoal goal =
      options.pipeName.empty() ? ParseGoal::CompileAll : ParseGoal::CompilePipe;
  return parse({file.str(), std::nullopt, options, goal}, context);
}

std::unique_ptr<PipelineFile> PipelineFile::parse(const ParseRequest &request,
                                                  mlir::MLIRContext &context) {
  loadDialects(context);
  llvm::FailureOr<ParsedFile> file = parseFile(request, context);
  if (failed(file))
    return nullptr;
  std::unique_ptr<PipelineFile> result(new PipelineFile(context));
  for (std::unique_ptr<ParsedUnit> &unit : file->units)
    result->units.push_back(std::make_unique<Unit>(std::move(unit), context));
  return result;
}

size_t PipelineFile::size() const { return units.size(); }

llvm::StringRef PipelineFile::getName(size_t index) const {
  return units[index]->parsed->pipeline.name;
}

llvm::FailureOr<PipelineDescription>
PipelineFile::describe(size_t index) const {
  if (!units[index]->isRead)
    return failure();
  return units[index]->parsed->pipeline;
}

mlir::OwningOpRef<mlir::ModuleOp> PipelineFile::translate(size_t index) {
  return units[index]->translate(context);
}

/// The one pipeline that CompilePipe asks for.
static mlir::OwningOpRef<mlir::ModuleOp>
translate(std::unique_ptr<PipelineFile> file) {
  return file ? file->translate(0) : nullptr;
}

mlir::OwningOpRef<mlir::ModuleOp>
piko::translateCppToPiko(llvm::StringRef file, const FrontendOptions &options,
                         mlir::MLIRContext &context) {
  return translate(PipelineFile::parse(
      {file.str(), std::nullopt, options, ParseGoal::CompilePipe}, context));
}

mlir::OwningOpRef<mlir::ModuleOp>
piko::translateCppToPiko(llvm::StringRef name, llvm::StringRef text,
                         const FrontendOptions &options,
                         mlir::MLIRContext &context) {
  return translate(PipelineFile::parse(
      {name.str(), text.str(), options, ParseGoal::CompilePipe}, context));
}

llvm::FailureOr<std::vector<std::string>>
piko::listPipes(llvm::StringRef file, const FrontendOptions &options,
                mlir::MLIRContext &context) {
  llvm::FailureOr<ParsedFile> parsed = parseFile(
      {file.str(), std::nullopt, options, ParseGoal::ListPipes}, context);
  if (failed(parsed))
    return failure();
  return std::move(parsed->pipes);
}

llvm::FailureOr<PipelineDescription>
piko::describePipe(llvm::StringRef file, const FrontendOptions &options,
                   mlir::MLIRContext &context) {
  std::unique_ptr<PipelineFile> parsed = PipelineFile::parse(
      {file.str(), std::nullopt, options, ParseGoal::CompilePipe}, context);
  if (!parsed)
    return failure();
  return parsed->describe(0);
}
