// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The compiler's command: reads a pipeline from C++ or .mlir and writes it at
// any level.

#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"

#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/FileSystem.h"
#include "llvm/Support/InitLLVM.h"
#include "llvm/Support/ToolOutputFile.h"

using namespace mlir;
using namespace piko;

namespace {

enum class Emit { Authored, Kernels, Resolved, Target, LLVM, LLVMIR };

struct CommandLine {
  llvm::cl::OptionCategory category{"pikoc options"};
  llvm::cl::opt<std::string> file{llvm::cl::Positional, llvm::cl::Required,
                                  llvm::cl::desc("FILE.cpp|FILE.mlir"),
                                  llvm::cl::cat(category)};
  llvm::cl::opt<std::string> pipe{
      "pipe", llvm::cl::value_desc("name"),
      llvm::cl::desc("the pipeline to compile, where a file has several"),
      llvm::cl::cat(category)};
  llvm::cl::opt<Emit> emit{
      "emit", llvm::cl::desc("the level to write (default: llvmir)"),
      llvm::cl::init(Emit::LLVMIR), llvm::cl::cat(category),
      llvm::cl::values(
          clEnumValN(Emit::Authored, "authored", "stages with their phases"),
          clEnumValN(Emit::Kernels, "kernels", "phases that run together"),
          clEnumValN(Emit::Resolved, "resolved", "loops over bins"),
          clEnumValN(Emit::Target, "target", "upstream dialects"),
          clEnumValN(Emit::LLVM, "llvm", "the llvm and omp dialects"),
          clEnumValN(Emit::LLVMIR, "llvmir", "LLVM IR"))};
  llvm::cl::opt<bool> listPipes{
      "list-pipes", llvm::cl::desc("print the names of the file's pipelines"),
      llvm::cl::cat(category)};
  llvm::cl::list<std::string> includeDirs{
      "I", llvm::cl::Prefix, llvm::cl::value_desc("folder"),
      llvm::cl::desc("where C++ looks for headers"), llvm::cl::cat(category)};
  llvm::cl::list<std::string> defines{
      "D", llvm::cl::Prefix, llvm::cl::value_desc("name[=value]"),
      llvm::cl::desc("a macro for C++"), llvm::cl::cat(category)};
  llvm::cl::opt<std::string> output{
      "o", llvm::cl::value_desc("file"), llvm::cl::init("-"),
      llvm::cl::desc("where to write (default: standard output)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<bool> remarks{
      "remarks", llvm::cl::desc("print what the passes have to say"),
      llvm::cl::cat(category)};
};

} // namespace

static Level getLevel(Emit emit) {
  return emit == Emit::LLVMIR ? Level::LLVM : static_cast<Level>(emit);
}

static LogicalResult printPipes(const CompileOptions &options,
                                MLIRContext &context, raw_ostream &stream) {
  auto names = readPipelineNames(options, context);
  if (failed(names))
    return failure();
  for (const std::string &name : *names)
    stream << name << "\n";
  return success();
}

static LogicalResult compile(const CompileOptions &options, Emit emit,
                             MLIRContext &context, raw_ostream &stream) {
  OwningOpRef<ModuleOp> module = readPipeline(options, context);
  if (!module || failed(lowerPipeline(*module, getLevel(emit))))
    return failure();
  if (emit != Emit::LLVMIR) {
    module->print(stream);
    stream << "\n";
    return success();
  }
  llvm::LLVMContext llvmContext;
  std::unique_ptr<llvm::Module> translated =
      translateToLLVMIR(*module, llvmContext);
  if (!translated)
    return failure();
  translated->print(stream, nullptr);
  return success();
}

int main(int argc, char **argv) {
  llvm::InitLLVM init(argc, argv);
  CommandLine line;
  llvm::cl::HideUnrelatedOptions(line.category);
  llvm::cl::ParseCommandLineOptions(argc, argv,
                                    "Piko's compiler for pipelines\n");
  std::error_code code;
  llvm::ToolOutputFile output(line.output, code, llvm::sys::fs::OF_Text);
  if (code) {
    llvm::errs() << "error: cannot write '" << line.output
                 << "': " << code.message() << "\n";
    return 1;
  }

  DialectRegistry registry;
  registerPikoDialects(registry);
  MLIRContext context(registry);
  DiagnosticPrinter printer(context, llvm::errs(), line.remarks);
  CompileOptions options{line.file, line.pipe, line.includeDirs, line.defines};
  LogicalResult result =
      line.listPipes ? printPipes(options, context, output.os())
                     : compile(options, line.emit, context, output.os());
  if (failed(result))
    return 1;
  output.keep();
  return 0;
}
