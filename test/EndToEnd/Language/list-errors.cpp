// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What only a run can find of lists and barriers, on all targets.
// RUN: %compare_targets %s --stops --pipe Read --runs 1 --threads 1 2 | FileCheck %s --check-prefix=READ
// RUN: %compare_targets %s --stops --pipe Part --runs 1 --threads 1 2 | FileCheck %s --check-prefix=PART
// RUN: %compare_targets %s --stops --pipe Count --runs 1 --threads 1 2 | FileCheck %s --check-prefix=COUNT
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> out;
};

// READ: expected: {{.*}}stage 'ReadOutside'{{.*}}: expected an index in [0, 1000), but got 1000
// READ: got: stage 'stage', bin 0: expected an index in [0, 1000), but got 1000
struct ReadOutside : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &list) {
    state().out[0] = list[list.size()].tag;
  }
};
struct Read : piko::Pipe<State> {
  ReadOutside stage;
  Read() { source(stage); }
};

// PART: expected: {{.*}}stage 'PartWays'{{.*}}: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration 3 does not
// PART: got: stage 'stage', bin 0: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration 3 does not
struct PartWays : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &) {
    parallelFor(8, [&](int i) {
      state().out[i] = i;
      if (i < 3)
        sync();
      state().out[i] += 1;
    });
  }
};
struct Part : piko::Pipe<State> {
  PartWays stage;
  Part() { source(stage); }
};

// Iteration 0 would go on for ever.
// COUNT: expected: {{.*}}stage 'CountApart'{{.*}}: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration 1 does not
// COUNT: got: stage 'stage', bin 0: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration 1 does not
struct CountApart : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &) {
    parallelFor(8, [&](int i) {
      for (int k = 0; k < 5 || i == 0; k += (i == 0 ? 0 : 1)) {
        state().out[i] += k;
        sync();
      }
    });
  }
};
struct Count : piko::Pipe<State> {
  CountApart stage;
  Count() { source(stage); }
};
