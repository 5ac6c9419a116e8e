// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A read under a test of its index stays there, also where the condition right
// around it is one that another read has.
// RUN: %compare_targets %s --domain 1 1 --count 500 --runs 1 | FileCheck %s
// CHECK: {{^equal}}
#include <piko.h>

struct Particle {
  int a, b, c, d;
};
struct Record {
  int value, others[3], last;
};
struct State {
  piko::Buffer<Record> records;
  piko::Buffer<int> sums;
};

struct Sum : piko::Stage<0, 0, 64, Particle>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::One); }
  void process(const Particle &p) {
    int64_t size = state().records.size();
    int64_t near = p.a & 63, far = int64_t(p.c) * 40000003;
    int sum = 0;
    bool flag = p.b > 3;
    if (near < size) {
      bool isInside = far >= 0 && far < size;
      if (flag)
        sum = state().records[near].value;
      if (isInside) {
        int last = 0;
        if (flag)
          last = state().records[far].last;
        sum += last;
      }
    }
    piko::atomicAdd(state().sums[p.d & 15], sum);
  }
};
struct Pipe : piko::Pipe<State> {
  Sum sum;
  Pipe() { source(sum); }
};
