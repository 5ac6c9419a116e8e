// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Options.h"

#include "Piko/CommandLine/CommandLine.h"
#include "Piko/Target/Processor.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <system_error>

using piko::CommandLine;

namespace {

/// What a pipeline and its tests' memory may have of anything.
constexpr int mostOfAll = 1 << 30;

void addCaseOptions(CommandLine &line, Case &into) {
  line.addText("--pipe", "NAME", into.pipe,
               "which pipeline of the file (the only one)");
  line.addNumbers("--domain", "W H ..", 0, into.domain,
                  "the domain's size (64 48)", 1, 1073741824);
  line.addNumbers("--count", "N ..", 0, into.counts,
                  "primitives of each source; the last number is for all that "
                  "follow (1000)",
                  0, mostOfAll);
  line.addNumber("--elements", "N", into.elements, "of each buffer (64)", 0,
                 mostOfAll);
  line.addNumber("--seed", "S", into.seed, "of the input (1)");
  line.addNumber("--loop-limit", "N", into.loopLimit,
                 "of hops and rounds (0, as it is)");
  line.addNumber("--strip", "N", into.strip,
                 "primitives of a source in a strip (0, all)");
  line.addNumber("--budget", "BYTES", into.budget,
                 "what bins may hold (0, no budget)");
  line.addText("--capture", "FILE", into.capture,
               "what pikort_capture has written, in place of made-up input");
  line.add_flag("--wide", into.wide,
                "input of all bits, infinities and NaNs among it");
}

/// Reads words with a command line that throws nothing of CLI11's.
std::string read(CommandLine &line, const std::vector<std::string> &words) {
  auto help = line.read(words);
  if (!help)
    throw std::runtime_error(help.error().message);
  return *help;
}

/// Takes what --cpu or a name of --targets says apart.
void setProcessor(Target &target, const std::string &name) {
  const std::string other = "aarch64";
  target.cpu = name;
  if (name != other && !name.starts_with(other + ":"))
    return;
  target.arch = other;
  target.cpu = name == other ? "" : name.substr(other.size() + 1);
}

/// A name of --targets, with the options for a GPU that all of them share.
Target readTarget(const std::string &name, const piko::GPUOptions &gpu) {
  Target target{name, "native", gpu};
  if (auto kind = piko::parseGPUTarget(name);
      kind && *kind != piko::GPUTarget::Auto) {
    target.gpu.target = *kind;
    return target;
  }
  setProcessor(target, name);
  llvm::Expected<piko::Processor> processor = piko::resolveProcessor(
      target.cpu, llvm::cantFail(piko::resolveTriple(target.arch)));
  if (name.empty() || !processor)
    throw std::runtime_error(
        "expected --targets with cpu, gpu-on-cpu, cuda, aarch64 or names of "
        "processors between commas, but got '" +
        name + "'" +
        (processor ? "" : ": " + llvm::toString(processor.takeError())));
  return target;
}

/// Those of --targets, or the one of --target and --cpu.
std::vector<Target> readTargets(const std::optional<std::string> &names,
                                const Target &one) {
  if (!names) {
    Target only = one;
    setProcessor(only, one.cpu);
    return {only};
  }
  if (one.gpu.target != piko::GPUTarget::None || one.cpu != Target().cpu)
    throw std::runtime_error(
        "expected --targets, or --target and --cpu, but got both");
  std::vector<Target> targets;
  for (size_t begin = 0; begin <= names->size();) {
    size_t end = std::min(names->find(',', begin), names->size());
    std::string name = names->substr(begin, end - begin);
    if (std::any_of(targets.begin(), targets.end(),
                    [&](const Target &t) { return t.name == name; }))
      throw std::runtime_error("expected each of --targets once, but got '" +
                               name + "' twice");
    targets.push_back(readTarget(name, one.gpu));
    begin = end + 1;
  }
  return targets;
}

} // namespace

/// What to compile, and how.
static void addCompilerOptions(CommandLine &line, Options &options) {
  line.addText("FILE", "", options.file, "the pipelines, C++ or .mlir");
  line.addText("--reference", "FILE", options.reference,
               "the C++ that the reference executor runs (FILE)");
  line.addOptional(
      "--check", "[=nan:RECORD.FIELD,..]",
      [&](const std::string &text) {
        auto check = piko::parseCheckOptions(text);
        if (!check)
          throw CommandLine::wrong("--check", "expected =nan:RECORD.FIELD,.. "
                                              "or nothing, but got '" +
                                                  text + "'");
        options.check = *check;
      },
      "checking mode, on both sides");
  line.addText(
      "--ranks", "N",
      [&](const std::string &text) {
        options.synthesis.ranks = true;
        setenv("PIKO_RANKS", text.c_str(), /*overwrite=*/1);
      },
      "compiled for ranks, and so many in threads");
  line.addText(
      "--without", "PASS,..",
      [&](const std::string &text) {
        auto synthesis = piko::parseSynthesisOptions(text);
        if (!synthesis)
          throw CLI::ValidationError(piko::describeWrongSynthesisOptions(text));
        options.synthesis.without = synthesis->without;
      },
      "passes of synthesis to leave out");
  line.addNumber(
      "--mapping-window", "F", options.synthesis.mappingWindow,
      "hold loops as vectors and as scalar loops where estimates are "
      "within this factor of each other");
  line.addText(
      "-O", "LEVEL",
      [&](const std::string &level) {
        if (level.size() != 1 || level[0] < '0' || level[0] > '3')
          throw CLI::ValidationError("expected -O0 to -O3, but got -O" + level);
        options.optLevel = level[0] - '0';
      },
      "-O0 to -O3: how much LLVM optimizes (-O3 for the first target, -O1 for "
      "others, -O0 for GPUs)");
  line.add_flag_callback(
      "--no-cache", [&] { options.cache.enabled = false; },
      "compile the reference executor's code anew");
}

/// What cases run on. `one` is what --target to --gpu-chip say.
static void addTargetOptions(CommandLine &line, Target &one,
                             std::optional<std::string> &targets) {
  line.addText(
      "--targets", "NAME,..",
      [&](const std::string &names) { targets = names; },
      "what each case runs on: cpu, gpu-on-cpu, cuda, processors by LLVM's "
      "names, aarch64, or aarch64:NAME for one of these");
  line.addText(
      "--target", "TARGET",
      [&](const std::string &name) {
        auto target = piko::parseGPUTarget(name);
        if (!target || *target == piko::GPUTarget::Auto)
          throw CommandLine::wrong("--target", "expected cpu, cuda or "
                                               "gpu-on-cpu, but got '" +
                                                   name + "'");
        one.gpu.target = *target;
      },
      "the only target: cpu, gpu-on-cpu or cuda (cpu)");
  line.addText("--cpu", "NAME", one.cpu, "its processor (native)");
  line.addNumber("--gpu-threads", "N", one.gpu.threads,
                 "threads of a block (0, as the stage says)");
  line.addNumber("--gpu-seed", "N", one.gpu.seed,
                 "for gpu-on-cpu: permutes the blocks (0, in order)");
  line.addNumber(
      "--gpu-blocks", "N", one.gpu.blocks,
      "for gpu-on-cpu: most blocks of a grid (0, one for each unit)");
  line.addText(
      "--gpu-chip", "NAME,..",
      [&](const std::string &names) {
        if (!one.gpu.setChips(names))
          throw CommandLine::wrong("--gpu-chip",
                                   "expected names such as sm_90 between "
                                   "commas, but got '" +
                                       names + "'");
      },
      "for cuda: PTX for the oldest of these, cubins for each");
}

/// What is run of a target, and what must come of it.
static void addRunOptions(CommandLine &line, Options &options) {
  line.addText("--cases", "FILE", options.cases,
               "a file with the options of a case in each line, or of C++ in "
               "each line after '// CASE: '");
  line.addNumbers("--threads", "T ..", 0, options.threads,
                  "numbers of threads (1 2 7)", 1, 65536);
  line.addNumber("--runs", "N", options.runs, "of each number (3)", 1,
                 mostOfAll);
  line.addNumber("--timeout", "SECONDS", options.timeout, "of a case (none)");
  line.addText(
      "--runner", "COMMAND",
      [&](const std::string &text) {
        std::istringstream words(text);
        options.runner = {std::istream_iterator<std::string>(words), {}};
      },
      "for aarch64: piko-run-capture with its emulator, words between spaces");
  line.addText(
      "--tolerance", "X",
      [&](const std::string &text) {
        options.tolerance =
            CommandLine::readNumber<double>("--tolerance", text, 0);
      },
      "relative differences that stages may have which are not strict (any)");
  line.add_flag("--stops", options.stops,
                "all cases must stop, with the same message everywhere");
  line.add_flag("--spread", options.spread,
                "each case runs on one of the targets, in turn");
  line.add_flag("--owners", options.owners,
                "print which threads ran which bins");
}

Options parseOptions(int argc, char **argv) {
  CommandLine line(
      "piko-compare [options] FILE",
      "Runs pipelines on the reference executor and on one or more "
      "targets, on the same made-up input, and compares all state "
      "bit for bit.");
  Options options;
  Target one;
  std::optional<std::string> targets;
  addCompilerOptions(line, options);
  addTargetOptions(line, one, targets);
  addRunOptions(line, options);
  line.beginGroup("Of a case");
  addCaseOptions(line, options.one);
  options.help = read(line, {argv + 1, argv + argc});
  if (!options.help.empty())
    return options;
  if (options.file.empty())
    throw std::runtime_error("expected a file; see --help");
  if (options.reference.empty())
    options.reference = options.file;
  options.targets = readTargets(targets, one);
  for (const Target &target : options.targets)
    if (!target.arch.empty() && options.runner.empty())
      throw std::runtime_error("expected --runner for " + target.arch);
  return options;
}

bool hasOwnCases(const Options &options) {
  return options.cases.ends_with(".cpp") || options.cases.ends_with(".mlir");
}

std::vector<Case> readCases(const Options &options) {
  std::ifstream stream(options.cases);
  if (!stream)
    throw std::runtime_error("--cases: cannot open '" + options.cases +
                             "': " + std::generic_category().message(errno));
  const std::string mark = hasOwnCases(options) ? "// CASE: " : "";
  std::vector<Case> cases;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    if (!line.starts_with(mark))
      continue;
    std::istringstream text(line.substr(mark.size()));
    Case one = options.one;
    CommandLine words("", "");
    addCaseOptions(words, one);
    try {
      read(words, {std::istream_iterator<std::string>(text), {}});
    } catch (const std::runtime_error &error) {
      throw std::runtime_error("--cases: '" + options.cases + "', line " +
                               std::to_string(number) + ": " + error.what());
    }
    cases.push_back(one);
  }
  if (cases.empty())
    throw std::runtime_error("--cases: expected a case in a line" +
                             (mark.empty() ? "" : " after '" + mark + "'") +
                             " of '" + options.cases + "'");
  return cases;
}
