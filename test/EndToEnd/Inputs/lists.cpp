// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lists.mlir means: batches that depend on the bin, empty bins, and
// iterations that emit.
#include "ports.h"

struct Settings {
  int batch;
};
struct Pixel {
  float sum = 0;
};
struct State {
  Settings settings;
  piko::Image<Pixel> image;
};

struct Gather : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 5, p.y), glm::ivec2(p.x, p.y));
  }
  void schedule(piko::BinId bin) {
    batch(1 + (state().settings.batch + bin.index) % 7);
    if (bin.index % 2 == 0)
      everyBin();
  }
  void process(const piko::List<Point> &list) {
    float sum = 0;
    for (int64_t i = 0; i < list.size(); ++i)
      sum = sum * 0.5f + list[i].value;
    emit({binLo().x, binLo().y, sum, int(list.size())});
    int n = int(list.size());
    parallelFor(n, [&](int i) {
      Point p = list[n - 1 - i];
      p.value += sum;
      emit(p);
      if (p.tag % 2 == 0)
        emit({binLo().x, p.y, p.value, p.tag});
    });
  }
};
struct Blend : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.75f + p.value; });
  }
};
struct Lists : piko::Pipe<State> {
  Gather gather;
  Blend blend;
  Lists() {
    source(gather);
    connect(gather, 0, blend);
  }
};
