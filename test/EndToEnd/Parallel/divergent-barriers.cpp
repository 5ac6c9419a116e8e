// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations that do not all come to a barrier are an error, and nothing after
// it runs: not what the barrier's branch guards, nor a loop that others leave.
// REQUIRES: all
// RUN: %compare_targets %s --stops --pipe Guarded --runs 1 --threads 1 2 | FileCheck %s
// RUN: %compare_targets %s --stops --pipe Loops --runs 1 --threads 1 2 | FileCheck %s
// RUN: %compare_targets %s --stops --pipe Counts --runs 1 --threads 1 2 | FileCheck %s
// CHECK: got: stage 'stage', bin {{[0-9]+}}: expected every iteration of parallelFor to call {{sync|count}}() as often as iteration 0, but iteration {{[0-9]+}} does not
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> out;
};

/// The guard is what keeps indices inside a private array.
struct GuardArray : piko::Stage<0, 0, 32, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &list) {
    int seen[16] = {};
    parallelFor(20000, [&](int i) {
      if (i >= 16)
        return;
      seen[i] = list[i].tag;
      sync();
      piko::atomicAdd(state().out[0], seen[15 - i]);
    });
  }
};
struct Guarded : piko::Pipe<State> {
  GuardArray stage;
  Guarded() { source(stage); }
};

/// Iteration 0 stays in the loop, and what would let it go is after a barrier.
struct LeaveLoop : piko::Stage<0, 0, 32, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &list) {
    int rounds[4] = {3, 1, 2, 3};
    parallelFor(int(list.size()), [&](int i) {
      int mine = 0;
      while (mine < rounds[i & 3]) {
        sync();
        ++mine;
        if (any(i > 2 && mine > 1))
          piko::atomicAdd(state().out[i], 1);
      }
      do {
        sync();
        rounds[i & 3] = 0;
        sync();
      } while (rounds[0] > 0);
    });
  }
};
struct Loops : piko::Pipe<State> {
  LeaveLoop stage;
  Loops() { source(stage); }
};

/// The second loop's bound is only known after the first barrier.
struct CountAgain : piko::Stage<0, 0, 32, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &list) {
    parallelFor(int(list.size()), [&](int i) {
      int sum = 0;
      if (i & 1)
        sum = count(list[i].tag > 0);
      for (int64_t k = 0; k < int64_t(sum) << 32; ++k)
        sync();
    });
  }
};
struct Counts : piko::Pipe<State> {
  CountAgain stage;
  Counts() { source(stage); }
};
