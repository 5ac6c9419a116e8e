// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A stage that calls state() and does not say of which class hears what to
// derive from.
// RUN: not piko-translate --cpp-to-piko %s 2>&1 | FileCheck %s
#include <piko.h>

struct State {
  float threshold;
  piko::Buffer<float> out;
};
struct Missing : piko::Stage<0, 0, 1, float> {
  void process(const float &f) {
    // CHECK: errors-uses.cpp:[[#@LINE + 1]]:13: error: expected stage 'Missing' to derive from piko::Uses<State>, where State is the state of its pipeline, because it calls state()
    if (f > state().threshold)
      parallelFor(4, [&](int i) {
        // CHECK: errors-uses.cpp:[[#@LINE + 1]]:9: error: expected stage 'Missing' to derive from piko::Uses<State>
        state().out[i] = f;
      });
  }
};
template <class T>
struct Template : piko::Stage<0, 0, 1, T>, piko::Uses<State> {
  void process(const T &t) {
    // CHECK-NOT: error
    this->state().out[0] = t;
  }
};
template <class T, class S>
struct Dependent : piko::Stage<0, 0, 1, T>, piko::Uses<S> {
  void process(const T &t) {
    // CHECK: errors-uses.cpp:[[#@LINE + 1]]:5: error: expected this->state() in a template, whose bases are not known
    state().out[0] = t;
  }
};
// CHECK: errors-uses.cpp:[[#@LINE + 1]]:28: error: use of undeclared identifier 'state'
float elsewhere() { return state().threshold; }
struct Pipeline : piko::Pipe<State> {
  Missing missing;
  Template<float> made;
  Pipeline() {
    source(missing);
    source(made);
  }
};
