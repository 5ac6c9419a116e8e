// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Scans and sorts of iterations that are the lanes of one vector: the tree of a
// float scan is the language's, sorts are stable and put NaN last, keys are of all
// types, and lanes without an iteration take no part.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: piko-compare %s --cases %s --runs 1 --without vectorize -O0
// RUN: %if x86_64 %{ piko-compare %s --cases %s --runs 1 --cpu x86-64-v4 %}
// CASE: --pipe Two --count 320
// CASE: --pipe Three --count 320
// CASE: --pipe Seven --count 320
// CASE: --pipe Eight --count 320
// CASE: --pipe Thirteen --count 320
// CASE: --pipe Sixteen --count 320
// RUN: pikoc %s --pipe Thirteen --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=LANES
// LANES: remark: stage '{{.*}}': these iterations are vectorized for 16 at once
// What combines by a loop has no vector form.
// RUN: piko-compare %s --pipe Loops --count 128 --runs 1 | FileCheck %s
// CHECK: equal
// RUN: pikoc %s --pipe Loops --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=CUT
// CUT: remark: stage '{{.*}}': these iterations are not vectorized: it has no vector form
#include "../Inputs/vector-iterations.h"

#include <limits>

template <int Count>
struct Collect : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    if (p.serial % 32 != 0) // so that each has 32 elements
      return;
    parallelFor(Count, [&](int i) {
      int at = p.serial + 2 * i;
      float value = p.value + float((i * 7 + p.serial) % 5) * 0.37f;
      float key = (i + p.serial) % 4 == 3
                      ? std::numeric_limits<float>::quiet_NaN()
                      : float((i * 5 + p.serial) % 6) - 2;
      int rank = int(sort(key * 0.5f));
      float before =
          scan(value, [](float a, float b) { return a * 0.5f + b; }, p.value);
      double wide =
          scan(double(i) + p.value, [](double a, double b) { return a - b; });
      state().floats[at] = before + float(rank);
      state().doubles[at] = wide;
      unsigned bits = unsigned(i * 0x9e3779b9u) ^ unsigned(p.serial);
      int ranks = int(sort(bits)) * 16 + int(sort(int(bits)));
      ranks = ranks * 16 + int(sort(uint8_t(bits)));
      ranks = ranks * 16 + int(sort(double(bits % 3)));
      state().ints[at] = ranks;
      glm::vec2 pair = scan(glm::vec2(value, 1), [](glm::vec2 a, glm::vec2 b) {
        return glm::vec2(a.x * b.y + b.x, a.y + b.y);
      });
      state().floats[at + 1] = pair.x - pair.y;
      bool odd = scan(i % 3 == 0, [](bool a, bool b) { return a != b; });
      state().ints[at + 1] = odd + int(sort(int64_t(i) * -(i % 2)));
    });
  }
};
struct Two : Alone<Collect<2>> {};
struct Three : Alone<Collect<3>> {};
struct Seven : Alone<Collect<7>> {};
struct Eight : Alone<Collect<8>> {};
struct Thirteen : Alone<Collect<13>> {};
struct Sixteen : Alone<Collect<16>> {};

struct LoopScan : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &p) {
    if (p.serial % 32 == 0)
      parallelFor(16, [&](int i) {
        state().ints[p.serial + i] = scan(p.serial + i, [](int a, int b) {
          while (b > 3 && a < 1000)
            a += b /= 2;
          return a;
        });
      });
  }
};
struct Loops : Alone<LoopScan> {};
