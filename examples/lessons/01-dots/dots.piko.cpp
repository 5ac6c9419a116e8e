// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Dot {
  glm::vec2 position;
  glm::vec3 color;
};

struct Canvas {
  piko::Image<piko::scene::Color> image;
};

struct Plot : piko::Stage<8, 8, 64, Dot>, piko::Uses<Canvas> {
  void assignBin(const Dot &dot) {
    assignToBin(dot, binFromPosition(dot.position));
  }

  void process(const Dot &dot) {
    auto add = [&](piko::scene::Color &pixel) {
      pixel.rgba += glm::vec4(dot.color, 1);
    };
    update(state().image, glm::ivec2(dot.position), add);
  }
};

struct Dots : piko::Pipe<Canvas> {
  Plot plot;
  Dots() { source(plot); }
};
