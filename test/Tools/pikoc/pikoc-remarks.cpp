// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pikoc says about vectors: one verdict for each phase, at its line, with
// what is in the way, at the user's lines. The report has the same.
// RUN: pikoc %s --mapping-window 1 --remarks --emit=target -o /dev/null 2>&1 | grep -E "(remark|note): " > %t
// RUN: FileCheck %s --check-prefix=DIFFER < %t
// RUN: FileCheck %s --check-prefix=WRITTEN < %t
// RUN: FileCheck %s --check-prefix=EMITS < %t
// RUN: FileCheck %s --check-prefix=DIVIDES < %t
// RUN: FileCheck %s --check-prefix=SHADE < %t
// RUN: pikoc %s --mapping-window 1 --explain | FileCheck %s --check-prefix=EXPLAIN

// EXPLAIN: {{^}}Kernels, in order:
// EXPLAIN: {{^  }}piko-plan-vectors
// EXPLAIN: {{^    .*}}pikoc-remarks.cpp:[[#]]:8: stage 'emits': process is not vectorized
// EXPLAIN-NEXT: {{^      .*}}pikoc-remarks.cpp:[[#]]:7: lanes take turns to emit, in order
#include <piko.h>

struct Item {
  glm::ivec2 at;
  float x, y;
  int count;
};
struct Depth {
  float z = 1;
};
struct State {
  piko::Buffer<float> in, out;
  piko::Buffer<int> numbers;
  piko::Image<Depth> depth;
  piko::Image<float> color;
};

inline float work(float x, float y) {
  for (int i = 0; i < 12; ++i) {
    x = piko::sqrt(x * x + y * y + 1.0f);
    y = x * y + x;
  }
  return x + y;
}

struct Shade : piko::Stage<8, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &i) { assignToBin(i, binFromPosition(i.at)); }
  // SHADE: :[[#@LINE+1]]:8: remark: stage 'shade': process is vectorized for {{4|8}} primitives at once
  void process(const Item &i) {
    if (update(state().depth, i.at, [&](Depth &d) {
          bool passed = i.y < d.z;
          d.z = passed ? i.y : d.z;
          return passed;
        })) {
      float color = work(i.x, i.y);
      update(state().color, i.at, [&](float &c) { c = c * 0.5f + color; });
    }
  }
};

struct Differ : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // Loops whose counts differ are no obstacle.
  // DIFFER: :[[#@LINE+1]]:8: remark: stage 'differ': process is vectorized for {{4|8}} primitives at once
  void process(const Item &i) {
    float x = i.x;
    for (int k = 0; k < i.count; ++k)
      x = x * x / (x + i.y) + piko::sqrt(i.y);
    state().out[i.count] = x;
  }
};

struct Written : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // Nor is a read of what the kernel writes.
  // WRITTEN: :[[#@LINE+1]]:8: remark: stage 'written': process is vectorized for {{4|8}} primitives at once
  void process(const Item &i) {
    float x = state().out[i.count];
    state().out[i.count] = work(x, x);
  }
};

struct Emits : piko::Stage<0, 0, 64, Item, Item> {
  // EMITS: :[[#@LINE+1]]:8: remark: stage 'emits': process is not vectorized: {{4|8}} at once are expected to take {{[0-9]+}} cycles, and one after the other {{[0-9]+}}; specifyLanes(Items) does so all the same
  void process(const Item &i) {
    Item next = i;
    for (int k = 0; k < 4; ++k) {
      next.x = next.x * next.y + i.x;
      // EMITS-NEXT: :[[#@LINE+1]]:7: note: lanes take turns to emit, in order
      emit(next);
    }
  }
};

struct Divides : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // Nor is a division that may be by 0.
  // DIVIDES: :[[#@LINE+1]]:8: remark: stage 'divides': process is vectorized for {{4|8}} primitives at once
  void process(const Item &i) {
    int part = 100 / i.count;
    state().out[i.at.x] = work(float(part), i.y);
  }
};

struct Lists : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const piko::List<Item> &items) {
    for (const Item &i : items)
      piko::atomicAdd(state().numbers[0], i.count);
  }
};

struct All : piko::Pipe<State> {
  Differ differ;
  Written written;
  Emits emits;
  Divides divides;
  Lists lists;
  Shade shade;
  All() {
    source(differ);
    source(written);
    source(emits);
    source(divides);
    connect(emits, 0, lists);
    source(shade);
  }
};
