//===- Options.cpp - The command line of piko-render ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Options.h"

#include <cmath>

using namespace piko;
using namespace piko::render;

namespace {

constexpr int maxInt = 1'000'000'000;
const std::string ofSizes = "Of scenes and tables";
const std::string ofScenes = "Of scenes only";

void setTarget(const std::string &name, LoadOptions &load) {
  load.target =
      name == "reference" ? ExecutionTarget::Reference : ExecutionTarget::CPU;
  load.gpu.target =
      name == "reference" ? GPUTarget::None : *parseGPUTarget(name);
}

void setLevel(const std::string &text, LoadOptions &load) {
  if (text.size() != 1 || text[0] < '0' || text[0] > '3')
    throw CLI::ValidationError("expected -O0 to -O3, but got -O" + text);
  load.optLevel = text[0] - '0';
}

void setWithout(const std::string &text, LoadOptions &load) {
  auto synthesis = parseSynthesisOptions(text);
  if (!synthesis)
    throw CLI::ValidationError(describeWrongSynthesisOptions(text));
  load.synthesis.without = synthesis->without;
}

void setCheck(const std::string &text, LoadOptions &load) {
  auto check = parseCheckOptions(text);
  if (!check)
    throw CommandLine::wrong(
        "--check",
        "expected =nan:RECORD.FIELD,... or nothing, but got '" + text + "'");
  load.check = *check;
}

void addValue(const std::string &text, Options &options) {
  size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos)
    throw CommandLine::wrong("--set",
                             "expected NAME=VALUE, but got '" + text + "'");
  options.values.emplace_back(text.substr(0, equals), text.substr(equals + 1));
}

void addNames(CommandLine &line, const std::string &name,
              const std::string &value, std::vector<std::string> &names,
              const std::string &description) {
  line.addText(
      name, value,
      [=, &names](const std::string &text) {
        for (std::string &part : splitNames(name, text))
          names.push_back(std::move(part));
      },
      description);
}

void addPoint(CommandLine &line, const std::string &name,
              std::optional<glm::vec3> &point, const std::string &description) {
  line.addValues(
      name, "X Y Z", 3,
      [=, &point](const CommandLine::Words &words) {
        point.emplace();
        for (int i = 0; i < 3; ++i)
          (*point)[i] = float(CommandLine::readNumber<double>(name, words[i]));
      },
      description);
}

void addDistance(CommandLine &line, const std::string &name,
                 std::optional<float> &distance,
                 const std::string &description) {
  line.addText(
      name, "D",
      [=, &distance](const std::string &text) {
        distance = float(CommandLine::readNumber<double>(name, text));
        if (!(*distance > 0) || !std::isfinite(*distance))
          throw CommandLine::wrong(
              name, "expected a distance above 0 that a float holds");
      },
      description);
}

void addCompilerOptions(CommandLine &line, Options &options) {
  LoadOptions &load = options.load;
  line.addChoice(
      "--target", "TARGET",
      {{"cpu", "compiled for this machine"},
       {"cuda", "for an NVIDIA GPU"},
       {"auto", "for that where there is one"},
       {"gpu-on-cpu", "for a GPU that this machine emulates"},
       {"reference", "run by the reference executor"}},
      [&](const std::string &text) { setTarget(text, load); },
      "what the pipeline runs on (cpu):");
  line.addText(
      "-O", "LEVEL", [&](const std::string &text) { setLevel(text, load); },
      "-O0 to -O3: how much to optimise; the reference executor at most as "
      "-O1 has it (-O3)");
  line.addText(
      "--mappings", "SETTING", options.mappings,
      "which version runs of loops that the code holds as vectors and as "
      "scalar loops: measured (the faster), expected (by estimates), vectors "
      "or scalar; or, behind one of these, KERNEL:NUMBER=vectors, ...; all "
      "results are the same ($PIKO_MAPPINGS; measured)");
  line.addNumber("--mapping-window", "F", load.synthesis.mappingWindow,
                 "hold both versions where estimates are within this factor of "
                 "each other; 1: nowhere (2)",
                 1, 1000);
  addNames(line, "--fix", "NAME,...", options.fix,
           "specialize the pipeline for values that the scene has: CONSTANT, "
           "BUFFER.size, all (all constants but cameras, and sizes of small "
           "buffers), or NAME=VALUE; may be repeated");
  line.addText("--tuned", "FILE", options.tuned,
               "the setting that piko-tune wrote there");
  line.addNumber("--gpu-threads", "N", load.gpu.threads,
                 "for cuda and gpu-on-cpu: threads of a block, a power of two "
                 "up to 1024 (as many as the stage has; up to 256 where a bin "
                 "has more than 16 pixels for each)",
                 1, 1024);
  line.addText(
      "--gpu-chip", "NAME,...",
      [&](const std::string &names) {
        if (!load.gpu.setChips(names))
          throw CommandLine::wrong(
              "--gpu-chip",
              "expected names such as sm_90 between commas, but got '" + names +
                  "'");
      },
      "for cuda and auto: PTX for the oldest of these chips and later ones, "
      "and a cubin for each where ptxas is found (PTX for sm_70)");
  line.addNumber("--gpu-seed", "N", load.gpu.seed,
                 "for gpu-on-cpu: permutes the blocks (in order)", 0, maxInt);
  line.addNumber("--gpu-blocks", "N", load.gpu.blocks,
                 "for gpu-on-cpu: most blocks of a grid (one for each unit of "
                 "work)",
                 1, maxInt);
}

void addRunOptions(CommandLine &line, Options &options) {
  line.addOptional(
      "--check", "[=nan:RECORD.FIELD,...]",
      [&](const std::string &text) { setCheck(text, options.load); },
      "check the rules of state on one thread, and that these fields are never "
      "NaN");
  line.addNumber("--warmup", "N", options.warmup, "untimed frames (5)", 0,
                 maxInt);
  line.addNumber("--frames", "N", options.frames, "timed frames (30)", 1,
                 maxInt);
  line.addNumber("--seconds", "S", options.seconds,
                 "stop early after so long, but with 3 timed frames at least "
                 "(1000)",
                 0);
  line.addNumber("--reruns", "N", options.reruns,
                 "run so many frames more, each of which must leave the same "
                 "(0)",
                 0, maxInt);
  line.addTexts("--out", "IMAGE", options.images,
                "write the last frame: .png, .exr, .ppm, ...; may be repeated");
  addNames(line, "--against", "TARGET,...", options.against,
           "run once on each of these, too (as for --target, or a processor's "
           "name for its code), and compare all state bit for bit; exit status "
           "1 if any differs");
  line.addNumber("--tolerance", "X", options.tolerance,
                 "relative differences that --against allows (0)", 0);
  line.addText("--trace", "FILE", options.trace,
               "run one more frame, and write which thread ran which bins "
               "when, for Perfetto or chrome://tracing");
  line.add_flag("--counters", options.counters,
                "count the work of one more frame beside the least that it "
                "needs: calls, loops, bytes, arithmetic, lanes");
  line.add_flag("--explain", options.explain,
                "name the frame's three largest wastes, and what would remove "
                "them");
  line.add_flag("--json", options.json, "print one line of JSON");
  line.add_flag("--quiet", options.quiet,
                "print nothing at the end but what other options ask for");
  line.add_flag("--kernel-times", options.kernelTimes,
                "for cuda, with --json: what kernels take, in frames of their "
                "own, whose grids are launched one by one");
}

void addBriefs(CommandLine &line) {
  line.setBrief("--pipe", "which pipeline of the file (the only one)");
  line.setBrief("--target", "cpu, cuda, auto, gpu-on-cpu or reference (cpu)");
  line.setBrief("--out", "write the picture: .png, .exr, .ppm, ...");
  line.setBrief("--width", "pixels of a row (1024)");
  line.setBrief("--height", "rows (768)");
  line.setBrief("--eye", "where the camera is");
  line.setBrief("--at", "where it looks");
  line.setBrief("--lights", "number of lights (1)");
  line.setBrief("--ground", "put a square under the scene");
  line.setBrief("--set", "a constant of the pipeline");
  line.setBrief("--threads", "threads, 0 for all (0)");
  line.setBrief("--frames", "timed frames (30)");
  line.setBrief("--against", "compare with these targets, bit for bit");
  line.setBrief("--check", "check the rules of state");
  line.setBrief("--tuned", "a setting of piko-tune's");
  line.setBrief("--fix", "specialize for values of the scene");
  line.setBrief("--explain", "the three largest wastes of a frame");
  line.setBrief("--trace", "which thread ran which bins when");
  line.setBrief("--json", "print one line of JSON");
  line.setBrief("--quiet", "print nothing at the end");
}

/// What is wrong with options that are fine one by one; empty if nothing.
std::string findProblem(const Options &options) {
  bool isReference = options.load.target == ExecutionTarget::Reference;
  if (options.pipeline.empty() || options.scene.empty())
    return "expected a pipeline file and a scene file";
  if (!(options.view.fovy > 0 && options.view.fovy < 180))
    return "--fovy: expected an angle between 0 and 180 degrees";
  if (options.view.nearZ && options.view.farZ &&
      !(*options.view.farZ > *options.view.nearZ))
    return "--far: expected a distance above that of --near";
  if (!options.against.empty() && isPipelineLibrary(options.pipeline))
    return "--against: expected the text of a pipeline, but '" +
           options.pipeline + "' is a library";
  if (!options.fix.empty() && isReference)
    return "--fix is for pipelines that are compiled, and does nothing with "
           "--target reference";
  if (options.explain && isReference)
    return "--explain is for pipelines that are compiled: nothing is measured "
           "of --target reference";
  if (options.ranks > 0 && options.usesMPI)
    return "--ranks: expected no --mpi beside it, whose processes are the "
           "ranks";
  if ((options.ranks > 0 || options.usesMPI) &&
      options.load.target != ExecutionTarget::CPU)
    return std::string(options.usesMPI ? "--mpi" : "--ranks") +
           ": expected --target cpu, because ranks of other targets are not "
           "supported";
  return {};
}

} // namespace

void render::addSizeOptions(CommandLine &line, Options &options) {
  line.addNumber("--width", "W", options.view.width, "pixels of a row (1024)",
                 1, 65536);
  line.addNumber("--height", "H", options.view.height, "rows (768)", 1, 65536);
}

void render::addViewOptions(CommandLine &line, Options &options) {
  line.addNumber("--lights", "L", options.lights,
                 "number of lights, 0 for none (1)", 0, 1'000'000);
  addPoint(line, "--eye", options.view.eye,
           "where the camera is (so that the scene fits)");
  addPoint(line, "--at", options.view.at,
           "where it looks (at the scene's middle, along -z)");
  line.addNumber("--fovy", "DEGREES", options.view.fovy,
                 "field of view from bottom to top (45)");
  addDistance(line, "--near", options.view.nearZ,
              "of the plane before which nothing is drawn (before all that is "
              "seen)");
  addDistance(line, "--far", options.view.farZ,
              "of the plane behind which nothing is drawn (about the scene)");
  line.add_flag("--cull", options.cull, "leave out back faces");
  line.add_flag("--ground", options.ground, "put a square under the scene");
}

void render::addSceneOptions(CommandLine &line, Options &options) {
  line.addText("PIPELINE", "", options.pipeline,
               "the text of a pipeline, or a library of what pikoc made of it");
  line.addText("SCENE", "", options.scene,
               "what is rendered, a table of primitives (.csv), or what a host "
               "fed and bound");
  LoadOptions &load = options.load;
  line.addText("--cpu", "NAME", load.cpu,
               "the processor to compile for, as clang names them, of which "
               "this machine has everything (native)");
  line.addTexts("-I", "FOLDER", load.includeDirs,
                "for the pipeline's preprocessor");
  line.addTexts("-D", "NAME[=VALUE]", load.defines, "likewise");
  line.addText(
      "--without", "PASS,...",
      [&](const std::string &text) { setWithout(text, load); },
      "passes of synthesis to leave out");
  line.add_flag_callback(
      "--no-cache", [&] { load.cache.enabled = false; },
      "compile even if nothing changed since the last time");
  line.addText("--cache-dir", "FOLDER", load.cache.directory,
               "where compiled code is kept ($PIKO_CACHE_DIR, "
               "$XDG_CACHE_HOME/piko or ~/.cache/piko)");
  line.addText(
      "--set", "NAME=VALUE",
      [&](const std::string &text) { addValue(text, options); },
      "a constant of the pipeline, if it is an int or a float");
  line.addNumber("--threads", "N", options.threads, "threads, 0 for all (0)", 0,
                 10000);
  line.addNumber("--ranks", "N", options.ranks,
                 "divide frames among so many ranks that own bins, each in "
                 "threads of its own (none)",
                 0, 1024);
  line.add_flag("--mpi", options.usesMPI,
                "the same for the processes that mpirun has started: the first "
                "one prints and writes");
  line.addNumber("--rank-seconds", "S", options.rankSeconds,
                 "how long an exchange of --mpi may take, 0 for ever (60)", 0);
  line.addNumber("--memory-budget", "BYTES", options.memoryBudget,
                 "what bins may hold at a time: sources run in strips (0, no "
                 "budget)",
                 0);
  line.addNumber("--strip", "N", options.stripSize,
                 "primitives of a source in a strip (0, what fits)", 0);

  line.beginGroup(ofSizes);
  addSizeOptions(line, options);
  line.beginGroup(ofScenes);
  addViewOptions(line, options);
}

std::string render::checkOptions(const CommandLine &line, Options &options) {
  options.load.synthesis.ranks |= options.ranks > 0 || options.usesMPI;
  options.sizeOption = line.findOption(ofSizes);
  options.sceneOption = line.findOption(ofScenes);
  return findProblem(options);
}

Result<Options> render::parseOptions(const std::vector<std::string> &words) {
  CommandLine line(
      "piko-render [options] FILE.piko.cpp SCENE\n"
      "piko-render [options] FILE.piko.cpp TABLE.csv\n"
      "piko-render [options] FILE.piko.cpp CAPTURE",
      "Compiles a pipeline that uses the types of piko/scene.h, renders a "
      "scene with it, and says how long a frame took. Or feeds it a table of "
      "primitives, whose first line has the names of their fields. Or runs any "
      "pipeline on what an application has fed and bound, which pikort_capture "
      "or "
      "$PIKO_CAPTURE has written. In place of the text there may be what was "
      "compiled ahead of time: FILE.so, a shared library of pikoc's objects, "
      "each of which runs on what it was made for.",
      "piko-render raster.piko.cpp --pipe Fused bunny.obj --out bunny.png");
  Options options;
  line.addText("--pipe", "NAME", options.load.pipeName,
               "which pipeline of the file (the only one)");
  addCompilerOptions(line, options);
  addRunOptions(line, options);
  addSceneOptions(line, options);
  addBriefs(line);
  auto help = line.read(words);
  if (!help)
    return help.error();
  options.help = *help;
  std::string problem = checkOptions(line, options);
  if (options.help.empty() && !problem.empty())
    return Error{problem};
  return options;
}
