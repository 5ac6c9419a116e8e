// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// parallelForPixels(lo, hi, f): boxes that lie in the bin, cross its edges, lie
// outside, are empty or inverted, or reach to the ends of int; from Processes of
// one primitive and of lists, nested, with emissions, updates, stores and
// barriers.
// RUN: pikoc %s --emit=kernels -o - | FileCheck %s --check-prefix=PIXELS
// PIXELS-COUNT-7: piko.parallel_pixels
// PIXELS-NOT: piko.parallel_pixels
// RUN: %compare_targets %s --cases %s
// CASE: --domain 67 35 --count 400
// CASE: --domain 1 1 --count 40
// CASE: --domain 8 16 --count 40
// RUN: piko-compare %s --domain 67 35 --count 60 --runs 2 --check | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Seed {
  int x, y, width, height, kind;
};
struct Cell {
  glm::ivec2 at;
  int id;
};
struct Pixel {
  int drawn = 0, sum = 0;
};
struct State {
  piko::Image<Pixel> drawn, sunk, listed, stored, met;
};

struct Box {
  glm::ivec2 lo, hi;
};
static Box boxOf(const Seed &s) {
  glm::ivec2 lo(s.x % 80 - 5, s.y % 50 - 5);
  Box box = {lo, lo + glm::ivec2(s.width & 31, s.height & 15)};
  switch (s.kind & 15) {
  case 0:
    box.hi.x = INT32_MAX;
    break;
  case 1:
    box.lo = glm::ivec2(INT32_MIN);
    break;
  case 2:
    box = {glm::ivec2(INT32_MIN), glm::ivec2(INT32_MAX)};
    break;
  case 3: // inverted
    box = {glm::ivec2(INT32_MAX), glm::ivec2(INT32_MIN)};
    break;
  case 4:
    box.hi.y = box.lo.y - 1;
    break;
  case 5:
    box.hi = box.lo;
    break;
  case 6:
    box.hi.y = INT32_MIN;
    break;
  }
  return box;
}

// The cells of the box in one primitive's bin, and twice in a nested loop.
struct Draw : piko::Stage<8, 8, 64, Seed, Cell>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void process(const Seed &s) {
    Box b = boxOf(s);
    parallelForPixels(b.lo, b.hi, [&](glm::ivec2 p) {
      update(state().drawn, p,
             [&](Pixel &pixel) { pixel.drawn = pixel.drawn * 31 + s.kind; });
      if ((p.x ^ p.y) & 1)
        emit({p, s.kind});
    });
    parallelForPixels({1, b.lo.y}, {3, b.hi.y}, [&](auto &p) {
      p.x += s.width & 3;
      parallelForPixels(p, glm::ivec2(b.hi.x, p.y),
                        [&](const glm::ivec2 &q) { emit({q, p.x}); });
    });
  }
};

// What arrives, in order.
struct Sink : piko::Stage<8, 8, 64, Cell>, piko::Uses<State> {
  void assignBin(const Cell &c) { assignToBin(c, binFromPosition(c.at)); }
  void process(const Cell &c) {
    update(state().sunk, c.at,
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 17 + c.id; });
  }
};

// A list, whose boxes are drawn one after the other.
struct Listed : piko::Stage<16, 8, 64, Seed>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void schedule(piko::BinId) { batch(7); }
  void process(const piko::List<Seed> &seeds) {
    for (const Seed &s : seeds) {
      Box b = boxOf(s);
      parallelForPixels(b.lo, b.hi, [&](glm::ivec2 p) {
        update(state().listed, p,
               [&](Pixel &pixel) { pixel.drawn = pixel.drawn * 31 + s.width; });
      });
    }
  }
};

// Iterations that meet, in the order of their pixels.
struct Met : piko::Stage<16, 4, 64, Seed>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void process(const Seed &s) {
    Box b = boxOf(s);
    int values[64];
    parallelForPixels(b.lo, b.hi, [&](glm::ivec2 p) {
      int i = (p.y - binLo().y) * 16 + p.x - binLo().x;
      values[i] = p.x * 5 + p.y + s.kind;
      int before = scan(values[i], [](int a, int c) { return a + c; });
      bool some = any(p.x % 7 == 3);
      int64_t rank = sort(-values[i]);
      sync();
      int left = b.lo.x < p.x && binLo().x < p.x ? values[i - 1] : -1;
      update(state().met, p, [&](Pixel &pixel) {
        pixel.drawn = pixel.drawn * 31 + before + left;
        pixel.sum += int(rank) + some * 1000;
      });
    });
  }
};

// Once for each bin: stores to its pixels, also by the short form.
struct Stored : piko::Stage<8, 8, 64, Seed>, piko::Uses<State> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void schedule(piko::BinId) { everyBin(); }
  void process(const piko::List<Seed> &seeds) {
    glm::ivec2 middle = binLo() + 3;
    parallelForPixels(
        [&](glm::ivec2 p) { state().stored.store(p, {p.x, p.y}); });
    parallelForPixels(middle, middle + 1, [&](glm::ivec2 p) {
      state().stored.store(p, {int(seeds.size()), p.x * p.y});
    });
  }
};

struct Everything : piko::Pipe<State> {
  Draw draw;
  Sink sink;
  Listed listed;
  Met met;
  Stored stored;
  Everything() {
    source(draw);
    connect(draw, 0, sink);
    source(listed);
    source(met);
    source(stored);
  }
};
