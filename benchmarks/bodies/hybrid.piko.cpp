// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Rays through a grid of cells with lists of spheres (3D DDA).
#include <piko.h>

struct Ray {
  glm::vec3 from, along;
  int index;
};
struct Sphere {
  glm::vec3 centre;
  float radius;
};
struct Cell {
  int begin, end;
};
struct State {
  int n = 0;
  piko::Buffer<Cell> cells;
  piko::Buffer<int> indices;
  piko::Buffer<Sphere> spheres;
  piko::Buffer<float> out;
};

struct Walk : piko::Stage<0, 0, 1, Ray>, piko::Uses<State> {
  void process(const Ray &ray) {
    int n = state().n;
    glm::ivec3 cell = glm::clamp(glm::ivec3(glm::floor(ray.from)),
                                 glm::ivec3(0), glm::ivec3(n - 1));
    glm::ivec3 step;
    glm::vec3 next, delta;
    for (int d = 0; d < 3; ++d) {
      step[d] = ray.along[d] < 0 ? -1 : 1;
      delta[d] = glm::abs(1 / ray.along[d]);
      float edge = float(cell[d] + (step[d] > 0 ? 1 : 0));
      next[d] = (edge - ray.from[d]) / ray.along[d];
    }
    float best = 1e30f;
    while (true) {
      const Cell &c = state().cells[(cell.z * n + cell.y) * n + cell.x];
      for (int i = c.begin; i < c.end; ++i) {
        const Sphere &s = state().spheres[state().indices[i]];
        glm::vec3 o = ray.from - s.centre;
        float a = glm::dot(ray.along, ray.along), b = glm::dot(o, ray.along);
        float disc = b * b - a * (glm::dot(o, o) - s.radius * s.radius);
        if (disc < 0)
          continue;
        float t = (-b - piko::sqrt(disc)) / a;
        if (t > 0 && t < best)
          best = t;
      }
      int axis = next.x < next.y ? (next.x < next.z ? 0 : 2)
                                 : (next.y < next.z ? 1 : 2);
      if (best < next[axis])
        break;
      cell[axis] += step[axis];
      if (cell[axis] < 0 || cell[axis] >= n)
        break;
      next[axis] += delta[axis];
    }
    state().out[ray.index] = best;
  }
};
struct Hybrid : piko::Pipe<State> {
  Walk walk;
  Hybrid() { source(walk); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int n = 24;
  std::vector<Ray> rays;
  std::vector<Cell> cells;
  std::vector<int> indices;
  std::vector<Sphere> spheres;
  std::vector<float> out;
  void bind(auto &pipe) {
    bodies::Random random;
    float size = float(n);
    std::vector<std::vector<int>> lists(n * n * n);
    for (int i = 0; i < 3000; ++i) {
      spheres.push_back(
          {{random.in(0, size), random.in(0, size), random.in(0, size)},
           random.in(.05f, .4f)});
      const Sphere &s = spheres.back();
      glm::ivec3 lo = glm::max(glm::ivec3(s.centre - s.radius), glm::ivec3(0));
      glm::ivec3 hi =
          glm::min(glm::ivec3(s.centre + s.radius), glm::ivec3(n - 1));
      for (int z = lo.z; z <= hi.z; ++z)
        for (int y = lo.y; y <= hi.y; ++y)
          for (int x = lo.x; x <= hi.x; ++x)
            lists[(z * n + y) * n + x].push_back(i);
    }
    for (const std::vector<int> &list : lists) {
      int begin = int(indices.size());
      indices.insert(indices.end(), list.begin(), list.end());
      cells.push_back({begin, int(indices.size())});
    }
    for (int i = 0; i < 20000; ++i)
      rays.push_back(
          {{random.in(0, size), random.in(0, size), random.in(0, size)},
           {random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)},
           i});
    out.resize(rays.size());
    pipe.setDomain({1, 1});
    pipe.state().n = n;
    bodies::bind(pipe.state().cells, cells);
    bodies::bind(pipe.state().indices, indices);
    bodies::bind(pipe.state().spheres, spheres);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.walk, rays);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Hybrid, Host)
#endif
