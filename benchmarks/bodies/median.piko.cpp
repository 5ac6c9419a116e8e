// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A 3 x 3 median of bytes, by insertion sort in a private array.
#include <algorithm>
#include <piko.h>

struct Row {
  int y;
};
struct State {
  int width = 0, height = 0;
  piko::Buffer<uint8_t> in, out;
};

struct Filter : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    int w = state().width, h = state().height;
    for (int x = 0; x < w; ++x) {
      uint8_t values[9];
      int n = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          int sx = std::min(std::max(x + dx, 0), w - 1);
          int sy = std::min(std::max(row.y + dy, 0), h - 1);
          uint8_t v = state().in[sy * w + sx];
          int at = n++;
          for (; at > 0 && values[at - 1] > v; --at)
            values[at] = values[at - 1];
          values[at] = v;
        }
      state().out[row.y * w + x] = values[4];
    }
  }
};
struct Median : piko::Pipe<State> {
  Filter filter;
  Median() { source(filter); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 256, h = 256;
  std::vector<Row> rows;
  std::vector<uint8_t> in, out = std::vector<uint8_t>(w * h);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < w * h; ++i)
      in.push_back(uint8_t(random.next()));
    for (int y = 0; y < h; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    pipe.state().width = w;
    pipe.state().height = h;
    bodies::bind(pipe.state().in, in);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.filter, rows);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Median, Host)
#endif
