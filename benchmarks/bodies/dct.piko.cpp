// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Discrete cosine transforms of 8 x 8 blocks, in private arrays, and back to
// integers by a table of quantizers.
#include <piko.h>

struct Block {
  int x, y;
};
struct State {
  int width = 0;
  piko::Buffer<float> cosines; // 8 x 8
  piko::Buffer<int> quantizers;
  piko::Buffer<uint8_t> pixels;
  piko::Buffer<int16_t> out;
};

struct Transform : piko::Stage<0, 0, 1, Block>, piko::Uses<State> {
  void process(const Block &block) {
    float in[64], rows[64];
    int w = state().width;
    for (int i = 0; i < 64; ++i)
      in[i] =
          float(state().pixels[(block.y + i / 8) * w + block.x + i % 8]) - 128;
    for (int y = 0; y < 8; ++y)
      for (int u = 0; u < 8; ++u) {
        float sum = 0;
        for (int x = 0; x < 8; ++x)
          sum += in[y * 8 + x] * state().cosines[u * 8 + x];
        rows[y * 8 + u] = sum;
      }
    for (int u = 0; u < 8; ++u)
      for (int v = 0; v < 8; ++v) {
        float sum = 0;
        for (int y = 0; y < 8; ++y)
          sum += rows[y * 8 + u] * state().cosines[v * 8 + y];
        int value = int(sum) / state().quantizers[v * 8 + u];
        state().out[(block.y + v) * w + block.x + u] = int16_t(value);
      }
  }
};
struct Dct : piko::Pipe<State> {
  Transform transform;
  Dct() { source(transform); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 256, h = 256;
  std::vector<Block> blocks;
  std::vector<float> cosines;
  std::vector<int> quantizers;
  std::vector<uint8_t> pixels;
  std::vector<int16_t> out = std::vector<int16_t>(w * h);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 64; ++i) {
      cosines.push_back(float(std::cos((2 * (i % 8) + 1) * (i / 8) * 0.19635)) /
                        2);
      quantizers.push_back(1 + i / 4);
    }
    for (int i = 0; i < w * h; ++i)
      pixels.push_back(uint8_t(random.next()));
    for (int i = 0; i < w * h / 64; ++i)
      blocks.push_back({i % (w / 8) * 8, i / (w / 8) * 8});
    pipe.setDomain({1, 1});
    pipe.state().width = w;
    bodies::bind(pipe.state().cosines, cosines);
    bodies::bind(pipe.state().quantizers, quantizers);
    bodies::bind(pipe.state().pixels, pixels);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.transform, blocks);
  }
  // For a pixel the offset, and 8 products and sums in each of two passes.
  double flops() const { return 33.0 * w * h; }
  // Pixels are read, coefficients are written.
  double bytes() const {
    return w * h * double(sizeof(uint8_t) + sizeof(int16_t));
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Dct, Host)
#endif
