//===- Frame.cpp - A scene bound to a pipeline ----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Frame.h"
#include "RankProcess.h"

#include "Piko/CommandLine/Messages.h"
#include "Piko/CommandLine/Progress.h"
#include "Piko/Replay/CaptureFile.h"

#include <algorithm>
#include <cstdio>

using namespace piko;
using namespace piko::render;

Error render::errorOf(pikort_pipeline *pipeline) {
  return {pikort_message(pipeline)};
}

/// A host's input in the place of a scene.
static Result<SceneInput> loadCapture(const Options &options) {
  auto fail = [&](const std::string &why) {
    return Error{"capture '" + options.scene + "': " + why};
  };
  for (const std::string &option : {options.sizeOption, options.sceneOption})
    if (!option.empty())
      return fail(option + " is an option of scenes");
  auto capture = replay::readCapture(options.scene);
  if (!capture)
    return capture.error();
  SceneInput scene{};
  scene.size = {int(capture->domain[0]), int(capture->domain[1])};
  scene.values = options.values;
  scene.capture = std::move(*capture);
  return scene;
}

/// Primitives in the place of a scene.
static Result<SceneInput> loadPrimitives(const Options &options) {
  if (!options.sceneOption.empty())
    return Error{"table '" + options.scene + "': " + options.sceneOption +
                 " is an option of scenes"};
  auto table = loadTable(options.scene);
  if (!table)
    return table.error();
  SceneInput scene{};
  scene.size = {options.view.width, options.view.height};
  scene.values = options.values;
  scene.table = std::move(*table);
  return scene;
}

Result<SceneInput> render::loadScene(const Options &options,
                                     const std::string &tool) {
  if (replay::isCaptureFile(options.scene))
    return loadCapture(options);
  if (isTableFile(options.scene))
    return loadPrimitives(options);
  Progress bar("loading " + options.scene);
  auto mesh = loadMesh(options.scene, [&](double part) { bar.update(part); });
  if (!mesh)
    return mesh.error();
  for (const std::string &warning : mesh->warnings)
    std::fprintf(stderr, "%s: warning: '%s': %s\n", tool.c_str(),
                 options.scene.c_str(), warning.c_str());
  if (options.ground)
    addGround(*mesh);
  Sphere bounds = boundingSphere(*mesh);
  std::vector<std::string> warnings;
  auto camera = makeCamera(options.view, *mesh, warnings);
  if (!camera)
    return Error{"scene '" + options.scene + "': " + camera.error().message};
  for (const std::string &warning : warnings)
    std::fprintf(stderr, "%s: warning: %s\n", tool.c_str(), warning.c_str());
  SceneInput scene{};
  scene.size = {options.view.width, options.view.height};
  scene.camera = *camera;
  scene.settings.cullBackFaces = options.cull;
  scene.lights = makeLights(options.lights, bounds);
  scene.mesh = std::move(*mesh);
  scene.values = options.values;
  return scene;
}

static bool setOptions(const Options &options, pikort_pipeline *pipeline) {
  return pikort_set_threads(pipeline, options.threads) == PIKORT_OK &&
         pikort_set_static_input(pipeline, 1) == PIKORT_OK &&
         setRanks(options, pipeline) &&
         (options.mappings.empty() ||
          pikort_set_mappings(pipeline, options.mappings.c_str()) == PIKORT_OK);
}

Result<std::string> render::bindInput(const Options &options,
                                      pikort_pipeline *pipeline,
                                      SceneInput &scene) {
  auto bound = bindScene(pipeline, scene);
  if (!bound)
    return bound;
  bool isCapture = scene.capture.has_value();
  if ((!isCapture || options.memoryBudget) &&
      pikort_set_memory_budget(pipeline, options.memoryBudget) != PIKORT_OK)
    return errorOf(pipeline);
  if ((!isCapture || options.stripSize) &&
      pikort_set_strip_size(pipeline, options.stripSize) != PIKORT_OK)
    return errorOf(pipeline);
  return bound;
}

Result<std::string> render::createPipeline(const Options &options,
                                           const pikort_program &program,
                                           SceneInput &scene,
                                           PipelineOwner &owner) {
  int32_t code = pikort_create(&program, &owner.pipeline);
  pikort_pipeline *pipeline = owner.pipeline;
  int64_t extent[] = {scene.size.x, scene.size.y};
  const char *refusal = pikort_device_refusal(pipeline);
  if (*refusal && options.load.gpu.target != GPUTarget::CUDA)
    std::fprintf(stderr, "piko-render: warning: %s; runs on the processor\n",
                 refusal);
  if (code == PIKORT_OK && options.load.gpu.target == GPUTarget::CUDA &&
      pikort_device(pipeline) == PIKORT_PROCESSOR) {
    return Error{"--target cuda: " +
                 (*refusal ? std::string(refusal)
                           : "'" + options.pipeline +
                                 "' has code for the processor alone")};
  }
  if (code != PIKORT_OK ||
      (!scene.capture && pikort_set_domain(pipeline, 2, extent) != PIKORT_OK) ||
      !setOptions(options, pipeline))
    return errorOf(pipeline);
  return bindInput(options, pipeline, scene);
}

Result<std::vector<scene::Color>> render::readImage(pikort_pipeline *pipeline,
                                                    const std::string &name) {
  pikort_view view;
  if (pikort_get_view(pipeline, name.c_str(), &view) != PIKORT_OK)
    return errorOf(pipeline);
  size_t count = size_t(view.extent[0] * view.extent[1]);
  std::vector<scene::Color> pixels(count);
  if (view.record_size == sizeof(scene::Color)) {
    std::copy_n(static_cast<const scene::Color *>(view.data), count,
                pixels.begin());
    return pixels;
  }
  if (view.record_size != sizeof(scene::Color8))
    return Error{"image '" + name + "': expected pixels of " +
                 std::to_string(sizeof(scene::Color)) + " or " +
                 std::to_string(sizeof(scene::Color8)) + " bytes, but got " +
                 std::to_string(view.record_size)};
  auto *bytes = static_cast<const scene::Color8 *>(view.data);
  for (size_t i = 0; i < count; ++i)
    for (int channel = 0; channel < 4; ++channel)
      pixels[i].rgba[channel] =
          float(bytes[i].rgba >> (8 * channel) & 255) / 255.0f;
  return pixels;
}

Result<Frame> Frame::load(const Options &options, bool wasCompiled) {
  std::string diagnostics;
  Frame frame;
  {
    Progress progress("compiling " + options.pipeline);
    frame.program = loadPipeline(options.pipeline, options.load, diagnostics);
  }
  if (!frame.program && diagnostics.empty())
    return Error{"cannot load pipeline '" + options.pipeline + "'"};
  if (frame.program && wasCompiled)
    return frame;
  std::fputs(addToolName("piko-render", diagnostics).c_str(), stderr);
  if (!frame.program)
    return Error{}; // already said
  return frame;
}

Result<Done> Frame::bind(const Options &options, SceneInput &scene) {
  auto bound = createPipeline(options, program->get(), scene, owner);
  if (!bound)
    return bound.error();
  output = *bound;
  return Done{};
}

Result<Done> Frame::run() {
  if (pikort_run(owner.pipeline) != PIKORT_OK)
    return errorOf(owner.pipeline);
  return Done{};
}
