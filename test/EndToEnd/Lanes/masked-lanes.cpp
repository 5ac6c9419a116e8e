// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lanes that are masked off divide by zero, INT_MIN by -1, read out of range and
// leave loops early: no trap, no error, and the reference's values, whatever lanes
// are given.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Items --domain 32 32 --count 1003 --wide
// CASE: --pipe Iterations --domain 32 32 --count 203 --wide
// CASE: --pipe One --domain 32 32 --count 203 --wide
// CASE: --pipe Chosen --domain 32 32 --count 1003 --wide
//
// RUN: pikoc %s --pipe Items --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=REMARK
// REMARK: stage 'mask': process is vectorized for {{[0-9]+}} primitives at once
// RUN: pikoc %s --pipe Iterations --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=INNER
// INNER: stage 'mask': these iterations are vectorized for {{[0-9]+}} at once
#include <piko.h>

#include <climits>
#include <cstdint>

struct Item {
  int a, b, count, first, serial;
};
struct Result {
  int quotient, sum, odd, last;
};
struct State {
  piko::Image<Result> results;
  piko::Buffer<int> values;
};

/// With `Own`, the lanes that the text asks for.
template <piko::Lanes Lanes, bool Own = true>
struct Mask : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void schedule(piko::BinId) {
    if constexpr (Own)
      this->specifyLanes(Lanes);
  }
  void process(const Item &item) {
    this->parallelFor(8, [&](int turn) {
      const auto &values = this->state().values;
      int size = int(values.size());
      int a = (item.a + turn) % 3 == 0 ? INT_MIN : item.a;
      int b = ((item.b >> turn) & 3) - 1; // -1 to 2
      Result result{0, 0, 0, -1};
      if (b != 0 && !(a == INT_MIN && b == -1))
        result.quotient = a / b + a % b;
      // Where it has no turn, where it would begin is nowhere.
      int n = (item.count >> turn) & 3;
      int first = n == 0 || size < 4
                      ? INT_MAX - 1
                      : int(uint32_t(item.first) % (uint32_t(size) - 3));
      if (size < 4)
        n = 0;
      int i = 0;
      while (true) {
        if (i >= n)
          break;
        result.sum += values[first + i++];
      }
      // An iteration of the loop that a case of a switch ends.
      for (int k = 0; k < 6; ++k) {
        switch ((item.a >> k) & 3) {
        case 0:
          continue;
        case 1:
          result.odd += 3;
          break;
        case 2:
          if (k == turn)
            continue;
          result.odd ^= item.b;
          break;
        default:
          --result.odd;
        }
        result.last = k;
      }
      if (turn == (item.serial & 7))
        this->update(this->state().results,
                     glm::ivec2(item.serial & 31, item.serial >> 5 & 31),
                     [&](Result &r) { r = result; });
    });
  }
};

template <class S> struct Lone : piko::Pipe<State> {
  S mask;
  Lone() { this->source(mask); }
};
struct Items : Lone<Mask<piko::Lanes::Items>> {};
struct Iterations : Lone<Mask<piko::Lanes::Iterations>> {};
struct One : Lone<Mask<piko::Lanes::One>> {};
struct Chosen : Lone<Mask<piko::Lanes::One, false>> {};
