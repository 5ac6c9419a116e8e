// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pipelines with cycles share. Updates that do not commute show the order.
#include "ports.h"

struct Pixel {
  float sum = 0;
  int count = 0;
};
struct State {
  piko::Image<Pixel> image, drawn;
};

struct Blend : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.75f + p.value;
      ++pixel.count;
    });
  }
};

inline Point moved(const Point &p, int dx, int dy, float value, int tag) {
  return {(p.x + dx) % 64, (p.y + dy) % 48, value, tag};
}

// Two stages play ping-pong; both let some out, to two stages.
struct Ping : piko::Stage<8, 8, 64, Point, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 3, p.y));
  }
  void process(const Point &p) {
    if (p.tag > 2)
      emit(moved(p, 2, 2, p.value * 0.5f, p.tag - 3), 0);
    if (p.tag % 2 == 0)
      emit(p, 1);
    else
      emit(p, 2);
  }
};
struct Pong : piko::Stage<0, 0, 64, Point, Point, Point, Point> {
  void process(const Point &p) {
    Point next = moved(p, 7, 0, p.value + 2, p.tag);
    if (p.tag % 3 == 0)
      emit(next, 0);
    else if (p.tag % 3 == 1)
      emit(next, 1);
    else
      emit(next, 2);
    if (p.tag % 4 == 0)
      emit(moved(p, 0, 7, p.value - 2, p.tag / 2), 0);
  }
};
// To both, or to either.
struct Deal : piko::Stage<32, 8, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 3, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    if (p.tag % 3 != 0)
      emit(moved(p, 3, 5, p.value, p.tag), 0);
    if (p.tag % 3 != 1)
      emit(moved(p, 5, 3, p.value, p.tag), 1);
  }
};
struct Shift : piko::Stage<0, 0, 64, Point, Point> {
  void process(const Point &p) { emit(moved(p, 1, 1, p.value, p.tag)); }
};
struct Merge : piko::Stage<32, 32, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const piko::List<Point> &list) {
    for (int i = 0; i < int(list.size()); ++i) {
      const Point &p = list[i];
      if (p.tag > 6)
        emit(moved(p, 1, i % 4, p.value + i, p.tag / 2), 0);
      else
        emit(p, 1);
    }
  }
};
