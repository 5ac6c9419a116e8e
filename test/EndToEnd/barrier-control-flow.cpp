// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Barriers in every kind of control flow: in the test of a loop, in a switch, in
// branches, and in a loop that iterations count from different numbers.
// RUN: piko-compare %s --count 400 | FileCheck %s
// RUN: piko-compare %s --count 20 --seed 5 | FileCheck %s
// CHECK: equal
#include "Inputs/ports.h"
struct Pixel {
  float sum = 0;
};
struct State {
  piko::Image<Pixel> image;
};
struct Mix : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 5, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const piko::List<Point> &list) {
    int n = int(list.size());
    float shared[64];
    int kind = list[0].tag % 4;
    parallelFor(n, [&](int i) {
      const Point &p = list[i];
      float mine[4] = {p.value, 2 * p.value, 3 * p.value, 0};
      shared[i % 64] = p.value;
      sync();
      // The test of this loop comes behind barriers.
      int round = 0;
      float sum = 0;
      do {
        float other = shared[(i + 1 + round) % n % 64];
        sync();
        shared[i % 64] = other + float(i);
        mine[(round + i) & 3] += other;
        sum += mine[round & 3];
        sync();
        ++round;
      } while (round < kind + 1);
      switch (kind) {
      case 0:
        sync();
        sum += shared[(i + 2) % n % 64];
        sync();
        break;
      case 1:
        emit({p.x, p.y, sum, 1});
        sync();
        sync();
        sum -= shared[(i + 3) % n % 64];
        sync();
        break;
      case 2:
        sum *= 2;
        break;
      default:
        for (int k = 0; k < 3; ++k) {
          shared[(i + k) % 64] = sum * float(k);
          sync();
          if (k == 1 && n > 3) {
            sum += shared[(i + 7) % n % 64];
            sync();
          } else {
            sum -= 1;
          }
        }
      }
      // Equally often, from different numbers.
      for (int k = i; k < i + 2; ++k) {
        shared[i % 64] = sum + float(k);
        sync();
        sum += shared[(i + k) % n % 64];
        sync();
      }
      emit({p.x, p.y, sum, n});
      if (sum > 0)
        emit({p.x, p.y, 1, n});
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
