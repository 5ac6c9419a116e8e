// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Operations point at the user's text, also where a header did the work.
// RUN: piko-translate --cpp-to-piko --mlir-print-debuginfo %s | FileCheck %s
#include <piko.h>

struct Item {
  glm::vec3 value;
};
struct State {
  piko::Buffer<float> results;
};
struct Length : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &item) {
    // CHECK: math.sqrt {{.*}} loc(#[[LENGTH:.*]])
    // CHECK: #[[LENGTH]] = loc("{{.*}}locations.cpp":[[#@LINE + 1]]:26)
    state().results[0] = glm::length(item.value);
  }
};
struct Pipeline : piko::Pipe<State> {
  Length length;
  Pipeline() { source(length); }
};
