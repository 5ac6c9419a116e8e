// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Points and normals of bicubic Bezier patches.
#include <piko.h>

struct Patch {
  glm::vec3 points[16];
  int index;
};
struct Vertex {
  glm::vec3 position, normal;
};
struct State {
  piko::Buffer<Vertex> out;
};
constexpr int N = 17;

struct Dice : piko::Stage<0, 0, 1, Patch>, piko::Uses<State> {
  static void basis(float t, float b[4], float d[4]) {
    float s = 1 - t;
    b[0] = s * s * s;
    b[1] = 3 * t * s * s;
    b[2] = 3 * t * t * s;
    b[3] = t * t * t;
    d[0] = -3 * s * s;
    d[1] = 3 * s * s - 6 * s * t;
    d[2] = 6 * s * t - 3 * t * t;
    d[3] = 3 * t * t;
  }
  void process(const Patch &patch) {
    for (int y = 0; y < N; ++y)
      for (int x = 0; x < N; ++x) {
        float bu[4], du[4], bv[4], dv[4];
        basis(float(x) / (N - 1), bu, du);
        basis(float(y) / (N - 1), bv, dv);
        glm::vec3 p(0), tu(0), tv(0);
        for (int j = 0; j < 4; ++j)
          for (int i = 0; i < 4; ++i) {
            const glm::vec3 &c = patch.points[j * 4 + i];
            p += c * (bu[i] * bv[j]);
            tu += c * (du[i] * bv[j]);
            tv += c * (bu[i] * dv[j]);
          }
        glm::vec3 n = glm::cross(tu, tv);
        float length = piko::sqrt(glm::dot(n, n));
        state().out[(patch.index * N + y) * N + x] = {p, length > 0 ? n / length
                                                                    : n};
      }
  }
};
struct Bezier : piko::Pipe<State> {
  Dice dice;
  Bezier() { source(dice); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Patch> patches;
  std::vector<Vertex> out = std::vector<Vertex>(300 * N * N);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int n = 0; n < 300; ++n) {
      Patch patch;
      patch.index = n;
      for (int i = 0; i < 16; ++i)
        patch.points[i] = {i % 4 + random.unit(), i / 4 + random.unit(),
                           random.unit()};
      patches.push_back(patch);
    }
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.dice, patches);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Bezier, Host)
#endif
