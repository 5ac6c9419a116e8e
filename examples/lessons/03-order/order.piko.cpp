// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Petal {
  glm::vec2 center;
  float radius;
  glm::vec3 color;
};

struct Canvas {
  piko::Image<piko::scene::Color> image;
};

struct Draw : piko::Stage<16, 16, 64, Petal>, piko::Uses<Canvas> {
  void assignBin(const Petal &petal) {
    assignToBoundingBox(petal, petal.center - petal.radius,
                        petal.center + petal.radius);
  }

  void process(const Petal &petal) {
    parallelForPixels([&](glm::ivec2 p) {
      float far = glm::distance(glm::vec2(p) + 0.5f, petal.center);
      float cover = glm::clamp(petal.radius - far + 0.5f, 0.0f, 1.0f);
      if (cover > 0)
        update(state().image, p, [&](piko::scene::Color &pixel) {
          float alpha = 0.75f * cover;
          pixel.rgba = glm::mix(pixel.rgba, glm::vec4(petal.color, 1), alpha);
        });
    });
  }
};

struct Petals : piko::Pipe<Canvas> {
  Draw draw;
  Petals() { source(draw); }
};
