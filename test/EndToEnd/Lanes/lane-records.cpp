// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops over records with arrays, whose words LLVM gathers; loops that state
// bounds; and blocks of bytes and of numbers of 16 bits, which lanes store.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: piko-compare %s --cases %s --runs 1 --without vectorize -O0
// RUN: piko-compare %s --cases %s --runs 1 --without hoist-loads
// CASE: --pipe Traces --count 70
// CASE: --pipe Norms --count 1
// CASE: --pipe Gaps --count 1
// CASE: --pipe Rows --count 2
// CASE: --pipe Inner --count 2
// CASE: --pipe Haar --count 16
// CASE: --pipe Planes --count 16
// CASE: --pipe Dither --count 16
// CASE: --pipe Quotients --count 16
//
// RUN: %if x86_64 %{ pikoc %s --pipe Rows --cpu x86-64-v4 --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=LOOP %}
// RUN: %if x86_64 %{ pikoc %s --pipe Inner --cpu x86-64-v4 --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=LOOP %}
// LOOP: remark: stage '{{.*}}': iterations of this loop do not depend on one another, and are vectorized
#include <piko.h>

struct Dot {
  int serial;
};
struct Matrix {
  float m[4][4];
  int serial;
};
struct Sample {
  float a[6], b[6];
  int64_t stamp;
};
struct Knot {
  glm::vec3 position;
  float mass;
};
struct State {
  int width = 32;
  piko::Buffer<Matrix> matrices;
  piko::Buffer<Sample> samples;
  piko::Buffer<Knot> knots;
  piko::Buffer<float> out;
  piko::Buffer<int16_t> shorts;
  piko::Buffer<uint8_t> bytes;
};

//===-- Records with arrays -----------------------------------------------===//

struct Fill : piko::Stage<0, 0, 1, Dot, Matrix> {
  void process(const Dot &dot) {
    Matrix matrix;
    for (int i = 0; i < 16; ++i)
      matrix.m[i / 4][i % 4] = 0.25f * float(dot.serial) - float(i * i);
    matrix.serial = dot.serial;
    emit(matrix);
  }
};
struct Trace : piko::Stage<0, 0, 1, Matrix>, piko::Uses<State> {
  void process(const piko::List<Matrix> &list) {
    for (int64_t n = 0; n < list.size() && n < 64; ++n) {
      float trace = 0;
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
          trace += list[n].m[i][j] * list[n].m[j][i];
      state().out[n] = trace;
    }
  }
};
struct Traces : piko::Pipe<State> {
  Fill fill;
  Trace trace;
  Traces() {
    source(fill);
    connect(fill, 0, trace);
  }
};

template <class Body>
struct OnDots : piko::Stage<0, 0, 1, Dot>, piko::Uses<State> {
  void process(const Dot &dot) { Body::run(state(), dot.serial); }
};
template <class Body> struct Alone : piko::Pipe<State> {
  OnDots<Body> stage;
  Alone() { source(stage); }
};

struct Norm {
  static void run(State &state, int) {
    for (int i = 0; i < 64; ++i) {
      const Sample &s = state.samples[i];
      float sum = 0;
      for (int k = 0; k < 6; ++k)
        sum += s.a[k] * s.b[5 - k];
      state.out[i] = sum;
    }
  }
};
struct Norms : Alone<Norm> {};

// Not all words of a piece, and one that is alone.
struct Gap {
  static void run(State &state, int) {
    for (int i = 0; i < 64; ++i) {
      const Matrix &m = state.matrices[i];
      state.out[i] = m.m[0][0] * m.m[0][3] + m.m[1][2] * m.m[2][1] + m.m[3][3];
    }
  }
};
struct Gaps : Alone<Gap> {};

//===-- Bounds that state has ---------------------------------------------===//

struct Row {
  static void run(State &state, int y) {
    y &= 1;
    for (int x = 0; x < state.width; ++x) {
      glm::vec3 sum(0);
      for (int d = -1; d <= 1; d += 2)
        if (x + d >= 0 && x + d < state.width) {
          const Knot &other = state.knots[y * state.width + x + d];
          const Knot &knot = state.knots[y * state.width + x];
          glm::vec3 way = other.position - knot.position;
          sum += way / (1 + glm::dot(way, way)) * other.mass;
        }
      state.out[y * state.width + x] = sum.x * sum.y - sum.z;
    }
  }
};
struct Rows : Alone<Row> {};

struct Within {
  static void run(State &state, int y) {
    y &= 1;
    for (int x = 1; x <= state.width - 2; ++x)
      state.out[y * state.width + x] =
          piko::sqrt(glm::abs(state.knots[y * state.width + x - 1].mass)) /
          (1 + state.knots[y * state.width + x + 1].mass *
                   state.knots[y * state.width + x + 1].mass);
  }
};
struct Inner : Alone<Within> {};

//===-- Narrow numbers of lanes -------------------------------------------===//

// Each of 16 primitives has a block of 2 x 2.
struct HaarBlock {
  static void run(State &state, int serial) {
    int at = serial * 4, in[4];
    for (int i = 0; i < 4; ++i)
      in[i] = state.bytes[at + i];
    for (int y = 0; y < 2; ++y) {
      state.shorts[at + 2 * y] = int16_t(in[2 * y] + in[2 * y + 1]);
      state.shorts[at + 2 * y + 1] = int16_t(in[2 * y] - in[2 * y + 1]);
    }
  }
};
struct Haar : Alone<HaarBlock> {};

struct Plane {
  static void run(State &state, int serial) {
    for (int v = 0; v < 2; ++v)
      for (int u = 0; u < 2; ++u) {
        float sum = float(serial);
        for (int k = 0; k < 4; ++k)
          sum += state.out[v * 4 + k] * float(u * k);
        state.shorts[(serial / 4 * 2 + v) * 8 + serial % 4 * 2 + u] =
            int16_t(int(sum) / (1 + u));
      }
  }
};
struct Planes : Alone<Plane> {};

struct Dithers {
  static void run(State &state, int serial) {
    for (int i = 0; i < 4; ++i) {
      float value = state.out[i] * float(serial % 7) / (1 + state.out[i + 9]);
      state.bytes[serial * 4 + i] = uint8_t(int(value) & 255);
    }
  }
};
struct Dither : Alone<Dithers> {};

//===-- Divisors that lanes share -----------------------------------------===//

struct Quotient {
  static void run(State &state, int serial) {
    for (int i = 0; i < 4; ++i) {
      int divisor = int(state.shorts[i] & 3) - 1;
      divisor = divisor == 0 ? 7 : divisor;
      int value = serial * serial * 1000 - 77777;
      state.bytes[serial * 4 + i] =
          uint8_t((value / divisor + value % divisor) & 255);
    }
  }
};
struct Quotients : Alone<Quotient> {};
