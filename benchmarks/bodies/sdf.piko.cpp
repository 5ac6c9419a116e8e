// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Sphere tracing of a signed distance function, with normals and a shadow.
#include <piko.h>

struct Row {
  int y;
};
struct State {
  piko::Buffer<float> out;
};
constexpr int width = 160, height = 120;

struct Trace : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  static float scene(glm::vec3 p) {
    glm::vec3 q = glm::abs(p - glm::vec3(0.8f, 0, 0)) - glm::vec3(0.4f);
    float box = glm::length(glm::max(q, glm::vec3(0))) +
                glm::min(glm::max(q.x, glm::max(q.y, q.z)), 0.0f);
    float ball = glm::length(p + glm::vec3(0.6f, 0, 0)) - 0.6f;
    glm::vec2 t(glm::length(glm::vec2(p.x, p.z)) - 1.2f, p.y + 0.2f);
    float torus = glm::length(t) - 0.15f;
    return glm::min(glm::min(box, ball), glm::min(torus, p.y + 0.8f));
  }
  static glm::vec3 normal(glm::vec3 p) {
    const float e = 0.001f;
    glm::vec3 n(scene(p + glm::vec3(e, 0, 0)) - scene(p - glm::vec3(e, 0, 0)),
                scene(p + glm::vec3(0, e, 0)) - scene(p - glm::vec3(0, e, 0)),
                scene(p + glm::vec3(0, 0, e)) - scene(p - glm::vec3(0, 0, e)));
    return glm::normalize(n);
  }
  void process(const Row &row) {
    for (int x = 0; x < width; ++x) {
      glm::vec3 from(0, 0.5f, -4);
      glm::vec3 along = glm::normalize(glm::vec3(
          (x - width * 0.5f) / height, (height * 0.5f - row.y) / height, 1.2f));
      float t = 0;
      for (int i = 0; i < 96 && t < 20; ++i) {
        float d = scene(from + along * t);
        if (d < 0.001f)
          break;
        t += d;
      }
      float light = 0;
      if (t < 20) {
        glm::vec3 p = from + along * t;
        glm::vec3 n = normal(p), sun = glm::normalize(glm::vec3(1, 2, -1));
        float s = 0.02f;
        while (s < 5) {
          float d = scene(p + sun * s);
          if (d < 0.001f)
            break;
          s += d;
        }
        light = glm::max(glm::dot(n, sun), 0.0f) * (s < 5 ? 0.2f : 1.0f);
      }
      state().out[row.y * width + x] = light;
    }
  }
};
struct Sdf : piko::Pipe<State> {
  Trace trace;
  Sdf() { source(trace); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Row> rows;
  std::vector<float> out = std::vector<float>(width * height);
  void bind(auto &pipe) {
    for (int y = 0; y < height; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.trace, rows);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Sdf, Host)
#endif
