// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lanes emit at once, or store at once and emit in turns: each pipeline's
// last stage sees the order.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: piko-compare %s --cases %s --runs 1 --cpu x86-64-v2
// CASE: --pipe OneField --domain 8 8 --count 1003
// CASE: --pipe OneField --domain 8 8 --count 60000
// CASE: --pipe ManyFields --domain 8 8 --count 1003
// CASE: --pipe ManyFields --domain 8 8 --count 20000
// CASE: --pipe Padded --domain 8 8 --count 1003
// CASE: --pipe Short --domain 8 8 --count 1003
// CASE: --pipe Two --domain 8 8 --count 1003
// CASE: --pipe Three --domain 8 8 --count 9000
// CASE: --pipe Four --domain 8 8 --count 1003
// CASE: --pipe Ports --domain 8 8 --count 1003
// CASE: --pipe Nested --domain 8 8 --count 1003
// CASE: --pipe Looped --domain 8 8 --count 1003
// CASE: --pipe Binned --domain 64 64 --count 5000
// CASE: --pipe Boxed --domain 64 64 --count 5000
// CASE: --pipe Counted --domain 64 64 --count 5000
// CASE: --pipe Local --domain 64 64 --count 5000
// CASE: --pipe Rows --domain 8 8 --count 300
//
// A bin that is none is named.
// RUN: not piko-compare %s --pipe Outside --domain 64 64 --count 900 --runs 1 2>&1 | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: got: stage 'last': expected a bin id in [0, 4096), but got 4096
//
// Why lanes take turns.
// RUN: pikoc %s --pipe Short --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=SHORT
// SHORT: note: lanes take turns to emit, in order: the record is no whole number of words of 4 bytes, up to 256 bytes
// RUN: pikoc %s --pipe Looped --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=LOOPED
// LOOPED: note: lanes take turns to emit, in order: a loop of each lane emits
// RUN: pikoc %s --pipe Four --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=FOUR
// FOUR: note: lanes take turns to emit, in order: more than 3 of each lane go to the port
#include <piko.h>

#include <cstdint>

struct Prim {
  int x, y, z, w, serial;
};
struct Result {
  int hash;
};
struct State {
  piko::Buffer<Result> results;
};
inline int mix(int hash, float value) {
  return hash * 31 + piko::toInt(value * 16);
}
inline float root(int x, int y) {
  return piko::sqrt(float((x & 1023) * (y & 255)) + 0.5f);
}

// --- One record of an iteration ---------------------------------------------

struct EmitOne : piko::Stage<0, 0, 64, Prim, float> {
  void process(const Prim &p) {
    float r = root(p.x, p.y);
    if (r > 60)
      emit(r / (float(p.z & 15) + 1));
  }
};
struct TakeOne : piko::Stage<0, 0, 64, float>, piko::Uses<State> {
  void process(const piko::List<float> &list) {
    int hash = 1;
    for (float value : list)
      hash = mix(hash, value);
    state().results[bin().index].hash = hash;
  }
};
struct OneField : piko::Pipe<State> {
  EmitOne first;
  TakeOne last;
  OneField() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

struct Many {
  float a;
  double b;
  int16_t c, d;
  uint8_t e, f;
  int64_t g;
  float h[3];
  bool i;
};
struct EmitMany : piko::Stage<0, 0, 64, Prim, Many> {
  void process(const Prim &p) {
    float r = root(p.x, p.y), s = root(p.z, p.w);
    if ((p.w & 3) == 0)
      return;
    emit(Many{r,
              double(s) * r,
              int16_t(p.x),
              int16_t(p.y >> 3),
              uint8_t(p.z),
              uint8_t(p.w),
              int64_t(p.x) * p.y,
              {s, r - s, r * s},
              r > s});
  }
};
struct TakeMany : piko::Stage<0, 0, 64, Many>, piko::Uses<State> {
  void process(const piko::List<Many> &list) {
    int hash = 1;
    for (const Many &m : list) {
      hash = mix(mix(hash, m.a), float(m.b));
      hash = hash * 31 + m.c * 3 + m.d * 5 + m.e * 7 + m.f * 11;
      hash = hash * 31 + int(m.g) + int(m.g >> 32);
      hash = mix(mix(mix(hash, m.h[0]), m.h[1]), m.h[2]) + m.i;
    }
    state().results[bin().index].hash = hash;
  }
};
struct ManyFields : piko::Pipe<State> {
  EmitMany first;
  TakeMany last;
  ManyFields() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

/// With padding inside and after, of which a byte by byte copy tells.
struct Gap {
  uint8_t kind;
  double value;
  uint8_t last;
};
struct EmitGap : piko::Stage<0, 0, 64, Prim, Gap> {
  void process(const Prim &p) {
    float r = root(p.x, p.y);
    if ((p.w & 3) != 0)
      emit(Gap{uint8_t(p.z), double(r) / 3, uint8_t(p.w)});
  }
};
struct TakeGap : piko::Stage<0, 0, 64, Gap>, piko::Uses<State> {
  void process(const piko::List<Gap> &list) {
    int hash = 1;
    for (const Gap &g : list)
      hash = mix(hash, float(g.value)) * 7 + g.kind * 3 + g.last;
    state().results[bin().index].hash = hash;
  }
};
struct Padded : piko::Pipe<State> {
  EmitGap first;
  TakeGap last;
  Padded() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

/// No whole words: lanes take turns.
struct Small {
  int16_t a, b, c;
};
struct EmitSmall : piko::Stage<0, 0, 64, Prim, Small> {
  void process(const Prim &p) {
    int r = piko::toInt(root(p.x, p.y) * 5);
    if (r & 1)
      emit(Small{int16_t(r), int16_t(p.z), int16_t(p.w)});
  }
};
struct TakeSmall : piko::Stage<0, 0, 64, Small>, piko::Uses<State> {
  void process(const piko::List<Small> &list) {
    int hash = 1;
    for (const Small &s : list)
      hash = hash * 31 + s.a + s.b * 3 + s.c * 5;
    state().results[bin().index].hash = hash;
  }
};
struct Short : piko::Pipe<State> {
  EmitSmall first;
  TakeSmall last;
  Short() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

// --- Several records of an iteration ----------------------------------------

struct Pair {
  int number;
  float value;
};
struct TakePairs : piko::Stage<0, 0, 64, Pair>, piko::Uses<State> {
  void process(const piko::List<Pair> &list) {
    int hash = 1;
    for (const Pair &p : list)
      hash = mix(hash, p.value) * 3 + p.number;
    state().results[bin().index].hash = hash;
  }
};
template <int most> struct EmitPairs : piko::Stage<0, 0, 64, Prim, Pair> {
  void process(const Prim &p) {
    float r = root(p.x, p.y);
    if (r > 200)
      emit(Pair{p.serial, r});
    if (most > 1)
      emit(Pair{-p.serial, r / 3});
    if (most > 2 && (p.z & 1))
      emit(Pair{p.z, r / 5});
    if (most > 3 && r < 300)
      emit(Pair{p.w, r / 7});
  }
};
template <int most> struct Pairs : piko::Pipe<State> {
  EmitPairs<most> first;
  TakePairs last;
  Pairs() {
    this->source(first);
    this->connect(first, 0, last);
    this->allocateForSource(this->state().results, 0);
  }
};
struct Two : Pairs<2> {};
struct Three : Pairs<3> {};
struct Four : Pairs<4> {};

struct Divide : piko::Stage<0, 0, 64, Prim, Pair, float, Pair> {
  void process(const Prim &p) {
    float r = root(p.x, p.y);
    if (r > 250)
      return emit(Pair{p.serial, r}, 0);
    if (p.z & 1)
      emit(r / 3, 1);
    emit(Pair{p.z, r / 5}, 2);
    if (r > 120)
      emit(Pair{p.w, r / 7}, 2);
  }
};
struct TakeOther : piko::Stage<0, 0, 64, float>, piko::Uses<State> {
  void process(const piko::List<float> &list) {
    int hash = 1;
    for (float value : list)
      hash = mix(hash, value);
    state().results[1].hash = hash;
  }
};
struct TakeThird : piko::Stage<0, 0, 64, Pair>, piko::Uses<State> {
  void process(const piko::List<Pair> &list) {
    int hash = 1;
    for (const Pair &p : list)
      hash = mix(hash, p.value) * 3 + p.number;
    state().results[2].hash = hash;
  }
};
struct Ports : piko::Pipe<State> {
  Divide first;
  TakePairs last;
  TakeOther other;
  TakeThird third;
  Ports() {
    source(first);
    connect(first, 0, last);
    connect(first, 1, other);
    connect(first, 2, third);
    allocateForSource(state().results, 0);
  }
};

struct Branch : piko::Stage<0, 0, 64, Prim, Pair> {
  void process(const Prim &p) {
    float r = root(p.x, p.y);
    switch (p.z & 7) {
    case 0:
      return;
    case 1:
      emit(Pair{p.serial, r});
      break;
    case 2:
    case 3:
      r = piko::sqrt(r) * 3 + 1;
      if (r > 20)
        emit(Pair{p.x, r});
      else
        r += 5;
      break;
    default:
      r *= 0.37f;
    }
    if (r > 30)
      emit(Pair{p.y, r / 2});
  }
};
struct Nested : piko::Pipe<State> {
  Branch first;
  TakePairs last;
  Nested() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

/// As many as an iteration says: lanes take turns.
struct Repeat : piko::Stage<0, 0, 64, Prim, Pair> {
  void process(const Prim &p) {
    float r = root(p.x, p.y);
    for (int i = 0; i < (p.z & 7); ++i) {
      r = piko::sqrt(r * r + 2) + 0.25f;
      if ((p.w >> i & 3) != 0)
        emit(Pair{p.serial + i, r});
    }
  }
};
struct Looped : piko::Pipe<State> {
  Repeat first;
  TakePairs last;
  Looped() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

// --- Bins -------------------------------------------------------------------

struct Spot {
  glm::vec2 at;
  float radius;
  int serial;
  float weight;
};
struct Throw : piko::Stage<0, 0, 64, Prim, Spot> {
  void process(const Prim &p) {
    float r = root(p.x, p.y);
    if ((p.w & 7) != 0)
      emit(Spot{glm::vec2(p.x & 63, p.y & 63), float(p.z & 7), p.serial, r});
  }
};
inline int hashOf(const piko::List<Spot> &list) {
  int hash = 1;
  for (const Spot &s : list)
    hash = mix(hash, s.weight) * 3 + s.serial;
  return hash;
}
struct Catch : piko::Stage<8, 8, 64, Spot>, piko::Uses<State> {
  void assignBin(const Spot &s) { assignToBin(s, binFromPosition(s.at)); }
  void process(const piko::List<Spot> &list) {
    state().results[bin().index].hash = hashOf(list);
  }
};
struct Binned : piko::Pipe<State> {
  Throw first;
  Catch last;
  Binned() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

struct CatchAll : piko::Stage<8, 8, 64, Spot>, piko::Uses<State> {
  void assignBin(const Spot &s) {
    assignToBoundingBox(s, s.at - s.radius, s.at + s.radius);
  }
  void process(const piko::List<Spot> &list) {
    state().results[bin().index].hash = hashOf(list);
  }
};
struct Boxed : piko::Pipe<State> {
  Throw first;
  CatchAll last;
  Boxed() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

/// A bin gathers from others: positions are counted.
struct Move : piko::Stage<16, 16, 64, Spot, Spot> {
  void assignBin(const Spot &s) { assignToBin(s, binFromPosition(s.at)); }
  void process(const Spot &s) {
    Spot moved = s;
    moved.at = glm::vec2(63, 63) - s.at;
    moved.weight = piko::sqrt(s.weight + 1);
    if (moved.weight > 10)
      emit(moved);
    if (s.serial & 1)
      emit(s);
  }
};
struct Counted : piko::Pipe<State> {
  Throw first;
  Move second;
  Catch last;
  Counted() {
    source(first);
    connect(first, 0, second);
    connect(second, 0, last);
    allocateForSource(state().results, 0);
  }
};

struct Stay : piko::Stage<16, 16, 64, Spot, Spot> {
  void assignBin(const Spot &s) { assignToBin(s, binFromPosition(s.at)); }
  void process(const Spot &s) {
    Spot other = s;
    other.weight = piko::sqrt(s.weight + 1) / (s.radius + 1);
    if (other.weight > 3)
      emit(other);
  }
};
struct Gather : piko::Stage<16, 16, 64, Spot>, piko::Uses<State> {
  void assignBin(const Spot &s) { assignToPreviousBins(s); }
  void schedule(piko::BinId) { endBin(); }
  void process(const piko::List<Spot> &list) {
    state().results[bin().index].hash = hashOf(list);
  }
};
struct Local : piko::Pipe<State> {
  Throw first;
  Stay second;
  Gather last;
  Local() {
    source(first);
    connect(first, 0, second);
    connect(second, 0, last);
    allocateForSource(state().results, 0);
  }
};

struct CatchOutside : piko::Stage<1, 1, 64, Spot>, piko::Uses<State> {
  void assignBin(const Spot &s) {
    assignToBin(s, piko::BinId{s.serial == 777 ? 4096 : s.serial & 63});
  }
  void process(const piko::List<Spot> &list) {
    state().results[bin().index & 255].hash = hashOf(list);
  }
};
struct Outside : piko::Pipe<State> {
  Throw first;
  CatchOutside last;
  Outside() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};

// --- Loops ------------------------------------------------------------------

struct EmitRows : piko::Stage<0, 0, 64, Prim, Pair> {
  void process(const Prim &p) {
    parallelFor(p.x & 63, [&](int i) {
      float r = root(p.y + i, p.z);
      for (int j = 0; j < (p.w & 31); ++j) {
        float s = piko::sqrt(r + float(j) * 0.3f) / (float(j & 3) + 1);
        s = piko::sqrt(s + 0.7f) * s - r / (s + 3) + piko::sqrt(s * 3 + 1);
        if (s > 1)
          emit(Pair{i * 32 + j, s});
      }
    });
    for (int i = 0; i < (p.y & 63); ++i) {
      float r = root(p.y + i, p.z);
      r = piko::sqrt(r + 0.7f) * r - r / (r + 3) + piko::sqrt(r * 3 + 1);
      emit(Pair{p.serial, r});
    }
  }
};
struct Rows : piko::Pipe<State> {
  EmitRows first;
  TakePairs last;
  Rows() {
    source(first);
    connect(first, 0, last);
    allocateForSource(state().results, 0);
  }
};
