// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lines are in the bins that they touch, as the reference has it: short and
// long ones, in any direction, through corners, of positions anywhere.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Planar --count 3000 --domain 61 43
// CASE: --pipe Planar --count 2000 --domain 64 64 --wide
// CASE: --pipe Linear --count 2000 --domain 100 --wide
// CASE: --pipe Spatial --count 2000 --domain 13 18 7 --wide
// CASE: --pipe Wide --count 2000 --domain 61 43 --wide
// RUN: piko-compare %s --pipe Planar --count 300 --domain 61 43 --runs 1 --target gpu-on-cpu --gpu-threads 32 --wide | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Ends {
  int at[8];
  float position[4];
};
struct Piece {
  glm::ivec2 a, b;
};
template <int Rank> struct State {
  piko::Image<int, Rank> seen, marked;
};

// Every third one is short, and may go through corners.
static Piece pieceOf(const Ends &e) {
  glm::ivec2 a(e.at[0], e.at[1]), b(e.at[2], e.at[3]);
  if (e.at[4] % 3 == 0) {
    a = glm::ivec2(e.at[0] & 63, e.at[1] & 63) - 4;
    b = a + (e.at[2] & 31) * glm::ivec2(e.at[5] & 1 ? 1 : -1, 1);
  } else if (e.at[4] % 3 == 1) {
    a &= 127;
    b &= 127;
  }
  return {a - 1, b - 1};
}

// From one stage's bins to another's, through an edge.
struct Split : piko::Stage<16, 8, 64, Ends, Piece>, piko::Uses<State<2>> {
  void assignBin(const Ends &e) {
    Piece p = pieceOf(e);
    assignToLine(e, p.a, p.b);
  }
  void process(const Ends &e) {
    update(state().seen, binLo(),
           [&](int &seen) { seen = seen * 31 + e.at[6]; });
    emit(pieceOf(e));
  }
};
struct Mark : piko::Stage<4, 4, 64, Piece>, piko::Uses<State<2>> {
  void assignBin(const Piece &p) {
    if (p.a.x != p.b.y)
      assignToLine(p, glm::vec2(p.a) + 0.75f, glm::vec2(p.b));
    else // bins are a set
      assignToBoundingBox(p, p.a, p.a);
    assignToLine(p, p.a, p.a);
  }
  void process(const Piece &p) {
    update(state().marked, binLo(),
           [&](int &seen) { seen = seen * 17 + p.a.x + p.b.y; });
  }
};
struct Planar : piko::Pipe<State<2>> {
  Split split;
  Mark mark;
  Planar() {
    source(split);
    connect(split, 0, mark);
  }
};

struct MarkRow : piko::BasicStage<piko::Bins<7>, 64, Ends>,
                 piko::Uses<State<1>> {
  void assignBin(const Ends &e) {
    if (e.at[4] & 1)
      assignToLine(e, glm::ivec1(e.at[0]), glm::ivec1(e.at[1]));
    else if (e.position[0] == e.position[0] && e.position[1] == e.position[1])
      assignToLine(e, {e.position[0]}, {e.position[1]});
  }
  void process(const Ends &e) {
    update(state().seen, binLo(),
           [&](int &seen) { seen = seen * 31 + e.at[6]; });
  }
};
struct Linear : piko::Pipe<State<1>> {
  MarkRow row;
  Linear() { source(row); }
};

struct MarkVolume : piko::BasicStage<piko::Bins<4, 4, 2>, 64, Ends>,
                    piko::Uses<State<3>> {
  void assignBin(const Ends &e) {
    glm::ivec3 a(e.at[0], e.at[1], e.at[2]), b(e.at[3], e.at[4], e.at[5]);
    if (e.at[7] & 1) {
      a = (a & 15) - 1;
      b = (b & 15) - 1;
    }
    assignToLine(e, a, b);
  }
  void process(const Ends &e) {
    update(state().seen, binLo(),
           [&](int &seen) { seen = seen * 31 + e.at[6]; });
  }
};
struct Spatial : piko::Pipe<State<3>> {
  MarkVolume volume;
  Spatial() { source(volume); }
};

// One dimension is the whole domain; a coordinate is computed in 64 bits.
struct MarkColumns : piko::Stage<8, 0, 64, Ends>, piko::Uses<State<2>> {
  void assignBin(const Ends &e) {
    int64_t x = (int64_t(e.at[0]) * 3) >> 2;
    assignToLine(e, glm::ivec2(int(x), e.at[1]), glm::ivec2(30, e.at[2]));
  }
  void process(const Ends &e) {
    update(state().seen, binLo(),
           [&](int &seen) { seen = seen * 31 + e.at[6]; });
  }
};
struct Wide : piko::Pipe<State<2>> {
  MarkColumns columns;
  Wide() { source(columns); }
};
