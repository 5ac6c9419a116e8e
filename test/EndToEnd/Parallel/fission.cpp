// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A stage with a loop, fed from a loop, runs after the stage that feeds it, from
// a list of the bin, also where primitives come in strips; and runs inside it
// where the order of what it emits would show, or where it only changes pixels.
// REQUIRES: all
// RUN: pikoc %s --pipe Chain --remarks --emit=kernels -o - 2>&1 | FileCheck %s --check-prefix=BEHIND
// BEHIND: remark: stage 'shade' takes what stage 'spread' emits in a loop from a list, as its own loops fill vectors there
// BEHIND: piko.schedule direct_map after
// BEHIND: piko.local_barrier @spread[0] -> @shade
// BEHIND: piko.strips
// RUN: pikoc %s --pipe Pixels --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=BEHIND-PIXELS
// BEHIND-PIXELS: remark: stage 'shade' takes what stage 'cover' emits in a loop from a list
// BEHIND-PIXELS: remark: stage 'shade' runs bin by bin after stage 'cover'
// RUN: pikoc %s --pipe Further,Merged,Whole --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=INSIDE
// INSIDE-COUNT-3: remark: stage 'shade' runs inside stage 'spread'
// INSIDE-NOT: remark: stage 'shade' runs inside stage 'spread'
//
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Chain --domain 67 35 --count 900
// CASE: --pipe Chain --domain 67 35 --count 900 --strip 50
// CASE: --pipe Pixels --domain 67 35 --count 300
// CASE: --pipe Pixels --domain 67 35 --count 300 --strip 20
// CASE: --pipe Further --domain 67 35 --count 900
// CASE: --pipe Merged --domain 67 35 --count 900
// CASE: --pipe Whole --domain 67 35 --count 300
// CASE: --pipe Waits --domain 67 35 --count 300 --strip 13
// CASE: --pipe Twice --domain 67 35 --count 3300 --budget 3000000
// RUN: piko-compare %s --pipe Chain --domain 67 35 --count 300 --runs 1 --without fuse-kernels | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Particle {
  int x, y;
  float value;
  int serial;
};
struct Splat {
  glm::ivec2 at;
  float value;
};
struct Shaded {
  glm::ivec2 at;
  float value, sum;
};
struct Pixel {
  float value = 0;
  int count = 0;
};
struct State {
  piko::Buffer<float> lights;
  piko::Image<Pixel> image, other;
};

template <int Bin>
struct Spread : piko::Stage<Bin, Bin, 64, Particle, Splat>, piko::Uses<State> {
  void assignBin(const Particle &p) {
    this->assignToBoundingBox(p, {p.x - 2, p.y - 2}, {p.x + 2, p.y + 2});
  }
  void schedule(piko::BinId) { this->specifySchedule(piko::DirectMap); }
  void process(const Particle &p) {
    glm::ivec2 lo = glm::max(this->binLo(), glm::ivec2(p.x, p.y) - 2),
               hi = glm::min(this->binHi() - 1, glm::ivec2(p.x, p.y) + 2);
    for (int y = lo.y; y <= hi.y; ++y)
      for (int x = lo.x; x <= hi.x; ++x)
        if ((x * 3 + y + p.serial) % 4 != 0)
          this->emit(Splat{{x, y}, p.value + float(x - p.x)}, 0);
  }
};

template <int Bin>
struct Shade : piko::Stage<Bin, Bin, 64, Splat, Shaded>, piko::Uses<State> {
  void assignBin(const Splat &s) {
    this->assignToBin(s, this->binFromPosition(s.at));
  }
  void process(const Splat &s) {
    float sum = 0;
    for (int64_t i = 0; i < this->state().lights.size() && i < 11; ++i)
      sum = sum * 0.5f + this->state().lights[i] * s.value;
    if (sum < 50)
      this->emit(Shaded{s.at, s.value, sum}, 0);
  }
};

// A kernel of its own, as any core may take the bin.
template <int Bin>
struct Blend : piko::Stage<Bin, Bin, 64, Shaded>, piko::Uses<State> {
  void assignBin(const Shaded &s) {
    this->assignToBin(s, this->binFromPosition(s.at));
  }
  void schedule(piko::BinId) { this->specifySchedule(piko::LoadBalance); }
  void process(const Shaded &s) {
    this->update(this->state().image, s.at, [&](Pixel &p) {
      p.value = p.value * 0.75f + s.sum - s.value;
      ++p.count;
    });
  }
};

template <int Bin, int LastBin = Bin> struct Pipeline : piko::Pipe<State> {
  Spread<Bin> spread;
  Shade<Bin> shade;
  Blend<LastBin> blend;
  Pipeline() {
    this->source(spread);
    this->connect(spread, 0, shade);
    this->connect(shade, 0, blend);
    this->allocateForSource(this->state().lights, 0);
  }
};
struct Chain : Pipeline<8> {};
// Bins of another size see the order of lineage.
struct Further : Pipeline<8, 16> {};
struct Whole : Pipeline<0> {};

// So does a stage that is fed by another, too.
struct Bright : piko::Stage<8, 8, 64, Particle, Shaded> {
  void assignBin(const Particle &p) {
    if (p.x >= 0 && p.y >= 0 && p.x < domain().x && p.y < domain().y)
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Particle &p) { emit(Shaded{{p.x, p.y}, p.value, 1}, 0); }
};
struct Merged : piko::Pipe<State> {
  Spread<8> spread;
  Shade<8> shade;
  Bright bright;
  Blend<8> blend;
  Merged() {
    source(spread);
    source(bright);
    connect(spread, 0, shade);
    connect(shade, 0, blend);
    connect(bright, 0, blend);
    allocateForSource(state().lights, 0);
  }
};

// From pixels in parallel.
struct Cover : piko::Stage<16, 16, 64, Particle, Splat>, piko::Uses<State> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, {p.x - 5, p.y - 3}, {p.x + 5, p.y + 3});
  }
  void process(const Particle &p) {
    parallelForPixels({p.x - 5, p.y - 3}, {p.x + 5, p.y + 3},
                      [&](glm::ivec2 at) {
                        if ((at.x ^ at.y ^ p.serial) & 1)
                          emit(Splat{at, p.value * float(at.y)}, 0);
                      });
  }
};
struct Pixels : piko::Pipe<State> {
  Cover cover;
  Shade<16> shade;
  Blend<16> blend;
  Pixels() {
    source(cover);
    connect(cover, 0, shade);
    connect(shade, 0, blend);
    allocateForSource(state().lights, 0);
  }
};

// What waits is fed by the stage after, from strip to strip.
struct Last : Blend<8> {
  void schedule(piko::BinId) {
    endBin();
    endStage<Shade<8>>();
  }
};
struct Waits : piko::Pipe<State> {
  Spread<8> spread;
  Shade<8> shade;
  Last last;
  Waits() {
    source(spread);
    connect(spread, 0, shade);
    connect(shade, 0, last);
    allocateForSource(state().lights, 0);
  }
};

// Only the stage after changes pixels, in a strip for which memory may run out.
struct Many : piko::Stage<8, 8, 64, Particle, Splat> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, {p.x - 2, p.y - 2}, {p.x + 2, p.y + 2});
  }
  void schedule(piko::BinId) { specifySchedule(piko::DirectMap); }
  void process(const Particle &p) {
    int count = p.serial < 3000 ? 1 : 1000;
    for (int k = 0; k < count; ++k)
      emit(Splat{binLo(), p.value + float(k)});
  }
};
struct Fork : piko::Stage<8, 8, 64, Splat, Shaded, Shaded> {
  void assignBin(const Splat &s) { assignToPreviousBins(s); }
  void process(const Splat &s) {
    float sum = 0;
    for (int i = 0; i < int(s.value) % 8; ++i)
      sum = sum * 0.5f + s.value;
    emit(Shaded{s.at, s.value, sum}, 1);
    emit(Shaded{s.at, s.value, sum}, 0);
  }
};
struct Count : piko::Stage<8, 8, 64, Shaded>, piko::Uses<State> {
  void assignBin(const Shaded &s) { assignToPreviousBins(s); }
  void process(const Shaded &s) {
    update(state().other, s.at, [&](Pixel &p) {
      p.value = p.value * 0.75f + s.sum;
      ++p.count;
    });
  }
};
struct Twice : piko::Pipe<State> {
  Many many;
  Fork fork;
  Count count;
  Blend<8> blend;
  Twice() {
    source(many);
    connect(many, 0, fork);
    connect(fork, 0, blend);
    connect(fork, 1, count);
    allocateForSource(state().lights, 0);
  }
};
