//===- DepthRange.h - What a camera's near and far planes cut ---*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is seen of a scene through the image's four sides, whatever the planes
// of depth are. In double precision and relative to the eye, so that a view of
// 1e-7 degrees is as exact as others.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_SCENE_DEPTHRANGE_H
#define PIKO_TOOLS_SCENE_DEPTHRANGE_H

#include "Piko/Scene/SceneFile.h"

#include <limits>

namespace piko::render {

/// What is seen of a scene before the near plane and beyond the far one.
struct CutParts {
  int64_t beforeNear = 0, beyondFar = 0; ///< triangles and patches
  /// Distances along `forward` of the nearest and the farthest point of these.
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
};

/// Of triangles, exact but for the rounding of doubles, where one that is seen
/// edge-on is not seen. Of patches by the hulls of their control points, of a
/// part of 1/256 a side where one crosses a plane: what is seen may be less.
CutParts findCutParts(const scene::Camera &camera, const Mesh &mesh);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_DEPTHRANGE_H
