// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The compiler's command: reads a pipeline from C++ or, at any level, from
// .mlir and writes an object with its header, any level on the way, or a
// report.

#include "Dependencies.h"

#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Driver/Explain.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Driver/TunedSetting.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"
#include "Piko/Target/Object.h"
#include "Piko/Target/PTX.h"
#include "Piko/Target/Processor.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/InitLLVM.h"
#include "llvm/Support/Path.h"

#include <csignal>

using namespace mlir;
using namespace piko;

namespace {

enum class Emit {
  Authored,
  Kernels,
  Machine,
  Target,
  LLVM,
  LLVMIR,
  Assembly,
  Object,
  GPU,
  PTX
};

struct CommandLine {
  llvm::cl::OptionCategory category{"pikoc options"};
  llvm::cl::opt<std::string> file{llvm::cl::Positional, llvm::cl::Required,
                                  llvm::cl::desc("FILE.cpp|FILE.mlir|-"),
                                  llvm::cl::cat(category)};
  llvm::cl::opt<std::string> pipe{
      "pipe", llvm::cl::value_desc("name,..."),
      llvm::cl::desc("the pipeline to compile, where a file has several; of "
                     "several what is written stands one after the other"),
      llvm::cl::cat(category)};
  llvm::cl::opt<Emit> emit{
      "emit",
      llvm::cl::desc("what to write (default: object where -o ends in .o or "
                     "--header is given, assembly where it ends in .s, or else "
                     "llvmir)"),
      llvm::cl::init(Emit::LLVMIR), llvm::cl::cat(category),
      llvm::cl::values(
          clEnumValN(Emit::Authored, "authored", "stages with their phases"),
          clEnumValN(Emit::Kernels, "kernels", "phases that run together"),
          clEnumValN(Emit::Machine, "machine", "structured work on bins"),
          clEnumValN(Emit::Target, "target", "upstream dialects"),
          clEnumValN(Emit::LLVM, "llvm", "the llvm and omp dialects"),
          clEnumValN(Emit::LLVMIR, "llvmir", "LLVM IR"),
          clEnumValN(Emit::Assembly, "assembly", "the processor's language"),
          clEnumValN(Emit::Object, "object", "an object file to link"),
          clEnumValN(Emit::GPU, "gpu",
                     "kernels for a GPU, and what launches them"),
          clEnumValN(Emit::PTX, "ptx", "kernels as NVIDIA's assembly"))};
  llvm::cl::opt<std::string> output{
      "o", llvm::cl::value_desc("file"), llvm::cl::init("-"),
      llvm::cl::desc("where to write (default: standard output)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> header{
      "header", llvm::cl::value_desc("file"),
      llvm::cl::desc("write a C++ header for who links the object"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> nameSpace{
      "namespace", llvm::cl::value_desc("name"),
      llvm::cl::init(defaultNamespace),
      llvm::cl::desc("of the class in the header, and a part of the object's "
                     "symbol (default: pipelines)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> depfile{
      "depfile", llvm::cl::value_desc("file"),
      llvm::cl::desc("write a rule for make or ninja with the files read"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> cpu{
      "cpu", llvm::cl::value_desc("name,..."),
      llvm::cl::desc("the processor to make code for, as clang names them, or "
                     "native (default: x86-64-v3, generic elsewhere, sm_90 for "
                     "ptx); of several in an object the last runs that fits "
                     "the machine"),
      llvm::cl::cat(category)};
  llvm::cl::opt<GPUTarget> target{
      "target", llvm::cl::desc("what code runs on (default: cpu)"),
      llvm::cl::values(
          clEnumValN(GPUTarget::None, "cpu", "the processor"),
          clEnumValN(GPUTarget::CUDA, "cuda",
                     "kernels on an NVIDIA GPU, all else on the processor"),
          clEnumValN(GPUTarget::Auto, "auto",
                     "cuda where a program finds a device, else cpu: for an "
                     "object"),
          clEnumValN(
              GPUTarget::Emulator, "gpu-on-cpu",
              "kernels for a GPU, on the processor: blocks one after the "
              "other, their threads by turns")),
      llvm::cl::init(GPUTarget::None), llvm::cl::cat(category)};
  llvm::cl::opt<std::string> gpuChip{
      "gpu-chip", llvm::cl::value_desc("name,..."),
      llvm::cl::desc("chips of --target cuda: PTX for the oldest of them and "
                     "later ones (default: sm_70), and, where ptxas is found, "
                     "a cubin for each that is named"),
      llvm::cl::cat(category)};
  llvm::cl::opt<int64_t> gpuBlocks{
      "gpu-blocks", llvm::cl::value_desc("count"), llvm::cl::init(0),
      llvm::cl::desc("most blocks of a grid of --target gpu-on-cpu (default: "
                     "one for each unit of work)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<int64_t> gpuSeed{
      "gpu-seed", llvm::cl::value_desc("number"), llvm::cl::init(0),
      llvm::cl::desc("permutes the blocks of --target gpu-on-cpu (default: in "
                     "order)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<int64_t> gpuThreads{
      "gpu-threads", llvm::cl::value_desc("count"), llvm::cl::init(0),
      llvm::cl::desc(
          "threads of a block, a power of two up to 1024 (default: "
          "as many as the stage has; up to 256 where a bin has more than "
          "16 pixels for each)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<unsigned> optLevel{
      "O",
      llvm::cl::Prefix,
      llvm::cl::value_desc("level"),
      llvm::cl::init(3),
      llvm::cl::desc("how much to optimise, 0 to 3 (default: 3)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<Sanitizer> sanitizer{
      "sanitize",
      llvm::cl::desc("instrument the code for a program and a libpikort that "
                     "are built with this sanitizer"),
      llvm::cl::init(Sanitizer::None), llvm::cl::cat(category),
      llvm::cl::values(clEnumValN(Sanitizer::Address, "address",
                                  "accesses to heap and stack"),
                       clEnumValN(Sanitizer::Thread, "thread", "data races"))};
  llvm::cl::opt<bool> listPipes{
      "list-pipes", llvm::cl::desc("print the names of the file's pipelines"),
      llvm::cl::cat(category)};
  llvm::cl::opt<bool> listTunables{
      "list-tunables",
      llvm::cl::desc("print where the file declares tunables, and the values "
                     "that each may have, first the standard one"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> tuned{
      "tuned", llvm::cl::value_desc("file"),
      llvm::cl::desc("compile with the setting that piko-tune wrote there"),
      llvm::cl::cat(category)};
  llvm::cl::list<std::string> includeDirs{
      "I", llvm::cl::Prefix, llvm::cl::value_desc("folder"),
      llvm::cl::desc("where C++ looks for headers"), llvm::cl::cat(category)};
  llvm::cl::list<std::string> defines{
      "D", llvm::cl::Prefix, llvm::cl::value_desc("name[=value]"),
      llvm::cl::desc("a macro for C++"), llvm::cl::cat(category)};
  llvm::cl::opt<bool> noCache{
      "no-cache", llvm::cl::desc("compile objects even if nothing changed"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> cacheDir{
      "cache-dir", llvm::cl::value_desc("folder"),
      llvm::cl::desc("where objects are kept (default: $PIKO_CACHE_DIR, "
                     "$XDG_CACHE_HOME/piko or ~/.cache/piko)"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> check{
      "check", llvm::cl::ValueOptional,
      llvm::cl::value_desc("nan:record.field,..."),
      llvm::cl::desc("check the rules of state while the pipeline runs, and "
                     "these fields for NaN"),
      llvm::cl::cat(category)};
  llvm::cl::opt<std::string> without{
      "without", llvm::cl::value_desc("pass,..."),
      llvm::cl::desc("passes of synthesis to leave out"),
      llvm::cl::cat(category)};
  llvm::cl::list<std::string> fix{
      "fix", llvm::cl::CommaSeparated, llvm::cl::value_desc("name=value,..."),
      llvm::cl::desc("specialize the pipeline for values of constants, "
                     "name[.field][[element]], and for sizes of buffers, "
                     "name.size; a run with others is an error"),
      llvm::cl::cat(category)};
  llvm::cl::opt<double> mappingWindow{
      "mapping-window", llvm::cl::value_desc("factor"),
      llvm::cl::desc(
          "hold a loop as vectors and as a scalar loop, of which the "
          "runtime measures which is faster, where estimates are "
          "within this factor of each other (default: 2; 1: none)"),
      llvm::cl::init(SynthesisOptions().mappingWindow),
      llvm::cl::cat(category)};
  llvm::cl::opt<bool> explain{
      "explain", llvm::cl::desc("write what synthesis makes of the pipeline"),
      llvm::cl::cat(category)};
  llvm::cl::opt<bool> remarks{
      "remarks", llvm::cl::desc("print what the passes have to say"),
      llvm::cl::cat(category)};

  /// What the file of --tuned holds.
  TunedSetting setting;

  bool isListing() const { return listPipes || listTunables; }
  Emit getEmit() const {
    if (emit.getNumOccurrences())
      return emit;
    llvm::StringRef extension = llvm::sys::path::extension(output);
    if (header.getNumOccurrences() || extension == ".o")
      return Emit::Object;
    return extension == ".s" ? Emit::Assembly : Emit::LLVMIR;
  }
  /// None if its value is wrong.
  std::optional<CheckOptions> getCheck() const {
    if (!check.getNumOccurrences())
      return CheckOptions();
    return parseCheckOptions(check.empty() ? "" : "=" + check);
  }
  std::optional<SynthesisOptions> getSynthesis() const {
    auto options =
        without.empty() ? SynthesisOptions() : parseSynthesisOptions(without);
    if (options) {
      options->fix.assign(fix.begin(), fix.end());
      options->mappingWindow = mappingWindow;
    }
    return options;
  }
  bool isEmulated() const { return target == GPUTarget::Emulator; }
  /// Returns what is wrong, or nothing.
  std::string readTuned() {
    if (!tuned.getNumOccurrences())
      return "";
    std::string error;
    if (auto found = readTunedSetting(tuned, error))
      setting = std::move(*found);
    return error;
  }
  /// Sets what was tuned; returns what is wrong, or nothing.
  std::string tune(CompileOptions &options) const {
    if (!tuned.getNumOccurrences())
      return "";
    return setting.apply(options.pipeName, options.tunables, options.synthesis);
  }
  CompileOptions getSource() const {
    CompileOptions options = getUntuned();
    (void)tune(options);
    return options;
  }
  std::string pipeName; ///< The one of `pipe` that is compiled.
  CompileOptions getUntuned() const {
    GPUOptions gpu{.threads = gpuThreads,
                   .target = target,
                   .seed = gpuSeed,
                   .blocks = gpuBlocks};
    if (gpuChip.getNumOccurrences())
      (void)gpu.setChips(gpuChip.getValue());
    return {
        .file = file,
        .pipeName = pipeName,
        .includeDirs = {includeDirs.begin(), includeDirs.end()},
        .defines = {defines.begin(), defines.end()},
        .check = *getCheck(),
        .synthesis = *getSynthesis(),
        .gpu = std::move(gpu),
        // Of standard input the cache does not know what was in it.
        .cache = {.enabled = !noCache && file != "-", .directory = cacheDir}};
  }
  TargetOptions getTarget() const {
    return TargetOptions{.cpu = cpu,
                         .optLevel = static_cast<int>(optLevel),
                         .sanitizer = sanitizer}
        .leaveOut(getSource().synthesis);
  }
};

} // namespace

static int fail(const llvm::Twine &message) {
  llvm::errs() << "error: " << message << "\n";
  return 1;
}

/// The names between commas; one with arguments of a template may have its own.
static std::vector<std::string> splitNames(llvm::StringRef text) {
  std::vector<std::string> names(1);
  int depth = 0;
  for (char c : text) {
    depth += (c == '<') - (c == '>');
    if (c == ',' && depth == 0)
      names.emplace_back();
    else
      names.back() += c;
  }
  return names;
}

/// What is wrong with options that are fine one by one; empty if nothing.
static std::string checkOptions(const CommandLine &line) {
  bool isObject = line.getEmit() == Emit::Object && !line.isListing();
  if (!line.getCheck())
    return "--check: expected nan:RECORD.FIELD,..., but got '" + line.check +
           "'";
  if (!line.getSynthesis())
    return describeWrongSynthesisOptions(line.without);
  CompileOptions source = line.getUntuned();
  if (std::string wrong = line.tune(source); !wrong.empty())
    return "--tuned: " + wrong;
  if (!(line.mappingWindow >= 1 && line.mappingWindow <= 1000))
    return "--mapping-window: expected a factor in [1, 1000]";
  if (line.optLevel > 3)
    return "expected -O0 to -O3, but got -O" + std::to_string(line.optLevel);
  if (!isObject &&
      (line.header.getNumOccurrences() || line.depfile.getNumOccurrences()))
    return "--header and --depfile belong to an object, which --emit=object or "
           "an -o that ends in .o asks for";
  if (splitNames(line.pipe).size() > 1 &&
      (isObject || line.listPipes || line.listTunables || line.file == "-"))
    return "--pipe: expected one pipeline, because only text is written of "
           "several in a file, but got '" +
           line.pipe + "'";
  if (!isObject && llvm::StringRef(line.cpu).contains(','))
    return "--cpu: expected one processor, because only an object has code for "
           "several, but got '" +
           line.cpu + "'";
  bool isGPU = line.getEmit() >= Emit::GPU;
  bool isForGPU = line.target != GPUTarget::None;
  if (isForGPU && isGPU)
    return "--target is for the host's code, and goes without --emit=gpu and "
           "--emit=ptx";
  if (line.gpuThreads.getNumOccurrences() && !isForGPU && !isGPU)
    return "--gpu-threads belongs to --emit=gpu, --emit=ptx, --target cuda or "
           "--target gpu-on-cpu";
  bool isForCUDA =
      line.target == GPUTarget::CUDA || line.target == GPUTarget::Auto;
  if (line.gpuChip.getNumOccurrences() && !isForCUDA)
    return "--gpu-chip belongs to --target cuda or auto";
  if (line.gpuChip.getNumOccurrences() &&
      !GPUOptions().setChips(line.gpuChip.getValue()))
    return "--gpu-chip: expected names such as sm_90 between commas, but got "
           "'" +
           line.gpuChip + "'";
  if (line.target == GPUTarget::Auto && !isObject)
    return "--target auto belongs to an object, which has code for both";
  if (line.gpuSeed.getNumOccurrences() && !line.isEmulated())
    return "--gpu-seed belongs to --target gpu-on-cpu";
  if (line.gpuBlocks.getNumOccurrences() && !line.isEmulated())
    return "--gpu-blocks belongs to --target gpu-on-cpu";
  if (line.sanitizer.getNumOccurrences() &&
      (line.getEmit() < Emit::Assembly || isGPU))
    return "--sanitize belongs to an object or assembly";
  if (line.explain && (line.emit.getNumOccurrences() || line.isListing() ||
                       line.getEmit() != Emit::LLVMIR))
    return "--explain writes a report, and goes without --emit, --list-pipes, "
           "--list-tunables and an -o that ends in .o or .s";
  if (!line.fix.empty() && line.getEmit() == Emit::Authored)
    return "--fix takes effect below the authored level, which --emit=authored "
           "prints as it is";
  if (isObject && line.output == "-" && llvm::outs().is_displayed())
    return "expected -o, because an object is not for a terminal";
  return "";
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

/// What levels below the machine's depend on; nothing after an error.
static std::optional<CPUOptions> findProcessor(const CommandLine &line) {
  llvm::Expected<Processor> processor = resolveProcessor(line.cpu);
  if (processor)
    return CPUOptions{.lanes = processor->lanes};
  fail(llvm::toString(processor.takeError()));
  return std::nullopt;
}

static std::optional<std::string> explain(const CommandLine &line,
                                          MLIRContext &context) {
  CompileOptions source = line.getSource();
  OwningOpRef<ModuleOp> module = readPipeline(source, context);
  if (!module)
    return std::nullopt;
  std::optional<CPUOptions> cpu = findProcessor(line);
  if (!cpu)
    return std::nullopt;
  auto report = explainPipeline(*module, source.check, source.synthesis, *cpu,
                                source.gpu, static_cast<int>(line.optLevel));
  return failed(report) ? std::nullopt : std::optional(*report);
}

static std::string print(ModuleOp module) {
  std::string text;
  llvm::raw_string_ostream stream(text);
  module->print(stream);
  stream << "\n";
  return text;
}

/// LLVM IR as text, or assembly made of it; nothing after an error.
static std::optional<std::string> translate(const CommandLine &line,
                                            ModuleOp module) {
  llvm::LLVMContext context;
  std::unique_ptr<llvm::Module> translated = translateToLLVMIR(
      module, context, line.getSource().gpu, static_cast<int>(line.optLevel));
  if (!translated)
    return std::nullopt;
  std::string text;
  llvm::raw_string_ostream stream(text);
  if (line.getEmit() == Emit::LLVMIR) {
    translated->print(stream, nullptr);
    return text;
  }
  auto code = generateCode(*translated, line.getTarget(), CodeFormat::Assembly);
  if (code)
    return *code;
  fail(llvm::toString(code.takeError()));
  return std::nullopt;
}

/// Kernels for a GPU, as a level or as PTX; nothing after an error.
static std::optional<std::string> writeKernels(const CommandLine &line,
                                               MLIRContext &context) {
  CompileOptions source = line.getSource();
  OwningOpRef<ModuleOp> module = readPipeline(source, context);
  if (!module ||
      failed(lowerToGPU(*module, source.check, source.synthesis, source.gpu)))
    return std::nullopt;
  if (line.getEmit() == Emit::GPU)
    return print(*module);
  llvm::LLVMContext llvmContext;
  std::unique_ptr<llvm::Module> kernels =
      translateKernels(*module, llvmContext);
  if (!kernels)
    return std::nullopt;
  auto text = generatePTX(*kernels, line.cpu, static_cast<int>(line.optLevel));
  if (text)
    return *text;
  fail(llvm::toString(text.takeError()));
  return std::nullopt;
}

/// What a level looks like, the file's pipelines, or a report; nothing after an
/// error.
static std::optional<std::string> writeText(const CommandLine &line) {
  PikoContext context;
  DiagnosticPrinter printer(context, llvm::errs(), line.remarks);
  if (line.listPipes) {
    auto names = readPipelineNames(line.getSource(), context);
    return failed(names) ? std::nullopt : std::optional(printPipes(*names));
  }
  if (line.listTunables) {
    auto tunables = readTunables(line.getUntuned(), context);
    return failed(tunables) ? std::nullopt
                            : std::optional(printTunables(*tunables));
  }
  if (line.explain)
    return explain(line, context);
  if (line.getEmit() >= Emit::GPU)
    return writeKernels(line, context);
  Level level = line.getEmit() >= Emit::LLVMIR
                    ? Level::LLVM
                    : static_cast<Level>(line.getEmit());
  std::optional<CPUOptions> cpu = findProcessor(line);
  if (!cpu)
    return std::nullopt;
  CompileOptions source = line.getSource();
  // Who looks at it wants to see what the text means.
  source.reusesAuthored = level != Level::Authored;
  OwningOpRef<ModuleOp> module = readPipeline(source, context);
  if (!module || failed(lowerPipeline(*module, level, source.check,
                                      source.synthesis, source.gpu, *cpu)))
    return std::nullopt;
  if (line.getEmit() >= Emit::LLVMIR)
    return translate(line, *module);
  return print(*module);
}

/// The texts of all pipelines that are named; nothing after an error.
static std::optional<std::string> writeTexts(CommandLine &line) {
  bool isMLIR = !line.explain && line.getEmit() != Emit::LLVMIR &&
                line.getEmit() != Emit::Assembly && line.getEmit() != Emit::PTX;
  std::string texts;
  for (const std::string &name : splitNames(line.pipe)) {
    line.pipeName = name;
    std::optional<std::string> text = writeText(line);
    if (!text)
      return std::nullopt;
    if (!texts.empty())
      texts += isMLIR ? "\n// -----\n\n" : "\n";
    texts += *text;
  }
  return texts;
}

/// The object and what belongs to it; false after an error.
static bool writeObject(const CommandLine &line,
                        support::OutputFiles &outputs) {
  ObjectOptions options{.source = line.getSource(),
                        .target = line.getTarget(),
                        .nameSpace = line.nameSpace,
                        .remarks = line.remarks};
  if (line.setting.stripSize > 0)
    llvm::errs() << "warning: --tuned: the host sets strips of "
                 << line.setting.stripSize << " primitives\n";
  std::string diagnostics;
  std::optional<CompiledObject> object = compileObject(options, diagnostics);
  llvm::errs() << diagnostics;
  if (!object)
    return false;
  if (line.header.getNumOccurrences() && object->header.empty()) {
    fail("--header: expected the machine level or one above it, because below "
         "it nothing says what the pipeline takes");
    return false;
  }
  if (!line.tuned.empty())
    object->files.push_back(line.tuned);
  std::vector<std::string> targets = {line.output};
  auto done = outputs.add(line.output, object->code);
  if (done && line.header.getNumOccurrences()) {
    targets.push_back(line.header);
    done = outputs.add(line.header, object->header);
  }
  if (done && line.depfile.getNumOccurrences())
    done = outputs.add(line.depfile, writeDependencies(targets, object->files));
  if (!done)
    fail(done.error().message);
  return bool(done);
}

/// Returns the exit status.
static int compile(int argc, char **argv) {
  CommandLine line;
  llvm::cl::HideUnrelatedOptions(line.category);
  llvm::cl::ParseCommandLineOptions(argc, argv,
                                    "Piko's compiler for pipelines\n");
  line.pipeName = line.pipe;
  if (std::string wrong = line.readTuned(); !wrong.empty())
    return fail("--tuned: " + wrong);
  if (std::string wrong = checkOptions(line); !wrong.empty())
    return fail(wrong);
  support::OutputFiles outputs;
  if (line.getEmit() == Emit::Object && !line.isListing()) {
    if (!writeObject(line, outputs))
      return 1;
  } else {
    std::optional<std::string> text = writeTexts(line);
    if (!text)
      return 1;
    if (auto done = outputs.add(line.output, *text); !done)
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
  return runMainOnDeepStack([&] { return compile(argc, argv); });
}
