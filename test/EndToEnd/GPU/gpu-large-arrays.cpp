// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Arrays of a phase that threads of a block share, and for which shared memory
// has no room.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Wide --count 700 --domain 40 30
// CASE: --pipe Two --count 700 --domain 40 30
// CASE: --pipe Ofeach --count 60 --domain 40 30
// CASE: --pipe Records --count 300 --domain 40 30
// CASE: --pipe Across --count 700 --domain 40 30
// RUN: %if all %{ env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --cases %s --gpu-threads 8 --target cuda --runs 1 --threads 2 | FileCheck %s %}
// CHECK: equal
#include "../Inputs/ports.h"

struct Pixel {
  float sum = 0;
};
struct State {
  piko::Image<Pixel> image;
};
using Base = piko::Stage<16, 16, 64, Point>;

struct Binned : Base, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void add(const Point &p, float value) {
    update(state().image, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.5f + value; });
  }
};

struct WideStage : Binned {
  void process(const piko::List<Point> &list) {
    float table[9000];
    int count = int(list.size());
    parallelFor(9000, [&](int i) { table[i] = float(i % 7) + float(count); });
    for (int i = 0; i < count; ++i)
      add(list[i], table[(list[i].tag & 1023) * 7 + 5]);
  }
};

/// The first has room, the second one not.
struct TwoStage : Binned {
  void process(const piko::List<Point> &list) {
    int first[4000];
    double second[3000];
    parallelFor(4000, [&](int i) { first[i] = i * 3; });
    parallelFor(3000, [&](int i) { second[i] = first[i] + 0.25; });
    for (const Point &p : list)
      add(p, float(second[(p.tag & 1023) + first[1] % 2]));
  }
};

struct OfeachStage : Binned {
  void process(const Point &p) {
    int own[7000];
    parallelFor(7000, [&](int i) { own[i] = (i ^ p.tag) & 255; });
    int sum = 0;
    for (int i = 0; i < 7000; i += 61)
      sum += own[i];
    add(p, float(sum));
  }
};

struct RecordsStage : Binned {
  struct Entry {
    float key;
    int place;
  };
  void process(const piko::List<Point> &list) {
    Entry entries[4096];
    int count = int(list.size()) < 4096 ? int(list.size()) : 4096;
    parallelFor(count, [&](int i) { entries[i] = {list[i].value * 2, i}; });
    for (int i = count - 1; i >= 0; --i)
      add(list[entries[i].place], entries[i].key);
  }
};

struct AcrossStage : Binned {
  void process(const piko::List<Point> &list) {
    float shared[8000];
    int count = int(list.size());
    parallelFor(count, [&](int i) {
      shared[i] = list[i].value;
      sync();
      float next = shared[(i + 1) % count];
      sync();
      shared[i] = next + float(i);
    });
    for (int i = 0; i < count; ++i)
      add(list[i], shared[i]);
  }
};

template <class S> struct Of : piko::Pipe<State> {
  S stage;
  Of() { source(stage); }
};
struct Wide : Of<WideStage> {};
struct Two : Of<TwoStage> {};
struct Ofeach : Of<OfeachStage> {};
struct Records : Of<RecordsStage> {};
struct Across : Of<AcrossStage> {};
