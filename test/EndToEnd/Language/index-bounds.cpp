// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Indices that are tested before a loop, or not at all, are those of the
// reference, at the ends of buffers and past them.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Rows --count 500
// CASE: --pipe Tiles --count 300
// CASE: --pipe Clamped --count 200
// RUN: not piko-compare %s --pipe Past --count 40 --runs 1 --threads 1 2 | FileCheck %s --check-prefix=PAST
// RUN: not piko-compare %s --pipe Below --count 40 --runs 1 --threads 1 2 | FileCheck %s --check-prefix=BELOW
#include "../Inputs/ports.h"

struct Pixel {
  float sum = 0;
};
struct State {
  piko::Buffer<float> in, out;
  piko::Image<Pixel> image;
};

/// Rows of 10 of both buffers, which are equally long.
struct Add : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &list) {
    int rows = int(state().out.size()) / 10;
    rows = int(list.size()) < rows ? int(list.size()) : rows;
    for (int row = 0; row < rows; ++row) {
      int base = row * 10;
      for (int j = 0; j < 10; ++j)
        state().out[base + j] = state().in[base + 9 - j] + list[row].value;
      for (int j = 1; j < 10; ++j)
        state().out[base + j] += state().out[base + j - 1];
      int n = list[row].tag % 10;
      for (int64_t j = -n; j < 0; ++j)
        state().out[base + n + j] += state().in[base];
    }
    for (int i = 0; i < int(state().out.size()); ++i)
      if (state().out[i] > 100)
        state().out[i] = float(i);
  }
};
struct Rows : piko::Pipe<State> {
  Add stage;
  Rows() { source(stage); }
};

struct Fill : piko::Stage<16, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 9, p.y - 3), glm::ivec2(p.x, p.y));
  }
  void process(const piko::List<Point> &list) {
    parallelForPixels([&](glm::ivec2 cell) {
      float sum = 0;
      for (int i = 0; i < int(list.size()); ++i)
        if (list[i].x >= cell.x && list[i].y >= cell.y)
          sum += list[i].value;
      update(state().image, cell, [&](Pixel &p) { p.sum += sum; });
    });
  }
};
struct Tiles : piko::Pipe<State> {
  Fill stage;
  Tiles() { source(stage); }
};

// PAST: expected: {{.*}}stage 'ReadPast'{{.*}}: expected an index into 'in' in [0, 64), but got 64
// PAST: got: stage 'stage', bin 0: expected an index into 'in' in [0, 64), but got 64
struct ReadPast : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &) {
    float sum = 0;
    int end = int(state().in.size()) - 10;
    for (int j = 0; j < 11; ++j)
      sum += state().in[end + j];
    state().out[0] = sum;
  }
};
struct Past : piko::Pipe<State> {
  ReadPast stage;
  Past() { source(stage); }
};

// BELOW: expected: {{.*}}stage 'ReadBelow'{{.*}}: expected an index into 'out' in [0, 64), but got -3
// BELOW: got: stage 'stage', bin 0: expected an index into 'out' in [0, 64), but got -3
struct ReadBelow : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &) {
    for (int j = 0; j < 11; ++j)
      state().out[j - 3] = 1;
  }
};
struct Below : piko::Pipe<State> {
  ReadBelow stage;
  Below() { source(stage); }
};

// A bound that is made of the index itself.
struct ReadClamped : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &list) {
    float sum = 0;
    for (int64_t i = 0; i < list.size(); ++i) {
      int at = list[i].tag - 40, most = int(state().in.size()) - 1;
      if (at == glm::clamp(at, 0, most))
        sum += state().in[at];
      if (glm::max(at, 0) == at && glm::min(most, at) == at)
        sum -= 0.5f * state().in[at];
    }
    state().out[0] = sum;
  }
};
struct Clamped : piko::Pipe<State> {
  ReadClamped stage;
  Clamped() { source(stage); }
};
