// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lanes that read elements side by side: entries of tables, clamped pixels, rows
// of bytes, and places of both ends of a buffer, where there is no next one.
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: %if all %{ piko-compare %s --cases %s --runs 1 --without pair-gathers %}
// CASE: --pipe Tables --count 200
// CASE: --pipe Clamps --count 200
// CASE: --pipe Blocks --count 200
// CASE: --pipe Shorts --count 200
// CASE: --pipe Fields --count 200
// CASE: --pipe Alone --count 200
// RUN: not piko-compare %s --pipe Past --count 200 --runs 1 --threads 1 2 | FileCheck %s --check-prefix=PAST
// PAST: got: stage 'stage', bin 0: expected an index into 'numbers' in [0, 64), but got 64
#include <piko.h>

struct Item {
  int x, y, serial;
};
struct Pair {
  int low, high;
};
struct State {
  piko::Buffer<float> numbers, out;
  piko::Buffer<uint8_t> bytes;
  piko::Buffer<int16_t> shorts, halves;
  piko::Buffer<Pair> pairs;
};
template <class Body>
struct OnItems : piko::Stage<0, 0, 1, Item>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Item &item) {
    // Buffers have 64 elements, of which none is in order.
    int at = item.serial * 37 + 11;
    float value = Body::run(state(), at & 63, item);
    if (item.serial < 64)
      state().out[item.serial] = value;
  }
};
template <class Body> struct Of : piko::Pipe<State> {
  OnItems<Body> stage;
  Of() { source(stage); }
};

// The last entry, which no other one follows, is not read with the next one.
struct Table {
  static float run(State &state, int at, const Item &) {
    float a = state.numbers[at], b = at < 63 ? state.numbers[at + 1] : 0;
    float c = at > 0 ? state.numbers[at - 1] : 1;
    return a * 2 + b - c;
  }
};
struct Tables : Of<Table> {};

struct Clamp {
  static float run(State &state, int at, const Item &) {
    int x = at % 8, y = at / 8;
    float sum = 0;
    for (int d = -1; d <= 1; ++d) {
      int row = glm::clamp(y + d, 0, 7) * 8;
      sum += state.numbers[row + glm::clamp(x - 1, 0, 7)] * 3 -
             state.numbers[row + glm::clamp(x, 0, 7)] +
             state.numbers[row + glm::clamp(x + 1, 0, 7)] * 2;
    }
    return sum;
  }
};
struct Clamps : Of<Clamp> {};

struct Block {
  static float run(State &state, int at, const Item &) {
    int first = at % 40, sum = 0;
    for (int i = 0; i < 24; ++i)
      sum += (i + 1) * int(state.bytes[first + i / 12 + i % 12]);
    return float(sum);
  }
};
struct Blocks : Of<Block> {};

struct Short {
  static float run(State &state, int at, const Item &item) {
    int first = at & ~7, sum = 0;
    for (int i = 0; i < 8; ++i)
      sum = sum * 3 + state.shorts[first + (i & 7)];
    if (item.serial < 64)
      state.halves[at] = int16_t(sum);
    return float(sum);
  }
};
struct Shorts : Of<Short> {};

struct Field {
  static float run(State &state, int at, const Item &item) {
    float sum = 0;
    for (int i = state.pairs[at].low & 7; i < (state.pairs[at].high & 15); ++i)
      sum = sum * 1.5f + state.numbers[(at + i) & 63];
    return item.serial % 3 != 0 ? sum : float(state.pairs[at ^ 1].high);
  }
};
struct Fields : Of<Field> {};

struct One {
  static float run(State &state, int at, const Item &) {
    return float(state.bytes[at]) + float(state.shorts[63 - at]);
  }
};
struct Alone : Of<One> {};

struct Behind {
  static float run(State &state, int at, const Item &) {
    return state.numbers[at] + state.numbers[at + 1];
  }
};
struct Past : Of<Behind> {};
