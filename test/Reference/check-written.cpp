// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Built with MemorySanitizer, checking mode finds fields that were never
// written; padding does not count.
// RUN: %cxx_reference -O0 -DPIKO_CHECK -fsanitize=memory %s -o %t
// RUN: %t 0 | FileCheck %s --check-prefix=NONE
// RUN: %t 1 | FileCheck %s --check-prefix=EMIT
// RUN: %t 2 | FileCheck %s --check-prefix=STORE
// RUN: %t 3 | FileCheck %s --check-prefix=UPDATE
// RUN: %t 4 | FileCheck %s --check-prefix=BUFFER
#include <piko.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

struct Pair {
  char tag; // padding follows
  int value;
};
struct Fragment {
  char tag; // padding follows
  glm::vec2 at;
  Pair pairs[2];
};
struct State {
  piko::Image<Pair> image;
  piko::Buffer<Pair> pairs;
};

static Pair make(bool isWhole, int value) {
  Pair pair;
  pair.tag = 'p';
  if (isWhole)
    pair.value = value;
  return pair;
}

int wrong;

struct Make : piko::Stage<0, 0, 1, int, Fragment>, piko::Uses<State> {
  void process(const int &i) {
    Fragment f;
    f.tag = 'f';
    f.at = {i, i};
    f.pairs[0] = make(true, i);
    f.pairs[1] = make(wrong != 1 || i < 1, i);
    // EMIT: stage 'Make', bin 0: expected field 'pairs' of 'Fragment' to be written, but it never was
    // EMIT-NEXT: check-written.cpp:[[#@LINE+2]]
    // EMIT-NEXT: lineage: source 0 primitive 1
    emit(f);
    // STORE: stage 'Make', bin 0: expected field 'value' of 'Pair' to be written, but it never was
    // STORE-NEXT: check-written.cpp:[[#@LINE+1]]
    state().image.store({i, 0}, make(wrong != 2, i));
    // UPDATE: expected field 'value' of 'Pair' to be written, but it never was
    // UPDATE-NEXT: check-written.cpp:[[#@LINE+1]]
    update(state().image, {i, 1},
           [&](Pair &pair) { pair = make(wrong != 3, i); });
    // BUFFER: expected field 'value' of 'Pair' to be written, but it never was
    // BUFFER-NEXT: check-written.cpp:[[#@LINE+1]]
    state().pairs[i] = make(wrong != 4, i);
  }
};
struct Take : piko::Stage<0, 0, 1, Fragment> {
  void process(const Fragment &) {}
};
struct MakePipe : piko::Pipe<State> {
  Make make;
  Take take;
  MakePipe() {
    source(make);
    connect(make, 0, take);
    allocateForSource(state().pairs, 0);
  }
};

int main(int, char **arguments) {
  wrong = std::atoi(arguments[1]);
  std::vector<int> ints{0, 1};
  MakePipe pipe;
  pipe.setDomain({4, 4});
  pipe.feed(pipe.make, ints);
  try {
    pipe.run();
    std::puts("nothing found"); // NONE: nothing found
  } catch (const piko::Error &error) {
    std::puts(error.what());
  }
}
