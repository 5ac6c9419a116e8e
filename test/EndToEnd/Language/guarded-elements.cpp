// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Elements of arrays in primitives, read under conditions that keep the index
// inside: nothing reads one ahead of its condition.
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Conditions --count 2000
// CASE: --pipe Loops --count 2000
#include <piko.h>

struct Item {
  int i, n;
  int w[4];
};
struct State {
  piko::Image<int> hits;
};

struct Conjunction : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    int i = p.i & 1 ? p.i << 20 : p.i & 3; // mostly far outside
    int hit = i >= 0 && i < 4 && p.w[i] * 3 + p.n > 7;
    bool other = i >= 0 && i < 4 && p.w[i] > 7;
    update(state().hits, {0, 0}, [&](int &h) { h = h * 3 + hit; });
    if (other)
      update(state().hits, {1, 0}, [&](int &h) { h = h * 3 + 1; });
    int chosen = i >= 0 && i < 4 ? p.w[i] : p.n;
    update(state().hits, {2, 0}, [&](int &h) { h = h * 3 + chosen; });
  }
};
struct Until : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    int k = 0;
    while (k < 4 && p.w[k] < 0)
      ++k;
    update(state().hits, {3, 0}, [&](int &h) { h = h * 3 + k; });
    for (int n = 0, j = p.i; n < 8; ++n, j += 1 << 29)
      if (j >= 0 && j < 4 && p.w[j] > 7 && p.w[j] % 3 != 1)
        update(state().hits, {4, 0}, [&](int &h) { h = h * 3 + p.w[j]; });
  }
};
struct Conditions : piko::Pipe<State> {
  Conjunction stage;
  Conditions() { source(stage); }
};
struct Loops : piko::Pipe<State> {
  Until stage;
  Loops() { source(stage); }
};
