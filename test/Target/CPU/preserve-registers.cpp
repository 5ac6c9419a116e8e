// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
// The call that reports an index outside a buffer clobbers no register: what it calls
// saves all that the processor has, and clears none after it has restored them. In an
// object for several processors each has its own. Nothing is made without optimization.
// RUN: pikoc %s -o - --emit=assembly --cpu=x86-64-v4 | FileCheck %s --check-prefixes=CHECK,V4
// RUN: pikoc %s -o - --emit=assembly --cpu=x86-64-v3 | FileCheck %s --check-prefixes=CHECK,V3
// RUN: pikoc %s -o - --emit=assembly --cpu=x86-64-v4 -O0 | FileCheck %s --check-prefix=NONE
// RUN: pikoc %s -o %t.o --cpu=x86-64-v3,x86-64-v4
// RUN: llvm-nm %t.o | FileCheck %s --check-prefix=BOTH
// REQUIRES: x86_64

#include <piko.h>

struct Row {
  int begin;
};
struct State {
  piko::Buffer<float> in, out;
};

struct Add : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    for (int i = row.begin; i < row.begin + 100; ++i) {
      float sum = state().in[i * i % 7];
      state().out[i] = sum + state().in[i * 3 % 11];
    }
  }
};
struct Pipe : piko::Pipe<State> {
  Add add;
  Pipe() { source(add); }
};

// CHECK:     call{{q?}} {{.*}}pikoir_fail_index.preserving
// CHECK:     pikoir_fail_index.preserving{{.*}}:
// V4:        vmovups %zmm31, [[SLOT:.*\(%rsp\)]]
// V3:        vmovups %ymm15, [[SLOT:.*\(%rsp\)]]
// CHECK-NOT: vzeroupper
// CHECK:     call{{q?}} {{.*}}pikoir_fail_index
// CHECK-NOT: vzeroupper
// V4:        vmovups [[SLOT]], %zmm31
// V3:        vmovups [[SLOT]], %ymm15
// CHECK-NOT: vzeroupper
// CHECK:     ret
// NONE:      call{{q?}} {{.*}}pikoir_fail_index
// NONE-NOT:  preserving
// BOTH-DAG:  t pikoir_fail_index.preserving.x86-64-v3
// BOTH-DAG:  t pikoir_fail_index.preserving.x86-64-v4
