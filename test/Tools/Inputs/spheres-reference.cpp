// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What main.cpp of the tutorial draws, with the reference executor.
#include "spheres.piko.cpp"

#include <algorithm>
#include <cstdio>
#include <vector>

int main() {
  std::vector<Sphere> spheres;
  for (int i = 0; i < 12; ++i) {
    float t = i / 11.0f;
    spheres.push_back({.center = {40 + 240 * t, 120, 100 - 50 * t},
                       .radius = 20 + 40 * t,
                       .color = {1 - t, 0.4f, t}});
  }
  Spheres pipe;
  pipe.setDomain({320, 240});
  pipe.state().light = {-0.6f, -0.6f, -0.53f};
  pipe.feed(pipe.draw, spheres);
  pipe.run();
  std::printf("P6\n320 240\n255\n");
  for (int64_t i = 0; i < pipe.state().picture.size(); ++i)
    for (int c = 0; c < 3; ++c)
      std::putchar(
          int(std::clamp(pipe.state().picture.data()[i].color[c], 0.0f, 1.0f) *
                  255 +
              0.5f));
}
