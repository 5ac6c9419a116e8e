//===- bilateral.piko.cpp - A bilateral filter on tiles of 16 x 16 --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   pixels --> Load - - - (input) - - -> Filter (output)
//
// The threads of a tile load it, with an apron, into an array that they share,
// and then filter from there.
//
//===----------------------------------------------------------------------===//
#include <piko.h>

namespace bilateral {

struct Pixel {
  glm::ivec2 at;
  glm::vec3 color;
};

struct State {
  float sigmaSpace = 2;
  float sigmaColor = 0.1f;
  piko::Image<glm::vec3> input;
  piko::Image<glm::vec3> output;
};

struct Load : piko::Stage<16, 16, 256, Pixel>, piko::Uses<State> {
  void assignBin(const Pixel &p) {
    piko::BinId bin = binFromPosition(p.at);
    if (bin.index >= 0)
      assignToBin(p, bin);
  }

  void process(const Pixel &p) {
    update(state().input, p.at, [&](glm::vec3 &color) { color = p.color; });
  }
};

// Takes no primitive: it runs for every bin once all pixels are loaded.
struct Filter : piko::Stage<16, 16, 256, Pixel>, piko::Uses<State> {
  static constexpr int radius = 3;
  static constexpr int side = 16 + 2 * radius;

  void assignBin(const Pixel &p) { assignToAll(p); }

  void schedule(piko::BinId) {
    everyBin();
    endStage<Load>();
  }

  void process(const piko::List<Pixel> &) {
    glm::vec3 tile[side][side];
    parallelFor(256, [&](int i) {
      glm::ivec2 corner = binLo() - radius;
      for (int j = i; j < side * side; j += 256) {
        glm::ivec2 at(j % side, j / side);
        tile[at.y][at.x] =
            state().input(glm::clamp(corner + at, glm::ivec2(0), domain() - 1));
      }
      sync();

      glm::ivec2 pixel = binLo() + glm::ivec2(i % 16, i / 16);
      if (glm::any(glm::greaterThanEqual(pixel, binHi())))
        return; // the bin is partial
      glm::ivec2 center = pixel - corner;
      glm::vec3 sum(0);
      float weights = 0;
      for (int y = -radius; y <= radius; ++y)
        for (int x = -radius; x <= radius; ++x) {
          glm::vec3 color = tile[center.y + y][center.x + x];
          float w = weight({x, y}, color - tile[center.y][center.x]);
          sum += w * color;
          weights += w;
        }
      state().output.store(pixel, sum / weights);
    });
  }

  float weight(glm::vec2 distance, glm::vec3 difference) {
    float s = state().sigmaSpace, c = state().sigmaColor;
    return piko::exp(-glm::dot(distance, distance) / (2 * s * s) -
                     glm::dot(difference, difference) / (2 * c * c));
  }
};

struct Bilateral : piko::Pipe<State> {
  Load load;
  Filter filter;

  Bilateral() {
    source(load);   // source 0
    source(filter); // source 1, which has no primitives
  }
};

} // namespace bilateral
