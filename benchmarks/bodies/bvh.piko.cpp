// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Rays through a bounding volume hierarchy, with a stack of 32 nodes.
#include <piko.h>

struct Ray {
  glm::vec3 from, along;
  int index;
};
struct Node {
  glm::vec3 lo;
  int first; // child, or triangle
  glm::vec3 hi;
  int count; // 0: two children
};
struct Triangle {
  glm::vec3 a, b, c;
};
struct Hit {
  float t;
  int triangle;
};
struct State {
  piko::Buffer<Node> nodes;
  piko::Buffer<Triangle> triangles;
  piko::Buffer<Hit> hits;
};

struct Shoot : piko::Stage<0, 0, 1, Ray>, piko::Uses<State> {
  static float enter(const Node &node, const Ray &ray, glm::vec3 inverse,
                     float best) {
    glm::vec3 a = (node.lo - ray.from) * inverse;
    glm::vec3 b = (node.hi - ray.from) * inverse;
    glm::vec3 near = glm::min(a, b), far = glm::max(a, b);
    float t = glm::max(glm::max(near.x, near.y), glm::max(near.z, 0.0f));
    float u = glm::min(glm::min(far.x, far.y), glm::min(far.z, best));
    return t <= u ? t : 1e30f;
  }
  void process(const Ray &ray) {
    glm::vec3 inverse = 1.0f / ray.along;
    Hit hit{1e29f, -1};
    int stack[32];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const Node &node = state().nodes[stack[--top]];
      if (enter(node, ray, inverse, hit.t) >= hit.t)
        continue;
      if (node.count == 0) {
        float l = enter(state().nodes[node.first], ray, inverse, hit.t);
        float r = enter(state().nodes[node.first + 1], ray, inverse, hit.t);
        bool swap = r < l;
        if (glm::max(l, r) < hit.t)
          stack[top++] = node.first + (swap ? 0 : 1);
        if (glm::min(l, r) < hit.t)
          stack[top++] = node.first + (swap ? 1 : 0);
        continue;
      }
      for (int i = node.first; i < node.first + node.count; ++i) {
        const Triangle &t = state().triangles[i];
        glm::vec3 e = t.b - t.a, f = t.c - t.a;
        glm::vec3 p = glm::cross(ray.along, f);
        float det = glm::dot(e, p);
        if (det == 0)
          continue;
        float scale = 1 / det;
        glm::vec3 s = ray.from - t.a;
        float u = glm::dot(s, p) * scale;
        if (u < 0 || u > 1)
          continue;
        glm::vec3 q = glm::cross(s, e);
        float v = glm::dot(ray.along, q) * scale;
        if (v < 0 || u + v > 1)
          continue;
        float d = glm::dot(f, q) * scale;
        if (d > 0 && d < hit.t)
          hit = {d, i};
      }
    }
    state().hits[ray.index] = hit;
  }
};
struct Bvh : piko::Pipe<State> {
  Shoot shoot;
  Bvh() { source(shoot); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Ray> rays;
  std::vector<Node> nodes;
  std::vector<Triangle> triangles;
  std::vector<Hit> hits;
  static glm::vec3 centre(const Triangle &t) { return t.a + t.b + t.c; }
  void build(int node, int begin, int end) {
    glm::vec3 lo(1e30f), hi(-1e30f);
    for (int i = begin; i < end; ++i)
      for (glm::vec3 p : {triangles[i].a, triangles[i].b, triangles[i].c}) {
        lo = glm::min(lo, p);
        hi = glm::max(hi, p);
      }
    nodes[node] = {lo, begin, hi, end - begin};
    if (end - begin <= 4)
      return;
    glm::vec3 size = hi - lo;
    int axis =
        size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    std::stable_sort(triangles.begin() + begin, triangles.begin() + end,
                     [&](const Triangle &a, const Triangle &b) {
                       return centre(a)[axis] < centre(b)[axis];
                     });
    int child = int(nodes.size());
    nodes[node].first = child;
    nodes[node].count = 0;
    nodes.resize(nodes.size() + 2);
    build(child, begin, (begin + end) / 2);
    build(child + 1, (begin + end) / 2, end);
  }
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 5000; ++i) {
      glm::vec3 at{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)};
      auto near = [&] {
        return at + glm::vec3{random.in(-.05f, .05f), random.in(-.05f, .05f),
                              random.in(-.05f, .05f)};
      };
      glm::vec3 a = near(), b = near(), c = near();
      triangles.push_back({a, b, c});
    }
    nodes.resize(1);
    build(0, 0, int(triangles.size()));
    for (int i = 0; i < 6000; ++i)
      rays.push_back(
          {{0, 0, -3}, {random.in(-.35f, .35f), random.in(-.35f, .35f), 1}, i});
    hits.resize(rays.size());
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().nodes, nodes);
    bodies::bind(pipe.state().triangles, triangles);
    bodies::bind(pipe.state().hits, hits);
    pipe.feed(pipe.shoot, rays);
  }
  uint64_t result(auto &) { return bodies::hash(hits); }
};
PIKO_BODY_MAIN(Bvh, Host)
#endif
