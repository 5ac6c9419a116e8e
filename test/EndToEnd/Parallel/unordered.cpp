// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Atomics that show their order, in sums that do not.
// RUN: %compare_targets %s --count 4000 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct Sums {
  float total;
  double wide;
  int next;
};
struct Count {
  int value;
};
struct State {
  piko::Buffer<Sums> sums;
  piko::Buffer<Count> taken;
};

struct Take : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void schedule(piko::BinId) { specifyOrder(piko::Unordered); }
  void process(const Point &p) {
    piko::atomicAdd(state().sums[0].total, p.value);
    piko::atomicAdd(state().sums[0].wide, double(p.value));
    int place = piko::atomicAddFetch(state().sums[0].next, 1);
    emit({place % 64, p.y, p.value, p.tag});
  }
};
struct Tally : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) { piko::atomicAdd(state().taken[p.x].value, 1); }
};
struct Takes : piko::Pipe<State> {
  Take take;
  Tally tally;
  Takes() {
    source(take);
    connect(take, 0, tally);
  }
};
