// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages that become one where a list hands its items on, by index, by iterator
// and between the iterations of a parallel loop, and where a truth value says
// that a pixel is in the bin: a local one, and a field of what is emitted.
// REQUIRES: all
// RUN: pikoc %s --pipe Lists --emit=kernels --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=REMARK
// RUN: FileCheck %s --check-prefix=KERNEL --input-file=%t.mlir
// REMARK-DAG: stage 'shade' keeps each primitive in the bin
// REMARK-DAG: stage 'drop' keeps each primitive in the bin
// REMARK-DAG: stage 'blend' keeps each primitive in the bin
// REMARK-DAG: stage 'write' keeps each primitive in the bin
// REMARK-DAG: stage 'mark' keeps each primitive in the bin
// REMARK-DAG: stage 'shade' runs inside stage 'sort'
// REMARK-DAG: stage 'drop' runs inside stage 'first'
// REMARK-DAG: stage 'blend' runs inside stage 'near'
// REMARK-DAG: stage 'write' runs inside stage 'walk'
// REMARK-DAG: stage 'mark' runs inside stage 'walk'
// KERNEL-DAG: piko.stage @sort {{.*}} fused ["shade"]
// KERNEL-DAG: piko.stage @first {{.*}} fused ["drop"]
// KERNEL-DAG: piko.stage @near {{.*}} fused ["blend"]
// KERNEL-DAG: piko.stage @walk {{.*}} fused ["write", "mark"]
//
// RUN: pikoc %s --pipe Open --emit=kernels --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=OPEN
// OPEN: the bins of stage 'shade' are not known to be those before
// OPEN: note: 'pixel.x' is not proved to be at least the bin's lower bound here; if it always is, promise that by assignToPreviousBins
//
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Lists --domain 67 35 --count 2000
// CASE: --pipe Open --domain 67 35 --count 500
// RUN: piko-compare %s --pipe Lists --domain 67 35 --count 2000 --without fuse-stages | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Seed {
  int x, y, size;
};
struct Splat {
  glm::ivec2 pixel;
  float depth;
};
struct Choice {
  glm::ivec2 pixel;
  int weight;
  bool isInside;
};
struct Point {
  glm::vec2 position;
  float weight;
};
struct Color {
  glm::vec3 rgb;
};
struct State {
  piko::Image<Color> shaded, last, blended, walked;
  piko::Buffer<int> table;
};

static glm::ivec2 place(const Seed &s) {
  return glm::ivec2((unsigned(s.x) >> 1) % 67u, (unsigned(s.y) >> 1) % 35u);
}

template <typename In, typename... Out>
using Bins = piko::Stage<8, 8, 64, In, Out...>;

struct Spread : Bins<Seed, Splat, Splat, Point>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToBin(s, binFromPosition(place(s))); }
  void process(const Seed &s) {
    glm::ivec2 at = place(s) * 3;
    Splat splat{{at.x % 67, at.y % 35}, float(s.size & 255)};
    emit(splat, 0);
    emit(splat, 1);
    emit(Point{glm::vec2(place(s)) + 0.25f, float(s.size & 15)}, 2);
  }
};

// Hands all items on, the last one first.
struct Sort : Bins<Splat, Splat> {
  void assignBin(const Splat &s) { assignToBin(s, binFromPosition(s.pixel)); }
  void process(const piko::List<Splat> &list) {
    for (int64_t i = list.size() - 1; i >= 0; --i)
      if (list[i].depth > 3)
        emit(list[i]);
  }
};
struct Shade : Bins<Splat>, piko::Uses<State> {
  void assignBin(const Splat &s) { assignToBin(s, binFromPosition(s.pixel)); }
  void process(const Splat &s) {
    update(state().shaded, s.pixel,
           [&](Color &c) { c.rgb = c.rgb * 0.5f + s.depth; });
  }
};

// The first of a list that is never empty, and those that an iterator gives.
struct First : Bins<Splat, Splat> {
  void assignBin(const Splat &s) { assignToBin(s, binFromPosition(s.pixel)); }
  void process(const piko::List<Splat> &list) {
    emit({list[0].pixel, float(list.size())});
    for (const Splat &s : list)
      if (s.depth < 9)
        emit({s.pixel, s.depth * 0.5f});
  }
};
struct Drop : Bins<Splat>, piko::Uses<State> {
  void assignBin(const Splat &s) { assignToBin(s, binFromPosition(s.pixel)); }
  void process(const Splat &s) {
    update(state().last, s.pixel, [&](Color &c) { c.rgb.x += s.depth; });
  }
};

// By a function of floats, from iterations.
struct Near : Bins<Point, Point> {
  void assignBin(const Point &p) {
    assignToBin(p, binFromPosition(p.position * 0.75f));
  }
  void process(const piko::List<Point> &list) {
    parallelFor(list.size(),
                [&](int i) { emit({list[i].position, list[i].weight * 2}); });
  }
};
struct Blend : Bins<Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBin(p, binFromPosition(p.position * 0.75f));
  }
  void process(const Point &p) {
    update(state().blended, glm::ivec2(p.position * 0.75f),
           [&](Color &c) { c.rgb.y = c.rgb.y * 0.5f + p.weight; });
  }
};

// Walks away from its place, and says of what it emits whether that is inside.
struct Walk : Bins<Seed, Splat, Choice>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToBin(s, binFromPosition(place(s))); }
  void process(const Seed &s) {
    glm::ivec2 at = place(s) + glm::ivec2(s.size & 3, (s.size >> 2) & 3);
    bool isInside = false;
    if (s.size & 64) {
      int limit = state().table[s.size & 7];
      isInside = at.x < binHi().x && at.y < binHi().y;
      if (isInside && (limit & 1))
        isInside = (limit & 2) == 0;
    }
    emit(Choice{at, s.size & 7, isInside}, 1);
    if (isInside)
      emit(Splat{at, 1.0f}, 0);
  }
};
struct Write : Bins<Splat>, piko::Uses<State> {
  void assignBin(const Splat &s) { assignToBin(s, binFromPosition(s.pixel)); }
  void process(const Splat &s) {
    update(state().walked, s.pixel, [&](Color &c) { c.rgb.x += s.depth; });
  }
};
struct Mark : Bins<Choice>, piko::Uses<State> {
  void assignBin(const Choice &c) {
    if (c.isInside)
      assignToBin(c, binFromPosition(c.pixel));
  }
  void process(const Choice &c) {
    update(state().walked, c.pixel,
           [&](Color &color) { color.rgb.y += float(c.weight); });
  }
};

struct Lists : piko::Pipe<State> {
  Spread spread;
  Sort sort;
  Shade shade;
  First first;
  Drop drop;
  Near near;
  Blend blend;
  Walk walk;
  Write write;
  Mark mark;
  Lists() {
    source(spread);
    source(walk);
    connect(spread, 0, sort);
    connect(sort, 0, shade);
    connect(spread, 1, first);
    connect(first, 0, drop);
    connect(spread, 2, near);
    connect(near, 0, blend);
    connect(walk, 0, write);
    connect(walk, 1, mark);
  }
};

// Of an item that nobody has tested to be in the list, nothing is known.
struct Any : Bins<Splat, Splat>, piko::Uses<State> {
  void assignBin(const Splat &s) { assignToBin(s, binFromPosition(s.pixel)); }
  void schedule(piko::BinId) { everyBin(); }
  void process(const piko::List<Splat> &list) {
    if (state().table[0] == 12345)
      emit(list[0]);
  }
};
struct Open : piko::Pipe<State> {
  Spread spread;
  Any any;
  Shade shade;
  Drop drop;
  Blend blend;
  Open() {
    source(spread);
    connect(spread, 0, any);
    connect(any, 0, shade);
    connect(spread, 1, drop);
    connect(spread, 2, blend);
  }
};
