//===- Patches.h - What Reyes pipelines draw --------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef UNITTESTS_FAILURES_PATCHES_H
#define UNITTESTS_FAILURES_PATCHES_H

#include "../../Support/Camera.h"
#include "../Cast.h"
#include "../Failure.h"

#include <vector>

namespace failures {

/// Patches before the camera of Camera.h.
struct PatchScene {
  std::vector<piko::scene::Patch> patches;
  int size = 128; ///< of the picture
  float rate = 1, nearZ = 0.25f;

  /// A patch whose control points are surface(i, j).
  template <class F> void add(F surface) {
    piko::scene::Patch patch{};
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        patch.points[4 * i + j] = surface(i, j);
    patch.index = int(patches.size());
    patches.push_back(patch);
  }
};

/// A picture, with alpha 0 where nothing was drawn.
template <class Pipe> Image drawPatches(const PatchScene &scene) {
  using Patch = typename Pipe::Patch;
  using Light = typename Pipe::Light;
  std::vector<Patch> patches = castAll<Patch>(scene.patches);
  std::vector<Light> lights{{{0.6f, 0.48f, 0.64f, 0}, {1, 1, 1, 0}}};
  Pipe pipe;
  pipe.setDomain({scene.size, scene.size});
  pipe.state().camera =
      std::bit_cast<typename Pipe::Camera>(test::makeCamera(scene.nearZ, 1000));
  pipe.state().rate = scene.rate;
  pipe.state().lights.assign(lights);
  pipe.state().patches.assign(patches);
  pipe.feed(pipe.load, patches);
  pipe.run().orThrow();
  auto color = pipe.state().color.view();
  return paint(scene.size, scene.size, [&](int x, int y) {
    return std::bit_cast<piko::scene::Color>(color(x, y));
  });
}

/// Pixels that are drawn where covers(x, y) is false, or not where it is true,
/// at their centres and all within a pixel of it.
template <class F> int countMisdrawn(const Image &image, F covers) {
  int wrong = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      bool isDrawn = image.pixels[y * image.width + x].rgba.a != 0;
      bool isRight = false;
      for (int dy = -1; dy <= 1 && !isRight; ++dy)
        for (int dx = -1; dx <= 1 && !isRight; ++dx)
          isRight = covers(x + dx + 0.5, y + dy + 0.5) == isDrawn;
      wrong += !isRight;
    }
  return wrong;
}

/// Nothing in red.
inline Image showHoles(const Image &image) {
  return paint(image.width, image.height, [&](int x, int y) {
    piko::scene::Color c = image.pixels[y * image.width + x];
    return c.rgba.a == 0 ? rgb(1, 0.1f, 0.1f) : c;
  });
}

} // namespace failures

#endif // UNITTESTS_FAILURES_PATCHES_H
