// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Runs passes on `.mlir` files.

#include "Piko/CommandLine/Help.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/PassReport.h"
#include "Piko/Driver/Registration.h"
#include "Piko/Support/OutOfMemory.h"

#include "mlir/IR/MLIRContext.h"
#include "mlir/Pass/PassManager.h"
#include "mlir/Support/FileUtilities.h"
#include "mlir/Tools/mlir-opt/MlirOptMain.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/InitLLVM.h"
#include "llvm/Support/MemoryBuffer.h"
#include "llvm/Support/ToolOutputFile.h"

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

enum class ReportFormat { None, Text, JSON };

/// Runs passes and says on the standard error what they changed.
static LogicalResult runWithReport(const std::string &input,
                                   const std::string &output,
                                   ReportFormat format,
                                   DialectRegistry &registry) {
  piko::PassReport report;
  MlirOptMainConfig config = MlirOptMainConfig::createFromCLOptions();
  MlirOptMainConfig asAsked = config;
  config.setPassPipelineSetupFn([&](PassManager &passes) {
    report.follow(passes);
    return asAsked.setupPassPipeline(passes);
  });
  std::string error;
  auto from = openInputFile(input, &error);
  auto to = from ? openOutputFile(output, &error) : nullptr;
  if (!from || !to) {
    llvm::errs() << "piko-opt: error: " << error << "\n";
    return failure();
  }
  if (failed(MlirOptMain(to->os(), std::move(from), registry, config)))
    return failure();
  to->keep();
  if (format == ReportFormat::JSON)
    report.writeJSON(llvm::errs());
  else
    report.writeText(llvm::errs());
  return success();
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
  auto [input, output] = registerAndParseCLIOptions(
      argc, argv, "Piko's optimizer: passes on .mlir files\n", registry);
  if (report == ReportFormat::None)
    return asMainReturnCode(MlirOptMain(argc, argv, input, output, registry));
  llvm::InitLLVM init(argc, argv);
  return asMainReturnCode(runWithReport(input, output, report, registry));
}

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-opt");
  if (piko::answerHelp(help, argc, argv))
    return 0;
  return piko::runMainOnDeepStack([&] { return optimize(argc, argv); });
}
