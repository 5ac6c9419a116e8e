// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What primitives overwrite in a bin that is the whole domain is computed once for
// each pixel, by a kernel of its own, and is what the reference executor computes:
// the texts are those of defer-shading.cpp, and some more.
// REQUIRES: all
// RUN: sed -n 's|^// CASE: ||p' %S/defer-shading.cpp > %t.cases
// RUN: sed -n 's|^// MORE: ||p' %s >> %t.cases
// RUN: %compare_targets %s --cases %t.cases --runs 1 --threads 1 3 > %t.out
// RUN: not grep blank %t.out
// RUN: piko-compare %s --cases %t.cases --runs 1 --threads 2 --without reduce-updates | FileCheck %s --check-prefix=EQUAL
// RUN: piko-compare %s --pipe Loops --domain 45 37 --count 300 --runs 1 --threads 2 --strip 7 | FileCheck %s --check-prefix=STRIPS
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe Nearest --domain 45 37 --count 300 --runs 1 --target cuda --strip 7 | FileCheck %s --check-prefix=STRIPS
// STRIPS: {{^equal$}}
// EQUAL-COUNT-22: {{^equal$}}
// MORE: --pipe Line --domain 300 --count 500
// MORE: --pipe Box --domain 20 11 7 --count 500
// MORE: --pipe Bands --domain 45 37 --count 300
// MORE: --pipe Pattern --domain 45 37 --count 300
// MORE: --pipe Twice --domain 45 37 --count 300
// MORE: --pipe Later --domain 45 37 --count 300
// MORE: --pipe Loops --domain 45 37 --count 300
// MORE: --pipe Reads --domain 45 37 --count 300
// MORE: --pipe Splats --domain 45 37 --count 9000
//
// What would fail for a hidden pixel fails all the same.
// RUN: not piko-compare %s --pipe Fails --domain 45 37 --count 300 --runs 1 --threads 1 2 | FileCheck %s --check-prefix=FAILS
// FAILS: 1 threads, run 0: got: stage 'stage', bin 0: expected an index into 'lights' in [0, 300), but got 300
// FAILS: 2 threads, run 0: got: stage 'stage', bin 0: expected an index into 'lights' in [0, 300), but got 300
//
// RUN: pikoc %s --pipe Nearest,OneRecord,TwoWays,Kinds,Line,Bands,Loops,Splats --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=ONCE
// ONCE-COUNT-8: remark: what is written to '{{color|image|line}}' is computed once for each pixel, by a kernel after that of stage
// ONCE-NOT: remark: what is written to '{{color|image|line}}' is computed once for each pixel, by a kernel after that of stage
// RUN: pikoc %s --pipe Picture --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=READ
// READ: remark: what is written to 'color' is computed also where it is overwritten
// READ: note: the index of this read is not proved to be inside, and would not be tested where it is overwritten
// RUN: pikoc %s --pipe Reads --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=OFTEN
// OFTEN-NOT: is computed once for each pixel
#define WHOLE true
#include "defer-shading.cpp"

template <int Rank> struct Field {
  piko::Buffer<float> lights;
  piko::Image<float, Rank> depth, line;
};

/// Of one and three dimensions.
template <int Rank, class Bins>
struct FieldStage : piko::BasicStage<Bins, 64, Particle>,
                    piko::Uses<Field<Rank>> {
  void process(const Particle &p) {
    glm::vec<Rank, int> at;
    for (int d = 0; d < Rank; ++d)
      at[d] = d % 2 ? p.y : p.x;
    this->parallelForPixels(at - 2, at + 2, [&](glm::vec<Rank, int> q) {
      float z = p.value + float(q[0] % 3);
      bool passed = false;
      this->update(this->state().depth, q, [&](float &most) {
        passed = z > most;
        if (passed)
          most = z;
      });
      if (!passed)
        return;
      float sum = z;
      for (int64_t i = 0; i < this->state().lights.size() && i < 11; ++i)
        sum +=
            std::sqrt(std::abs(this->state().lights[i])) * float(q[Rank - 1]);
      this->update(this->state().line, q, [&](float &c) { c = sum; });
    });
  }
};
template <int Rank, class Bins> struct FieldPipe : piko::Pipe<Field<Rank>> {
  FieldStage<Rank, Bins> stage;
  FieldPipe() {
    this->source(stage);
    this->allocateForSource(this->state().lights, 0);
  }
};
struct Line : FieldPipe<1, piko::Bins<0>> {};
struct Box : FieldPipe<3, piko::Bins<0, 0, 0>> {};

// A bin that is the whole domain in one dimension alone.
struct BandsStage : piko::Stage<0, 8, 64, Particle>, piko::Uses<State> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y) - 3, glm::ivec2(p.x, p.y) + 3);
  }
  void process(const Particle &p) {
    parallelForPixels(
        glm::ivec2(p.x, p.y) - 3, glm::ivec2(p.x, p.y) + 3, [&](glm::ivec2 at) {
          float sum = p.value + float(binLo().y + bin().index);
          for (int k = 0; k < at.x + 3; ++k)
            sum = std::sqrt(sum * sum + float(p.serial + binHi().y)) / 3;
          update(state().color, at, [&](Color &c) { c.b = sum; });
        });
  }
};
struct Bands : Alone<BandsStage> {};

// Nothing is kept: a colour is of the pixel alone.
struct PatternStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      if (!covers(p, at))
        return;
      float re = 0, im = 0;
      for (int i = 0; i < 30 && re * re + im * im < 4; ++i) {
        float next = re * re - im * im + float(at.x) / 30 - 1;
        im = 2 * re * im + float(at.y) / 30;
        re = next;
      }
      update(state().color, at, [&](Color &c) { c = {re, im, 1}; });
    });
  }
};
struct Pattern : Alone<PatternStage> {};

// Two stages paint the same image, one after the other; a third reads it.
struct Over : NearestStage {
  void schedule(piko::BinId) { endStage<NearestStage>(); }
  void process(const Particle &p) {
    if (p.serial % 3 == 0)
      NearestStage::process({p.x + 2, p.y, p.value * 2, p.serial});
  }
};
struct Copy : Discs<> {
  void schedule(piko::BinId) { endStage<Over>(); }
  void process(const Particle &p) {
    glm::ivec2 at =
        glm::clamp(glm::ivec2(p.x, p.y), glm::ivec2(0), domain() - 1);
    Color seen = state().color(at);
    update(state().other, at, [&](Color &c) { c.g += seen.r + seen.b; });
  }
};
struct Twice : piko::Pipe<State> {
  NearestStage stage;
  Over over;
  Copy copy;
  Twice() {
    source(stage);
    source(over);
    source(copy);
    allocateForSource(state().lights, 0);
  }
};

// Part of the pixel is painted, the rest counted by another stage.
struct CountStage : Discs<> {
  void schedule(piko::BinId) { endStage<OneRecordStage>(); }
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      update(state().image, at, [&](Pixel &pixel) {
        pixel.count = pixel.count * 3 + int(pixel.color.r) % 7 + p.serial;
      });
    });
  }
};
struct Later : piko::Pipe<State> {
  OneRecordStage stage;
  CountStage count;
  Later() {
    source(stage);
    source(count);
    allocateForSource(state().lights, 0);
  }
};

// A stage on a cycle is launched for each wave.
struct LoopsStage : piko::Stage<0, 0, 64, Particle, Particle>,
                    piko::Uses<State> {
  void process(const Particle &p) {
    parallelForPixels(glm::ivec2(p.x, p.y) - 3, glm::ivec2(p.x, p.y) + 3,
                      [&](glm::ivec2 at) {
                        float sum = p.value;
                        for (int k = 0; k < at.x + 3; ++k)
                          sum = std::sqrt(sum * sum + float(p.serial)) / 3;
                        update(state().color, at, [&](Color &c) { c.b = sum; });
                      });
    if (p.serial % 4 > 1)
      emit(Particle{p.y, p.x, p.value / 2, p.serial / 2}, 0);
  }
};
struct Loops : piko::Pipe<State> {
  LoopsStage stage;
  Loops() {
    source(stage);
    connect(stage, 0, stage);
    allocateForSource(state().lights, 0);
  }
};

// What it is computed from changes meanwhile.
struct ReadsStage : Discs<> {
  void schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float sum = p.value;
      for (int k = 0; k < 9; ++k)
        sum = sum * 0.5f + state().depth(at) * float(k);
      update(state().color, at, [&](Color &c) { c.r = sum; });
      update(state().depth, at, [&](float &d) { d += 1; });
    });
  }
};
struct Reads : Alone<ReadsStage> {};

// A point each, without a loop over pixels.
struct SplatsStage : piko::Stage<0, 0, 64, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    glm::ivec2 at(p.x, p.y);
    if (at.x < 0 || at.y < 0 || at.x >= domain().x || at.y >= domain().y)
      return;
    if (!update(state().depth, at, [&](float &most) {
          bool nearer = p.value > most;
          most = nearer ? p.value : most;
          return nearer;
        }))
      return;
    float light = 0;
    for (int64_t i = 0; i < state().lights.size() && i < 20; ++i)
      light += state().lights[i] / (1 + p.value * p.value);
    update(state().color, at,
           [&](Color &c) { c = {light, p.value, float(p.serial)}; });
  }
};
struct Splats : Alone<SplatsStage> {};

// Reads after a buffer's end, of primitives that others hide.
struct FailsStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float sum = 0;
      for (int64_t i = 0; i < 5; ++i)
        sum += state().lights[i + p.serial];
      update(state().color, at, [&](Color &c) { c.r = sum; });
    });
  }
};
struct Fails : Alone<FailsStage> {};
