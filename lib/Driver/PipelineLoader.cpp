// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From a pipeline's file to a program in memory.

#include "Piko/Driver/PipelineLoader.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Frontend/HostCompiler.h"
#include "Piko/Target/JIT.h"

#include <chrono>

using namespace mlir;
using namespace piko;

namespace {

class JITProgram : public LoadedProgram {
public:
  /// Finds the program in code; false, with `error` set, if it is not there.
  bool load(std::unique_ptr<llvm::Module> module,
            std::unique_ptr<llvm::LLVMContext> context,
            llvm::StringRef pipeline, std::string &error);
  void setMilliseconds(double value) { milliseconds = value; }

private:
  bool findFunctions(llvm::StringRef pipeline, std::string &error);

  std::unique_ptr<JITCode> code;
  std::string name;
};

} // namespace

static const char *const referenceEntry = "piko_reference_program";

bool JITProgram::findFunctions(llvm::StringRef pipeline, std::string &error) {
  auto fail = [&](llvm::Error failure) {
    error += "error: " + llvm::toString(std::move(failure)) + "\n";
    return false;
  };
  if (pipeline.empty()) {
    auto entry = code->lookup<const pikort_program *()>(referenceEntry);
    if (!entry)
      return fail(entry.takeError());
    program = *(*entry)();
    return true;
  }
  auto setup =
      code->lookup<void(pikort_pipeline *)>((pipeline + ".setup").str());
  if (!setup)
    return fail(setup.takeError());
  auto run =
      code->lookup<int32_t(pikort_pipeline *)>((pipeline + ".run").str());
  if (!run)
    return fail(run.takeError());
  name = pipeline.str();
  program = {PIKORT_ABI_VERSION, name.c_str(), *setup, *run};
  return true;
}

bool JITProgram::load(std::unique_ptr<llvm::Module> module,
                      std::unique_ptr<llvm::LLVMContext> context,
                      llvm::StringRef pipeline, std::string &error) {
  auto made = JITCode::create(std::move(module), std::move(context));
  if (!made) {
    error += "error: " + llvm::toString(made.takeError()) + "\n";
    return false;
  }
  code = std::move(*made);
  return findFunctions(pipeline, error);
}

/// LLVM IR of the compiled pipeline, and its name; null after diagnostics.
static std::unique_ptr<llvm::Module> compile(const CompileOptions &options,
                                             MLIRContext &context,
                                             llvm::LLVMContext &llvmContext,
                                             std::string &pipeline) {
  OwningOpRef<ModuleOp> module = readPipeline(options, context);
  if (!module)
    return nullptr;
  for (auto op : module->getOps<PipelineOp>())
    pipeline = op.getSymName().str();
  if (failed(lowerPipeline(*module, Level::LLVM)))
    return nullptr;
  return translateToLLVMIR(*module, llvmContext);
}

/// LLVM IR of the reference executor; null after diagnostics.
static std::unique_ptr<llvm::Module>
compileReference(const CompileOptions &options, MLIRContext &context,
                 llvm::LLVMContext &llvmContext) {
  if (llvm::StringRef(options.file).ends_with(".mlir")) {
    emitError(FileLineColLoc::get(&context, options.file, 1, 1))
        << "the reference executor runs C++, not the text of the dialect";
    return nullptr;
  }
  context.loadAllAvailableDialects();
  FrontendOptions frontend = getFrontendOptions(options);
  FailureOr<PipelineDescription> pipeline =
      describePipe(options.file, frontend, context);
  if (failed(pipeline))
    return nullptr;
  return compileForHost(generateReferenceAdapter(*pipeline, options.file),
                        frontend, llvmContext, context);
}

std::unique_ptr<LoadedProgram> piko::loadPipeline(const std::string &file,
                                                  const LoadOptions &options,
                                                  std::string &diagnostics) {
  auto start = std::chrono::steady_clock::now();
  DialectRegistry registry;
  registerPikoDialects(registry);
  MLIRContext context(registry);
  llvm::raw_string_ostream stream(diagnostics);
  DiagnosticPrinter printer(context, stream);
  CompileOptions compileOptions{file, options.pipeName, options.includeDirs,
                                options.defines};
  auto llvmContext = std::make_unique<llvm::LLVMContext>();
  std::string pipeline;
  std::unique_ptr<llvm::Module> module =
      options.target == ExecutionTarget::Reference
          ? compileReference(compileOptions, context, *llvmContext)
          : compile(compileOptions, context, *llvmContext, pipeline);
  auto program = std::make_unique<JITProgram>();
  if (!module || !program->load(std::move(module), std::move(llvmContext),
                                pipeline, diagnostics))
    return nullptr;
  program->setMilliseconds(std::chrono::duration<double, std::milli>(
                               std::chrono::steady_clock::now() - start)
                               .count());
  return program;
}
