// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Mistakes that only a run can find stop it with the stage's name, on all
// targets.
// RUN: %compare_targets %s --stops --pipe Read --runs 1 --threads 1 2 | FileCheck %s --check-prefix=READ
// RUN: %compare_targets %s --stops --pipe Write --runs 1 --threads 1 2 | FileCheck %s --check-prefix=WRITE
// RUN: %compare_targets %s --stops --pipe Bin --runs 1 --threads 1 2 | FileCheck %s --check-prefix=BIN
// RUN: %compare_targets %s --stops --pipe Box --runs 1 --threads 1 2 | FileCheck %s --check-prefix=BOX
// RUN: %compare_targets %s --stops --pipe Line --runs 1 --threads 1 2 | FileCheck %s --check-prefix=LINE
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> in, out;
  piko::Image<float> image;
};

// READ: got: stage 'stage', bin 0: expected an index into 'in' in [0, 64), but got -10000
struct ReadOutside : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    piko::atomicAdd(state().out[p.tag], state().in[p.tag % 2 * 7 - 10000]);
  }
};
struct Read : piko::Pipe<State> {
  ReadOutside stage;
  Read() { source(stage); }
};

// WRITE: got: stage 'stage', bin 0: expected an index into 'image' in [0, 48), but got {{48|49|5[0-9]|6[0-3]}}
struct WriteOutside : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    state().image.store(glm::ivec2(p.x, p.y), 1.0f);
  }
};
struct Write : piko::Pipe<State> {
  WriteOutside stage;
  Write() { source(stage); }
};

// BIN: expected: {{.*}}stage 'BinOutside': expected a bin id in [0, 48), but got
// BIN: got: stage 'stage': expected a bin id in [0, 48), but got
struct BinOutside : piko::Stage<8, 8, 64, Point> {
  void assignBin(const Point &p) { assignToBin(p, {p.tag}); }
  void process(const Point &) {}
};
struct Bin : piko::Pipe<State> {
  BinOutside stage;
  Bin() { source(stage); }
};

// BOX: expected: {{.*}}stage 'BoxNaN': expected positions of numbers, but got NaN
// BOX: got: stage 'stage': expected positions of numbers, but got NaN
struct BoxNaN : piko::Stage<8, 8, 64, Point> {
  void assignBin(const Point &p) {
    float zero = p.value - p.value;
    assignToBoundingBox(p, glm::vec2(zero / zero, 1), glm::vec2(3, 3));
  }
  void process(const Point &) {}
};
struct Box : piko::Pipe<State> {
  BoxNaN stage;
  Box() { source(stage); }
};

// LINE: expected: {{.*}}stage 'LineNaN': expected positions of numbers, but got NaN
// LINE: got: stage 'stage': expected positions of numbers, but got NaN
struct LineNaN : piko::Stage<8, 8, 64, Point> {
  void assignBin(const Point &p) {
    float zero = p.value - p.value;
    assignToLine(p, glm::vec2(3, 3), glm::vec2(1, zero / zero));
  }
  void process(const Point &) {}
};
struct Line : piko::Pipe<State> {
  LineNaN stage;
  Line() { source(stage); }
};
