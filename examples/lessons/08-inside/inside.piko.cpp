// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Wave {
  glm::vec2 center;
  float length; // pixels
  glm::vec3 color;
};

struct Pond {
  piko::Image<piko::scene::Color> image;
};

struct Spread : piko::Stage<32, 32, 64, Wave>, piko::Uses<Pond> {
  void assignBin(const Wave &wave) { assignToAll(wave); }

  void process(const Wave &wave) {
    parallelForPixels([&](glm::ivec2 p) {
      float far = glm::distance(glm::vec2(p), wave.center);
      float height = glm::abs(2 * glm::fract(far / wave.length) - 1);
      float light = glm::floor(3 * height) / 3;
      update(state().image, p, [&](piko::scene::Color &pixel) {
        pixel.rgba += light * glm::vec4(wave.color, 1);
      });
    });
  }
};

struct Waves : piko::Pipe<Pond> {
  Spread spread;
  Waves() { source(spread); }
};
