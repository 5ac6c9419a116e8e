//===- Options.cpp - The command line of piko-render ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Options.h"

#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <set>

using namespace piko;
using namespace piko::render;

const char *const render::usage =
    R"(usage: piko-render [options] FILE.piko.cpp SCENE
       piko-render [options] FILE.piko.cpp CAPTURE

Compiles a pipeline that uses the types of piko/scene.h, renders a scene with
it, and says how long a frame took. Or runs any pipeline on what an application
has fed and bound, which pikort_capture or $PIKO_CAPTURE has written. In place
of the text there may be what was compiled ahead of time: FILE.so, a shared
library of pikoc's objects, each of which runs on what it was made for.

  --pipe NAME            which pipeline of the file (the only one)
  --target cpu|cuda|auto|gpu-on-cpu|reference
                         compiled for this machine; for an NVIDIA GPU; for that
                         where there is one; for a GPU that this machine emulates;
                         or run by the reference executor (cpu)
  --cpu NAME             the processor to compile for, as clang names them, of
                         which this machine has everything (native)
  -O0, -O1, -O2, -O3     how much to optimise; the reference executor at most as
                         -O1 has it (-O3)
  -I FOLDER, -D NAME[=VALUE]   for the pipeline's preprocessor
  --without PASS,...     passes of synthesis to leave out
  --mappings SETTING     which version runs of loops that the code holds as
                         vectors and as scalar loops: measured (the faster),
                         expected (by estimates), vectors or scalar; or, behind
                         one of these, KERNEL:NUMBER=vectors, ...; all results
                         are the same ($PIKO_MAPPINGS; measured)
  --mapping-window F     hold both versions where estimates are within this
                         factor of each other; 1: nowhere (2)
  --fix NAME,...         specialize the pipeline for values that the scene has:
                         CONSTANT, BUFFER.size, all (all constants but cameras,
                         and sizes of small buffers), or NAME=VALUE; may be
                         repeated
  --tuned FILE           the setting that piko-tune wrote there
  --gpu-threads N        for cuda and gpu-on-cpu: threads of a block, a power of
                         two up to 1024 (as many as the stage has; up to 256
                         where a bin has more than 16 pixels for each)
  --gpu-chip NAME,...    for cuda and auto: PTX for the oldest of these chips and
                         later ones, and a cubin for each where ptxas is found
                         (PTX for sm_70)
  --gpu-seed N           for gpu-on-cpu: permutes the blocks (in order)
  --gpu-blocks N         for gpu-on-cpu: most blocks of a grid (one for each unit
                         of work)
  --no-cache             compile even if nothing changed since the last time
  --cache-dir FOLDER     where compiled code is kept ($PIKO_CACHE_DIR,
                         $XDG_CACHE_HOME/piko or ~/.cache/piko)

Of scenes only:
  --width W --height H   image size in pixels (1024 768)
  --lights L             number of lights, 0 for none (1)
  --eye x y z --at x y z camera position and target (the scene fits, seen along
                         -z)
  --fovy DEGREES         field of view from bottom to top (45)
  --near D --far D       distances of the planes before and behind which nothing
                         is drawn (about the scene, and before all that is seen)
  --cull                 leave out back faces
  --ground               put a square under the scene

  --set NAME=VALUE       a constant of the pipeline, if it is an int or a float
  --check[=nan:RECORD.FIELD,...]   check the rules of state on one thread, and
                         that these fields are never NaN
  --threads N            threads, 0 for all (0)
  --memory-budget BYTES  what bins may hold at a time: sources run in strips (0,
                         no budget)
  --strip N              primitives of a source in a strip (0, what fits)
  --warmup N --frames N  untimed and timed frames (5 30)
  --seconds S            stop early after so long, but with 3 timed frames at
                         least (1000)
  --reruns N             run so many frames more, each of which must leave the
                         same (0)
  --out IMAGE            write the last frame: .png, .exr, .ppm, ...; may be
                         repeated
  --against TARGET,...   run once on each of these, too (as for --target, or a
                         processor's name for its code), and compare all state
                         bit for bit; exit status 1 if any differs
  --tolerance X          relative differences that --against allows (0)
  --trace FILE           run one more frame, and write which thread ran which
                         bins when, for Perfetto or chrome://tracing
  --counters             count the work of one more frame beside the least that
                         it needs: calls, loops, bytes, arithmetic, lanes
  --explain              name the frame's three largest wastes, and what would
                         remove them
  --json                 print one line of JSON
  --kernel-times         for cuda, with --json: what kernels take, in frames of
                         their own, whose grids are launched one by one
  --help                 print this
)";

namespace {

/// Reads words one by one; the first problem is kept.
class Parser {
public:
  explicit Parser(const std::vector<std::string> &words) : words(words) {}

  Result<Options> parse() {
    while (next < words.size() && problem.empty())
      parseWord(words[next++]);
    if (problem.empty() && !options.help)
      check();
    if (!problem.empty())
      return Error{problem};
    return options;
  }

private:
  void parseWord(const std::string &word) {
    if (word == "-I" || word.starts_with("-I"))
      options.load.includeDirs.push_back(attached(word));
    else if (word == "-D" || word.starts_with("-D"))
      options.load.defines.push_back(attached(word));
    else if (word.starts_with("-O"))
      parseLevel(word);
    else if (word == "--check" || word.starts_with("--check="))
      parseCheck(word.substr(7));
    else if (word.size() > 1 && word[0] == '-')
      parseOption(word);
    else
      parseArgument(word);
  }

  void parseOption(const std::string &name) {
    constexpr int maxInt = 1'000'000'000;
    const std::map<std::string, std::function<void()>> actions = {
        {"--help", [&] { options.help = true; }},
        {"--pipe", [&] { options.load.pipeName = value(name); }},
        {"--target", [&] { parseTarget(value(name)); }},
        {"--cpu", [&] { options.load.cpu = value(name); }},
        {"--no-cache", [&] { options.load.cache.enabled = false; }},
        {"--cache-dir", [&] { options.load.cache.directory = value(name); }},
        {"--without", [&] { parseWithout(value("--without")); }},
        {"--mappings", [&] { options.mappings = value(name); }},
        {"--mapping-window", [&] { parseWindow(number(name)); }},
        {"--fix", [&] { parseFix(value(name)); }},
        {"--tuned", [&] { options.tuned = value(name); }},
        {"--gpu-threads",
         [&] { options.load.gpu.threads = integer(name, 1, 1024); }},
        {"--gpu-chip", [&] { parseChips(value(name)); }},
        {"--gpu-seed",
         [&] { options.load.gpu.seed = integer(name, 0, maxInt); }},
        {"--gpu-blocks",
         [&] { options.load.gpu.blocks = integer(name, 1, maxInt); }},
        {"--width", [&] { options.view.width = integer(name, 1, 65536); }},
        {"--height", [&] { options.view.height = integer(name, 1, 65536); }},
        {"--lights", [&] { options.lights = integer(name, 0, 1'000'000); }},
        {"--eye", [&] { options.view.eye = vector(name); }},
        {"--at", [&] { options.view.at = vector(name); }},
        {"--fovy", [&] { options.view.fovy = float(number(name)); }},
        {"--near", [&] { options.view.nearZ = distance(name); }},
        {"--far", [&] { options.view.farZ = distance(name); }},
        {"--cull", [&] { options.cull = true; }},
        {"--ground", [&] { options.ground = true; }},
        {"--set", [&] { parseSet(value(name)); }},
        {"--threads", [&] { options.threads = integer(name, 0, 10000); }},
        {"--memory-budget", [&] { options.memoryBudget = size(name); }},
        {"--strip", [&] { options.stripSize = size(name); }},
        {"--warmup", [&] { options.warmup = integer(name, 0, maxInt); }},
        {"--frames", [&] { options.frames = integer(name, 1, maxInt); }},
        {"--reruns", [&] { options.reruns = integer(name, 0, maxInt); }},
        {"--seconds", [&] { options.seconds = number(name); }},
        {"--out", [&] { options.images.push_back(value(name)); }},
        {"--against", [&] { parseAgainst(value(name)); }},
        {"--tolerance", [&] { options.tolerance = tolerance(name); }},
        {"--trace", [&] { options.trace = value(name); }},
        {"--counters", [&] { options.counters = true; }},
        {"--explain", [&] { options.explain = true; }},
        {"--json", [&] { options.json = true; }},
        {"--kernel-times", [&] { options.kernelTimes = true; }},
    };
    auto action = actions.find(name);
    if (action == actions.end())
      return fail("unknown option '" + name + "'");
    static const std::set<std::string> ofScenes = {
        "--width", "--height", "--lights", "--eye",
        "--at",    "--fovy",   "--cull",   "--ground"};
    if (options.sceneOption.empty() && ofScenes.contains(name))
      options.sceneOption = name;
    action->second();
  }

  void parseLevel(const std::string &word) {
    if (word.size() == 3 && word[2] >= '0' && word[2] <= '3')
      options.load.optLevel = word[2] - '0';
    else
      fail("expected -O0 to -O3, but got " + word);
  }

  void parseChips(const std::string &names) {
    if (!options.load.gpu.setChips(names))
      fail(
          "--gpu-chip: expected names such as sm_90 between commas, but got '" +
          names + "'");
  }

  void parseWithout(const std::string &text) {
    if (auto synthesis = parseSynthesisOptions(text))
      options.load.synthesis.without = synthesis->without;
    else
      fail(describeWrongSynthesisOptions(text));
  }

  void parseWindow(double factor) {
    if (factor < 1 || factor > 1000)
      fail("--mapping-window: expected a factor in [1, 1000]");
    options.load.synthesis.mappingWindow = factor;
  }

  /// Adds names with commas between them.
  void parseNames(const std::string &option, const std::string &text,
                  std::vector<std::string> &names) {
    for (size_t begin = 0; begin <= text.size();) {
      size_t end = std::min(text.find(',', begin), text.size());
      if (end == begin)
        return fail(option +
                    ": expected names with commas between them, but got '" +
                    text + "'");
      names.push_back(text.substr(begin, end - begin));
      begin = end + 1;
    }
  }

  void parseFix(const std::string &text) {
    parseNames("--fix", text, options.fix);
  }

  void parseAgainst(const std::string &text) {
    parseNames("--against", text, options.against);
  }

  double tolerance(const std::string &name) {
    double result = number(name);
    if (!(result >= 0))
      fail(name + ": expected a number of at least 0");
    return result;
  }

  void parseCheck(const std::string &text) {
    if (auto check = parseCheckOptions(text))
      options.load.check = *check;
    else
      fail("--check: expected =nan:RECORD.FIELD,... or nothing, but got '" +
           text + "'");
  }

  void parseSet(const std::string &text) {
    size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos)
      return fail("--set: expected NAME=VALUE, but got '" + text + "'");
    options.values.emplace_back(text.substr(0, equals),
                                text.substr(equals + 1));
  }

  void parseArgument(const std::string &word) {
    if (options.pipeline.empty())
      options.pipeline = word;
    else if (options.scene.empty())
      options.scene = word;
    else
      fail("unexpected argument '" + word + "'");
  }

  void check() {
    if (options.pipeline.empty() || options.scene.empty())
      fail("expected a pipeline file and a scene file");
    else if (!(options.view.fovy > 0 && options.view.fovy < 180))
      fail("--fovy: expected an angle between 0 and 180 degrees");
    else if (options.view.nearZ && options.view.farZ &&
             !(*options.view.farZ > *options.view.nearZ))
      fail("--far: expected a distance above that of --near");
    else if (!options.against.empty() && isPipelineLibrary(options.pipeline))
      fail("--against: expected the text of a pipeline, but '" +
           options.pipeline + "' is a library");
    else if (!options.fix.empty() &&
             options.load.target == ExecutionTarget::Reference)
      fail("--fix is for pipelines that are compiled, and does nothing with "
           "--target reference");
    else if (options.explain &&
             options.load.target == ExecutionTarget::Reference)
      fail("--explain is for pipelines that are compiled: nothing is measured "
           "of --target reference");
    else if (!(options.seconds >= 0))
      fail("--seconds: expected a number of at least 0");
  }

  std::string value(const std::string &name) {
    if (next < words.size())
      return words[next++];
    fail("option '" + name + "' lacks its value");
    return {};
  }
  /// What follows -I or -D, in the same word or the next.
  std::string attached(const std::string &word) {
    return word.size() > 2 ? word.substr(2) : value(word);
  }

  template <class T> T read(const std::string &name, const char *expected) {
    std::string text = value(name);
    T result{};
    auto [end, error] =
        std::from_chars(text.data(), text.data() + text.size(), result);
    if (error != std::errc() || end != text.data() + text.size())
      fail(name + ": expected " + expected + ", but got '" + text + "'");
    return result;
  }
  double number(const std::string &name) {
    double result = read<double>(name, "a number");
    if (!std::isfinite(result))
      fail(name + ": expected a finite number");
    return result;
  }
  int integer(const std::string &name, int least, int most) {
    int result = read<int>(name, "a whole number");
    if (result < least || result > most)
      fail(name + ": expected a number from " + std::to_string(least) + " to " +
           std::to_string(most) + ", but got " + std::to_string(result));
    return result;
  }
  int64_t size(const std::string &name) {
    auto result = read<int64_t>(name, "a whole number");
    if (result < 0)
      fail(name + ": expected a number of at least 0, but got " +
           std::to_string(result));
    return result;
  }
  float distance(const std::string &name) {
    auto result = float(number(name));
    if (!(result > 0) || !std::isfinite(result))
      fail(name + ": expected a distance above 0 that a float holds");
    return result;
  }
  glm::vec3 vector(const std::string &name) {
    glm::vec3 v;
    for (int i = 0; i < 3; ++i)
      v[i] = float(number(name));
    return v;
  }
  void parseTarget(const std::string &name) {
    options.load.target =
        name == "reference" ? ExecutionTarget::Reference : ExecutionTarget::CPU;
    auto target = name == "reference" ? GPUTarget::None : parseGPUTarget(name);
    if (target)
      options.load.gpu.target = *target;
    else
      fail("--target: expected cpu, cuda, auto, gpu-on-cpu or reference, but "
           "got '" +
           name + "'");
  }

  void fail(const std::string &message) {
    if (problem.empty())
      problem = message;
  }

  const std::vector<std::string> &words;
  size_t next = 0;
  Options options;
  std::string problem;
};

} // namespace

Result<Options> render::parseOptions(const std::vector<std::string> &words) {
  return Parser(words).parse();
}
