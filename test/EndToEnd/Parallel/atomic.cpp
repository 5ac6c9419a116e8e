// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Integer atomics of all kinds, in a bin that all threads share.
// RUN: %compare_targets %s --count 50000 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct Statistics {
  int sum, least, most;
  unsigned least2, most2, all, any, odd;
};
struct State {
  piko::Buffer<Statistics> statistics;
  piko::Buffer<unsigned> histogram;
};

struct Gather : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    Statistics &s = state().statistics[p.tag / 4];
    piko::atomicAdd(s.sum, p.x - p.y);
    piko::atomicMin(s.least, p.x - 31);
    piko::atomicMax(s.most, p.y - 31);
    piko::atomicMin(s.least2, unsigned(p.x));
    piko::atomicMax(s.most2, unsigned(p.x - 5));
    piko::atomicAnd(s.all, unsigned(p.x));
    piko::atomicOr(s.any, unsigned(p.y));
    piko::atomicXor(s.odd, unsigned(p.y));
    piko::atomicAdd(state().histogram[p.x], 1u);
  }
};
struct Atomics : piko::Pipe<State> {
  Gather gather;
  Atomics() { source(gather); }
};
