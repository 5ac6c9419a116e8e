// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A line with a width is in the bins that it touches, as the reference has it:
// no pixel that is near enough is missed, and no bin that is far is named. Ends
// are anywhere, widths too.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Planar --count 500 --domain 61 43
// CASE: --pipe Planar --count 300 --domain 64 64 --wide
// CASE: --pipe Spatial --count 300 --domain 13 18 7 --wide
// RUN: not piko-compare %s --pipe NoWidth --count 1 --domain 8 8 --runs 1 | FileCheck %s --check-prefix=NAN
// NAN: expected: {{.*}}expected positions of numbers, but got NaN
// NAN: got: {{.*}}expected positions of numbers, but got NaN
#include <piko.h>

struct Ends {
  int at[7];
  float width;
};
struct Line {
  glm::vec2 a, b;
  float width;
};
template <int Rank> struct State {
  piko::Image<int, Rank> named, drawn, whole, checked;
};

// In the picture and around it; some are points, or along an axis.
static Line lineOf(const Ends &e) {
  Line line{{e.at[0] % 160 - 40, e.at[1] % 160 - 40},
            {e.at[2] % 160 - 40, e.at[3] % 160 - 40},
            float(e.at[4] & 15) * 0.5f};
  line.a += 0.25f * float(e.at[5] & 3);
  if (e.at[6] % 5 == 0)
    line.b.x = line.a.x;
  if (e.at[6] % 7 == 0)
    line.b = line.a;
  return line;
}

// How far a point is from the segment.
static float distanceTo(const Line &line, glm::vec2 p) {
  glm::vec2 along = line.b - line.a, offset = p - line.a;
  float length = glm::dot(along, along);
  float part = length > 0 ? glm::dot(offset, along) / length : 0.0f;
  return glm::distance(offset, along * glm::clamp(part, 0.0f, 1.0f));
}

template <class Stage>
static void draw(Stage &stage, piko::Image<int> &image, const Line &line) {
  stage.parallelForPixels([&](glm::ivec2 p) {
    if (distanceTo(line, glm::vec2(p) + 0.5f) <= 0.5f * line.width)
      stage.update(image, p, [](int &drawn) { ++drawn; });
  });
}

struct Small : piko::Stage<8, 4, 64, Ends>, piko::Uses<State<2>> {
  void assignBin(const Ends &e) {
    Line line = lineOf(e);
    assignToLine(e, line.a, line.b, line.width);
  }
  void process(const Ends &e) {
    Line line = lineOf(e);
    update(state().named, binLo(), [](int &named) { ++named; });
    // Of a square brush, from the bin's middle to its corner.
    float reach = 0.7072f * line.width + glm::length(glm::vec2(4, 2)) + 0.01f;
    if (distanceTo(line, glm::vec2(binLo()) + glm::vec2(4, 2)) > reach)
      state().checked.store({-1, 0}, 1);
    draw(*this, state().drawn, lineOf(e));
  }
};
// One bin, so that nothing can be missed.
struct Whole : piko::Stage<0, 0, 64, Ends>, piko::Uses<State<2>> {
  void process(const Ends &e) { draw(*this, state().whole, lineOf(e)); }
};
struct Both : piko::Stage<0, 0, 64, Ends, Ends, Ends> {
  void process(const Ends &e) {
    emit(e, 0);
    emit(e, 1);
  }
};
// Stores outside of the image where a pixel is missing.
struct Check : piko::Stage<16, 16, 64, Ends>, piko::Uses<State<2>> {
  void assignBin(const Ends &e) { assignToAll(e); }
  void schedule(piko::BinId) {
    everyBin();
    endStage<Small>();
    endStage<Whole>();
  }
  void process(const piko::List<Ends> &) {
    parallelForPixels([&](glm::ivec2 p) {
      int missing = state().whole(p) - state().drawn(p);
      state().checked.store(p + 1000 * missing, 1);
    });
  }
};
struct Planar : piko::Pipe<State<2>> {
  Both both;
  Small small;
  Whole whole;
  Check check;
  Planar() {
    source(both);
    source(check);
    connect(both, 0, small);
    connect(both, 1, whole);
  }
};

// Of any length and width, in three dimensions, from cell to cell.
struct Fill : piko::BasicStage<piko::Bins<4, 0, 3>, 64, Ends>,
              piko::Uses<State<3>> {
  void assignBin(const Ends &e) {
    glm::ivec3 a(e.at[0], e.at[1], e.at[2]), b(e.at[3], e.at[4], e.at[5]);
    if (e.at[6] % 3 == 0) { // short
      a &= 15;
      b &= 15;
    }
    assignToLine(e, a, b, float(e.at[6] & 255) * 0.1f);
    if (e.at[6] % 3 == 1)
      assignToLine(e, {1, 2, 3}, {e.at[0] & 15, 2, 3}, 2);
    if (e.at[6] % 3 == 2)
      assignToLine(e, {1.5f, 2, 3}, {0.5f, float(e.at[0]), 3}, 2);
  }
  void process(const Ends &e) {
    update(state().named, binLo(),
           [&](int &named) { named = named * 31 + e.at[6]; });
  }
};
struct Spatial : piko::Pipe<State<3>> {
  Fill fill;
  Spatial() { source(fill); }
};

struct Widthless : piko::Stage<8, 8, 64, Ends> {
  void assignBin(const Ends &e) {
    assignToLine(e, glm::ivec2(0), glm::ivec2(4), 0.0f / float(e.at[0] & 0));
  }
  void process(const Ends &) {}
};
struct NoWidth : piko::Pipe<> {
  Widthless widthless;
  NoWidth() { source(widthless); }
};
