// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Disc {
  glm::vec2 center;
  float radius;
  glm::vec3 color;
};

struct Canvas {
  piko::Image<piko::scene::Color> image;
};

struct Draw : piko::Stage<16, 16, 64, Disc>, piko::Uses<Canvas> {
  void assignBin(const Disc &disc) {
    assignToBoundingBox(disc, disc.center - disc.radius,
                        disc.center + disc.radius);
  }

  void process(const Disc &disc) {
    parallelForPixels([&](glm::ivec2 p) {
      bool isEdge = p.x == binLo().x || p.y == binLo().y;
      float far = glm::distance(glm::vec2(p) + 0.5f, disc.center);
      float light = far < disc.radius ? 1.0f : isEdge ? 0.4f : 0.15f;
      update(state().image, p, [&](piko::scene::Color &pixel) {
        pixel.rgba += light * glm::vec4(disc.color, 1);
      });
    });
  }
};

struct Discs : piko::Pipe<Canvas> {
  Draw draw;
  Discs() { source(draw); }
};
