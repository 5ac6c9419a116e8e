// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Atomics that show the order of calls.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct State {
  piko::Buffer<float> sum;
  piko::Buffer<double> precise;
  piko::Buffer<int32_t> next;
  piko::Buffer<uint64_t> lowest;
};

// CHECK-LABEL: piko.stage @append
// CHECK: piko.schedule load_balance unordered
struct Append : piko::Stage<0, 0, 64, float, int>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyOrder(piko::Unordered); }
  void process(const float &f) {
    // CHECK: piko.atomic add_float @sum[%{{.*}} : index] "value", %{{.*}} : f32{{$}}
    piko::atomicAdd(state().sum[0], f);
    // CHECK: piko.atomic add_float @precise[%{{.*}} : index] "value", %{{.*}} : f64{{$}}
    piko::atomicAdd(state().precise[0], f);
    // CHECK: piko.atomic min_unsigned @lowest[%{{.*}} : index] "value", %{{.*}} : i64 -> i64
    piko::atomicMinFetch(state().lowest[0], 7);
    // CHECK: %[[OLD:.*]] = piko.atomic add @next[%{{.*}} : index] "value", %{{.*}} : i32 -> i32
    // CHECK: piko.emit 0(%[[OLD]]) : i32
    emit(piko::atomicAddFetch(state().next[0], 1));
  }
};
struct Drain : piko::Stage<0, 0, 64, int> {
  void process(const int &) {}
};
struct Pipeline : piko::Pipe<State> {
  Append append;
  Drain drain;
  Pipeline() {
    source(append);
    connect(append, 0, drain);
  }
};
