// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Fields, ports and stages that nothing depends on are dropped, and what is
// left gives the reference executor's bits: sums that are not associative show
// the order in which primitives on several paths arrive.
// REQUIRES: all
// RUN: pikoc %s --pipe PrunePipe --emit=kernels --remarks -o %t 2>&1 | FileCheck %s --check-prefix=REMARKS
// RUN: %compare_targets %s --pipe PrunePipe --count 3000 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

// REMARKS-DAG: stage 'look' is removed, because nothing it does can be observed
// REMARKS-DAG: stage 'unused' is emptied, because nothing it does can be observed
// REMARKS-DAG: edge to stage 'relax' carries 32 instead of 64 bytes
// REMARKS-DAG: edge to stage 'gather' carries 12 instead of 64 bytes
// REMARKS-DAG: edge to stage 'mark' carries 8 instead of 64 bytes
struct Sample {
  char kind;     // read by gather alone
  double unread; // computed by all, read by none
  int x, y, rounds;
  float value;
  float weights[4]; // read on the cycle alone
  float history[4]; // passed on around the cycle, and no further
};
struct Pixel {
  float sum = 0;
};
struct State {
  piko::Image<Pixel> image, marks;
  piko::Buffer<float> out;
};

struct Unused : piko::Stage<0, 0, 64, Point, Point> {
  void process(const Point &p) {
    Point q = p;
    q.value *= 2;
    emit(q);
  }
};
struct Split : piko::Stage<0, 0, 64, Point, Point, Sample, Sample, Sample> {
  void process(const Point &p) {
    emit(p, 0);
    Sample s = {};
    s.kind = char(p.tag % 3);
    s.unread = p.value * 3.0;
    s.x = p.x;
    s.y = p.y;
    s.rounds = p.tag % 4;
    s.value = p.value;
    for (int i = 0; i < 4; ++i) {
      s.weights[i] = float(i + p.tag % 5);
      s.history[i] = p.value - float(i);
    }
    if (p.tag % 2)
      emit(s, 1);
    emit(p, 0);
    s.value += 1;
    emit(s, 2);
    emit(s, 3);
  }
};
struct Look : piko::Stage<8, 8, 64, Point, Point> {
  void assignBin(const Point &p) {
    piko::BinId bin = binFromPosition(glm::ivec2(p.x, p.y));
    if (bin.index >= 0)
      assignToBin(p, bin);
  }
  void process(const Point &p) { emit(p); }
};
// Goes around, and out.
struct Relax : piko::Stage<0, 0, 64, Sample, Sample, Sample> {
  void process(const Sample &s) {
    Sample t = s;
    t.unread = s.unread * s.unread;
    t.value = s.value * 0.5f + s.weights[s.rounds];
    for (int i = 0; i < 3; ++i)
      t.history[i] = s.history[i + 1];
    t.history[3] = t.value;
    t.rounds = s.rounds - 1;
    if (t.rounds >= 0)
      emit(t, 0);
    else
      emit(t, 1);
  }
};
struct Mark : piko::Stage<16, 16, 64, Sample>, piko::Uses<State> {
  void assignBin(const Sample &s) {
    piko::BinId bin = binFromPosition(glm::ivec2(s.x, s.y));
    if (bin.index >= 0)
      assignToBin(s, bin);
  }
  void process(const Sample &s) {
    update(state().marks, glm::ivec2(s.x, s.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.75f + 1; });
  }
};
struct Gather : piko::Stage<0, 0, 64, Sample, Point> {
  void process(const piko::List<Sample> &samples) {
    float sum = 0;
    for (int64_t i = 0; i < samples.size(); ++i)
      if (samples[i].kind == 1)
        sum = sum * 0.5f + samples[i].value + float(samples[i].y);
    emit(Point{1, 1, sum, int(samples.size())});
  }
};
struct Draw : piko::Stage<0, 0, 64, Sample>, piko::Uses<State> {
  void process(const Sample &s) {
    if (isOnScreen({s.x, s.y, 0, 0}, domain()))
      update(state().image, glm::ivec2(s.x, s.y),
             [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.75f + s.value; });
  }
};
// Waits for what came before a stage that nothing depends on.
struct Finish : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void schedule(piko::BinId) { endStage<Look>(); }
  void process(const Point &p) {
    state().out[0] = p.value;
    state().out[1] = float(p.tag);
  }
};
struct Drain : piko::Stage<0, 0, 64, Point> {
  void process(const Point &) {}
};

struct PrunePipe : piko::Pipe<State> {
  Split split;
  Unused unused;
  Look look;
  Relax relax;
  Gather gather;
  Mark mark;
  Draw draw;
  Finish finish;
  Drain drain;
  PrunePipe() {
    source(split);
    source(unused);
    connect(unused, 0, drain);
    connect(split, 0, look);
    connect(look, 0, drain);
    connect(split, 1, relax);
    connect(split, 2, mark);
    connect(split, 3, gather);
    connect(relax, 0, relax);
    connect(relax, 1, draw);
    connect(gather, 0, finish);
  }
};
