// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What keeps the rules has no findings in checking mode, and the results that
// it has without.
// HOLE: cuda: what is checked is written down on the host
// REQUIRES: all
// RUN: %compare_checked %s --count 60 --runs 2 --threads 1 2 --check=nan:Point.value | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> counts;
  piko::Buffer<Point> shaded;
  piko::Image<float> depth, copy;
};

struct Store : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::vec2(p.x, p.y)));
  }
  void process(const Point &p) {
    // A read by a call that updates the pixel is a part of the update.
    float before = state().depth(glm::ivec2(p.x, p.y));
    bool changed = update(state().depth, glm::ivec2(p.x, p.y), [&](float &z) {
      if (p.value < z)
        return false;
      z = p.value;
      return true;
    });
    Point q;
    q.x = p.x;
    q.y = p.y;
    q.tag = p.tag;
    if (changed)
      q.value = before;
    else
      q.value = p.value;
    piko::atomicAdd(state().counts[p.tag % 4], 1);
    emit(q);
  }
};

// Waits for what it reads, and stores where no other call does.
struct Copy : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void schedule(piko::BinId) {
    endStage<Store>();
    everyBin();
  }
  void process(const piko::List<Point> &points) {
    int many = int(points.size());
    parallelForPixels([&](glm::ivec2 p) {
      state().copy.store(p, state().depth(p) + float(many));
    });
    float values[64];
    parallelFor(64, [&](int i) {
      values[i] = float(i);
      sync();
      if (bin().index == 0) {
        state().shaded[i] = {i, i, values[63 - i], i};
        sync();
        state().shaded[63 - i].tag = state().shaded[63 - i].x;
      }
    });
  }
};

struct Clean : piko::Pipe<State> {
  Store store;
  Copy copy;
  Clean() {
    source(store);
    connect(store, 0, copy);
  }
};
