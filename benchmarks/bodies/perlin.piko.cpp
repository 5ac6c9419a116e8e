// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Six octaves of Perlin noise, with the permutation in a buffer.
#include <piko.h>

struct Row {
  int y;
};
struct State {
  piko::Buffer<int> permutation; // 512
  piko::Buffer<float> out;
};
constexpr int width = 256, height = 128;

struct Noise : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  static float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }
  static float grad(int hash, float x, float y, float z) {
    int h = hash & 15;
    float u = h < 8 ? x : y;
    float v = h < 4 ? y : h == 12 || h == 14 ? x : z;
    return ((h & 1) == 0 ? u : -u) + ((h & 2) == 0 ? v : -v);
  }
  float noise(float x, float y, float z) const {
    const piko::Buffer<int> &p = state().permutation;
    int X = int(glm::floor(x)) & 255, Y = int(glm::floor(y)) & 255,
        Z = int(glm::floor(z)) & 255;
    x -= glm::floor(x);
    y -= glm::floor(y);
    z -= glm::floor(z);
    float u = fade(x), v = fade(y), w = fade(z);
    int A = p[X] + Y, AA = p[A] + Z, AB = p[A + 1] + Z;
    int B = p[X + 1] + Y, BA = p[B] + Z, BB = p[B + 1] + Z;
    float a = glm::mix(grad(p[AA], x, y, z), grad(p[BA], x - 1, y, z), u);
    float b =
        glm::mix(grad(p[AB], x, y - 1, z), grad(p[BB], x - 1, y - 1, z), u);
    float c = glm::mix(grad(p[AA + 1], x, y, z - 1),
                       grad(p[BA + 1], x - 1, y, z - 1), u);
    float d = glm::mix(grad(p[AB + 1], x, y - 1, z - 1),
                       grad(p[BB + 1], x - 1, y - 1, z - 1), u);
    return glm::mix(glm::mix(a, b, v), glm::mix(c, d, v), w);
  }
  void process(const Row &row) {
    for (int x = 0; x < width; ++x) {
      float sum = 0, amplitude = 1, frequency = 1 / 32.0f;
      for (int octave = 0; octave < 6; ++octave) {
        sum += amplitude *
               noise(float(x) * frequency, float(row.y) * frequency, 0.5f);
        amplitude *= 0.5f;
        frequency *= 2;
      }
      state().out[row.y * width + x] = sum;
    }
  }
};
struct Perlin : piko::Pipe<State> {
  Noise noise;
  Perlin() { source(noise); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Row> rows;
  std::vector<int> permutation;
  std::vector<float> out = std::vector<float>(width * height);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 256; ++i)
      permutation.push_back(i);
    for (int i = 255; i > 0; --i)
      std::swap(permutation[i], permutation[random.below(i + 1)]);
    for (int i = 0; i < 258; ++i)
      permutation.push_back(permutation[i]);
    for (int y = 0; y < height; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().permutation, permutation);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.noise, rows);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Perlin, Host)
#endif
