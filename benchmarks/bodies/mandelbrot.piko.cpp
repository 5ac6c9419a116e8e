// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The Mandelbrot set, a row of pixels for each primitive.
#include <piko.h>

struct Row {
  int y;
};
struct State {
  int limit = 256;
  piko::Buffer<int> counts;
};
constexpr int width = 512, height = 128;

struct Iterate : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    float ci = -1.25f + 2.5f * float(row.y) / float(height);
    for (int x = 0; x < width; ++x) {
      float cr = -2.0f + 2.75f * float(x) / float(width);
      float re = 0, im = 0;
      int n = 0;
      while (n < state().limit && re * re + im * im < 4.0f) {
        float next = re * re - im * im + cr;
        im = 2.0f * re * im + ci;
        re = next;
        ++n;
      }
      state().counts[row.y * width + x] = n;
    }
  }
};
struct Mandelbrot : piko::Pipe<State> {
  Iterate iterate;
  Mandelbrot() { source(iterate); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Row> rows;
  std::vector<int> counts = std::vector<int>(width * height);
  void bind(auto &pipe) {
    for (int y = 0; y < height; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().counts, counts);
    pipe.feed(pipe.iterate, rows);
  }
  uint64_t result(auto &) { return bodies::hash(counts); }
};
PIKO_BODY_MAIN(Mandelbrot, Host)
#endif
