// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Functions of the standard library in a file with several pipelines, each of
// which gets what they are compiled as.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Parts --domain 67 35 --count 500
// CASE: --pipe Rounds --domain 67 35 --count 500
#include <piko.h>

#include <cmath>

struct Number {
  float value;
  int serial;
};
struct State {
  piko::Buffer<float> out;
};

template <class Function>
struct Apply : piko::Stage<0, 0, 64, Number>, piko::Uses<State> {
  void assignBin(const Number &p) { assignToAll(p); }
  void process(const Number &p) {
    state().out[p.serial] = Function::of(p.value);
  }
};
template <class Function> struct Applied : piko::Pipe<State> {
  Apply<Function> apply;
  Applied() {
    source(apply);
    allocateForSource(state().out, 0);
  }
};

struct Part {
  static float of(float value) {
    int exponent;
    float part = std::frexp(value, &exponent);
    return std::ldexp(part, exponent % 7);
  }
};
struct Round {
  static float of(float value) {
    return float(std::lround(std::fmod(value, 7.5f)));
  }
};
struct Parts : Applied<Part> {};
struct Rounds : Applied<Round> {};
