// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// endStage<X> waits for all stages of type X; a member may have a stage's name.
// RUN: %compare_targets %s --cases %s
// CASE: --count 2000
// CASE: --count 2000 --strip 7
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> first;
  piko::Buffer<int> result;
};

struct Add : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) { piko::atomicAdd(state().first[p.x], p.tag); }
};
struct Gather : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void schedule(piko::BinId) { endStage<Add>(); }
  void process(const Point &p) {
    piko::atomicAdd(state().result[p.tag], state().first[p.x]);
  }
};
struct Waits : piko::Pipe<State> {
  Gather gather;
  Add first;
  Add second;
  Waits() {
    source(gather);
    source(first);
    source(second);
  }
};
