// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Options.h"

#include "Piko/CommandLine/CommandLine.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/StringRef.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/raw_ostream.h"

using namespace piko;
using namespace piko::pikoc;
using support::Error;
using support::Result;

namespace {

constexpr int64_t maxCount = 1'000'000'000;

struct EmitChoice {
  Emit emit;
  Choice choice;
};

const EmitChoice emitChoices[] = {
    {Emit::Authored, {"authored", "stages with their phases"}},
    {Emit::Kernels, {"kernels", "phases that run together"}},
    {Emit::Machine, {"machine", "structured work on bins"}},
    {Emit::Target, {"target", "upstream dialects"}},
    {Emit::LLVM, {"llvm", "the llvm and omp dialects"}},
    {Emit::LLVMIR, {"llvmir", "LLVM IR"}},
    {Emit::Assembly, {"assembly", "the processor's language"}},
    {Emit::Object, {"object", "an object file to link"}},
    {Emit::GPU, {"gpu", "kernels for a GPU, and what launches them"}},
    {Emit::PTX, {"ptx", "kernels as NVIDIA's assembly"}}};

/// The names between commas; one with arguments of a template may have its own.
std::vector<std::string> splitPipes(const std::string &text) {
  std::vector<std::string> names(1);
  int depth = 0;
  for (char c : text) {
    depth += (c == '<') - (c == '>');
    if (c == ',' && depth == 0)
      names.emplace_back();
    else
      names.back() += c;
  }
  if (llvm::is_contained(names, ""))
    throw CommandLine::wrong(
        "--pipe",
        "expected names with commas between them, but got '" + text + "'");
  return names;
}

void setCheck(const std::string &text, Options &options) {
  auto check = parseCheckOptions(text);
  if (!check)
    throw CommandLine::wrong(
        "--check",
        "expected =nan:RECORD.FIELD,... or nothing, but got '" + text + "'");
  options.check = *check;
}

void setWithout(const std::string &text, Options &options) {
  auto synthesis = parseSynthesisOptions(text);
  if (!synthesis)
    throw CLI::ValidationError(describeWrongSynthesisOptions(text));
  options.synthesis.without = synthesis->without;
}

void setLevel(const std::string &text, Options &options) {
  if (text.size() != 1 || text[0] < '0' || text[0] > '3')
    throw CLI::ValidationError("expected -O0 to -O3, but got -O" + text);
  options.optLevel = text[0] - '0';
}

void setChips(const std::string &names, Options &options) {
  options.setsGPUChip = true;
  if (!options.gpu.setChips(names))
    throw CommandLine::wrong(
        "--gpu-chip",
        "expected names such as sm_90 between commas, but got '" + names + "'");
}

void addOutputOptions(CommandLine &line, Options &options) {
  std::vector<Choice> levels;
  for (const EmitChoice &it : emitChoices)
    levels.push_back(it.choice);
  line.addText("-o", "FILE", options.output,
               "where to write (standard output)");
  line.addText("--header", "FILE", options.header,
               "write a C++ header for who links the object");
  line.addChoice(
      "--emit", "WHAT", levels,
      [&](const std::string &word) {
        for (const EmitChoice &it : emitChoices)
          if (it.choice.word == word)
            options.emit = it.emit;
      },
      "what to write (object where -o ends in .o or --header is given, "
      "assembly where it ends in .s, or else llvmir):");
  line.addText("--depfile", "FILE", options.depfile,
               "write a rule for make or ninja with the files read");
  line.addText("--namespace", "NAME", options.nameSpace,
               "of the class in the header, and a part of the object's symbol "
               "(pipelines)");
  line.add_flag("--list-pipes", options.listPipes,
                "print the names of the file's pipelines");
  line.add_flag("--list-tunables", options.listTunables,
                "print where the file declares tunables, and the values that "
                "each may have, first the standard one");
  line.add_flag("--explain", options.explain,
                "write what synthesis makes of the pipeline");
  line.add_flag("--remarks", options.remarks,
                "print what the passes have to say");
}

void addSourceOptions(CommandLine &line, Options &options) {
  line.addText(
      "--pipe", "NAME,...",
      [&](const std::string &text) { options.pipes = splitPipes(text); },
      "the pipeline to compile, where a file has several; of several what is "
      "written stands one after the other");
  line.addTexts("-I", "FOLDER", options.includeDirs,
                "where C++ looks for headers; may be repeated");
  line.addTexts("-D", "NAME[=VALUE]", options.defines,
                "a macro for C++; may be repeated");
  line.addText("--tuned", "FILE", options.tuned,
               "compile with the setting that piko-tune wrote there");
  line.addText(
      "--fix", "NAME=VALUE,...",
      [&](const std::string &text) {
        for (std::string &part : splitNames("--fix", text))
          options.synthesis.fix.push_back(std::move(part));
      },
      "specialize the pipeline for values of constants, name[.field][[element]]"
      ", and for sizes of buffers, name.size; a run with others is an error");
  line.addOptional(
      "--check", "[=nan:RECORD.FIELD,...]",
      [&](const std::string &text) { setCheck(text, options); },
      "check the rules of state while the pipeline runs, and these fields for "
      "NaN");
  line.addText(
      "--without", "PASS,...",
      [&](const std::string &text) { setWithout(text, options); },
      "passes of synthesis to leave out");
  line.add_flag(
      "--ranks", options.synthesis.ranks,
      "divide runs among ranks, processes that own bins; a host gives "
      "them by pikort/ranks.h");
  line.addNumber("--mapping-window", "FACTOR", options.synthesis.mappingWindow,
                 "hold a loop as vectors and as a scalar loop, of which the "
                 "runtime measures which is faster, where estimates are within "
                 "this factor of each other; 1: none (2)",
                 1, 1000);
  line.add_flag_callback(
      "--no-cache", [&] { options.usesCache = false; },
      "compile objects even if nothing changed");
  line.addText("--cache-dir", "FOLDER", options.cacheDirectory,
               "where objects are kept ($PIKO_CACHE_DIR, $XDG_CACHE_HOME/piko "
               "or ~/.cache/piko)");
}

void addTargetOptions(CommandLine &line, Options &options) {
  line.addChoice(
      "--arch", "NAME",
      {{"x86_64", "vectors of SSE, AVX2 or AVX-512"},
       {"aarch64", "64-bit Arm, with vectors of NEON"}},
      [&](const std::string &word) { options.arch = word; },
      "the processor's architecture (this machine's):");
  line.addText(
      "--cpu", "NAME,...", options.cpu,
      "the processor to make code for, as clang names them, or native "
      "(x86-64-v3, generic elsewhere, sm_90 for ptx); of several in an "
      "object the last runs that fits the machine");
  line.addText(
      "-O", "LEVEL", [&](const std::string &text) { setLevel(text, options); },
      "-O0 to -O3: how much to optimise (-O3)");
  line.addChoice(
      "--target", "TARGET",
      {{"cpu", "the processor"},
       {"cuda", "kernels on an NVIDIA GPU, all else on the processor"},
       {"auto", "cuda where a program finds a device, else cpu: for an object"},
       {"gpu-on-cpu", "kernels for a GPU, on the processor: blocks one after "
                      "the other, their threads by turns"}},
      [&](const std::string &word) {
        options.gpu.target = *parseGPUTarget(word);
      },
      "what code runs on (cpu):");
  line.addText(
      "--gpu-chip", "NAME,...",
      [&](const std::string &names) { setChips(names, options); },
      "chips of --target cuda: PTX for the oldest of them and later ones "
      "(sm_70), and, where ptxas is found, a cubin for each that is named");
  auto add = [&](const std::string &name, const std::string &value,
                 int64_t &number, bool &isSet, int64_t most,
                 const std::string &description) {
    line.addText(
        name, value,
        [=, &number, &isSet](const std::string &text) {
          isSet = true;
          number = CommandLine::readNumber<int64_t>(name, text, 0, most);
        },
        description);
  };
  add("--gpu-threads", "N", options.gpu.threads, options.setsGPUThreads,
      maxCount,
      "threads of a block, a power of two up to 1024 (as many as the stage "
      "has; up to 256 where a bin has more than 16 pixels for each)");
  add("--gpu-blocks", "N", options.gpu.blocks, options.setsGPUBlocks, maxCount,
      "most blocks of a grid of --target gpu-on-cpu (one for each unit of "
      "work)");
  add("--gpu-seed", "N", options.gpu.seed, options.setsGPUSeed, maxCount,
      "permutes the blocks of --target gpu-on-cpu (in order)");
  line.addChoice(
      "--sanitize", "WHAT",
      {{"address", "accesses to heap and stack"}, {"thread", "data races"}},
      [&](const std::string &word) {
        options.sanitizer =
            word == "thread" ? Sanitizer::Thread : Sanitizer::Address;
      },
      "instrument the code for a program and a libpikort that are built with "
      "this sanitizer:");
  line.addTexts("--llvm", "OPTION", options.llvm,
                "an option of LLVM's, as --llvm=-print-after-all; may be "
                "repeated");
}

void addBriefs(CommandLine &line) {
  line.setBrief("-o", "where to write; .o is an object, .s assembly");
  line.setBrief("--header", "the object's C++ header");
  line.setBrief("--pipe", "which pipeline of a file with several");
  line.setBrief("--cpu", "x86-64-v3, native, ...; several in one object");
  line.setBrief("--target", "cpu, cuda, auto or gpu-on-cpu");
  line.setBrief("-O", "-O0 to -O3 (-O3)");
  line.setBrief("-I", "where C++ looks for headers");
  line.setBrief("-D", "a macro for C++");
  line.setBrief("--fix", "specialize for values of constants");
  line.setBrief("--check", "check the rules of state while it runs");
  line.setBrief("--tuned", "a setting of piko-tune's");
  line.setBrief("--emit", "a level on the way: authored, kernels, ...");
  line.setBrief("--explain", "what synthesis makes of the pipeline");
  line.setBrief("--list-pipes", "the file's pipelines");
  line.setBrief("--depfile", "for make or ninja: the files read");
}

/// What is wrong with options for GPUs beside others; empty if nothing.
std::string findGPUProblem(const Options &options) {
  bool isGPU = options.getEmit() >= Emit::GPU;
  GPUTarget target = options.gpu.target;
  bool isForGPU = target != GPUTarget::None;
  if (isGPU && !options.arch.empty())
    return "--arch is for the processor's code, and goes without --emit=gpu "
           "and --emit=ptx";
  if (isForGPU && isGPU)
    return "--target is for the host's code, and goes without --emit=gpu and "
           "--emit=ptx";
  if (options.setsGPUThreads && !isForGPU && !isGPU)
    return "--gpu-threads belongs to --emit=gpu, --emit=ptx, --target cuda or "
           "--target gpu-on-cpu";
  if (options.setsGPUChip && target != GPUTarget::CUDA &&
      target != GPUTarget::Auto)
    return "--gpu-chip belongs to --target cuda or auto";
  if (target == GPUTarget::Auto &&
      (options.getEmit() != Emit::Object || options.isListing()))
    return "--target auto belongs to an object, which has code for both";
  if (options.setsGPUSeed && target != GPUTarget::Emulator)
    return "--gpu-seed belongs to --target gpu-on-cpu";
  if (options.setsGPUBlocks && target != GPUTarget::Emulator)
    return "--gpu-blocks belongs to --target gpu-on-cpu";
  return "";
}

std::string joinPipes(const Options &options) {
  std::string text;
  for (const std::string &name : options.pipes)
    text += (text.empty() ? "" : ",") + name;
  return text;
}

/// What is wrong with options that are fine one by one; empty if nothing.
std::string findProblem(const Options &options) {
  bool isObject = options.getEmit() == Emit::Object && !options.isListing();
  if (options.file.empty())
    return "expected FILE.cpp, FILE.mlir or -; see --help";
  CompileOptions source = options.getSource(options.pipes[0], false);
  if (!options.tuned.empty())
    if (std::string wrong = options.setting.apply(
            source.pipeName, source.tunables, source.synthesis);
        !wrong.empty())
      return "--tuned: " + wrong;
  if (!isObject && !(options.header.empty() && options.depfile.empty()))
    return "--header and --depfile belong to an object, which --emit=object or "
           "an -o that ends in .o asks for";
  if (options.pipes.size() > 1 &&
      (isObject || options.isListing() || options.file == "-"))
    return "--pipe: expected one pipeline, because only text is written of "
           "several in a file, but got '" +
           joinPipes(options) + "'";
  if (!isObject && options.cpu.find(',') != std::string::npos)
    return "--cpu: expected one processor, because only an object has code for "
           "several, but got '" +
           options.cpu + "'";
  if (std::string wrong = findGPUProblem(options); !wrong.empty())
    return wrong;
  Emit emit = options.getEmit();
  if (options.sanitizer != Sanitizer::None &&
      (emit < Emit::Assembly || emit >= Emit::GPU))
    return "--sanitize belongs to an object or assembly";
  if (options.explain &&
      (options.emit || options.isListing() || emit != Emit::LLVMIR))
    return "--explain writes a report, and goes without --emit, --list-pipes, "
           "--list-tunables and an -o that ends in .o or .s";
  if (!options.synthesis.fix.empty() && emit == Emit::Authored)
    return "--fix takes effect below the authored level, which --emit=authored "
           "prints as it is";
  if (isObject && options.output == "-" && llvm::outs().is_displayed())
    return "expected -o, because an object is not for a terminal";
  return "";
}

} // namespace

Emit Options::getEmit() const {
  if (emit)
    return *emit;
  llvm::StringRef extension = llvm::sys::path::extension(output);
  if (!header.empty() || extension == ".o")
    return Emit::Object;
  return extension == ".s" ? Emit::Assembly : Emit::LLVMIR;
}

CompileOptions Options::getSource(const std::string &pipe, bool isTuned) const {
  CompileOptions options{
      .file = file,
      .pipeName = pipe,
      .includeDirs = includeDirs,
      .defines = defines,
      .check = check,
      .synthesis = synthesis,
      .gpu = gpu,
      // Of standard input the cache does not know what was in it.
      .cache = {.enabled = usesCache && file != "-",
                .directory = cacheDirectory}};
  if (isTuned && !tuned.empty())
    (void)setting.apply(options.pipeName, options.tunables, options.synthesis);
  return options;
}

TargetOptions Options::getTarget(const std::string &pipe) const {
  return TargetOptions{
      .cpu = cpu, .optLevel = optLevel, .sanitizer = sanitizer, .arch = arch}
      .leaveOut(getSource(pipe).synthesis);
}

Result<Options> pikoc::parseOptions(const std::vector<std::string> &words) {
  CommandLine line(
      "pikoc [options] FILE.cpp|FILE.mlir|-",
      "Compiles a pipeline, written in C++ or, at any level, in .mlir, to an "
      "object with its header. Or writes any level on the way, or a report.",
      "pikoc spheres.piko.cpp -o spheres.o --header spheres.h");
  Options options;
  options.nameSpace = defaultNamespace;
  line.addText("FILE", "", options.file,
               "what to compile; - is .mlir on the standard input");
  addOutputOptions(line, options);
  line.beginGroup("What is compiled");
  addSourceOptions(line, options);
  line.beginGroup("What it is compiled to");
  addTargetOptions(line, options);
  addBriefs(line);
  auto help = line.read(words);
  if (!help)
    return help.error();
  options.help = *help;
  if (!options.help.empty())
    return options;
  if (!options.tuned.empty()) {
    std::string error;
    auto found = readTunedSetting(options.tuned, error);
    if (!found)
      return Error{"--tuned: " + error};
    options.setting = std::move(*found);
  }
  if (std::string problem = findProblem(options); !problem.empty())
    return Error{problem};
  return options;
}
