// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
// What all lanes share is broadcast from memory where it is used: numbers that
// were loaded before a branch, or on both of its sides, or together, by the
// SLP vectorizer.
// RUN: pikoc %s -o - --emit=assembly --cpu x86-64-v4 | FileCheck %s
// RUN: pikoc %s -o - --emit=assembly --cpu x86-64-v3 | FileCheck %s --check-prefix=AVX2
// REQUIRES: x86_64

#include <piko.h>

struct Light {
  glm::vec4 position;
  glm::vec3 color;
};
struct Pixel {
  glm::vec3 color{0};
};
struct State {
  piko::Buffer<Light> lights;
  piko::Image<Pixel> image;
};
struct Tick {
  int n;
};

// CHECK-LABEL: Lit.kernel_shade..omp_par:
// CHECK:       vucomiss
// CHECK:       vbroadcastss -12([[LIGHT:%r[a-z0-9]+]]), %zmm
// CHECK:       -24([[LIGHT]])
// CHECK:       -16([[LIGHT]])
// CHECK:       vsqrtps
// CHECK:       vbroadcastss -8([[LIGHT]]), %zmm
// CHECK:       vbroadcastss -4([[LIGHT]]), %zmm
// CHECK:       vbroadcastss ([[LIGHT]]), %zmm
// AVX2-LABEL: Lit.kernel_shade..omp_par:
// AVX2:       vucomiss
// AVX2:       vbroadcastss -12([[LIGHT:%r[a-z0-9]+]]), %ymm
// AVX2:       vsqrtps
// AVX2:       vbroadcastss -8([[LIGHT]]), %ymm
struct Shade : piko::Stage<16, 16, 64, Tick>, piko::Uses<State> {
  void assignBin(const Tick &t) { assignToAll(t); }
  void process(const Tick &t) {
    parallelForPixels([&](glm::ivec2 p) {
      glm::vec3 sum(0), at(p, t.n);
      for (int64_t i = 0; i < state().lights.size(); ++i) {
        const Light &light = state().lights[i];
        glm::vec3 l(light.position);
        if (light.position.w == 0)
          sum += light.color * glm::max(0.0f, l.x * at.x + l.y * at.y);
        else {
          l -= light.position.w * at;
          sum += light.color / glm::sqrt(glm::dot(l, l));
        }
      }
      update(state().image, p, [&](Pixel &pixel) { pixel.color = sum; });
    });
  }
};
struct Lit : piko::Pipe<State> {
  Shade shade;
  Lit() { source(shade); }
};
