// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Integer divisions that are known to have a result need no test of it.
// RUN: pikoc %s --emit=authored -o - | FileCheck %s
#include <piko.h>

struct A {
  int a, b;
  uint32_t u, v;
  int64_t l, m;
};
struct State {
  piko::Buffer<int> out;
  piko::Buffer<int64_t> large;
};
struct Known : piko::Stage<0, 0, 1, A>, piko::Uses<State> {
  // CHECK-LABEL: piko.stage @known
  // CHECK-NOT: piko.divide
  void process(const A &p) {
    state().out[0] = p.a / 3;
    // -x
    // CHECK: arith.subi
    state().out[1] = p.a / -1;
    state().out[2] = int(p.u % 12u);
    state().out[3] = int(p.u / (p.v | 1u));
    if (p.b > 0)
      state().out[4] = p.a % p.b;
    int n = p.b & 7;
    if (n != 0)
      state().out[5] = p.a / n;
    state().large[0] = p.l / 9;
  }
};
struct Unknown : piko::Stage<0, 0, 1, A>, piko::Uses<State> {
  // CHECK-LABEL: piko.stage @unknown
  void process(const A &p) {
    // CHECK: piko.divide quotient_signed {{.*}} : i32
    state().out[0] = p.a / p.b;
    // CHECK: piko.divide remainder_signed {{.*}} : i32
    state().out[1] = p.a % p.b;
    // CHECK: piko.divide quotient_unsigned {{.*}} : i32
    state().out[2] = int(p.u / p.v);
    // CHECK: piko.divide remainder_unsigned {{.*}} : i32
    state().out[3] = int(p.u % p.v);
    // CHECK: piko.divide quotient_signed {{.*}} : i64
    state().large[0] = p.l / p.m;
    // It is not 0, but it may be -1.
    // CHECK: piko.divide quotient_signed {{.*}} : i32
    if (p.a != 0)
      state().out[5] = p.b / p.a;
    // Whoever divides by 0 hears of it.
    // CHECK: piko.divide quotient_signed {{.*}} : i32
    int zero = p.a - p.a;
    state().out[6] = p.b / zero;
  }
};
struct Pixels : piko::Stage<8, 8, 1, A>, piko::Uses<State> {
  // The cells of a bin are divided by its extent.
  // CHECK-LABEL: piko.stage @pixels
  // CHECK-NOT: piko.divide
  void assignBin(const A &p) { assignToAll(p); }
  void process(const A &p) {
    parallelForPixels([&](glm::ivec2 at) { state().out[at.x + at.y] = p.a; });
  }
};
struct Divisions : piko::Pipe<State> {
  Known known;
  Unknown unknown;
  Pixels pixels;
  Divisions() {
    source(known);
    source(unknown);
    source(pixels);
  }
};
