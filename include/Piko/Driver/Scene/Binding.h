//===- Binding.h - A scene into a pipeline that is not known ----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The rule in piko/scene.h: state and sources are bound by type.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_DRIVER_SCENE_BINDING_H
#define PIKO_DRIVER_SCENE_BINDING_H

#include "Piko/Driver/Scene/SceneFile.h"

#include <pikort/pikort.h>

namespace piko::render {

struct SceneInput {
  scene::Camera camera;
  scene::Settings settings;
  std::vector<scene::Light> lights;
  Mesh mesh;
};

/// Binds a scene, which must outlive the runs, to all state and sources of a
/// pipeline, and returns the name of its Image<Color>. Errors: something is of
/// a type that no scene has, or there is not exactly one Image<Color>.
Result<std::string> bindScene(pikort_pipeline *pipeline, SceneInput &scene);

} // namespace piko::render

#endif // PIKO_DRIVER_SCENE_BINDING_H
