//===- Frontend.cpp - From C++ to the piko dialect ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Frontend/Frontend.h"

#include "Cleanup/Cleanup.h"
#include "Import/Conflicts.h"
#include "Import/ModuleBuilder.h"
#include "Import/Wiring.h"
#include "Parse/Tunables.h"
#include "Piko/Analysis/BranchProbability.h"
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
#include "Clang/ClangInvocation.h"
#include "llvm/ADT/StringExtras.h"

#include <cmath>

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
      mlir::FrozenRewritePatternSet(std::move(patterns), getInexactPatterns()),
      mlir::GreedyRewriteConfig().setListener(getProbabilityKeeper()));
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
    warnAboutConflicts(*module);
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

llvm::FailureOr<std::vector<TunableDescription>>
piko::listTunables(llvm::StringRef file, const FrontendOptions &options,
                   mlir::MLIRContext &context) {
  llvm::FailureOr<ParsedFile> parsed = parseFile(
      {file.str(), std::nullopt, options, ParseGoal::ListTunables}, context);
  if (failed(parsed))
    return failure();
  return std::move(parsed->tunables);
}

/// "a, b or c".
static std::string listAlternatives(llvm::ArrayRef<std::string> words) {
  std::string text = words.front();
  for (size_t i = 1; i < words.size(); ++i)
    text += (i + 1 < words.size() ? ", " : " or ") + words[i];
  return text;
}

/// Whether a value stands for one that is written down: reals are the same to
/// six digits.
static bool isSameValue(llvm::StringRef written, llvm::StringRef value) {
  double a = 0, b = 0;
  if (!written.contains_insensitive("e") && !written.contains("."))
    return written == value;
  if (!llvm::to_float(written, a) || !llvm::to_float(value, b))
    return written == value;
  return std::abs(a - b) <= 1e-6 * std::abs(a);
}

/// How PIKO_TUNED says that a tunable has a value; an error if there is no such
/// tunable or value.
static llvm::FailureOr<std::string>
writeTunable(llvm::ArrayRef<TunableDescription> tunables, llvm::StringRef name,
             llvm::StringRef value, mlir::Location file) {
  for (const TunableDescription &tunable : tunables) {
    if (tunable.name != name)
      continue;
    for (auto [written, text] : llvm::zip(tunable.values, tunable.texts))
      if (isSameValue(written, value))
        return tunable.name + "=" + text;
    return mlir::emitError(tunable.location)
           << "expected " << listAlternatives(tunable.values)
           << " for tunable '" << name << "', but got " << value;
  }
  return refuseTunable(name, tunables, file);
}

/// Whether a value may be an enumerator's name, which only the text knows.
static bool isName(llvm::StringRef value) {
  return !value.empty() && (llvm::isAlpha(value.front()) || value[0] == '_') &&
         value != "true" && value != "false";
}

/// Writes the enumerators that PIKO_TUNED names as their numbers.
static llvm::LogicalResult numberEnumerators(llvm::StringRef file,
                                             FrontendOptions &options,
                                             mlir::Location location,
                                             mlir::MLIRContext &context) {
  auto named = llvm::find_if(options.defines, [](llvm::StringRef define) {
    return llvm::any_of(readTunedMacro(define), [](TunedMacro setting) {
      return isName(setting.value);
    });
  });
  if (named == options.defines.end())
    return llvm::success();
  FrontendOptions others = options;
  llvm::erase(others.defines, *named);
  auto tunables = listTunables(file, others, context);
  if (failed(tunables))
    return failure();
  std::vector<std::string> settings;
  for (auto [name, value] : readTunedMacro(*named)) {
    auto setting = writeTunable(*tunables, name, value, location);
    if (failed(setting))
      return failure();
    settings.push_back(std::move(*setting));
  }
  *named = "PIKO_TUNED=\"" + llvm::join(settings, ";") + "\"";
  return llvm::success();
}

llvm::LogicalResult
piko::setTunables(llvm::StringRef file,
                  llvm::ArrayRef<std::pair<std::string, std::string>> values,
                  FrontendOptions &options, mlir::MLIRContext &context) {
  mlir::Location location = mlir::FileLineColLoc::get(&context, file, 1, 1);
  if (values.empty())
    return numberEnumerators(file, options, location, context);
  if (isTuned(options))
    return mlir::emitError(location) << "expected tunables in a tuned file or "
                                        "in PIKO_TUNED, but got both";
  auto tunables = listTunables(file, options, context);
  if (failed(tunables))
    return failure();
  std::vector<std::string> settings;
  for (const auto &[name, value] : values) {
    auto setting = writeTunable(*tunables, name, value, location);
    if (failed(setting))
      return failure();
    settings.push_back(std::move(*setting));
  }
  options.defines.push_back("PIKO_TUNED=\"" + llvm::join(settings, ";") + "\"");
  return llvm::success();
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
