// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that read around an element, in all styles: nests whose indices are
// tested in front by their ranges, rows with ends as vectors, and what is left
// to tests in the loop.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: piko-compare %s --cases %s --runs 1 --without hoist-bounds
// RUN: piko-compare %s --cases %s --runs 1 --without vectorize -O0
// CASE: --pipe Clamps --count 1
// CASE: --pipe Wraps --count 1
// CASE: --pipe Mirrors --count 1
// CASE: --pipe Inside --count 1
// CASE: --pipe Looks --count 1
// CASE: --pipe Down --count 1
// CASE: --pipe Pairs --count 1
// CASE: --pipe Breaks --count 1
// CASE: --pipe Triangles --count 1
// CASE: --pipe Wide --count 1
// CASE: --pipe Overflows --count 1
// CASE: --pipe Empty --count 1
// RUN: not piko-compare %s --pipe Past --count 1 --runs 1 --threads 1 2 | FileCheck %s --check-prefix=PAST
//
// RUN: %if x86_64 %{ pikoc %s --pipe Clamps --cpu x86-64-v4 --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=LOOP %}
// RUN: %if x86_64 %{ pikoc %s --pipe Wraps --cpu x86-64-v4 --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=LOOP %}
// RUN: %if x86_64 %{ pikoc %s --pipe Mirrors --cpu x86-64-v4 --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=LOOP %}
// LOOP: remark: stage '{{.*}}': iterations of this loop do not depend on one another, and are vectorized
// RUN: %if x86_64 %{ pikoc %s --pipe Clamps --cpu x86-64-v4 --mapping-window 1 --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=INNER %}
// INNER: remark: stage 'stage': process is not vectorized: iterations of a loop in it are; specifyLanes(Items) does so all the same
#include <piko.h>

struct Row {
  int serial;
};
struct State {
  piko::Buffer<float> in, out;
  piko::Buffer<uint8_t> bytes;
};
constexpr int width = 32; // of two rows, as buffers have 64 elements

template <class Body>
struct OnRows : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) { Body::run(state(), row.serial & 1); }
};
template <class Body> struct Alone : piko::Pipe<State> {
  OnRows<Body> stage;
  Alone() { source(stage); }
};

struct Clamp {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -2; dx <= 2; ++dx)
          sum += state.in[glm::clamp(y + dy, 0, 1) * width +
                          glm::clamp(x + dx, 0, width - 1)] *
                 float(dx + 3 * dy);
      state.out[y * width + x] = sum;
    }
  }
};
struct Clamps : Alone<Clamp> {};

struct Wrap {
  static void run(State &state, int y) {
    int w = int(state.out.size()) / 2;
    for (int x = 0; x < w; ++x) {
      int left = (x + w - 1) % w;
      unsigned right = unsigned(x + 3) % unsigned(w);
      state.out[y * w + x] = state.in[y * w + left] * 2 -
                             state.in[y * w + int(right)] +
                             state.in[(y * w + x + 17) % (2 * w)];
    }
  }
};
struct Wraps : Alone<Wrap> {};

struct Mirror {
  static void run(State &state, int y) {
    for (int x = 0; x < width; x++) {
      float sum = 0;
      for (int k = -3; k <= 3; k++) {
        int at = x + k < 0 ? -(x + k) : x + k;
        at = at > width - 1 ? 2 * (width - 1) - at : at;
        sum = sum * 0.5f + state.in[width * y + at];
      }
      state.out[width * y + x] = sum;
    }
  }
};
struct Mirrors : Alone<Mirror> {};

struct Guard {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0, count = 0;
      for (int k = -2; k <= 2; ++k)
        if (x + k >= 0 && x + k < width) {
          sum += state.in[y * width + x + k];
          count += 1;
        }
      state.out[y * width + x] = sum / count;
    }
  }
};
struct Inside : Alone<Guard> {};

// Bytes as indices have a range of their own.
struct Look {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      uint8_t b = state.bytes[y * width + x];
      state.out[y * width + x] = state.in[b & 63] + state.in[b / 4];
    }
  }
};
struct Looks : Alone<Look> {};

struct CountDown {
  static void run(State &state, int y) {
    for (int x = width - 1; x >= 0; --x)
      state.out[y * width + x] = state.in[glm::max(x - 1, 0) + y] * 3;
  }
};
struct Down : Alone<CountDown> {};

struct ByTwo {
  static void run(State &state, int y) {
    for (int x = 0; x < width; x += 2) {
      float a = state.in[y * width + x], b = state.in[y * width + x + 1];
      state.out[y * width + x] = a + b;
      state.out[y * width + x + 1] = a - b;
    }
  }
};
struct Pairs : Alone<ByTwo> {};

struct Break {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0;
      for (int k = 0; k < width; ++k) {
        float v = state.in[glm::min(x + k, width - 1) + y * width];
        if (v > 1)
          break;
        sum += v;
      }
      state.out[y * width + x] = sum;
    }
  }
};
struct Breaks : Alone<Break> {};

struct Triangle {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      float sum = 1;
      for (int k = 0; k <= x; ++k)
        sum += state.in[y * width + k] * state.in[y * width + x - k];
      state.out[y * width + x] = sum;
    }
  }
};
struct Triangles : Alone<Triangle> {};

struct Long {
  static void run(State &state, int y) {
    int64_t w = state.in.size() / 2;
    for (int64_t x = 0; x < w; ++x)
      for (size_t k = 0; k < 3; ++k)
        state.out[y * w + x] +=
            state.in[glm::min<int64_t>(x + int64_t(k), w - 1) + y * w];
  }
};
struct Wide : Alone<Long> {};

// The product wraps around, to the element itself.
struct Overflow {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      unsigned at = unsigned(x) * 0x10000u * 0x10001u - unsigned(x) * 0x10000u;
      state.out[y * width + x] = state.in[int(at) + x] * 2;
    }
  }
};
struct Overflows : Alone<Overflow> {};

// The inner loop's indices would be outside, but it never runs.
struct Nothing {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      float sum = float(x);
      for (int k = 100; k < y; ++k)
        sum += state.in[k * width + x];
      state.out[y * width + x] = sum;
    }
  }
};
struct Empty : Alone<Nothing> {};

// PAST: expected: {{.*}}stage 'OnRows<Reach>'{{.*}}: expected an index into 'in' in [0, 64), but got 64
// PAST: got: stage 'stage', bin 0: expected an index into 'in' in [0, 64), but got 64
struct Reach {
  static void run(State &state, int y) {
    for (int x = 0; x < width; ++x) {
      float sum = 0;
      for (int k = 0; k <= 1; ++k)
        sum += state.in[width + glm::min(x + k, width)];
      state.out[y * width + x] = sum;
    }
  }
};
struct Past : Alone<Reach> {};
