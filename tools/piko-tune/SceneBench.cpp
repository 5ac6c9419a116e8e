//===- SceneBench.cpp - A scene that settings render ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "SceneBench.h"

#include "Mappings.h"

#include "Piko/Scene/ImageError.h"
#include "Piko/Scene/ImageFile.h"

#include <algorithm>
#include <ctime>
#include <stdexcept>

using namespace piko;
using namespace piko::tune;
using render::Error;
using render::Result;

Result<std::unique_ptr<SceneBench>>
SceneBench::create(const TuneOptions &options, const Space &space) {
  std::unique_ptr<SceneBench> bench(new SceneBench(options, space));
  auto scene = render::loadScene(options.render);
  if (!scene)
    return scene.error();
  bench->scene = std::move(*scene);
  if (options.reference.empty())
    return bench;
  auto image = render::readImage(options.reference);
  if (!image)
    return image.error();
  auto [width, height] = std::pair(bench->scene.size.x, bench->scene.size.y);
  if (image->width != width || image->height != height)
    return Error{"expected a reference image of " + std::to_string(width) +
                 " x " + std::to_string(height) + " pixels, but '" +
                 options.reference + "' has " + std::to_string(image->width) +
                 " x " + std::to_string(image->height)};
  bench->reference = std::move(*image);
  return bench;
}

/// The first error of diagnostics.
static std::string findError(const std::string &diagnostics) {
  constexpr std::string_view word = "error: ";
  size_t at = diagnostics.find(word);
  size_t begin = at == std::string::npos ? 0 : at + word.size();
  return diagnostics.substr(begin, diagnostics.find('\n', begin) - begin);
}

Result<uint64_t> SceneBench::prepare(const Setting &setting) {
  LoadOptions load = options.render.load;
  TunedSetting tuned = space.describe(setting);
  std::string wrong = tuned.apply(load.pipeName, load.tunables, load.synthesis);
  if (!wrong.empty())
    return Error{wrong};
  Entry &entry = entries[setting];
  std::string diagnostics;
  if (!entry.program)
    entry.program = loadPipeline(options.render.pipeline, load, diagnostics);
  if (!entry.program)
    return Error{findError(diagnostics)};
  return entry.program->codeHash() +
         0x9e3779b97f4a7c15 * uint64_t(tuned.stripSize);
}

render::Options SceneBench::getOptions(const Setting &setting) const {
  render::Options render = options.render;
  if (int64_t strip = space.describe(setting).stripSize)
    render.stripSize = strip;
  return render;
}

Result<SceneBench::Instance *> SceneBench::getInstance(const Setting &setting) {
  Entry &entry = entries.at(setting);
  std::unique_ptr<Instance> &instance = entry.instance;
  if (instance)
    return instance.get();
  instance = std::make_unique<Instance>();
  render::Options render = getOptions(setting);
  if (scene.capture)
    instance->own = scene;
  auto image = render::createPipeline(render, entry.program->get(),
                                      instance->own ? *instance->own : scene,
                                      instance->owner);
  if (!image) {
    Error error = image.error();
    instance.reset();
    return error;
  }
  instance->image = *image;
  return instance.get();
}

/// Milliseconds from some time on, or that all threads have taken.
static double readClock(bool countsCPU) {
  timespec time{};
  clock_gettime(countsCPU ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &time);
  return 1e3 * double(time.tv_sec) + 1e-6 * double(time.tv_nsec);
}

Result<double> SceneBench::visit(const Setting &setting) {
  auto instance = getInstance(setting);
  if (!instance)
    return instance.error();
  pikort_pipeline *pipeline = (*instance)->owner.pipeline;
  double time = 0;
  for (int i = 0; i < runsOfVisit; ++i) {
    double start = readClock(options.countsCPU);
    if (pikort_run(pipeline) != PIKORT_OK)
      return render::errorOf(pipeline);
    // The second one, unless it was disturbed.
    double taken = readClock(options.countsCPU) - start;
    time = i == 0 ? taken : std::min(time, taken);
  }
  return time;
}

Result<std::string> SceneBench::findMappings(const Setting &setting) {
  if (auto prepared = prepare(setting); !prepared)
    return prepared.error();
  auto instance = getInstance(setting);
  if (!instance)
    return instance.error();
  pikort_pipeline *pipeline = (*instance)->owner.pipeline;
  auto isOpen = [&] {
    std::vector<pikort_mapping_info> mappings = render::readMappings(pipeline);
    return std::any_of(mappings.begin(), mappings.end(),
                       [](const pikort_mapping_info &info) {
                         return info.state < PIKORT_MAPPING_MEASURED;
                       });
  };
  constexpr int mostFrames = 20;
  for (int i = 0; i < mostFrames && isOpen(); ++i)
    if (pikort_run(pipeline) != PIKORT_OK)
      return render::errorOf(pipeline);
  return render::writeMappings(pipeline);
}

static double get(Metric metric, const render::ImageError &error) {
  switch (metric) {
  case Metric::Max:
    return error.largest;
  case Metric::Mean:
    return error.mean;
  case Metric::RMS:
    return error.rms;
  case Metric::P99:
    return error.p99;
  case Metric::FLIP:
    break;
  }
  return error.flip;
}

static double get(Metric metric, const replay::NumberErrors &error) {
  switch (metric) {
  case Metric::Max:
    return error.largest;
  case Metric::Mean:
    return error.mean;
  case Metric::RMS:
    return error.rms;
  default:
    return error.p99;
  }
}

/// Runs once on a capture that no run has changed.
static Result<render::Done> runAfresh(const render::Options &options,
                                      const render::SceneInput &scene,
                                      render::SceneInput &own,
                                      pikort_pipeline *pipeline) {
  own.capture = scene.capture;
  if (auto bound = render::bindInput(options, pipeline, own); !bound)
    return bound.error();
  if (pikort_run(pipeline) != PIKORT_OK)
    return render::errorOf(pipeline);
  return render::Done{};
}

Result<double> SceneBench::measureNumbers(Instance &instance) {
  if (!options.reference.empty() || options.metric == Metric::FLIP)
    return Error{"expected one image of colours, which --reference and "
                 "--metric flip are for, but pipeline '" +
                 std::string(pikort_name(instance.owner.pipeline)) +
                 "' has none or several"};
  try {
    replay::Outcome outcome = replay::readOutcome(instance.owner.pipeline);
    if (!referenceOutcome)
      referenceOutcome = outcome;
    return get(options.metric,
               replay::measureNumbers(*referenceOutcome, outcome));
  } catch (const std::runtime_error &error) {
    return Error{error.what()};
  }
}

Result<double> SceneBench::measureError(const Setting &setting) {
  auto instance = getInstance(setting);
  if (!instance)
    return instance.error();
  pikort_pipeline *pipeline = (*instance)->owner.pipeline;
  if (scene.capture)
    if (auto ok =
            runAfresh(getOptions(setting), scene, *(*instance)->own, pipeline);
        !ok)
      return ok.error();
  if ((*instance)->image.empty())
    return measureNumbers(**instance);
  auto pixels = render::readImage(pipeline, (*instance)->image);
  if (!pixels)
    return pixels.error();
  render::Image image{scene.size.x, scene.size.y, std::move(*pixels)};
  if (!reference)
    reference = image;
  auto error = options.metric == Metric::FLIP
                   ? render::compareImages(*reference, image)
                   : render::compareColors(*reference, image);
  if (!error)
    return error.error();
  return get(options.metric, *error);
}

void SceneBench::release(const Setting &setting) {
  if (auto entry = entries.find(setting); entry != entries.end())
    entry->second.instance.reset();
}
