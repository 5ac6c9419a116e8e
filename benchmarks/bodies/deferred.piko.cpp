// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tiled deferred shading: lights are sorted into tiles, and each pixel of a
// tile takes the tile's list.
#include <piko.h>

struct Light {
  glm::vec3 position;
  float radius;
  glm::vec3 color;
};
struct Surface {
  glm::vec3 position, normal, albedo;
};
struct Pixel {
  glm::vec3 color{0};
};
struct State {
  piko::Buffer<Surface> surfaces; // by pixel
  piko::Image<Pixel> image;
};

struct Shade : piko::Stage<16, 16, 64, Light>, piko::Uses<State> {
  void assignBin(const Light &l) {
    glm::vec2 at(l.position);
    assignToBoundingBox(l, at - l.radius, at + l.radius);
  }
  void schedule(piko::BinId) {
    specifySchedule(piko::LoadBalance);
    everyBin();
  }
  void process(const piko::List<Light> &lights) {
    parallelForPixels([&](glm::ivec2 cell) {
      const Surface &s = state().surfaces[cell.y * domain().x + cell.x];
      glm::vec3 sum = s.albedo * 0.05f;
      for (const Light &l : lights) {
        glm::vec3 to = l.position - s.position;
        float d2 = glm::dot(to, to);
        if (d2 > l.radius * l.radius)
          continue;
        float d = piko::sqrt(d2);
        float lambert = glm::max(glm::dot(s.normal, to) / d, 0.0f);
        float fade = 1 - d / l.radius;
        sum += s.albedo * l.color * (lambert * fade * fade);
      }
      state().image.store(cell, {sum});
    });
  }
};
struct Deferred : piko::Pipe<State> {
  Shade shade;
  Deferred() { source(shade); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 256, h = 192;
  std::vector<Light> lights;
  std::vector<Surface> surfaces;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 400; ++i)
      lights.push_back({{random.in(0, float(w)), random.in(0, float(h)), 3},
                        random.in(5, 25),
                        {random.unit(), random.unit(), random.unit()}});
    for (int i = 0; i < w * h; ++i)
      surfaces.push_back(
          {{float(i % w) + .5f, float(i / w) + .5f, random.unit()},
           {0, 0, 1},
           {random.unit(), random.unit(), random.unit()}});
    pipe.setDomain({w, h});
    bodies::bind(pipe.state().surfaces, surfaces);
    pipe.feed(pipe.shade, lights);
  }
  uint64_t result(auto &pipe) { return bodies::hashState(pipe.state().image); }
};
PIKO_BODY_MAIN(Deferred, Host)
#endif
