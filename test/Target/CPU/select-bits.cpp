// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
// A float that is chosen by an integer is moved by cmov, or its sign is flipped,
// and no branch depends on the data.
// RUN: pikoc %s -o - --emit=assembly --without=vectorize | FileCheck %s
// REQUIRES: x86_64

#include <piko.h>

struct Row {
  int begin;
};
struct State {
  piko::Buffer<int> hashes;
  piko::Buffer<float> out;
};

struct Choose : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    float x = 0.25f, y = 0.5f;
    for (int i = row.begin; i < 100; ++i) {
      int hash = state().hashes[i];
      float u = (hash & 8) == 0 ? x : y;
      x = y * 1.5f;
      y = (hash & 1) == 0 ? u : -u;
    }
    state().out[0] = y;
  }
};
struct Pipe : piko::Pipe<State> {
  Choose choose;
  Pipe() { source(choose); }
};

// CHECK:     testb $8
// CHECK-NOT: {{[[:space:]]j[a-z]+[[:space:]]}}
// CHECK:     cmov
