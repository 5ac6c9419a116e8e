// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Runs passes on `.mlir` files.

#include "Piko/CommandLine/Help.h"
#include "Piko/CommandLine/LLVMTool.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/PassReport.h"
#include "Piko/Driver/Registration.h"
#include "Piko/Support/OutOfMemory.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/MLIRContext.h"
#include "mlir/Pass/PassManager.h"
#include "mlir/Tools/mlir-opt/MlirOptMain.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/InitLLVM.h"
#include "llvm/Support/MemoryBuffer.h"

#include <csignal>
#include <cstring>

using namespace mlir;

static const piko::ToolHelp help{
    .usage = "piko-opt [options] FILE.mlir|-",
    .description = "Runs passes on .mlir files, in the order in which they are "
                   "named.",
    .example = "piko-opt dots.mlir --piko-synthesize --piko-to-machine",
    .options = {{.names = {"-o"}, .value = "FILE", .brief = "where to write"},
                {.names = {"--pass-pipeline"},
                 .value = "TEXT",
                 .brief = "passes with their options and nesting"},
                {.names = {"--piko-synthesize"},
                 .brief = "from the authored to the kernels level"},
                {.names = {"--piko-to-machine"},
                 .brief = "from there to the machine's"},
                {.names = {"--piko-to-cpu"},
                 .brief = "from there to upstream dialects"},
                {.names = {"--piko-cpu-to-llvm"},
                 .brief = "from there to llvm and omp"},
                {.names = {"--piko-to-gpu"},
                 .brief = "from the machine level to kernels for a GPU"},
                {.names = {"--report-passes=text|json"},
                 .brief = "which passes changed anything"},
                {.names = {"--mlir-print-ir-after-all"},
                 .brief = "the module after each pass"},
                {.names = {"--mlir-timing"}, .brief = "the time of each pass"},
                {.names = {"--split-input-file"},
                 .brief = "each part between // ----- by itself"},
                {.names = {"--verify-diagnostics"},
                 .brief = "compare with expected-error and others"},
                {.names = {"--show-dialects"},
                 .brief = "which dialects there are"}},
    .isLLVMs = true};

static const piko::LLVMTool tool("piko-opt");

enum class ReportFormat { None, Text, JSON };

/// Passes that there are not, and wrong options of them, which MLIR says
/// nowhere.
static bool checkPasses(const MlirOptMainConfig &config,
                        DialectRegistry &registry) {
  if (config.shouldUseExplicitModule()) // the top operation may be any
    return true;
  MLIRContext context(registry, MLIRContext::Threading::DISABLED);
  std::string said;
  ScopedDiagnosticHandler handler(&context, [&](Diagnostic &diagnostic) {
    if (said.empty())
      said = diagnostic.str();
    return success();
  });
  PassManager passes(&context, ModuleOp::getOperationName(),
                     PassManager::Nesting::Implicit);
  if (succeeded(config.setupPassPipeline(passes)))
    return true;
  StringRef text(said);
  if (size_t at = text.find(": error: "); at != StringRef::npos)
    text = text.drop_front(at + strlen(": error: "));
  text.consume_front("<Pass-Options-Parser>: ");
  return tool.fail("passes: " + text.rtrim().str());
}

/// Runs passes and says on the standard error, if it is asked for, what they
/// changed.
static bool runPasses(const std::string &input, const std::string &output,
                      ReportFormat format, DialectRegistry &registry) {
  piko::PassReport report;
  MlirOptMainConfig config = MlirOptMainConfig::createFromCLOptions();
  MlirOptMainConfig asAsked = config;
  if (!checkPasses(asAsked, registry))
    return false;
  if (format != ReportFormat::None)
    config.setPassPipelineSetupFn([&](PassManager &passes) {
      report.follow(passes);
      return asAsked.setupPassPipeline(passes);
    });
  std::unique_ptr<llvm::MemoryBuffer> file = tool.open(input);
  if (!file)
    return false;
  std::string text;
  llvm::raw_string_ostream stream(text);
  bool isRight =
      succeeded(MlirOptMain(stream, std::move(file), registry, config));
  // Of parts of a file some may be right.
  if ((isRight || output == "-") && !tool.write(output, text))
    return false;
  if (isRight && format == ReportFormat::JSON)
    report.writeJSON(llvm::errs());
  else if (isRight && format == ReportFormat::Text)
    report.writeText(llvm::errs());
  return isRight;
}

/// Remarks point at lines: the operations that they are about would be pages.
/// The option still prints them.
static void leaveOutOperations() {
  registerMLIRContextCLOptions();
  auto &options = llvm::cl::getRegisteredOptions();
  auto *print = options.lookup("mlir-print-op-on-diagnostic");
  static_cast<llvm::cl::opt<bool> *>(print)->setInitialValue(false);
}

/// Returns the exit status.
static int optimize(int argc, char **argv) {
  leaveOutOperations();
  llvm::cl::opt<ReportFormat> report{
      "report-passes",
      llvm::cl::desc(
          "say which passes changed anything, and how many operations "
          "there are more or fewer"),
      llvm::cl::init(ReportFormat::None),
      llvm::cl::values(
          clEnumValN(ReportFormat::Text, "text", "a line for each of them"),
          clEnumValN(ReportFormat::JSON, "json",
                     "all passes, and all numbers"))};
  DialectRegistry registry;
  piko::registerPikoDialects(registry);
  piko::registerPikoPasses();
  llvm::cl::opt<std::string> input{llvm::cl::Positional,
                                   llvm::cl::desc("<input file>"),
                                   llvm::cl::init("-")};
  llvm::cl::opt<std::string> output{"o", llvm::cl::desc("where to write"),
                                    llvm::cl::value_desc("file"),
                                    llvm::cl::init("-")};
  std::string header =
      registerCLIOptions("Piko's optimizer: passes on .mlir files\n", registry);
  llvm::InitLLVM init(argc, argv);
  if (!tool.parseOptions(argc, argv, header))
    return 1;
  MlirOptMainConfig config = MlirOptMainConfig::createFromCLOptions();
  if (config.shouldShowDialects() || config.shouldListPasses())
    return asMainReturnCode(MlirOptMain(argc, argv, input, output, registry));
  return runPasses(input, output, report, registry) ? 0 : 1;
}

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-opt");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  if (piko::answerHelp(help, argc, argv))
    return 0;
  return piko::runMainOnDeepStack([&] { return optimize(argc, argv); });
}
