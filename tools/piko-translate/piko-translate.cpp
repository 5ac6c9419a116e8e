// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Takes pipelines in and out of MLIR: C++ in; LLVM IR and Graphviz out.

#include "Piko/CommandLine/Help.h"
#include "Piko/CommandLine/LLVMTool.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/Registration.h"
#include "Piko/Frontend/Frontend.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Target/Graphviz.h"

#include "mlir/IR/AsmState.h"
#include "mlir/IR/BuiltinOps.h"
#include "mlir/Tools/mlir-translate/Translation.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/InitLLVM.h"
#include "llvm/Support/MemoryBuffer.h"
#include "llvm/Support/SourceMgr.h"

#include <csignal>

static const piko::ToolHelp help{
    .usage = "piko-translate [options] FILE",
    .description =
        "Takes pipelines in and out of MLIR. C++ comes in, LLVM IR and "
        "Graphviz go out.",
    .example = "piko-translate --piko-to-dot dots.mlir | dot -Tsvg -o dots.svg",
    .options = {{.names = {"--cpp-to-piko"},
                 .brief = "a pipeline in C++ to the piko dialect"},
                {.names = {"--pipe"},
                 .value = "NAME",
                 .brief = "which pipeline of the file"},
                {.names = {"--piko-to-dot"},
                 .brief = "pipelines as graphs for Graphviz"},
                {.names = {"--mlir-to-llvmir"},
                 .brief = "the llvm and omp dialects to LLVM IR"},
                {.names = {"-o"}, .value = "FILE", .brief = "where to write"}},
    .isLLVMs = true};

static mlir::LogicalResult exportLLVMIR(mlir::Operation *op,
                                        llvm::raw_ostream &stream) {
  llvm::LLVMContext context;
  std::unique_ptr<llvm::Module> module =
      piko::translate(op, context, "pipeline");
  if (!module)
    return mlir::failure();
  module->print(stream, nullptr);
  return mlir::success();
}

/// What translations make of a file, one of what another one has made; none
/// after an error.
static std::optional<std::string>
translate(std::unique_ptr<llvm::MemoryBuffer> file,
          llvm::ArrayRef<const mlir::Translation *> translations) {
  std::string text;
  for (const mlir::Translation *translation : translations) {
    if (translation != translations.front())
      file = llvm::MemoryBuffer::getMemBufferCopy(text, "<translated>");
    text.clear();
    llvm::raw_string_ostream stream(text);
    mlir::MLIRContext context;
    auto sources = std::make_shared<llvm::SourceMgr>();
    sources->AddNewSourceBuffer(std::move(file), llvm::SMLoc());
    mlir::SourceMgrDiagnosticHandler handler(*sources, &context);
    if (failed((*translation)(sources, stream, &context)))
      return std::nullopt;
  }
  return text;
}

/// Returns the exit status.
static int run(int argc, char **argv) {
  const piko::LLVMTool tool("piko-translate");
  llvm::cl::opt<std::string> input{llvm::cl::Positional,
                                   llvm::cl::desc("<input file>"),
                                   llvm::cl::init("-")};
  llvm::cl::opt<std::string> output{"o", llvm::cl::desc("where to write"),
                                    llvm::cl::value_desc("file"),
                                    llvm::cl::init("-")};
  llvm::cl::list<const mlir::Translation *, bool, mlir::TranslationParser>
      translations("", llvm::cl::desc("Translations to perform"));
  mlir::registerAsmPrinterCLOptions();
  mlir::registerMLIRContextCLOptions();
  mlir::registerTranslationCLOptions();
  llvm::InitLLVM init(argc, argv);
  if (!tool.parseOptions(argc, argv, "Piko's translator"))
    return 1;
  if (translations.empty())
    return !tool.fail("expected --cpp-to-piko, --piko-to-dot or "
                      "--mlir-to-llvmir; see --help");
  std::unique_ptr<llvm::MemoryBuffer> file = tool.open(input);
  if (!file)
    return 1;
  std::vector<const mlir::Translation *> chosen(translations.begin(),
                                                translations.end());
  std::optional<std::string> text = translate(std::move(file), chosen);
  return text && tool.write(output, *text) ? 0 : 1;
}

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-translate");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  if (piko::answerHelp(help, argc, argv))
    return 0;
  piko::registerCppToPikoTranslation(piko::makeHeaderStore({}));
  piko::registerPikoToDotTranslation();
  mlir::TranslateFromMLIRRegistration toLLVMIR(
      "mlir-to-llvmir", "translate the llvm and omp dialects to LLVM IR",
      exportLLVMIR, piko::registerPikoDialects);
  return piko::runMainOnDeepStack([&] { return run(argc, argv); });
}
