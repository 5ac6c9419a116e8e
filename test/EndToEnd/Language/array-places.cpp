// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records with several arrays, whose elements are reached with constant parts
// of the address that point into another array: before the first element,
// after the last one, and back.
// RUN: %compare_targets %s --count 64 | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <array>
#include <iterator>

struct Inner {
  int a[2];
  int b[3];
};
struct Base {
  int first[4];
};
struct Other {
  int second[4];
};
struct Both : Base, Other {
  int third[4];
};
struct Item {
  int u[4];
  int v[4];
  int grid[3][4];
  Inner inner[3];
  signed char c[4];
  signed char d[4];
  Both both;
  int i, j, serial;
};
struct Result {
  int64_t found[24];
  int u[4];
  int v[4];
  int grid[3][4];
  Inner inner[3];
};
struct State {
  piko::Buffer<Result> results;
};

struct Places : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    Result &out = state().results[p.serial];
    // 1 to 4, 1 to 3.
    int i = (p.i & 3) + 1, j = (p.j & 3) % 3 + 1;
    read(p, out.found, i, j);
    out.found[8] =
        *(p.d + i - 1) + 3 * *(p.c + i - 1) + 5 * *(std::end(p.c) - i);
    Item local = p;
    read(local, out.found + 12, i, j);
    write(out, i, j);
    Result copy = {};
    write(copy, j, j);
    for (int k = 0; k < 4; ++k)
      out.found[11] += copy.u[k] * 3 + copy.v[k] * 5 + copy.grid[k % 3][k] * 7;
    for (const Inner &inner : copy.inner)
      out.found[23] += inner.a[0] + inner.a[1] * 3 + inner.b[j - 1] * 7;
  }

  static void read(const Item &p, int64_t *out, int i, int j) {
    out[0] = p.v[i - 1] + int64_t(3) * p.u[-1 + i];
    out[1] = *(p.v + i - 1);
    const int *before = p.v - 1;
    out[2] = before[i];
    out[3] = *(std::end(p.u) - i) + int64_t(3) * std::end(p.v)[-i];
    out[4] = *(p.grid[j] + i - 5) + int64_t(3) * (p.grid + j)[-1][i - 1];
    out[5] = (p.inner + j - 1)->b[j - 1] + int64_t(3) * (p.inner + j)[-1].a[1];
    out[6] = *((p.inner + j - 1)->b + j - 1);
    Inner copy = *(p.inner + j - 1);
    out[7] = copy.a[0] + int64_t(3) * *(copy.b + j - 1) + copy.b[2];
    out[9] = *(p.both.second + i - 1) + int64_t(3) * *(p.both.third + i - 1) +
             int64_t(5) * p.both.first[i - 1];
    std::array<int, 3> rows[3] = {{1, 2, 3}, {p.i, p.j, 4}, {5, 6, p.v[0]}};
    out[10] = *(rows[1].data() + j - 1) + (rows + j)[-1][j - 1];
  }

  static void write(Result &out, int i, int j) {
    out.v[i - 1] = 10 + i;
    *(out.v + i - 1) += 3;
    *(out.u + i - 1) = 20 + i;
    *(std::end(out.u) - i) += 100;
    *(out.grid[j] + i - 5) += 7;
    (out.grid + j)[-1][0] += 9;
    (out.inner + j - 1)->b[j - 1] = 3;
    *((out.inner + j - 1)->a + 1) += 4;
    Inner inner = {{1, 2}, {3, 4, i}};
    *(out.inner + (i + j) % 3 + 1 - 1) = inner;
    int *back = out.grid[0] - 1;
    back[i] += 1;
  }
};
struct Pipe : piko::Pipe<State> {
  Places places;
  Pipe() { source(places); }
};
