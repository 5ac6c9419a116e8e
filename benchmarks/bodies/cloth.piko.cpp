// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Springs of a cloth: twelve neighbours on a grid, with state in buffers.
#include <piko.h>

struct Row {
  int y;
};
struct Knot {
  glm::vec3 position, velocity;
};
struct State {
  int width = 0, height = 0;
  float dt = 0.01f;
  piko::Buffer<Knot> now, next;
};

struct Step : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  glm::vec3 pull(const Knot &k, int x, int y, float rest) const {
    if (x < 0 || y < 0 || x >= state().width || y >= state().height)
      return glm::vec3(0);
    const Knot &other = state().now[y * state().width + x];
    glm::vec3 d = other.position - k.position;
    float length = piko::sqrt(glm::dot(d, d));
    return length > 0 ? d * (50.0f * (length - rest) / length) +
                            0.1f * (other.velocity - k.velocity)
                      : glm::vec3(0);
  }
  void process(const Row &row) {
    for (int x = 0; x < state().width; ++x) {
      int y = row.y;
      Knot k = state().now[y * state().width + x];
      glm::vec3 force(0, -9.81f, 0);
      for (int d = -1; d <= 1; d += 2) {
        force += pull(k, x + d, y, 1) + pull(k, x, y + d, 1);
        force += pull(k, x + d, y + d, 1.41421356f);
        force += pull(k, x + d, y - d, 1.41421356f);
        force += pull(k, x + 2 * d, y, 2) + pull(k, x, y + 2 * d, 2);
      }
      k.velocity += state().dt * force;
      k.position += state().dt * k.velocity;
      state().next[y * state().width + x] = k;
    }
  }
};
struct Cloth : piko::Pipe<State> {
  Step step;
  Cloth() { source(step); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 128, h = 128;
  std::vector<Row> rows;
  std::vector<Knot> now, next = std::vector<Knot>(w * h);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < w * h; ++i)
      now.push_back({{i % w + 0.1f * random.unit(), i / w, random.unit()},
                     {random.unit(), 0, 0}});
    for (int y = 0; y < h; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    pipe.state().width = w;
    pipe.state().height = h;
    pipe.state().dt = 0.01f;
    bodies::bind(pipe.state().now, now);
    bodies::bind(pipe.state().next, next);
    pipe.feed(pipe.step, rows);
  }
  uint64_t result(auto &) { return bodies::hash(next); }
};
PIKO_BODY_MAIN(Cloth, Host)
#endif
