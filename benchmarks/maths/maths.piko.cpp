// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A function of the maths for each float of a buffer.
#include <piko.h>

struct State {
  piko::Buffer<float> in, out;
};
struct Apply : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void schedule(piko::BinId) {
    specifyLanes(piko::Lanes::Iterations);
#ifdef MATHS_ULPS
    specifyUlps(MATHS_ULPS);
#endif
  }
  void process(const int &) {
    parallelFor(int(state().in.size()), [&](int i) {
      state().out[i] = piko::MATHS_FUNCTION(state().in[i]);
    });
  }
};
struct Maths : piko::Pipe<State> {
  Apply apply;
  Maths() { source(apply); }
};
