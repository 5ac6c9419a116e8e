// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The game of life on a torus, with indices by remainder.
#include <piko.h>

struct Row {
  int y;
};
struct State {
  int width = 0, height = 0;
  piko::Buffer<uint8_t> now, next;
};

struct Step : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    int w = state().width, h = state().height;
    int up = (row.y + h - 1) % h, down = (row.y + 1) % h;
    for (int x = 0; x < w; ++x) {
      int left = (x + w - 1) % w, right = (x + 1) % w;
      const piko::Buffer<uint8_t> &now = state().now;
      int count = now[up * w + left] + now[up * w + x] + now[up * w + right] +
                  now[row.y * w + left] + now[row.y * w + right] +
                  now[down * w + left] + now[down * w + x] +
                  now[down * w + right];
      bool alive = now[row.y * w + x] != 0;
      state().next[row.y * w + x] = count == 3 || (alive && count == 2);
    }
  }
};
struct Life : piko::Pipe<State> {
  Step step;
  Life() { source(step); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 512, h = 512;
  std::vector<Row> rows;
  std::vector<uint8_t> now, next = std::vector<uint8_t>(w * h);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < w * h; ++i)
      now.push_back(random.below(3) == 0);
    for (int y = 0; y < h; ++y)
      rows.push_back({y});
    pipe.setDomain({1, 1});
    pipe.state().width = w;
    pipe.state().height = h;
    bodies::bind(pipe.state().now, now);
    bodies::bind(pipe.state().next, next);
    pipe.feed(pipe.step, rows);
  }
  uint64_t result(auto &) { return bodies::hash(next); }
};
PIKO_BODY_MAIN(Life, Host)
#endif
