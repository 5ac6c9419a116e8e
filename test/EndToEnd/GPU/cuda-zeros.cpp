// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Of 0 and -0, min and max give the first: PTX's own minimum of them is -0.
// RUN: %compare_targets %s --count 64 --wide | FileCheck %s
// CHECK: equal
// RUN: pikoc %s --pipe Clamps --emit=ptx | FileCheck %s --check-prefix=PTX
// PTX-LABEL: .entry Clamps_kernel_clamp
// PTX-NOT:     {{min|max}}.f{{32|64}} {{.*}}, 0{{[fd]}}0000
// PTX-DAG:     min.f32 {{.*}}, 0f3F800000
// PTX-LABEL: ret;
#include <piko.h>

struct Number {
  float x;
  int serial;
};
struct Results {
  float low, high, one;
};
struct State {
  piko::Buffer<Results> results;
};

struct Clamp : piko::Stage<0, 0, 64, Number>, piko::Uses<State> {
  void process(const Number &n) {
    state().results[n.serial] = {piko::min<float>(0, n.x),
                                 piko::max<float>(0, n.x),
                                 piko::min<float>(1, n.x)};
  }
};

struct Clamps : piko::Pipe<State> {
  Clamp clamp;
  Clamps() { source(clamp); }
};
