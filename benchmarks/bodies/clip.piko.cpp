// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Sutherland-Hodgman: triangles against the planes of a box, in private arrays.
#include <piko.h>

struct Triangle {
  glm::vec4 corner[3];
  int index;
};
struct Area {
  float area;
  int corners;
};
struct State {
  piko::Buffer<Area> out;
};

struct Clip : piko::Stage<0, 0, 1, Triangle>, piko::Uses<State> {
  static float distance(const glm::vec4 &p, int plane) {
    float c = p[plane >> 1];
    return plane & 1 ? p.w - c : p.w + c;
  }
  void process(const Triangle &t) {
    glm::vec4 from[9], to[9];
    int n = 3;
    for (int i = 0; i < 3; ++i)
      from[i] = t.corner[i];
    for (int plane = 0; plane < 6 && n > 0; ++plane) {
      int m = 0;
      for (int i = 0; i < n; ++i) {
        glm::vec4 a = from[i], b = from[(i + 1) % n];
        float da = distance(a, plane), db = distance(b, plane);
        if (da >= 0)
          to[m++] = a;
        if ((da >= 0) != (db >= 0))
          to[m++] = a + (b - a) * (da / (da - db));
      }
      n = m;
      for (int i = 0; i < n; ++i)
        from[i] = to[i];
    }
    float area = 0;
    for (int i = 0; i < n; ++i) {
      glm::vec4 a = from[i] / from[i].w;
      glm::vec4 b = from[(i + 1) % n] / from[(i + 1) % n].w;
      area += a.x * b.y - a.y * b.x;
    }
    state().out[t.index] = {0.5f * area, n};
  }
};
struct Clipper : piko::Pipe<State> {
  Clip clip;
  Clipper() { source(clip); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Triangle> triangles;
  std::vector<Area> out;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 20000; ++i) {
      Triangle t;
      t.index = i;
      for (glm::vec4 &c : t.corner)
        c = {random.in(-2, 2), random.in(-2, 2), random.in(-2, 2),
             random.in(0.5f, 2)};
      triangles.push_back(t);
    }
    out.resize(triangles.size());
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.clip, triangles);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Clipper, Host)
#endif
