//===- Binding.h - A scene into a pipeline that is not known ----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The rule in piko/scene.h: state and sources are bound by type.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_SCENE_BINDING_H
#define PIKO_SCENE_BINDING_H

#include "Piko/Scene/Bvh.h"
#include "Piko/Scene/TableFile.h"

#include <pikort/capture.h>

#include <map>
#include <optional>
#include <utility>

namespace piko::render {

struct SceneInput {
  glm::ivec2 size; ///< of the image, in pixels
  scene::Camera camera;
  scene::Settings settings;
  std::vector<scene::Light> lights;
  Mesh mesh;
  /// Names of constants that are an int or a float, and their values.
  std::vector<std::pair<std::string, std::string>> values;
  /// In the place of all but the values: what a host's run has taken.
  std::optional<rt::Capture> capture;
  /// In the place of cameras, lights and meshes: primitives of the one source
  /// whose type no scene has.
  std::optional<Table> table;
  // Made for a pipeline that asks for them.
  std::vector<scene::Pixel> pixels;
  std::optional<Bvh> bvh;
  std::map<std::string, TableRecords> records; ///< of the table, by their type
};

/// Binds a scene, which must outlive the runs, to all state and sources of a
/// pipeline, and returns the name of its Image<Color>. Errors: something is of
/// a type that no scene or not this one has, there is not exactly one
/// Image<Color>, a value fits no constant, buildBvh fails, or a table feeds no
/// source or several, or has other fields.
///
/// A capture is bound by name, and its domain set. Then there need not be an
/// image of colours, and the name is empty if there is none or several. Errors:
/// the pipeline's state, records or sources are others.
Result<std::string> bindScene(pikort_pipeline *pipeline, SceneInput &scene);

/// The sum of a Buffer<Counter> after a run.
struct Count {
  std::string name;
  int64_t sum;
};
Result<std::vector<Count>> readCounters(pikort_pipeline *pipeline);

} // namespace piko::render

#endif // PIKO_SCENE_BINDING_H
