// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a stage's parallelForPixels is for a bin, without a stage.

#ifndef PIKO_UNITTESTS_EXAMPLES_PIXELSIN_H
#define PIKO_UNITTESTS_EXAMPLES_PIXELSIN_H

#include <glm/glm.hpp>

/// Calls f for the pixels of a closed box from `lo` up to and not including
/// `hi`, x fastest.
struct PixelsIn {
  glm::ivec2 lo, hi;

  template <class F>
  void operator()(glm::ivec2 from, glm::ivec2 to, F f) const {
    from = glm::max(from, lo);
    to = glm::min(to, hi - 1);
    for (int y = from.y; y <= to.y; ++y)
      for (int x = from.x; x <= to.x; ++x)
        f(glm::ivec2(x, y));
  }
};

#endif // PIKO_UNITTESTS_EXAMPLES_PIXELSIN_H
