// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An index that counts from the end of an array, where the next member begins,
// beside one from the beginning of that member.
// REQUIRES: all
// RUN: %compare_targets %s --count 64 | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <array>
#include <iterator>

struct Arrays {
  int u[4];
  int v[4];
};
struct Nested {
  Arrays first;
  int w[2];
  Arrays second;
};
struct Grids {
  int a[2][4];
  int b[2][4];
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
struct Points {
  glm::ivec2 a[3];
  glm::ivec2 b[3];
};
struct Item {
  Arrays arrays;
  Grids grids;
  Points points;
  int i, j, serial;
};
struct Result {
  int64_t found[32];
  Arrays arrays;
};
struct State {
  piko::Buffer<Result> results;
};

struct Ends : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    Result &out = state().results[p.serial];
    // 1 to 4, 0 to 3.
    int i = (p.i & 3) + 1, j = p.j & 3;
    Arrays local;
    for (int k = 0; k < 4; ++k) {
      local.u[k] = p.arrays.v[k] + 1;
      local.v[k] = p.arrays.u[k] + 2;
    }
    read(local, out.found, i, j);
    read(p.arrays, out.found + 4, i, j);
    Item copy = p;
    readMore(copy, out.found + 8, i, j);
    readMore(p, out.found + 13, i, j);
    out.arrays = {};
    write(out.arrays, i, j);
    read(out.arrays, out.found + 18, i, j);
    write(local, i, j);
    read(local, out.found + 22, i, j);
    out.found[26] = others(p, i, j);
    out.found[27] = folded(local, i, j);
    out.found[28] = folded(p.arrays, i, j);
  }

  static void read(const Arrays &a, int64_t *out, int i, int j) {
    out[0] = *(std::end(a.u) - i) + int64_t(3) * a.v[j];
    out[1] = a.v[j] + int64_t(3) * *(std::end(a.v) - i);
    const int *end = a.u + 4, *begin = a.v;
    out[2] = end[-i] + int64_t(3) * begin[j];
    out[3] = *(&a.u[4] - i) + int64_t(3) * *(&a.v[0] + j);
  }

  static void readMore(const Item &p, int64_t *out, int i, int j) {
    const Grids &g = p.grids;
    out[0] = *(std::end(g.a[1]) - i) + int64_t(3) * g.b[0][j];
    out[1] = *(std::end(g.a[0]) - i) + int64_t(3) * g.a[1][j];
    out[2] = (*(std::end(g.a) - 1 - i / 3))[j] + int64_t(3) * g.b[j & 1][j];
    const Points &q = p.points;
    int k = j % 3 + 1;
    out[3] = (std::end(q.a) - k)->y + int64_t(3) * q.b[k - 1].x;
    glm::ivec2 point = *(std::end(q.a) - k);
    out[4] = point.x + int64_t(3) * q.b[k - 1].y + point.y;
  }

  static void write(Arrays &a, int i, int j) {
    a.v[j] += 1;
    *(std::end(a.u) - i) += 100;
    *(std::end(a.v) - i) += 1000;
    a.u[j] += 7;
  }

  static int64_t others(const Item &p, int i, int j) {
    Nested nested = {p.arrays, {p.i, p.j}, {}};
    for (int k = 0; k < 4; ++k)
      nested.second.v[k] = 5 * (nested.second.u[k] = p.grids.b[0][k]);
    int64_t sum = *(std::end(nested.first.v) - i) + 3 * nested.w[j & 1] +
                  7 * *(std::end(nested.first.u) - i) + 9 * nested.first.v[j];
    sum += int64_t(11) * *(std::end(nested.w) - (j & 1) - 1) +
           13 * nested.second.u[j] + 17 * *(std::end(nested.second.u) - i) +
           19 * nested.second.v[j];
    Both both;
    for (int k = 0; k < 4; ++k) {
      both.first[k] = p.arrays.u[k];
      both.second[k] = p.arrays.v[k];
      both.third[k] = p.grids.a[1][k];
    }
    sum += int64_t(23) * *(std::end(both.first) - i) + 29 * both.second[j] +
           31 * *(std::end(both.second) - i) + 37 * both.third[j];
    std::array<Arrays, 2> two = {p.arrays, nested.second};
    sum += int64_t(41) * *(std::end(two[0].u) - i) + 43 * two[0].v[j] +
           47 * *(std::end(two[0].v) - i) + 53 * two[j & 1].u[j] +
           59 * two[1].u[j];
    return sum;
  }

  /// What is a constant only after some steps.
  static int64_t folded(const Arrays &a, int i, int j) {
    int n = 2;
    for (int k = 0; k < 2; ++k)
      n += 1;
    int four = 2;
    four += four;
    const int *end = a.u + four;
    return a.v[j] + int64_t(3) * *(end - i) + 5 * *(a.u + n - i);
  }
};
struct Pipe : piko::Pipe<State> {
  Ends ends;
  Pipe() { source(ends); }
};
