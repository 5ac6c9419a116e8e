// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A switch in an iteration that has a case for every value: its default is never
// reached, and so is in no loop.
// RUN: %compare_targets %s --count 500 | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Item {
  int kind;
  int value;
};
struct State {
  piko::Buffer<int> sums;
};

struct Sum : piko::Stage<0, 0, 32, Item>, piko::Uses<State> {
  void process(const Item &item) {
    parallelFor(item.value & 7, [&](int i) {
      int sum = 0;
      switch (uint32_t(item.kind + i) % 4u) {
      case 0:
        for (int k = 0; k < item.value; ++k)
          sum += k ^ i;
        [[fallthrough]];
      case 1:
        sum += 3;
        break;
      case 2:
        sum = -i;
        break;
      case 3:
        return;
      }
      piko::atomicAdd(state().sums[i], sum);
    });
  }
};

struct SumPipe : piko::Pipe<State> {
  Sum sum;
  SumPipe() { source(sum); }
};
