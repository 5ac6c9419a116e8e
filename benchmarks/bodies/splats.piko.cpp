// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Gaussian splats, sorted by depth in each bin and blended front to back.
#include <piko.h>

struct Splat {
  glm::vec2 centre;
  float depth, radius;
  glm::vec3 conic; // xx, xy, yy
  float opacity;
  glm::vec3 color;
};
struct Pixel {
  glm::vec3 color{0};
  float transmittance = 1;
};
struct State {
  piko::Image<Pixel> image;
};
constexpr int most = 256;

struct Blend : piko::Stage<16, 16, 64, Splat>, piko::Uses<State> {
  void assignBin(const Splat &s) {
    assignToBoundingBox(s, s.centre - s.radius, s.centre + s.radius);
  }
  void process(const piko::List<Splat> &list) {
    int order[most];
    int n = glm::min(int(list.size()), most);
    for (int i = 0; i < n; ++i) {
      int at = i;
      while (at > 0 && list[order[at - 1]].depth > list[i].depth) {
        order[at] = order[at - 1];
        --at;
      }
      order[at] = i;
    }
    parallelForPixels([&](glm::ivec2 cell) {
      glm::vec2 centre = glm::vec2(cell) + 0.5f;
      Pixel result;
      for (int i = 0; i < n && result.transmittance > 0.004f; ++i) {
        const Splat &s = list[order[i]];
        glm::vec2 d = centre - s.centre;
        float power = -0.5f * (s.conic.x * d.x * d.x + s.conic.z * d.y * d.y) -
                      s.conic.y * d.x * d.y;
        if (power > 0)
          continue;
        float alpha = glm::min(0.99f, s.opacity * piko::exp(power));
        if (alpha < 1.0f / 255)
          continue;
        result.color += s.color * (alpha * result.transmittance);
        result.transmittance *= 1 - alpha;
      }
      update(state().image, cell, [&](Pixel &p) { p = result; });
    });
  }
};
struct Splats : piko::Pipe<State> {
  Blend blend;
  Splats() { source(blend); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Splat> splats;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 2500; ++i) {
      float r = random.in(1.5f, 6), c = 4 / (r * r);
      splats.push_back({{random.in(0, 128), random.in(0, 128)},
                        random.unit(),
                        r,
                        {c, random.in(-.3f, .3f) * c, c},
                        random.unit(),
                        {random.unit(), random.unit(), random.unit()}});
    }
    pipe.setDomain({128, 128});
    pipe.feed(pipe.blend, splats);
  }
  uint64_t result(auto &pipe) { return bodies::hashState(pipe.state().image); }
};
PIKO_BODY_MAIN(Splats, Host)
#endif
