// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Disc {
  glm::vec2 center;
  float radius;
  glm::vec3 color;
};

struct Field {
  glm::vec3 light; // towards it; the host says where
  piko::Image<piko::scene::Color> image;
};

struct Draw : piko::Stage<16, 16, 64, Disc>, piko::Uses<Field> {
  void assignBin(const Disc &disc) {
    assignToBoundingBox(disc, disc.center - disc.radius,
                        disc.center + disc.radius);
  }

  void process(const Disc &disc) {
    parallelForPixels([&](glm::ivec2 p) {
      glm::vec2 at = (glm::vec2(p) + 0.5f - disc.center) / disc.radius;
      float inside = 1 - glm::dot(at, at);
      if (inside < 0)
        return;
      glm::vec3 normal(at, glm::sqrt(inside));
      float light = glm::dot(normal, state().light);
      light = glm::max(glm::ceil(light * 5) / 5, 0.2f);
      update(state().image, p, [&](piko::scene::Color &pixel) {
        pixel.rgba = glm::vec4(disc.color * light, 1);
      });
    });
  }
};

struct Sunflower : piko::Pipe<Field> {
  Draw draw;
  Sunflower() { source(draw); }
};
