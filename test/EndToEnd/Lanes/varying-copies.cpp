// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Copies and fills of a number of elements that varies: in an array and between
// two, forwards and backwards where they overlap, of numbers and of records, in
// local variables, primitives and state.
// REQUIRES: all
// RUN: %compare_targets %s --count 64 | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

struct A {
  int x;
  float y;
};
struct Item {
  int u[6];
  A recs[3];
  glm::ivec3 points[4];
  signed char bytes[8];
  int i, j, serial;
};
struct Result {
  int found[64];
  int own[6];
  A recs[3];
};
struct State {
  piko::Buffer<Result> results;
};
constexpr int table[6] = {3, 1, 4, 1, 5, 9};

struct Copies : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    Result &out = state().results[p.serial];
    // 1 to 4, 0 to 3.
    int i = (p.i & 3) + 1, j = p.j & 3, k = j % 3;
    numbers(p, out.found, i, j);
    merge(p, out.found + 6, i, j);
    others(p, out.found + 12, i, j);
    records(p, out, i, k);
    choose(p, out.found + 32, i, j);
    edit(p, out.found + 38, i, j);
    parallelFor(6, [&](int n) {
      int own[6] = {};
      std::copy(p.u, p.u + 6 - n, own + n);
      std::fill(own, own + n, 7);
      out.found[44 + n] = own[j] + own[n];
    });
  }

  static void numbers(const Item &p, int *out, int i, int j) {
    int a[6], b[6] = {};
    std::copy_n(p.u, 6, a);
    std::copy(a, a + i, b + 1);
    std::copy(a + j, a + 6, a);
    std::copy_backward(b, b + i, b + 6);
    std::move(b + j, b + i + 2, a + j % 3);
    std::memmove(a + 1, a, i * sizeof(int));
    std::fill(b, b + i, p.i);
    std::memset(a + j, 0, i / 2 * sizeof(int));
    std::copy(table, table + j, a);
    for (int n = 0; n < 6; ++n)
      out[n] = a[n] + b[n] * 3;
  }

  static void merge(const Item &p, int *out, int i, int j) {
    std::array<int, 6> a, b = {}, sorted = {1, 2, 3, 5, 8, 13};
    std::copy(p.u, p.u + i + 2, a.begin());
    std::fill(a.begin() + i + 2, a.end(), j);
    std::rotate(a.begin(), a.begin() + j, a.end());
    std::nth_element(a.begin(), a.begin() + 3, a.end());
    int middle = a[3];
    std::partial_sort(a.begin(), a.end(), a.end());
    std::merge(a.begin(), a.begin() + i, sorted.begin(), sorted.begin() + 2,
               b.begin());
    std::shift_left(a.begin(), a.end() - i, j);
    std::ranges::copy(std::span(sorted).first(j), a.begin() + 1);
    for (int n = 0; n < 6; ++n)
      out[n] = a[n] + b[n] * 3;
    out[0] += middle;
  }

  static void others(const Item &p, int *out, int i, int j) {
    signed char bytes[8] = {1, 2, 3, 4};
    std::copy(p.bytes, p.bytes + i, bytes + 1);
    std::fill(bytes + j, bytes + 4, p.i);
    std::fill(bytes + 6, bytes + 8, p.j);
    int grid[3][4] = {};
    std::copy(p.u, p.u + i, grid[j % 3]);
    std::copy(grid[j % 3], grid[j % 3] + i, grid[1]);
    glm::ivec3 points[4] = {};
    std::copy(p.points, p.points + i, points);
    std::copy(points, points + j, points + 1);
    float f[4] = {1, 2, 3, 4};
    std::memset(f + j, 255, i / 4 * sizeof(float));
    int bits[4];
    std::memcpy(bits, f, sizeof(bits));
    for (int n = 0; n < 12; ++n)
      out[n] = grid[n / 4][n % 4] + bytes[n % 8];
    for (int n = 0; n < 4; ++n)
      out[12 + n] = points[n].x + points[n].y * 3 + points[n].z * 5 + bits[n];
  }

  static void records(const Item &p, Result &out, int i, int k) {
    A recs[3];
    std::copy(p.recs, p.recs + 3, recs);
    std::rotate(recs, recs + k, recs + 3);
    std::copy(recs + k, recs + 3, out.recs);
    std::copy(out.recs, out.recs + k, out.recs + 1);
    std::copy(p.u, p.u + i, out.own + 1);
    std::copy(out.own + k, out.own + 2 + k, out.own + 1);
    out.found[28] = recs[k].x;
  }

  static void choose(const Item &p, int *out, int i, int j) {
    int a[6] = {1, 2, 3, 4, 5, 6}, b[6] = {};
    int *to = p.i & 4 ? a + 1 : b;
    const int *from = p.j & 4 ? a : p.u;
    std::copy(from + j, from + j + i / 2, to);
    for (int n = 0; n < 6; ++n)
      out[n] = a[n] + b[n] * 3;
  }

  /// As a vector does.
  static void edit(const Item &p, int *out, int i, int j) {
    int list[6] = {9, 8, 7, 6}, size = 4;
    std::move_backward(list + j, list + size, list + size + 1);
    list[j] = p.i;
    ++size;
    std::move(list + i, list + size, list + i - 1);
    --size;
    int *end = std::remove(list, list + size, 8);
    std::fill(end, list + 6, size);
    std::copy(list, list + 6, out);
  }
};
struct Pipe : piko::Pipe<State> {
  Copies copies;
  Pipe() { source(copies); }
};
