// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

constexpr auto numbers =
    piko::tunable("numbers", piko::Precision::Strict,
                  piko::Precision::Contracted, piko::Precision::Relaxed);
constexpr int steps = piko::tunable("steps", 96, 24);

struct Julia {
  glm::ivec2 lo, hi; // its box of pixels
  glm::vec2 c;
};

struct Plane {
  piko::Image<piko::scene::Color> image;
};

struct Iterate : piko::Stage<8, 8, 64, Julia>, piko::Uses<Plane> {
  void assignBin(const Julia &julia) {
    assignToBoundingBox(julia, julia.lo, julia.hi);
  }

  void schedule(piko::BinId) { specifyPrecision(numbers); }

  void process(const Julia &julia) {
    parallelForPixels(julia.lo, julia.hi, [&](glm::ivec2 p) {
      glm::vec2 size(julia.hi - julia.lo + 1);
      glm::vec2 z = (2.0f * glm::vec2(p - julia.lo) + 1.0f - size) / size.y;
      z *= 1.15f;
      int count = 0;
      for (; count < steps && z.x * z.x + z.y * z.y < 16; ++count)
        z = {z.x * z.x - z.y * z.y + julia.c.x, 2 * z.x * z.y + julia.c.y};
      float part = piko::log2(1.0f + float(count)) / piko::log2(1.0f + steps);
      glm::vec3 color(part * part, part * part * part, part);
      if (count == steps)
        color = glm::vec3(0);
      update(state().image, p, [&](piko::scene::Color &pixel) {
        pixel.rgba = glm::vec4(color, 1);
      });
    });
  }
};

struct Julias : piko::Pipe<Plane> {
  Iterate iterate;
  Julias() { source(iterate); }
};
