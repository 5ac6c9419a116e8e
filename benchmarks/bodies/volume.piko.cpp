// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ray marching of a volume of densities, trilinear, clamped at the edges.
#include <piko.h>

struct Ray {
  glm::vec3 from, along;
  int index;
};
struct State {
  int size = 0;
  piko::Buffer<float> density;
  piko::Buffer<glm::vec4> out;
};

struct March : piko::Stage<0, 0, 1, Ray>, piko::Uses<State> {
  float voxel(int x, int y, int z) const {
    int n = state().size;
    x = glm::clamp(x, 0, n - 1);
    y = glm::clamp(y, 0, n - 1);
    z = glm::clamp(z, 0, n - 1);
    return state().density[(z * n + y) * n + x];
  }
  float sample(glm::vec3 p) const {
    glm::vec3 f = glm::floor(p), t = p - f;
    int x = int(f.x), y = int(f.y), z = int(f.z);
    float a = glm::mix(voxel(x, y, z), voxel(x + 1, y, z), t.x);
    float b = glm::mix(voxel(x, y + 1, z), voxel(x + 1, y + 1, z), t.x);
    float c = glm::mix(voxel(x, y, z + 1), voxel(x + 1, y, z + 1), t.x);
    float d = glm::mix(voxel(x, y + 1, z + 1), voxel(x + 1, y + 1, z + 1), t.x);
    return glm::mix(glm::mix(a, b, t.y), glm::mix(c, d, t.y), t.z);
  }
  void process(const Ray &ray) {
    glm::vec3 color(0);
    float transmittance = 1, t = 0, far = float(state().size) * 1.7f;
    while (t < far && transmittance > 0.01f) {
      glm::vec3 p = ray.from + ray.along * t;
      float density = sample(p);
      if (density > 0.1f) {
        float alpha = 1 - piko::exp(-0.2f * density);
        color += transmittance * alpha *
                 glm::vec3(density, 1 - density, 0.5f * density);
        transmittance *= 1 - alpha;
      }
      t += 0.5f;
    }
    state().out[ray.index] = glm::vec4(color, transmittance);
  }
};
struct Volume : piko::Pipe<State> {
  March march;
  Volume() { source(march); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int n = 48, w = 64;
  std::vector<Ray> rays;
  std::vector<float> density;
  std::vector<glm::vec4> out = std::vector<glm::vec4>(w * w);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < n * n * n; ++i)
      density.push_back(random.unit() * random.unit());
    for (int i = 0; i < w * w; ++i)
      rays.push_back({{float(i % w) * n / w, float(i / w) * n / w, -1.0f},
                      {random.in(-.1f, .1f), random.in(-.1f, .1f), 1},
                      i});
    pipe.setDomain({1, 1});
    pipe.state().size = n;
    bodies::bind(pipe.state().density, density);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.march, rays);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Volume, Host)
#endif
