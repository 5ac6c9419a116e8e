//===- Standalone.cpp - A pipeline file that is a whole program -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Built by any C++20 compiler with no flag but the include path; all must
// print the same.
//
//===----------------------------------------------------------------------===//
#include <piko.h>

#include <cstdio>
#include <cstring>
#include <vector>

struct Splat {
  glm::vec3 center;
  float radius;
  glm::vec3 color;
};
struct Fragment {
  glm::ivec2 at;
  float z;
  glm::vec3 color;
};
struct Pixel {
  float z = 1;
  glm::vec3 color = glm::vec3(0);
};

struct SplatState {
  glm::mat4 view = glm::mat4(1);
  piko::Image<Pixel> pixels;
  piko::Buffer<int> drawn;
};

struct Project : piko::Stage<0, 0, 64, Splat, Splat>, piko::Uses<SplatState> {
  void process(const Splat &s) {
    Splat t = s;
    glm::vec4 p = state().view * glm::vec4(s.center, 1);
    t.center = glm::vec3(p) / p.w;
    t.color *= piko::exp(-t.center.z) * piko::sin(17 * s.radius);
    emit(t);
  }
};

struct Cover : piko::Stage<16, 16, 64, Splat, Fragment> {
  void assignBin(const Splat &s) {
    glm::vec2 c(s.center), r(s.radius);
    assignToBoundingBox(s, c - r, c + r);
  }
  void process(const Splat &s) {
    parallelForPixels([&](glm::ivec2 at) {
      glm::vec2 d = glm::vec2(at) + 0.5f - glm::vec2(s.center);
      float w = 1 - glm::dot(d, d) / (s.radius * s.radius);
      if (w > 0)
        emit(Fragment{at, s.center.z, s.color * piko::sqrt(w)});
    });
  }
};

struct Test : piko::Stage<16, 16, 64, Fragment>, piko::Uses<SplatState> {
  void assignBin(const Fragment &f) { assignToPreviousBins(f); }
  void process(const Fragment &f) {
    update(state().pixels, f.at, [&](Pixel &p) {
      if (f.z < p.z)
        p = {f.z, f.color + 0.25f * p.color};
    });
    piko::atomicAdd(state().drawn[bin().index], 1);
  }
};

struct SplatPipe : piko::Pipe<SplatState> {
  Project project;
  Cover cover;
  Test test;
  SplatPipe() {
    source(project);
    connect(project, 0, cover);
    connect(cover, 0, test);
  }
};

int main() {
  std::vector<Splat> splats;
  for (int i = 0; i < 200; ++i) {
    float f = float(i) / 200;
    splats.push_back({{50 + 60 * piko::cos(40 * f), 40 + 45 * piko::sin(31 * f),
                       piko::pow(f, 0.7f)},
                      2 + 9 * piko::abs(piko::tan(f)),
                      {f, 1 - f, piko::log(2 + f)}});
  }
  SplatPipe pipe;
  pipe.setDomain({100, 75});
  pipe.state().view[3] = glm::vec4(0.3f, -1.7f, 0.01f, 1);
  pipe.state().drawn.assign(std::vector<int>(7 * 5));
  pipe.feed(pipe.project, splats);
  pipe.run();
  uint64_t hash = 0xcbf29ce484222325;
  const auto &pixels = pipe.state().pixels;
  std::vector<unsigned char> bytes(pixels.size() * sizeof(Pixel));
  std::memcpy(bytes.data(), pixels.data(), bytes.size());
  for (unsigned char byte : bytes)
    hash = (hash ^ byte) * 0x100000001b3;
  std::printf("pixels %016llx\n", (unsigned long long)hash);
  for (int n : pipe.state().drawn)
    std::printf("%d ", n);
  std::printf("\n");
}
