// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How likely the text says that a branch is goes with it, from LLVM's branch weights
// and back to them, and lanes are chosen by it.
// RUN: pikoc %s --pipe Likely --emit=authored | FileCheck %s --check-prefix=LIKELY
// RUN: pikoc %s --pipe Unlikely --emit=authored | FileCheck %s --check-prefix=UNLIKELY
// RUN: pikoc %s --pipe Tenth --emit=authored | FileCheck %s --check-prefix=TENTH
// RUN: pikoc %s --pipe Plain --emit=authored | FileCheck %s --check-prefix=PLAIN
// LIKELY: piko.probability = 0.99950024987506247 : f64
// UNLIKELY: piko.probability = 4.997501249{{[0-9]*}}E-4 : f64
// TENTH: piko.probability = 0.1{{[0-9]*}} : f64
// PLAIN-NOT: piko.probability
//
// Of a switch there is one for each way, the default first.
// RUN: pikoc %s --pipe Cases --emit=authored | FileCheck %s --check-prefix=CASES
// CASES: piko.probabilities = array<f64: 0.33{{[0-9]*}}, 9.31{{[0-9]*}}E-10, 0.66{{[0-9]*}}>
//
// Of a loop it is how probable another iteration is, by all that ends it; the inner one, of
// which nothing is said, has none.
// RUN: pikoc %s --pipe Loops --emit=machine | FileCheck %s --check-prefix=LOOPS
// LOOPS: scf.while
// LOOPS: attributes {piko.probability = 0.9995{{[0-9]*}} : f64}
// LOOPS: scf.while
// LOOPS: attributes {piko.probability = 4.9975{{[0-9]*}}E-4 : f64}
// LOOPS: scf.while
// LOOPS: attributes {piko.probability = 0.7{{[45][0-9]*}} : f64}
// LOOPS: scf.while
// LOOPS: scf.while
// LOOPS-NOT: attributes {piko.probability
// LOOPS: scf.yield
// LOOPS: {piko.probability = 0.98999{{[0-9]*}} : f64}
// LOOPS: attributes {piko.probability = 0.98950{{[0-9]*}} : f64}
// RUN: pikoc %s --pipe Loops --emit=llvm | FileCheck %s --check-prefix=TURNS
// TURNS: weights([1048052, 524])
// TURNS: weights([524, 1048052])
// TURNS: weights([786432, 262144])
// TURNS: weights([103{{[0-9]*}}, 1{{[0-9]*}}])
//
// An inner loop that may leave both, of which nothing is said.
// RUN: pikoc %s --pipe Leaves --emit=machine | FileCheck %s --check-prefix=LEAVES
// LEAVES: scf.while
// LEAVES-NOT: attributes {piko.probability
//
// RUN: pikoc %s --pipe Unlikely --emit=llvm | FileCheck %s --check-prefix=WEIGHTS
// WEIGHTS: llvm.cond_br %{{.*}} weights([524, 1048052]),
//
// RUN: pikoc %s --cpu x86-64-v3 --pipe Plain --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=VECTORS
// RUN: pikoc %s --cpu x86-64-v3 --pipe Likely --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=VECTORS
// VECTORS: stage 'work': process is vectorized for {{[0-9]+}} primitives at once{{$}}
// RUN: pikoc %s --cpu x86-64-v3 --pipe Tenth --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=BOTH
// BOTH: stage 'work': process is vectorized for {{[0-9]+}} primitives at once, and held one after the other as well
#include <piko.h>

struct Item {
  float x, y;
  int serial;
};
struct State {
  piko::Buffer<float> out;
  piko::Buffer<int> next;
};

//
// A chain that is seldom followed does not count.
// RUN: pikoc %s --cpu x86-64-v3 --pipe Chains --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=BOTH
// RUN: pikoc %s --cpu x86-64-v3 --pipe FewChains --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=VECTORS

enum class Kind {
  Plain,
  Likely,
  Unlikely,
  Tenth,
  Cases,
  Loops,
  Leaves,
  Chains,
  FewChains
};

template <Kind K> struct Work : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  float compute(float x, float y) {
    for (int i = 0; i < 9; ++i)
      x = piko::sqrt(x * x + y) / (1 + x) + piko::sqrt(x + 3);
    return x;
  }
  void process(const Item &item) {
    float x = 0;
    if constexpr (K == Kind::Likely) {
      if (item.x > item.y) [[likely]]
        x = compute(item.x, item.y);
    } else if constexpr (K == Kind::Unlikely) {
      if (item.x > item.y) [[unlikely]]
        x = compute(item.x, item.y);
    } else if constexpr (K == Kind::Tenth) {
      if (__builtin_expect_with_probability(item.x > item.y, 1, 0.1))
        x = compute(item.x, item.y);
    } else if constexpr (K == Kind::Cases) {
      switch (item.serial) {
      [[unlikely]] case 3:
        x = compute(item.x, item.y);
        break;
      [[likely]] case 5:
        x = compute(item.y, item.x + 1);
        break;
      default:
        x = compute(item.y, item.y);
      }
    } else if constexpr (K == Kind::Loops) {
      int n = item.serial;
      for (x = item.x; x > item.y; x = x * 0.9f + 1 / (x + 3))
        [[likely]];
      for (int k = 0; k < n; ++k) [[unlikely]]
        x += piko::sqrt(x);
      do
        x = x * x + 1;
      while (__builtin_expect_with_probability(x < 100, 1, 0.75));
      while (__builtin_expect_with_probability(n > 7, 1, 0.99)) {
        for (int k = n; k > 3; k /= 2)
          x += 1 / x;
        n = n % 2 ? n * 3 : n / 2;
        if (n == 9) [[unlikely]]
          break;
      }
    } else if constexpr (K == Kind::Leaves) {
      int n = item.serial;
      auto search = [&] {
        while (n > 7) [[likely]] {
          for (int k = n; k > 3; k /= 2) [[likely]] {
            x += 1 / (x + 2);
            if (x > item.y)
              return;
          }
          n = n % 2 ? n * 3 : n / 2;
        }
      };
      search();
    } else if constexpr (K == Kind::Chains || K == Kind::FewChains) {
      auto go = [](bool more) {
        return K == Kind::Chains ? more : bool(__builtin_expect(more, 0));
      };
      x = item.x * item.y;
      for (int at = this->state().next[item.serial]; go(at > 0);)
        x += float(at = this->state().next[at] / at);
    } else {
      if (item.x > item.y)
        x = compute(item.x, item.y);
    }
    this->state().out[item.serial] = x;
  }
};

template <Kind K> struct Lone : piko::Pipe<State> {
  Work<K> work;
  Lone() { this->source(work); }
};
struct Plain : Lone<Kind::Plain> {};
struct Likely : Lone<Kind::Likely> {};
struct Unlikely : Lone<Kind::Unlikely> {};
struct Tenth : Lone<Kind::Tenth> {};
struct Cases : Lone<Kind::Cases> {};
struct Loops : Lone<Kind::Loops> {};
struct Leaves : Lone<Kind::Leaves> {};
struct Chains : Lone<Kind::Chains> {};
struct FewChains : Lone<Kind::FewChains> {};
