// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Numbers that are no indices stop all targets, before a kernel runs.
// RUN: %compare_targets %s --stops --pipe Below --runs 1 --threads 1 2 | FileCheck %s --check-prefix=BELOW
// RUN: %compare_targets %s --stops --pipe Sized --count 100 1 --runs 1 --threads 1 2 | FileCheck %s --check-prefix=SIZED
// RUN: %compare_targets %s --stops --pipe Indexed --runs 1 --threads 1 2 | FileCheck %s --check-prefix=INDEXED
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> in, out;
  piko::Buffer<float> sums;
};

struct Drop : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) { piko::atomicAdd(state().out[p.tag], p.x); }
};

// BELOW: expected: {{.*}}stage 'Drop': expected field 'tag' of primitive [[N:[0-9]+]] of source 0 in [0, 10), but got [[X:[0-9]+]]
// BELOW: got: stage 'drop': expected field 'tag' of primitive [[N]] of source 0 in [0, 10), but got [[X]]
struct Below : piko::Pipe<State> {
  Drop drop;
  Below() {
    source(drop);
    expectIndex<&Point::tag>(0, 10);
  }
};

// SIZED: expected: {{.*}}stage 'Drop': expected field 'tag' of primitive [[N:[0-9]+]] of source 0 to be an index into {{.*}}, in [0, 1), but got [[X:[0-9]+]]
// SIZED: got: stage 'drop': expected field 'tag' of primitive [[N]] of source 0 to be an index into 'sums', in [0, 1), but got [[X]]
struct One : piko::Stage<0, 0, 64, glm::ivec2>, piko::Uses<State> {
  void process(const glm::ivec2 &i) { piko::atomicAdd(state().out[0], i.x); }
};
struct Sized : piko::Pipe<State> {
  Drop drop;
  One one;
  Sized() {
    source(drop);
    source(one);
    allocateForSource(state().sums, 1);
    expectIndex<&Point::tag>(0, state().sums);
  }
};

// INDEXED: expected: {{.*}}buffer{{.*}}: expected element [[N:[0-9]+]] in [0, 5), but got [[X:[0-9]+]]
// INDEXED: got: buffer 'in': expected element [[N]] in [0, 5), but got [[X]]
struct Indexed : piko::Pipe<State> {
  Drop drop;
  Indexed() {
    source(drop);
    expectIndex(state().in, 5);
  }
};
