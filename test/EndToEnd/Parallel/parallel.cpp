// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lists, iterations that meet, and what they exchange, against the reference.
// RUN: %compare_targets %s --pipe Pipeline --count 700 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct Sum {
  float value;
  int count;
};
struct State {
  float scale = 0.75f;
  piko::Image<Sum> image;
};

// A list in batches, the best of it by reference, ranked and compacted.
struct Gather : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void schedule(piko::BinId bin) {
    if (bin.index % 3 == 0)
      specifySchedule(piko::All, 4);
    batch(16 + bin.index % 5);
  }
  void process(const piko::List<Point> &points) {
    const Point *best = nullptr;
    for (const Point &p : points)
      if (!best || p.value > best->value)
        best = &p;
    auto add = [](int a, int b) { return a + b; };
    float values[32];
    int n = int(points.size());
    parallelFor(n, [&](int i) {
      values[i] = points[i].value * state().scale;
      int rank = int(sort(points[i].value));
      Point out = points[rank];
      int place = scan(out.tag % 2, add);
      if (any(out.tag % 7 == 0))
        out.value += values[(i + 1) % n];
      out.tag += place;
      if (out.tag % 2)
        emit(out);
    });
    Point sum = *best;
    sum.value = reduce<float>(
        n, [&](int i) { return values[i]; },
        [](float a, float b) { return a + b; }, 0);
    emit(sum);
  }
};

struct Spread : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void process(const Point &point) {
    parallelForPixels([&](glm::ivec2 p) {
      float row[3];
      parallelFor(3, [&](int i) { row[i] = point.value * float(p.x + i); });
      update(state().image, p, [&](Sum &pixel) {
        pixel.value = pixel.value * 0.5f + row[p.y % 3];
        ++pixel.count;
      });
    });
  }
};
struct Pipeline : piko::Pipe<State> {
  Gather gather;
  Spread spread;
  Pipeline() {
    source(gather);
    connect(gather, 0, spread);
  }
};
