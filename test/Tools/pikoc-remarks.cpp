// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pikoc says about vectors: one verdict for each phase, at its line, with
// what is in the way, at the user's lines. The report has the same.
// RUN: pikoc %s --remarks --emit=target -o /dev/null 2>&1 | grep -E "(remark|note): " > %t
// RUN: FileCheck %s --check-prefix=SPLIT < %t
// RUN: FileCheck %s --check-prefix=DIFFER < %t
// RUN: FileCheck %s --check-prefix=WRITTEN < %t
// RUN: FileCheck %s --check-prefix=EMITS < %t
// RUN: FileCheck %s --check-prefix=DIVIDES < %t
// RUN: FileCheck %s --check-prefix=LISTS < %t
// RUN: FileCheck %s --check-prefix=SHADE < %t
// RUN: pikoc %s --explain | FileCheck %s --check-prefix=EXPLAIN

// EXPLAIN: {{^}}Kernels, in order:
// EXPLAIN: {{^  }}piko-compact-loops
// EXPLAIN-NEXT: {{^    .*}}pikoc-remarks.cpp:[[#]]:9: stage 'shade': process puts off what passes this test, to do it together
// EXPLAIN-NEXT: {{^  }}piko-vectorize
// EXPLAIN: {{^    .*}}pikoc-remarks.cpp:[[#]]:8: stage 'differ': process is not vectorized
// EXPLAIN-NEXT: {{^      [0-9]+}} operations could run ahead
// EXPLAIN-NEXT: {{^      .*}}pikoc-remarks.cpp:[[#]]:5: this loop is not vectorized: its number of iterations differs between primitives
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
  void process(const Item &i) {
    // SPLIT: :[[#@LINE+1]]:9: remark: stage 'shade': process puts off what passes this test, to do it together
    if (update(state().depth, i.at, [&](Depth &d) {
          bool passed = i.y < d.z;
          d.z = passed ? i.y : d.z;
          return passed;
        })) {
      float color = work(i.x, i.y);
      update(state().color, i.at, [&](float &c) { c = color; });
    }
  }
};

struct Differ : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // DIFFER: :[[#@LINE+1]]:8: remark: stage 'differ': process is not vectorized
  void process(const Item &i) {
    float x = i.x;
    // DIFFER-NEXT: note: {{[0-9]+}} operations could run ahead of effects, and would keep {{[0-9]+}} values: expected at least {{[0-9]+}} operations
    // DIFFER-NEXT: :[[#@LINE+1]]:5: note: this loop is not vectorized: its number of iterations differs between primitives
    for (int k = 0; k < i.count; ++k)
      x = x * x + i.y;
    state().out[i.count] = x;
  }
};

struct Written : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // WRITTEN: :[[#@LINE+1]]:8: remark: stage 'written': process is not vectorized
  void process(const Item &i) {
    // WRITTEN: :[[#@LINE+1]]:{{[0-9]+}}: note: this read of 'out' is not vectorized: its kernel writes 'out'
    float x = state().out[i.count];
    state().out[i.count] = work(x, x);
  }
};

struct Emits : piko::Stage<0, 0, 64, Item, Item> {
  // EMITS: :[[#@LINE+1]]:8: remark: stage 'emits': process is not vectorized
  void process(const Item &i) {
    Item next = i;
    // EMITS: :[[#@LINE+1]]:5: note: this loop is not vectorized: it emits
    for (int k = 0; k < 4; ++k) {
      next.x = next.x * next.y + i.x;
      emit(next);
    }
  }
};

struct Divides : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // DIVIDES: :[[#@LINE+1]]:8: remark: stage 'divides': process is not vectorized
  void process(const Item &i) {
    // DIVIDES: :[[#@LINE+1]]:{{[0-9]+}}: note: this division of integers is not vectorized: it may be by 0
    int part = 100 / i.count;
    state().numbers[i.at.x] = part * part + i.at.y;
  }
};

struct Lists : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // LISTS: :[[#@LINE+1]]:8: remark: stage 'lists': process is not vectorized
  void process(const piko::List<Item> &items) {
    // LISTS-NEXT: note: it takes a list, and runs once for all of it
    for (const Item &i : items)
      piko::atomicAdd(state().numbers[0], i.count);
  }
};

// The second loop of a stage has no verdict of its own.
// SHADE: remark: stage 'shade': process is vectorized for 16 primitives at once behind a test
// SHADE: note: this update of 'depth' is not vectorized, nor is what needs its result
// SHADE: note: behind this test, {{[0-9]+}} operations run ahead of effects, and keep {{[0-9]+}} values
// SHADE-NOT: stage 'shade'

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
