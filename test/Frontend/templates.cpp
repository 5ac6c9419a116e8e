// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages and pipelines from templates; if constexpr, lambdas and helpers are
// gone from the bodies, and what a constructor sets is known in them.
// RUN: piko-translate --cpp-to-piko --pipe=Wide %s | FileCheck %s
// RUN: piko-translate --cpp-to-piko --pipe=Narrow %s | FileCheck %s --check-prefix=NARROW
#include <piko.h>

struct Item {
  float value;
};
struct State {
  piko::Buffer<float> results;
};

template <class F> float twice(F f, float x) { return f(f(x)); }

template <int Bin>
struct Work : piko::Stage<Bin, Bin, Bin + 1, Item>, piko::Uses<State> {
  float bias = 1;

  void assignBin(const Item &item) {
    if constexpr (Bin == 0)
      this->assignToAll(item);
    else
      this->assignToBin(item, piko::BinId{3});
  }
  void process(const Item &item) {
    state().results[0] = twice([&](float x) { return x + bias; }, item.value);
  }
};

template <int Bin> struct Pipeline : piko::Pipe<State> {
  Work<Bin> work;
  Pipeline() {
    work.bias = Bin + 0.5f;
    source(work);
  }
};

// CHECK-LABEL: piko.pipeline @Wide
// CHECK: piko.stage @work bins [0, 0] threads 1
// CHECK: piko.assign_all
// CHECK: %[[BIAS:.*]] = arith.constant 5.000000e-01 : f32
// CHECK: %[[ONCE:.*]] = arith.addf %{{.*}}, %[[BIAS]]
// CHECK: arith.addf %[[ONCE]], %[[BIAS]]
struct Wide : Pipeline<0> {};

// NARROW-LABEL: piko.pipeline @Narrow
// NARROW: piko.stage @work bins [16, 16] threads 17
// NARROW: piko.assign_to
// NARROW: arith.constant 1.650000e+01 : f32
using Narrow = Pipeline<16>;
