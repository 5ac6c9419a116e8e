//===- piko-render.cpp - Render a scene with any pipeline -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The pipeline is compiled on the spot and bound to the scene by type, as
// piko/scene.h says.
//
//===----------------------------------------------------------------------===//
#include "Against.h"
#include "Frame.h"
#include "Mappings.h"
#include "Options.h"
#include "RankProcess.h"
#include "Report.h"
#include "Specialize.h"
#include "Trace.h"
#include "Wastes.h"

#include "Piko/CommandLine/Progress.h"
#include "Piko/Driver/TunedSetting.h"
#include "Piko/Replay/Outcome.h"
#include "Piko/Scene/ImageFile.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <span>
#include <stdexcept>

using namespace piko;
using namespace piko::render;

namespace {

class Stopwatch {
public:
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(Clock::now() - start)
        .count();
  }

private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start = Clock::now();
};

bool failedTogether = false; ///< The error of a run is that of all ranks.

/// What went wrong in a run, and how to see where in the text.
Error errorOfRun(const Options &options, pikort_pipeline *pipeline,
                 int32_t status) {
  Error error = errorOf(pipeline);
  failedTogether = status != PIKORT_RANK_FAILED;
  bool hasPlace = status == PIKORT_BIN_OUTSIDE ||
                  status == PIKORT_UPDATE_OUTSIDE ||
                  status == PIKORT_INDEX_OUTSIDE ||
                  status == PIKORT_NO_QUOTIENT || status == PIKORT_NOT_A_NUMBER;
  if (hasPlace && !options.load.check.enabled &&
      options.load.target != ExecutionTarget::Reference &&
      !isPipelineLibrary(options.pipeline))
    error.message += "\n  --check says at which line, and of which primitive";
  return error;
}

/// Runs the warm-up frames, then the timed ones. Ranks in processes of their
/// own must run as many, so that no clock says how many.
Result<FrameTimes> timeFrames(const Options &options,
                              pikort_pipeline *pipeline) {
  Progress bar("rendering");
  bool isRank = rankProcess().isOne();
  double limit = isRank ? std::numeric_limits<double>::infinity()
                        : 1000 * options.seconds,
         total = options.warmup + options.frames;
  Stopwatch warmup;
  for (int i = 0; i < options.warmup && warmup.milliseconds() < limit / 4;
       ++i) {
    if (int32_t status = pikort_run(pipeline); status != PIKORT_OK)
      return errorOfRun(options, pipeline, status);
    bar.update(i / total);
  }
  pikort_reset_stats(pipeline);
  std::vector<double> times;
  double spent = 0;
  while (int(times.size()) < options.frames &&
         (times.size() < 3 || spent < limit)) {
    Stopwatch frame;
    if (int32_t status = pikort_run(pipeline); status != PIKORT_OK)
      return errorOfRun(options, pipeline, status);
    times.push_back(frame.milliseconds());
    spent += times.back();
    bar.update((options.warmup + int(times.size())) / total);
  }
  std::sort(times.begin(), times.end());
  return FrameTimes{times[times.size() / 2], times.front(), times.back(),
                    spent / double(times.size()), int(times.size())};
}

/// What the last frame left.
struct Picture {
  std::vector<scene::Color> pixels; ///< none if there is no image
  std::string hash;
};

int64_t countDrawn(std::span<const scene::Color> pixels) {
  return std::count_if(pixels.begin(), pixels.end(),
                       [](const auto &pixel) { return pixel.rgba.a != 0; });
}

std::string textOfHash(uint64_t hash) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx",
                static_cast<unsigned long long>(hash));
  return text;
}

/// Equal images have equal hashes.
Result<Picture> readPicture(const Frame &frame) {
  Picture picture;
  if (!frame.image().empty()) {
    auto pixels = readImage(frame.pipeline(), frame.image());
    if (!pixels)
      return pixels.error();
    picture.pixels = std::move(*pixels);
    picture.hash = textOfHash(replay::hashBytes(
        {reinterpret_cast<const char *>(picture.pixels.data()),
         picture.pixels.size() * sizeof(scene::Color)}));
    return picture;
  }
  try {
    picture.hash =
        textOfHash(replay::hashOutcome(replay::readOutcome(frame.pipeline())));
    return picture;
  } catch (const std::runtime_error &error) {
    return Error{error.what()};
  }
}

/// Each frame more leaves the same in all state.
Result<Done> rerun(const Options &options, pikort_pipeline *pipeline) {
  if (options.reruns == 0)
    return Done{};
  try {
    Progress progress("running again");
    replay::Outcome first = replay::readOutcome(pipeline);
    for (int i = 1; i <= options.reruns; ++i) {
      progress.update(double(i - 1) / options.reruns);
      if (pikort_run(pipeline) != PIKORT_OK)
        return errorOf(pipeline);
      auto differences =
          replay::compareOutcomes(first, replay::readOutcome(pipeline));
      if (!differences.empty())
        return Error{"--reruns: frame " + std::to_string(i) +
                     " of them leaves something else: " + differences[0]};
    }
  } catch (const std::runtime_error &error) {
    return Error{error.what()};
  }
  return Done{};
}

int64_t countPrimitives(const SceneInput &scene) {
  int64_t count = scene.table ? int64_t(scene.table->lines.size()) : 0;
  if (scene.capture)
    for (const rt::Capture::Records &source : scene.capture->sources)
      count += source.count;
  return count;
}

/// Puts a frame for the values that the options name in the place of a general
/// one.
Result<Done> specializeFrame(Options &options, SceneInput &scene,
                             Frame &frame) {
  auto specialized = specialize(options, frame.pipeline());
  if (!specialized)
    return specialized.error();
  options = *specialized;
  auto loaded = Frame::load(options, /*wasCompiled=*/true);
  if (!loaded)
    return loaded.error();
  frame = std::move(*loaded);
  return frame.bind(options, scene);
}

/// Prints what is asked for.
Result<Done> report(const Options &options, const RunResult &result,
                    SceneInput &scene, const std::vector<Agreement> &agreements,
                    pikort_pipeline *pipeline) {
  Json line = makeReport(options, result, pipeline);
  std::string text;
  if (!options.quiet)
    text = summarize(options, result, pipeline) + "\n";
  text += printAgreements(agreements);
  if (!agreements.empty())
    line["against"] = reportAgreements(agreements);
  if (options.json && isTimed(options, pipeline)) {
    auto kernels = timeKernels(options, pipeline);
    if (!kernels)
      return kernels.error();
    line["kernels"] = *kernels;
  }
  if (options.counters || options.explain) {
    auto work = measureWork(options, scene, pipeline);
    if (!work)
      return work.error();
    std::vector<Waste> wastes =
        findWastes(*work, pipeline, options.load.gpu.target == GPUTarget::None);
    line["work"] = reportWork(*work);
    line["wastes"] = reportWastes(wastes);
    if (options.counters)
      text += printWork(*work, result.pixels);
    if (options.explain)
      text += printWastes(wastes) + printMappings(pipeline) +
              printTraffic(pipeline);
  }
  std::printf("%s",
              options.json ? (writeLine(line) + "\n").c_str() : text.c_str());
  return support::finishOutput();
}

/// Sets what piko-tune chose, where the command line does not say otherwise.
Result<Done> applyTuned(Options &options) {
  if (options.tuned.empty())
    return Done{};
  std::string wrong;
  auto setting = readTunedSetting(options.tuned, wrong);
  if (setting)
    wrong = setting->apply(options.load.pipeName, options.load.tunables,
                           options.load.synthesis);
  if (!wrong.empty())
    return Error{"--tuned: " + wrong};
  if (options.stripSize == 0)
    options.stripSize = setting->stripSize;
  if (options.mappings.empty())
    options.mappings = setting->mappings;
  return Done{};
}

/// What a pipeline counts is what it left out.
void warnOf(const std::vector<Count> &counts) {
  for (const Count &count : counts)
    if (count.sum != 0)
      std::fprintf(stderr, "piko-render: warning: '%s' counts %lld\n",
                   count.name.c_str(), static_cast<long long>(count.sum));
}

int countThreads(const Options &options, pikort_pipeline *pipeline) {
  bool isReference = options.load.target == ExecutionTarget::Reference;
  return isReference ? 1 : pikort_threads(pipeline);
}

/// Everything after the command line.
Result<Done> renderScene(Options options) {
  for (const std::string &image : options.images)
    if (auto ok = checkImageFormat(image); !ok)
      return ok.error();
  if (!options.trace.empty())
    if (auto ok = support::checkWritable(options.trace); !ok)
      return ok.error();
  std::vector<Agreement> agreements;
  if (!options.against.empty()) {
    auto found = runAgainst(options);
    if (!found)
      return found.error();
    agreements = std::move(*found);
  }
  auto frame = Frame::load(options, /*wasCompiled=*/!agreements.empty());
  if (!frame)
    return frame.error();
  Stopwatch loading;
  auto scene = loadScene(options);
  if (!scene)
    return scene.error();
  double loadMilliseconds = loading.milliseconds();
  if (auto ok = frame->bind(options, *scene); !ok)
    return ok.error();
  if (!options.fix.empty())
    if (auto ok = specializeFrame(options, *scene, *frame); !ok)
      return ok.error();
  pikort_pipeline *pipeline = frame->pipeline();
  if (!options.images.empty() && frame->image().empty())
    return Error{"--out: expected one image of colours to write, but pipeline "
                 "'" +
                 std::string(pikort_name(pipeline)) + "' has none or several"};

  auto times = timeFrames(options, pipeline);
  if (!times)
    return times.error();
  auto picture = readPicture(*frame);
  if (!picture)
    return picture.error();
  for (const std::string &image : options.images)
    if (auto ok =
            writeImage(image, scene->size.x, scene->size.y, picture->pixels);
        !ok)
      return ok.error();
  auto counts = readCounters(pipeline);
  if (!counts)
    return counts.error();
  warnOf(*counts);
  if (auto ok = rerun(options, pipeline); !ok)
    return ok.error();

  RunResult result{*times,
                   frame->compileMilliseconds(),
                   frame->isFromCache(),
                   loadMilliseconds,
                   int64_t(scene->mesh.triangles.size()),
                   int64_t(scene->mesh.vertices.size()),
                   int64_t(scene->mesh.patches.size()),
                   scene->size.x,
                   scene->size.y,
                   countPrimitives(*scene),
                   countThreads(options, pipeline),
                   countDrawn(picture->pixels),
                   picture->hash,
                   std::move(*counts)};
  if (auto ok = report(options, result, *scene, agreements, pipeline); !ok)
    return ok.error();
  if (!options.trace.empty())
    if (auto ok = traceFrame(pipeline, options.trace); !ok)
      return ok.error();
  if (!agree(agreements))
    return Error{"not all targets agree"};
  return Done{};
}

int fail(const Error &error) {
  if (!error.message.empty())
    std::fprintf(stderr, "piko-render: error: %s\n", error.message.c_str());
  return 1;
}

int stopRank(int status) {
  bool stops = rankProcess().stop(/*fails=*/false).empty();
  return stops ? status : 1;
}

/// An error of a run is that of all ranks, and the first one says it. Any other
/// is this process's own, for which the others would wait.
int failRank(const Error &error) {
  RankProcess &process = rankProcess();
  if (!process.isOne())
    return fail(error);
  if (failedTogether)
    return stopRank(process.ranks().rank == 0 ? fail(error) : 1);
  Error named = error;
  if (named.message.find("rank ") == std::string::npos)
    named.message =
        "rank " + std::to_string(process.ranks().rank) + ": " + named.message;
  fail(named);
  std::fflush(stderr);
  process.stop(/*fails=*/true);
  return 1;
}

} // namespace

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-render");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  auto options = parseOptions({argv + 1, argv + argc});
  if (!options)
    return fail(options.error());
  if (!options->help.empty()) {
    std::fputs(options->help.c_str(), stdout);
    auto ok = support::finishOutput();
    return ok ? 0 : fail(ok.error());
  }
  if (auto ok = applyTuned(*options); !ok)
    return fail(ok.error());
  if (auto ok = rankProcess().start(*options); !ok)
    return failRank(ok.error());
  auto ok = renderScene(*options);
  return ok ? stopRank(0) : failRank(ok.error());
}
