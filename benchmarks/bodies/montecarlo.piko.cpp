// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Random walks with an integer generator.
#include <piko.h>

struct Walker {
  uint32_t seed;
  int index;
};
struct State {
  piko::Buffer<float> out;
};

struct Walk : piko::Stage<0, 0, 1, Walker>, piko::Uses<State> {
  static float random(uint32_t &s) {
    s ^= s << 13;
    s ^= s >> 17;
    s ^= s << 5;
    return float(s >> 8) * (1.0f / 16777216.0f);
  }
  void process(const Walker &walker) {
    uint32_t s = walker.seed | 1;
    int inside = 0;
    float x = 0, y = 0;
    for (int i = 0; i < 1000; ++i) {
      float dx = random(s) - 0.5f;
      float dy = random(s) - 0.5f;
      x += dx;
      y += dy;
      if (x * x + y * y < 9)
        ++inside;
      else if (random(s) < 0.1f)
        x = y = 0;
    }
    state().out[walker.index] = float(inside) + x + y;
  }
};
struct MonteCarlo : piko::Pipe<State> {
  Walk walk;
  MonteCarlo() { source(walk); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Walker> walkers;
  std::vector<float> out;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 1000; ++i)
      walkers.push_back({random.next(), i});
    out.resize(walkers.size());
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.walk, walkers);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(MonteCarlo, Host)
#endif
