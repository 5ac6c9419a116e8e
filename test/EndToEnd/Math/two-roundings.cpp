// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An integer of 64 bits that becomes a float by way of a double is rounded
// twice: here first to a tie between two floats, which then goes to the even one.
// REQUIRES: all
// RUN: %compare_targets %s --count 1 --runs 1 --threads 1 | FileCheck %s
// CHECK: equal
// RUN: pikoc %s --emit=authored -o - | FileCheck %s --check-prefix=AUTHORED
// RUN: pikoc %s --emit=target -o - | FileCheck %s --check-prefix=AUTHORED
// AUTHORED: %[[D:.*]] = arith.sitofp %{{.*}} : i64 to f64
// AUTHORED: arith.truncf %[[D]] : f64 to f32
// AUTHORED: %[[U:.*]] = arith.uitofp %{{.*}} : i64 to f64
// AUTHORED: arith.truncf %[[U]] : f64 to f32
#include <piko.h>

struct Row {
  int serial;
};
struct State {
  piko::Buffer<float> out;
};

struct Round : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    int64_t tie = (int64_t(1) << 60) + (int64_t(1) << 36);
    int64_t above = tie + 1 + (row.serial & 1);
    state().out[0] = float(double(-above));
    uint64_t high = uint64_t(above) << 3;
    state().out[1] = float(double(high));
    state().out[2] = float(above);
  }
};
struct Rounds : piko::Pipe<State> {
  Round round;
  Rounds() { source(round); }
};
