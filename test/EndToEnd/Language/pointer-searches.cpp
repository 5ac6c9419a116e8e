// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pointers that searches give, into an array after another member and before one, and pointers that walk through the arrays of several records.
// REQUIRES: all
// RUN: %compare_targets %s --count 64 | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <span>

struct Inner {
  int a[2];
  int b[3];
};
struct Item {
  int u[6];
  Inner in[4];
  int i, j, serial;
};
struct Result {
  int64_t found[24];
  int own[6];
  Inner in[4];
};
struct State {
  piko::Buffer<Result> results;
};

struct Searches : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    Result &out = state().results[p.serial];
    int i = p.i & 3, j = p.j & 3;
    Inner in[4];
    std::copy(std::begin(p.in), std::end(p.in), in);
    std::copy(p.u, p.u + 6, out.own);
    out.found[0] = std::find(out.own, std::end(out.own), p.u[i]) - out.own;
    out.found[1] = std::find(out.own, out.own + 6, p.i) == std::end(out.own);
    auto isLarge = [&](int v) { return v > p.i; };
    out.found[2] = std::any_of(p.u, p.u + 6, isLarge);
    out.found[3] = std::none_of(std::begin(p.u), std::end(p.u), isLarge) +
                   2 * std::all_of(p.u + i, p.u + 4, isLarge);
    auto *record = std::find_if(
        in, in + 4, [&](const Inner &inner) { return inner.b[1] > p.j; });
    out.found[4] = record == std::end(in) ? -1 : record->a[1];
    std::span<const int> some = std::span(p.u).subspan(i);
    out.found[5] = std::ranges::max_element(some) - some.begin();
    for (int v : some.first(2))
      out.found[6] += v;
    out.found[7] = std::ranges::count_if(some, isLarge);
    walk(p.in, out.found + 8, i, j);
    walk(in, out.found + 12, i, j);
    std::copy(in, in + 4, out.in);
    walk(out.in, out.found + 16, i, j);
    int n = 0;
    for (int *q = out.in[i].b; n < 6; ++n) {
      *q++ += 1 + n;
      if (n == 2)
        q = out.in[j].b;
    }
  }

  /// From one record's array to another one's.
  static void walk(const Inner *in, int64_t *out, int i, int j) {
    int n = 0;
    for (const int *q = in[i].b; n < 6; ++n) {
      out[0] = out[0] * 3 + *q++;
      if (n == 2)
        q = in[j].b;
    }
    n = 0;
    for (const int *q = in[1].a; n < 4; ++n) {
      out[1] = out[1] * 3 + *q++;
      if (n == 1)
        q = in[2].a;
    }
    const int *chosen = j > 1 ? in[i].a : in[j].a, *end = chosen + 2;
    for (; chosen != end; ++chosen)
      out[2] = out[2] * 3 + *chosen;
    const int *one = i & 1 ? &in[i].b[1] : &in[2].b[j % 3];
    out[3] = *one;
  }
};
struct Pipe : piko::Pipe<State> {
  Searches searches;
  Pipe() { source(searches); }
};
