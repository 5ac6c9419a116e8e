// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a stage says about its lanes is obeyed, or an error at its line that says
// what could be. Results stay the same.
// RUN: pikoc %s --pipe Fine --remarks --emit=target -o /dev/null 2>&1 | FileCheck %s --check-prefix=FINE
// RUN: pikoc %s --pipe Fine --emit=machine | FileCheck %s --check-prefix=MACHINE
// RUN: pikoc %s --pipe Fine --explain | FileCheck %s --check-prefix=EXPLAIN
// RUN: piko-compare %s --pipe Fine --domain 37 21 --count 500 --runs 1 | FileCheck %s --check-prefix=EQUAL
// EQUAL: equal
// What is checked is done in order, whatever is said.
// RUN: pikoc %s --pipe Fine --check --remarks --emit=machine -o /dev/null 2>&1 | FileCheck %s --check-prefix=CHECKED
// CHECKED: stage 'forced': lanes are given one, because 'piko.check_call' is done in order of lineage
// RUN: pikoc %s --pipe Missing --emit=target -o /dev/null 2>&1 | FileCheck %s --check-prefix=MISSING
// RUN: not pikoc %s --pipe Meeting --emit=target -o /dev/null 2>&1 | FileCheck %s --check-prefix=MEETING
// RUN: not pikoc %s --pipe Listed --emit=target -o /dev/null 2>&1 | FileCheck %s --check-prefix=LISTED
// RUN: not pikoc %s --pipe Around --emit=target -o /dev/null 2>&1 | FileCheck %s --check-prefix=AROUND
#include <piko.h>

struct Box {
  glm::ivec2 at;
  int extent;
  float z;
};
struct State {
  piko::Image<float> z, sum;
};

// MACHINE-DAG: piko.items of @forced lanes items {
// FINE-DAG: stage 'forced': lanes are given items, as is specified
// FINE-DAG: stage 'forced': process is vectorized for {{4|8}} primitives at once
struct Forced : piko::Stage<0, 0, 64, Box, Box> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Box &b) {
    Box c = b;
    c.z = b.z * b.z + 1.0f;
    c.extent = b.extent & 3;
    emit(c);
  }
};

// It would be vectorized, and becomes no part of the stage before it.
// MACHINE-DAG: piko.items of @alone lanes one {
// FINE-DAG: the lanes of stage 'alone' are specified
struct Alone : piko::Stage<0, 0, 64, Box, Box> {
  void assignBin(const Box &b) { assignToPreviousBins(b); }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::One); }
  void process(const Box &b) {
    Box c = b;
    for (int i = 0; i < 16; ++i)
      c.z = piko::sqrt(c.z * c.z + 1.0f);
    emit(c);
  }
};

// MACHINE-DAG: piko.items of @few lanes collapsed {
// EXPLAIN: piko-map-lanes
// EXPLAIN: stage 'few': lanes are given collapsed
// EXPLAIN-NEXT: iterations of this parallel loop: about 4, at most about 64; operations of each: {{[0-9]+}}, around the loop: {{[0-9]+}}
// EXPLAIN-NEXT: not items: {{[0-9.]+}} times the operations
// EXPLAIN-NEXT: not iterations: {{[0-9.]+}} times the operations
struct Few : piko::Stage<8, 8, 64, Box, Box>, piko::Uses<State> {
  void assignBin(const Box &b) {
    assignToBoundingBox(b, b.at, b.at + b.extent);
  }
  void process(const Box &b) {
    parallelForPixels(b.at, b.at + b.extent, [&](const glm::ivec2 &at) {
      update(state().z, at, [&](float &z) { z = b.z < z ? z : b.z; });
      if (at == b.at)
        emit(b);
    });
  }
};

// MACHINE-DAG: piko.items of @said lanes iterations {
struct Said : piko::Stage<8, 8, 64, Box>, piko::Uses<State> {
  void assignBin(const Box &b) {
    assignToBoundingBox(b, b.at, b.at + b.extent);
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Box &b) {
    parallelForPixels(b.at, b.at + b.extent, [&](const glm::ivec2 &at) {
      update(state().sum, at, [&](float &sum) { sum = sum * 0.5f + b.z; });
    });
  }
};

struct Fine : piko::Pipe<State> {
  Forced forced;
  Alone alone;
  Few few;
  Said said;
  Fine() {
    source(forced);
    connect(forced, 0, alone);
    connect(alone, 0, few);
    connect(few, 0, said);
  }
};

template <class S> struct Of : piko::Pipe<State> {
  S stage;
  Of() { this->source(stage); }
};

// MISSING: pikoc-lanes.cpp:[[#@LINE + 2]]:32: warning: lanes of stage 'stage' are not given 'iterations': there is no parallel loop that does anything
struct MissingLoop : piko::Stage<0, 0, 64, Box>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Box &b) {
    update(state().z, b.at, [&](float &z) { z = b.z; });
  }
};
struct Missing : Of<MissingLoop> {};

struct MeetingLoop : piko::Stage<0, 0, 64, Box>, piko::Uses<State> {
  // MEETING: pikoc-lanes.cpp:[[#@LINE + 1]]:32: error: expected lanes of stage 'stage' to be given 'iterations' or 'one', but got 'collapsed': the iterations of a parallel loop meet
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Collapsed); }
  void process(const Box &b) {
    // MEETING: pikoc-lanes.cpp:[[#@LINE + 1]]:{{[0-9]+}}: note: see here
    parallelForPixels([&](const glm::ivec2 &at) {
      int sum = reduce(at.x * b.extent, [](int a, int c) { return a + c; });
      update(state().z, at, [&](float &z) { z = float(sum); });
    });
  }
};
struct Meeting : Of<MeetingLoop> {};

struct ListedLoop : piko::Stage<8, 8, 64, Box>, piko::Uses<State> {
  void assignBin(const Box &b) { assignToBin(b, binFromPosition(b.at)); }
  // LISTED: pikoc-lanes.cpp:[[#@LINE + 1]]:32: error: expected lanes of stage 'stage' to be given 'iterations' or 'one', but got 'items': a list is one item
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const piko::List<Box> &boxes) {
    parallelForPixels([&](const glm::ivec2 &at) {
      update(state().z, at, [&](float &z) { z = float(boxes.size()); });
    });
  }
};
struct Listed : Of<ListedLoop> {};

struct AroundLoop : piko::Stage<8, 8, 64, Box>, piko::Uses<State> {
  void assignBin(const Box &b) { assignToBin(b, binFromPosition(b.at)); }
  // AROUND: pikoc-lanes.cpp:[[#@LINE + 1]]:32: error: expected lanes of stage 'stage' to be given 'items', 'iterations' or 'one', but got 'collapsed': there are effects outside of the parallel loop
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Collapsed); }
  void process(const Box &b) {
    parallelForPixels([&](const glm::ivec2 &at) {
      update(state().z, at, [&](float &z) { z = z + b.z; });
    });
    // AROUND: pikoc-lanes.cpp:[[#@LINE + 1]]:{{[0-9]+}}: note: see here
    update(state().sum, b.at, [&](float &sum) { sum = sum + b.z; });
  }
};
struct Around : Of<AroundLoop> {};
