// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops around loops that change the same elements in each of their turns, in
// all styles: four iterations share the inner loop where none sees it, and the others
// keep their order.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: piko-compare %s --cases %s --runs 1 --without vectorize -O0
// CASE: --pipe Product --count 7
// CASE: --pipe Whiles --count 7
// CASE: --pipe Unsigneds --count 8
// CASE: --pipe References --count 6
// CASE: --pipe Taps --count 1
// CASE: --pipe Doubles --count 7
// CASE: --pipe Own --count 7
// CASE: --pipe Blocks --count 1
// CASE: --pipe Records --count 1
// CASE: --pipe Few --count 7
// CASE: --pipe Skewed --count 1
// CASE: --pipe Solves --count 1
// CASE: --pipe Sums --count 7
// CASE: --pipe Meets --count 1
//
// DEFINE: %{remarks} = pikoc %s --remarks --without vectorize -o /dev/null
// RUN: %{remarks} --pipe Product,Whiles,Unsigneds,References,Taps,Doubles,Own,Blocks,Records 2>&1 | FileCheck %s --check-prefix=JAMMED
// JAMMED-COUNT-10: remark: 4 iterations of this loop share those of the loop inside of it (unroll-and-jam)
// JAMMED-NOT: iterations of this loop
// RUN: %{remarks} --pipe Solves,Meets 2>&1 | FileCheck %s --check-prefix=ORDER
// ORDER: remark: iterations of this loop do not share those of the loop inside of it (unroll-and-jam)
// ORDER: note: it may use an element here that another iteration of the inner loop changes
// ORDER: remark: iterations of this loop do not share those of the loop inside of it (unroll-and-jam)
// ORDER: note: it may use an element here that another iteration of the inner loop changes
// RUN: %{remarks} --pipe Skewed,Sums 2>&1 | FileCheck %s --check-prefix=NONE --allow-empty
// NONE-NOT: iterations of this loop
#include <piko.h>

struct Row {
  int serial;
};
struct Pair {
  float x, y;
};
struct State {
  piko::Buffer<float> a, b, c;
  piko::Buffer<double> wide;
  piko::Buffer<Pair> pairs;
}; // of 64 elements

template <class Body>
struct OnRows : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) { Body::run(state(), row.serial); }
};
template <class Body> struct Alone : piko::Pipe<State> {
  OnRows<Body> stage;
  Alone() { source(stage); }
};

struct Multiply {
  static void run(State &state, int i) {
    int n = int(state.a.size()) / 9;
    for (int j = 0; j < n; ++j)
      state.c[i * n + j] = 0;
    for (int k = 0; k < n; ++k) {
      float a = state.a[i * n + k];
      for (int j = 0; j < n; ++j)
        state.c[i * n + j] += a * state.b[k * n + j];
    }
  }
};
struct Product : Alone<Multiply> {};

struct While {
  static void run(State &state, int i) {
    int n = 7, k = 0;
    while (k != n) {
      int j = 0;
      while (j < n) {
        float before = state.c[n * i + j];
        state.c[n * i + j] = before - state.b[j + n * k] * state.a[k];
        j++;
      }
      k++;
    }
  }
};
struct Whiles : Alone<While> {};

struct Unsigned {
  static void run(State &state, int i) {
    const unsigned n = 8, row = unsigned(i) * n;
    for (unsigned k = 0; k < n; k++)
      for (unsigned j = 0; j < n; j++)
        state.c[row + j] =
            state.c[row + j] + state.a[row + k] * state.b[k * n + j];
  }
};
struct Unsigneds : Alone<Unsigned> {};

struct Reference {
  static void run(State &state, int i) {
    constexpr int n = 6;
    auto &[a, b, c, wide, pairs] = state;
    for (int k = 0; k < 10; ++k)
      for (int j = 0; j < n; ++j) {
        float &sum = c[i * n + j];
        sum = sum * 0.5f + a[k] * b[k * n + j];
        sum += 1;
      }
  }
};
struct References : Alone<Reference> {};

// A filter, a tap after the other.
struct Tap {
  static void run(State &state, int) {
    int w = int(state.c.size()) - 8;
    for (int t = 0; t < 9; ++t) {
      float weight = state.a[t];
      for (int x = 0; x < w; ++x)
        state.c[x] += weight * state.b[x + t];
    }
  }
};
struct Taps : Alone<Tap> {};

struct Double {
  static void run(State &state, int i) {
    for (int k = 0; k < 7; ++k)
      for (int j = 0; j < 7; ++j)
        state.wide[7 * i + j] +=
            double(state.a[7 * i + k]) * state.b[7 * k + j];
  }
};
struct Doubles : Alone<Double> {};

// A private array as accumulators.
struct Array {
  static void run(State &state, int i) {
    float sums[40];
    for (int j = 0; j < 40; ++j)
      sums[j] = float(j);
    for (int k = 0; k < 21; ++k) {
      float a = state.a[(k + i) & 63];
      for (int j = 0; j < 40; ++j)
        sums[j] += a * state.b[k + j];
    }
    float last = 0;
    for (int j = 0; j < 40; ++j)
      last = last * 0.75f + sums[j];
    state.c[i] = last;
  }
};
struct Own : Alone<Array> {};

struct Block {
  static void run(State &state, int) {
    constexpr int n = 8;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
          state.c[i * n + j] += state.a[i * n + k] * state.b[k * n + j];
  }
};
struct Blocks : Alone<Block> {};

// Two fields, of which each is read by the other.
struct Record {
  static void run(State &state, int) {
    int n = int(state.pairs.size());
    for (int k = 0; k < 10; ++k)
      for (int j = 0; j < n; ++j) {
        state.pairs[j].x += state.a[k] * state.pairs[j].y;
        state.pairs[j].y -= state.b[k] * state.pairs[j].x;
      }
  }
};
struct Records : Alone<Record> {};

// Fewer iterations than share a loop, none, and iterations of the inner loop likewise.
struct Short {
  static void run(State &state, int i) {
    int few = i % 3, none = int(state.a.size()) - 64;
    for (int k = 0; k < few; ++k)
      for (int j = 0; j < 7; ++j)
        state.c[i * 7 + j] += state.a[k] * state.b[k * 7 + j];
    for (int k = 5; k < none; ++k)
      for (int j = 0; j < 7; ++j)
        state.c[i * 7 + j] += state.a[k];
    for (int k = 0; k < 9; ++k)
      for (int j = 3; j < none; ++j)
        state.c[i * 7 + j] += state.b[k];
  }
};
struct Few : Alone<Short> {};

// The inner loop's length follows from the outer one.
struct Skew {
  static void run(State &state, int) {
    for (int k = 0; k < 20; ++k)
      for (int j = k; j < 60; ++j)
        state.c[j] = state.c[j] * 0.5f + state.b[j - k];
  }
};
struct Skewed : Alone<Skew> {};

// Each iteration needs what the one before has made of another element.
struct Solve {
  static void run(State &state, int) {
    for (int k = 0; k < 12; ++k)
      for (int j = 1; j < 63; ++j)
        state.c[j] = (state.c[j - 1] + state.c[j + 1]) * 0.5f;
  }
};
struct Solves : Alone<Solve> {};

// One number for all iterations of the inner loop.
struct Sum {
  static void run(State &state, int i) {
    for (int k = 0; k < 7; ++k) {
      float sum = 0;
      for (int j = 0; j < 8; ++j)
        sum += state.a[j * 8 + k] * state.b[j * 7 + i];
      state.c[7 * k + i] = sum;
    }
  }
};
struct Sums : Alone<Sum> {};

// Iterations of the inner loop that change the same element.
struct Meet {
  static void run(State &state, int) {
    for (int k = 0; k < 10; ++k)
      for (int j = 0; j < 40; ++j)
        state.c[j & 7] = state.c[j & 7] * 0.5f + state.b[j + k];
  }
};
struct Meets : Alone<Meet> {};
