// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Primitives and records of state that are made from templates, which nothing
// else in the file needs.
// RUN: pikoc %s --emit=authored -o - | FileCheck %s
// CHECK-DAG: piko.record @"Boxed<int>" {"at" : i32 at 0}
// CHECK-DAG: piko.record @"Boxed<float>" {"at" : f32 at 0}
// CHECK-DAG: piko.record @"Pair<unsigned int, 2>" {"first" : i32[2 : 4] at 0, "second.at" : i32[2 : 4] at 8}
#include <piko.h>

template <class T> struct Boxed {
  T at;
};
template <class T, int N> struct Pair {
  T first[N];
  Boxed<T> second[N];
};
struct State {
  piko::Buffer<Pair<unsigned, 2>> pairs;
};

struct Source : piko::Stage<0, 0, 64, Boxed<int>, Boxed<float>> {
  void process(const Boxed<int> &) {}
};
struct Drain : piko::Stage<0, 0, 64, Boxed<float>>, piko::Uses<State> {
  void process(const Boxed<float> &) {}
};
struct Templates : piko::Pipe<State> {
  Source first;
  Drain drain;
  Templates() {
    source(first);
    connect(first, 0, drain);
  }
};
