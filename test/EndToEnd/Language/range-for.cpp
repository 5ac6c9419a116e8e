// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops over the elements of a buffer: of numbers and records, that change them,
// end early, lie in each other, and over a buffer of none.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Lit --domain 19 13 --count 40
// CASE: --pipe Search --count 40
// CASE: --pipe Pairs --count 8
// CASE: --pipe Doubles --count 1
// RUN: piko-compare %s --pipe Doubles --count 1 --runs 1 --check | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Lamp {
  float x, power;
};
struct State {
  piko::Buffer<Lamp> lamps;
  piko::Buffer<int> numbers;
  piko::Buffer<float> sums;
};

struct Shade : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    float light = 0;
    for (const Lamp &lamp : state().lamps)
      light += lamp.power * (lamp.x + float(i & 63));
    state().sums[i & 63] = light; // the same from each
  }
};
struct Lit : piko::Pipe<State> {
  Shade shade;
  Lit() { source(shade); }
};

struct Find : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    int place = 0;
    for (auto at = state().numbers.begin(), end = state().numbers.end();
         at != end; ++at, ++place)
      if (*at % 7 == (i & 3))
        break;
    state().sums[i & 3] = float(place);
  }
};
struct Search : piko::Pipe<State> {
  Find find;
  Search() { source(find); }
};

struct Cross : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    float sum = float(i & 7);
    for (const Lamp &a : state().lamps) {
      for (const Lamp &b : state().lamps)
        if (a.x < b.x)
          sum = sum * 0.5f + b.power;
      sum -= a.power;
    }
    state().sums[i & 7] = sum;
  }
};
struct Pairs : piko::Pipe<State> {
  Cross cross;
  Pairs() { source(cross); }
};

struct Change : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &) {
    for (int &number : state().numbers)
      number = number * 2 + 1;
    for (auto &lamp : state().lamps)
      lamp.power = 0.25f;
  }
};
struct Doubles : piko::Pipe<State> {
  Change change;
  Doubles() { source(change); }
};
