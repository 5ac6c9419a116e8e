// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The compiler's command: reads a pipeline from C++ or, at any level, from
// .mlir and writes an object with its header, any level on the way, or a
// report.

#include "Dependencies.h"
#include "Options.h"

#include "Piko/CommandLine/Messages.h"
#include "Piko/CommandLine/Progress.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Driver/Explain.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"
#include "Piko/Target/PTX.h"
#include "Piko/Target/Processor.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/InitLLVM.h"

#include <csignal>
#include <cstdio>

using namespace mlir;
using namespace piko;
using pikoc::Emit;

static int fail(const std::string &message) {
  llvm::errs() << addToolName("pikoc", "error: " + message + "\n");
  return 1;
}

static std::string printPipes(const std::vector<std::string> &names) {
  std::string text;
  for (const std::string &name : names)
    text += name + "\n";
  return text;
}

static std::string printTunables(const std::vector<TunableDescription> &list) {
  std::string text;
  llvm::raw_string_ostream stream(text);
  for (const TunableDescription &tunable : list) {
    if (auto place = dyn_cast<FileLineColLoc>(tunable.location))
      stream << place.getFilename().getValue() << ":" << place.getLine() << ":"
             << place.getColumn() << ": ";
    stream << tunable.name << " = " << llvm::join(tunable.values, " | ")
           << "\n";
  }
  return text;
}

static std::string print(ModuleOp module) {
  std::string text;
  llvm::raw_string_ostream stream(text);
  module->print(stream);
  stream << "\n";
  return text;
}

namespace {

/// The text that is asked for of one pipeline, or of the file. Members return
/// nothing after an error.
class TextWriter {
public:
  TextWriter(const pikoc::Options &options, const std::string &pipe)
      : options(options), source(options.getSource(pipe)),
        target(options.getTarget(pipe)) {}

  /// What a level looks like, the file's pipelines, or a report.
  std::optional<std::string> write();

private:
  std::optional<std::string> writeAsked();
  std::optional<std::string> explain();
  /// LLVM IR as text, or assembly made of it.
  std::optional<std::string> translate(ModuleOp module);
  /// Kernels for a GPU, as a level or as PTX.
  std::optional<std::string> writeKernels();

  /// What levels below the machine's depend on.
  std::optional<CPUOptions> findProcessor();
  std::nullopt_t fail(llvm::Error error) {
    diagnostics += "error: " + llvm::toString(std::move(error)) + "\n";
    return std::nullopt;
  }

  const pikoc::Options &options;
  CompileOptions source;
  const TargetOptions target;
  PikoContext context;
  std::string diagnostics; ///< Printed at the end.
};

} // namespace

std::optional<CPUOptions> TextWriter::findProcessor() {
  llvm::Expected<Processor> processor = resolveProcessor(options.cpu);
  if (!processor)
    return fail(processor.takeError());
  return CPUOptions{.lanes = processor->lanes};
}

std::optional<std::string> TextWriter::explain() {
  OwningOpRef<ModuleOp> module = readPipeline(source, context);
  if (!module)
    return std::nullopt;
  std::optional<CPUOptions> cpu = findProcessor();
  if (!cpu)
    return std::nullopt;
  auto report = explainPipeline(*module, source.check, source.synthesis, *cpu,
                                source.gpu, options.optLevel);
  return failed(report) ? std::nullopt : std::optional(*report);
}

std::optional<std::string> TextWriter::translate(ModuleOp module) {
  llvm::LLVMContext llvmContext;
  std::unique_ptr<llvm::Module> translated =
      translateToLLVMIR(module, llvmContext, source.gpu, options.optLevel);
  if (!translated)
    return std::nullopt;
  std::string text;
  llvm::raw_string_ostream stream(text);
  if (options.getEmit() == Emit::LLVMIR) {
    translated->print(stream, nullptr);
    return text;
  }
  auto code = generateCode(*translated, target, CodeFormat::Assembly);
  if (!code)
    return fail(code.takeError());
  return *code;
}

std::optional<std::string> TextWriter::writeKernels() {
  OwningOpRef<ModuleOp> module = readPipeline(source, context);
  if (!module ||
      failed(lowerToGPU(*module, source.check, source.synthesis, source.gpu)))
    return std::nullopt;
  if (options.getEmit() == Emit::GPU)
    return print(*module);
  llvm::LLVMContext llvmContext;
  std::unique_ptr<llvm::Module> kernels =
      translateKernels(*module, llvmContext);
  if (!kernels)
    return std::nullopt;
  auto text = generatePTX(*kernels, options.cpu, options.optLevel);
  if (!text)
    return fail(text.takeError());
  return *text;
}

std::optional<std::string> TextWriter::write() {
  std::optional<std::string> text;
  {
    Progress progress("compiling " + options.file);
    text = writeAsked();
  }
  llvm::errs() << addToolName("pikoc", diagnostics);
  return text;
}

std::optional<std::string> TextWriter::writeAsked() {
  llvm::raw_string_ostream stream(diagnostics);
  DiagnosticPrinter printer(context, stream, options.remarks);
  if (options.listPipes) {
    auto names = readPipelineNames(source, context);
    return failed(names) ? std::nullopt : std::optional(printPipes(*names));
  }
  if (options.listTunables) {
    auto tunables = readTunables(
        options.getSource(source.pipeName, /*isTuned=*/false), context);
    return failed(tunables) ? std::nullopt
                            : std::optional(printTunables(*tunables));
  }
  if (options.explain)
    return explain();
  Emit emit = options.getEmit();
  if (emit >= Emit::GPU)
    return writeKernels();
  Level level = emit >= Emit::LLVMIR ? Level::LLVM : static_cast<Level>(emit);
  std::optional<CPUOptions> cpu = findProcessor();
  if (!cpu)
    return std::nullopt;
  // Who looks at it wants to see what the text means.
  source.reusesAuthored = level != Level::Authored;
  OwningOpRef<ModuleOp> module = readPipeline(source, context);
  if (!module || failed(lowerPipeline(*module, level, source.check,
                                      source.synthesis, source.gpu, *cpu)))
    return std::nullopt;
  return emit >= Emit::LLVMIR ? translate(*module) : print(*module);
}

/// The texts of all pipelines that are named; nothing after an error.
static std::optional<std::string> writeTexts(const pikoc::Options &options) {
  Emit emit = options.getEmit();
  bool isMLIR = !options.explain && emit != Emit::LLVMIR &&
                emit != Emit::Assembly && emit != Emit::PTX;
  std::string texts;
  for (const std::string &pipe : options.pipes) {
    std::optional<std::string> text = TextWriter(options, pipe).write();
    if (!text)
      return std::nullopt;
    if (!texts.empty())
      texts += isMLIR ? "\n// -----\n\n" : "\n";
    texts += *text;
  }
  return texts;
}

/// The object and what belongs to it; false after an error.
static bool writeObject(const pikoc::Options &options,
                        support::OutputFiles &outputs) {
  const std::string &pipe = options.pipes[0];
  ObjectOptions objectOptions{.source = options.getSource(pipe),
                              .target = options.getTarget(pipe),
                              .nameSpace = options.nameSpace,
                              .remarks = options.remarks};
  std::string diagnostics;
  if (options.setting.stripSize > 0)
    diagnostics = "warning: --tuned: the host sets strips of " +
                  std::to_string(options.setting.stripSize) + " primitives\n";
  std::optional<CompiledObject> object;
  {
    Progress progress("compiling " + options.file);
    object = compileObject(objectOptions, diagnostics);
  }
  llvm::errs() << addToolName("pikoc", diagnostics);
  if (!object)
    return false;
  if (!options.header.empty() && object->header.empty()) {
    fail("--header: expected the machine level or one above it, because below "
         "it nothing says what the pipeline takes");
    return false;
  }
  if (!options.tuned.empty())
    object->files.push_back(options.tuned);
  std::vector<std::string> targets = {options.output};
  auto done = outputs.add(options.output, object->code);
  if (done && !options.header.empty()) {
    targets.push_back(options.header);
    done = outputs.add(options.header, object->header);
  }
  if (done && !options.depfile.empty())
    done =
        outputs.add(options.depfile, writeDependencies(targets, object->files));
  if (!done)
    fail(done.error().message);
  return bool(done);
}

/// LLVM's own options, which are the process's.
static void setLLVMOptions(const std::vector<std::string> &options) {
  std::vector<const char *> words = {"pikoc"};
  for (const std::string &option : options)
    words.push_back(option.c_str());
  if (words.size() > 1)
    llvm::cl::ParseCommandLineOptions(static_cast<int>(words.size()),
                                      words.data());
}

/// Returns the exit status.
static int compile(const std::vector<std::string> &words) {
  auto options = pikoc::parseOptions(words);
  if (!options)
    return fail(options.error().message);
  support::OutputFiles outputs;
  if (!options->help.empty()) {
    std::fputs(options->help.c_str(), stdout);
    auto done = support::finishOutput();
    return done ? 0 : fail(done.error().message);
  }
  setLLVMOptions(options->llvm);
  if (options->getEmit() == Emit::Object && !options->isListing()) {
    if (!writeObject(*options, outputs))
      return 1;
  } else {
    std::optional<std::string> text = writeTexts(*options);
    if (!text)
      return 1;
    if (auto done = outputs.add(options->output, *text); !done)
      return fail(done.error().message);
  }
  if (auto done = outputs.keep(); !done)
    return fail(done.error().message);
  return 0;
}

int main(int argc, char **argv) {
  llvm::InitLLVM init(argc, argv);
  piko::support::reportOutOfMemory("pikoc");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  std::vector<std::string> words(argv + 1, argv + argc);
  return runMainOnDeepStack([&] { return compile(words); });
}
