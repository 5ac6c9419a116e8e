// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is kept for a pixel is the last primitive's, however lanes come to it: in
// two branches, in loops, at neighbouring pixels, in iterations that meet; and
// what decides whether it is read decides that still.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Branches --domain 64 64 --count 3000
// CASE: --pipe Iterations --domain 64 64 --count 2000
// CASE: --pipe Boxes --domain 64 64 --count 3000
// CASE: --pipe Loops --domain 32 32 --count 3000
// CASE: --pipe Neighbours --domain 64 48 --count 50
// CASE: --pipe Stores --domain 20 9 --count 900
// CASE: --pipe Guarded --domain 40 40 --count 300
// CASE: --pipe Bytes --domain 40 40 --count 300
// CASE: --pipe Large --domain 40 40 --count 300
//
// RUN: pikoc %s --pipe Boxes,Neighbours,Loops,Bytes --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=ONCE
// ONCE-COUNT-4: remark: what is written to 'color' is computed once for each pixel
// ONCE-NOT: remark: what is written to 'color' is computed once for each pixel
#include <piko.h>

#include <cmath>
#include <cstdint>

struct Particle {
  int x, y;
  float value;
  int serial;
};
struct Color {
  float r = 0.5f, g = 0, b = 0;
};
struct Pixel {
  float z = 1000, light = 0;
};
struct State {
  piko::Buffer<float> lights, seen;
  piko::Image<Color> color;
  piko::Image<Pixel> image;
};

template <class S> struct Alone : piko::Pipe<State> {
  S stage;
  Alone() {
    source(stage);
    allocateForSource(state().lights, 0);
    allocateForSource(state().seen, 0);
  }
};

template <int Bin = 16>
struct Points : piko::Stage<Bin, Bin, 64, Particle>, piko::Uses<State> {
  void assignBin(const Particle &p) {
    if (p.x >= 0 && p.y >= 0 && p.x < this->domain().x &&
        p.y < this->domain().y)
      this->assignToBin(p, this->binFromPosition(glm::ivec2(p.x, p.y)));
  }
  float sum(float v) {
    float s = v;
    for (int64_t k = 0; k < this->state().lights.size() && k < 9; ++k)
      s = s * 0.5f + this->state().lights[k] / float(k + 1);
    return s;
  }
  void paint(glm::ivec2 at, Color color) {
    this->update(this->state().color, at, [&](Color &c) { c = color; });
  }
};

struct BranchesStage : Points<> {
  void process(const Particle &p) {
    float key = 0;
    for (int k = 1; k < 40; ++k)
      key += piko::sin(p.value * float(k)) / float(k);
    if (key > 0.5f)
      paint({p.x, p.y}, {sum(p.value), float(p.serial), p.value});
    else
      paint({p.x, p.y}, {sum(p.value * 2), key, p.value * 3});
  }
};
struct Branches : Alone<BranchesStage> {};

struct IterationsStage : Points<> {
  void process(const Particle &p) {
    parallelFor(p.serial % 30 + 5, [&](int i) {
      float key = 0;
      for (int k = 1; k < 20; ++k)
        key += piko::sin(p.value * float(k) + float(i)) / float(k);
      if (key > 0.5f)
        paint({p.x, p.y}, {sum(p.value), float(p.serial), float(i)});
      else
        paint({p.x, p.y}, {sum(p.value * 2), key, float(i)});
    });
  }
};
struct Iterations : Alone<IterationsStage> {};

struct BoxesStage : Points<> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y) + 1);
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Particle &p) {
    parallelForPixels({p.x, p.y}, {p.x + 1, p.y + 1}, [&](glm::ivec2 at) {
      paint(at, {sum(p.value), float(p.serial), 1});
    });
  }
};
struct Boxes : Alone<BoxesStage> {};

struct LoopsStage : Points<> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Particle &p) {
    for (int i = 0; i < p.serial % 5; ++i) {
      float light = sum(p.value + float(i));
      if ((p.serial + i) % 3)
        paint({p.x, p.y}, {light, float(p.serial), float(i)});
    }
  }
};
struct Loops : Alone<LoopsStage> {};

struct NeighboursStage : Points<> {
  void assignBin(const Particle &p) { assignToAll(p); }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Particle &p) {
    parallelForPixels([&](glm::ivec2 at) {
      if (at.x + 1 >= binHi().x)
        return;
      paint(at, {sum(p.value), p.value, 1});
      paint({at.x + 1, at.y}, {sum(p.value + float(at.x)), p.value * 2, 2});
    });
  }
};
struct Neighbours : Alone<NeighboursStage> {};

// What is read is stored to after it, by the same update.
struct StoresStage : Points<8> {
  void process(const Particle &p) {
    update(state().image, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      if (p.value >= pixel.z)
        return;
      float was = state().seen[p.serial];
      state().seen[p.serial] = p.value + 7;
      pixel.z = p.value;
      pixel.light = sum(was + p.value);
    });
  }
};
struct Stores : Alone<StoresStage> {};

// An element that only iterations of the loop may read.
struct Element {
  int x, y;
  float value;
  int serial, index;
  float weights[4];
};
struct GuardedStage : piko::Stage<8, 8, 64, Element>, piko::Uses<State> {
  void assignBin(const Element &e) {
    if (e.x >= 0 && e.y >= 0 && e.x < domain().x && e.y < domain().y)
      assignToBin(e, binFromPosition(glm::ivec2(e.x, e.y)));
  }
  void process(const Element &e) {
    int far = e.index * 40000000;
    int turns = far >= 0 && far < 4 ? 9 : 0;
    float s = e.value;
    for (int k = 0; k < turns; ++k)
      s = s * 0.5f + std::sqrt(std::abs(s * k + e.weights[far])) / (k + 1);
    update(state().color, {e.x, e.y}, [&](Color &c) { c.r = s; });
  }
};
struct Guarded : piko::Pipe<State> {
  GuardedStage stage;
  Guarded() { source(stage); }
};

// Coordinates of few bits, which are numbers of the colour, too.
struct Small {
  int8_t x;
  int16_t y;
  float value;
};
template <int Bin>
struct SmallStage : piko::Stage<Bin, Bin, 64, Small>, piko::Uses<State> {
  void assignBin(const Small &p) {
    if (p.x >= 0 && p.y >= 0 && p.x < this->domain().x &&
        p.y < this->domain().y)
      this->assignToBin(p, this->binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Small &p) {
    float s = float(p.x) + p.value;
    for (int k = 0; k < 9; ++k)
      s = s * 0.5f + std::sqrt(std::abs(s * float(p.x) + float(p.y))) / (k + 1);
    this->update(this->state().color, glm::ivec2(p.x, p.y),
                 [&](Color &c) { c = {s, p.value, float(p.y)}; });
  }
};
template <int Bin> struct SmallPipe : piko::Pipe<State> {
  SmallStage<Bin> stage;
  SmallPipe() { this->source(stage); }
};
struct Bytes : SmallPipe<8> {};
struct Large : SmallPipe<(1 << 30)> {};
