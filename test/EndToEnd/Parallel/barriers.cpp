// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Private and shared arrays across barriers, collective operations, barriers in
// loops and branches, and emissions between.
// RUN: %compare_targets %s --cases %s
// CASE: --count 1000
// CASE: --count 17
#include "../Inputs/ports.h"

struct Pixel {
  float sum = 0;
};
struct State {
  piko::Image<Pixel> image;
};

struct Mix : piko::Stage<16, 16, 64, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 5, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const piko::List<Point> &list) {
    auto add = [](float a, float b) { return a + 0.75f * b; };
    int n = int(list.size());
    float shared[64];
    parallelFor(n, [&](int i) {
      const Point &p = list[i];
      float mine[3] = {p.value, 2 * p.value, 3 * p.value};
      shared[i % 64] = p.value;
      emit(p);
      sync();
      mine[p.tag % 3] += shared[(i + 1) % n % 64];
      float total = reduce(p.value, add);
      float before = scan(p.value, add, 0.5f + float(i));
      int64_t rank = sort(p.value);
      Point q = list[rank];
      q.value = mine[(p.tag + 1) % 3] + total + before;
      q.tag = int(rank);
      emit(q);
      float sum = q.value;
      for (int stride = 1; stride < n; stride *= 2) {
        float other = shared[(i + stride) % n % 64];
        sync();
        shared[i % 64] = other + sum;
        sum = sum * 0.5f + other;
        if (stride % 4 == 1)
          emit({p.x, p.y, sum, stride});
        sync();
      }
      if (total > 10)
        sum = scan(sum, add);
      else
        sum = -sum;
      emit({q.x, q.y, sum, q.tag});
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
struct Barriers : piko::Pipe<State> {
  Mix mix;
  Blend blend;
  Barriers() {
    source(mix);
    connect(mix, 0, blend);
  }
};
