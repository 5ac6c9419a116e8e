// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Triangles by edge functions, with a depth test, in bins of 16 x 16.
#include <piko.h>

struct Triangle {
  glm::vec3 a, b, c, color;
};
struct Pixel {
  float z = 1;
  glm::vec3 color{0};
};
struct State {
  piko::Image<Pixel> image;
};

struct Draw : piko::Stage<16, 16, 64, Triangle>, piko::Uses<State> {
  void assignBin(const Triangle &t) {
    glm::vec3 lo = glm::min(t.a, glm::min(t.b, t.c));
    glm::vec3 hi = glm::max(t.a, glm::max(t.b, t.c));
    assignToBoundingBox(t, glm::vec2(lo), glm::vec2(hi));
  }
  static float edge(glm::vec3 a, glm::vec3 b, glm::vec2 p) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
  }
  void process(const Triangle &t) {
    float area = edge(t.a, t.b, glm::vec2(t.c));
    if (area == 0)
      return;
    for (int y = binLo().y; y < binHi().y; ++y)
      for (int x = binLo().x; x < binHi().x; ++x) {
        glm::vec2 p(float(x) + 0.5f, float(y) + 0.5f);
        float u = edge(t.b, t.c, p) / area, v = edge(t.c, t.a, p) / area;
        float w = 1 - u - v;
        if (u < 0 || v < 0 || w < 0)
          continue;
        float z = u * t.a.z + v * t.b.z + w * t.c.z;
        update(state().image, glm::ivec2(x, y), [&](Pixel &pixel) {
          if (z < pixel.z) {
            pixel.z = z;
            pixel.color = t.color * (1 - z);
          }
        });
      }
  }
};
struct Triangles : piko::Pipe<State> {
  Draw draw;
  Triangles() { source(draw); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Triangle> triangles;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 3000; ++i) {
      glm::vec3 at{random.in(0, 256), random.in(0, 256), random.unit()};
      auto near = [&] {
        return at + glm::vec3{random.in(-10, 10), random.in(-10, 10), 0};
      };
      glm::vec3 a = near(), b = near(), c = near();
      triangles.push_back(
          {a, b, c, {random.unit(), random.unit(), random.unit()}});
    }
    pipe.setDomain({256, 256});
    pipe.feed(pipe.draw, triangles);
  }
  uint64_t result(auto &pipe) { return bodies::hashState(pipe.state().image); }
};
PIKO_BODY_MAIN(Triangles, Host)
#endif
