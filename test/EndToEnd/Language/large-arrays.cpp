// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Local arrays that are nearly as large as they may be, in stages of one
// kernel, in iterations that meet, and again for each primitive.
// RUN: %compare_targets %s --cases %s --threads 2 --runs 1
// CASE: --pipe Chain --count 300
// CASE: --pipe Meeting --count 9
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> out;
};
constexpr int size = 60000;

struct First : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {p.tag % 4}); }
  void process(const Point &p) {
    int values[size];
    for (int i = 0; i < size; i += 7)
      values[i] = i * p.x;
    Point q = p;
    q.x = values[p.tag * 7];
    emit(q);
  }
};
struct Second : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void process(const Point &p) {
    int values[size];
    for (int i = 0; i < size; i += 11)
      values[i] = i ^ p.x;
    piko::atomicXor(state().out[p.tag % 16], values[p.y % 32 * 11]);
  }
};
struct Chain : piko::Pipe<State> {
  First first;
  Second second;
  Chain() {
    source(first);
    connect(first, 0, second);
  }
};

struct Meet : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    parallelFor(5, [&](int k) {
      int values[size];
      for (int i = 0; i < size; i += 13)
        values[i] = i * k + p.x;
      sync();
      piko::atomicAdd(state().out[k], values[p.y % 32 * 13]);
    });
  }
};
struct Meeting : piko::Pipe<State> {
  Meet meet;
  Meeting() { source(meet); }
};
