// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A 5 x 5 convolution of a buffer of floats, clamped at the edges.
#include <piko.h>

struct Row {
  int y;
};
struct State {
  int width = 0, height = 0;
  piko::Buffer<float> in, weights, out;
};

struct Convolve : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    int w = state().width, h = state().height;
    for (int x = 0; x < w; ++x) {
      float sum = 0;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          int sx = glm::clamp(x + dx, 0, w - 1);
          int sy = glm::clamp(row.y + dy, 0, h - 1);
          sum +=
              state().weights[(dy + 2) * 5 + dx + 2] * state().in[sy * w + sx];
        }
      state().out[row.y * w + x] = sum;
    }
  }
};
struct Convolution : piko::Pipe<State> {
  Convolve convolve;
  Convolution() { source(convolve); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 512, h = 256;
  std::vector<Row> rows;
  std::vector<float> in, weights, out = std::vector<float>(w * h);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < w * h; ++i)
      in.push_back(random.unit());
    for (int i = 0; i < 25; ++i)
      weights.push_back(random.in(-1, 1));
    for (int y = 0; y < h; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    pipe.state().width = w;
    pipe.state().height = h;
    bodies::bind(pipe.state().in, in);
    bodies::bind(pipe.state().weights, weights);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.convolve, rows);
  }
  // 25 products and sums for a pixel.
  double flops() const { return 50.0 * w * h; }
  // A pixel is read, and one is written.
  double bytes() const { return 2.0 * w * h * sizeof(float); }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Convolution, Host)
#endif
