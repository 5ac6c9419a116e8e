// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Prefix sums of the rows of a table, and of their squares.
#include <piko.h>

struct Row {
  int y;
};
struct State {
  int width = 0;
  piko::Buffer<float> in, sums, squares;
};

struct Scan : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    float sum = 0, square = 0;
    int base = row.y * state().width;
    for (int x = 0; x < state().width; ++x) {
      float v = state().in[base + x];
      sum += v;
      square += v * v;
      state().sums[base + x] = sum;
      state().squares[base + x] = square;
    }
  }
};
struct Prefix : piko::Pipe<State> {
  Scan scan;
  Prefix() { source(scan); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 2048, h = 256;
  std::vector<Row> rows;
  std::vector<float> in, sums = std::vector<float>(w * h),
                         squares = std::vector<float>(w * h);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < w * h; ++i)
      in.push_back(random.in(-1, 1));
    for (int y = 0; y < h; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    pipe.state().width = w;
    bodies::bind(pipe.state().in, in);
    bodies::bind(pipe.state().sums, sums);
    bodies::bind(pipe.state().squares, squares);
    pipe.feed(pipe.scan, rows);
  }
  // Two sums and a square.
  double flops() const { return 3.0 * w * h; }
  // One is read, two are written.
  double bytes() const { return 3.0 * w * h * sizeof(float); }
  uint64_t result(auto &) { return bodies::hash(sums) ^ bodies::hash(squares); }
};
PIKO_BODY_MAIN(Prefix, Host)
#endif
