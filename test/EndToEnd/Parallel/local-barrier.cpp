// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages that wait for their bin, in the kernel of the stage that feeds them:
// lists, batches, empty bins, primitives after endBin, iterations that meet. A
// stage further on gets what two of them, and the first one, emit, in lineage
// order.
// REQUIRES: all
// RUN: pikoc %s --pipe Chain --emit=kernels --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=REMARK
// RUN: FileCheck %s --check-prefix=KERNEL --input-file=%t.mlir
// REMARK-DAG: local-barrier.cpp:[[#]]:{{[0-9]+}}: remark: stage 'sort' runs bin by bin after stage 'spread'
// REMARK-DAG: remark: stage 'pairs' runs bin by bin after stage 'sort'
// REMARK-DAG: remark: stage 'settle' runs bin by bin after stage 'pairs'
// KERNEL:      piko.process of @spread
// KERNEL:      piko.assign of @sort port 0
// KERNEL:      piko.assign of @join port 1
// KERNEL:      piko.local_barrier @spread[0] -> @sort
// KERNEL-NEXT: piko.process of @sort
// KERNEL:      piko.local_barrier @sort[0] -> @pairs
// KERNEL:      piko.local_barrier @pairs[0] -> @settle
// KERNEL:      piko.kernel @kernel_join
//
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Chain --domain 67 35 --count 2000
// CASE: --pipe Chain --domain 67 35 --count 0
// CASE: --pipe Chain --domain 67 35 --count 2000 --strip 7
// CASE: --pipe Lists --domain 67 35 --count 2000
// CASE: --pipe Serial --domain 67 35 --count 500
// CASE: --pipe Layers --domain 67 35 --count 10000 --budget 4000000
// RUN: piko-compare %s --pipe Chain --domain 67 35 --count 2000 --runs 1 --without fuse-kernels | FileCheck %s
// RUN: piko-compare %s --pipe Chain --domain 67 35 --count 2000 --runs 1 --without fuse-stages | FileCheck %s
// On a GPU what lies between two stages is the block's.
// RUN: piko-compare %s --pipe Chain --domain 67 35 --count 500 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 64 --gpu-seed 3 | FileCheck %s
// RUN: piko-compare %s --pipe Lists --domain 67 35 --count 300 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 32 | FileCheck %s
// RUN: piko-compare %s --pipe Serial --domain 67 35 --count 200 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 32 | FileCheck %s
// CHECK: equal
// RUN: pikoc %s --pipe Chain --emit=ptx --cpu=sm_90 | FileCheck %s --check-prefix=PTX
// PTX: .entry Chain_kernel_spread
// PTX: vote.sync.ballot.b32
// PTX: shfl.sync.idx.b32
//
// What lies between two stages does not fit a budget that it fits for one bin.
// RUN: not piko-compare %s --pipe Layers --domain 67 35 --count 10000 --runs 1 --budget 4000000 --without fuse-kernels 2>&1 | FileCheck %s --check-prefix=SMALL
// SMALL: out of memory
#include "../Inputs/ports.h"

struct Pixel {
  float sum = 0;
  int last = -1;
};
struct State {
  piko::Image<Pixel> image, joined;
  piko::Buffer<int> bins;
};

constexpr int size = 8;

struct Spread : piko::Stage<size, size, 64, Point, Point, Point>,
                piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBoundingBox(p, glm::ivec2(p.x, p.y),
                          glm::ivec2(p.x + 3, p.y + 3));
  }
  void process(const Point &p) {
    for (int y = glm::max(p.y, binLo().y); y < glm::min(p.y + 4, binHi().y);
         ++y)
      for (int x = glm::max(p.x, binLo().x); x < glm::min(p.x + 4, binHi().x);
           ++x) {
        emit({x, y, p.value * float(x + 1), p.tag}, 0);
        if ((p.tag + x) % 5 == 0)
          emit({x, y, p.value, p.tag + 100}, 1);
      }
  }
};

// The pixels of a bin, by value, those with an odd tag first.
struct Sort : piko::Stage<size, size, 64, Point, Point, Point>,
              piko::Uses<State> {
  void assignBin(const Point &p) {
    if (p.tag % 7 != 3) // may stay behind
      assignToPreviousBins(p);
  }
  void schedule(piko::BinId) { endBin(); }
  void process(const piko::List<Point> &list) {
    int n = int(list.size());
    parallelFor(n, [&](int i) {
      int rank = sort(list[i].value);
      const Point &p = list[rank];
      bool odd = p.tag % 2 != 0;
      int before = scan(int(odd), [](int a, int b) { return a + b; });
      emit({p.x, p.y, p.value * 0.5f, before + i}, 0);
      if (odd)
        emit({p.x, p.y, p.value, i}, 1);
    });
  }
};

struct Pairs : piko::Stage<size, size, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void schedule(piko::BinId) {
    batch(3);
    everyBin();
  }
  void process(const piko::List<Point> &list) {
    piko::atomicAdd(state().bins[bin().index], 1 + int(list.size()));
    float sum = 0;
    for (const Point &p : list)
      sum = sum * 0.5f + p.value;
    for (int64_t i = 0; i < list.size(); ++i)
      emit({list[i].x, list[i].y, sum, int(i)});
    if (list.size() == 0)
      emit({binLo().x, binLo().y, 1, 0});
  }
};

struct Settle : piko::Stage<size, size, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void schedule(piko::BinId) { endBin(); }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.5f + p.value;
      pixel.last = p.tag;
    });
    if (p.tag % 2 == 0)
      emit({p.x + 5, p.y, p.value, p.tag});
  }
};

struct Join : piko::Stage<16, 16, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    update(state().joined, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.75f + p.value;
      pixel.last = pixel.last * 3 + p.tag;
    });
  }
};

struct Chain : piko::Pipe<State> {
  Spread spread;
  Sort sort;
  Pairs pairs;
  Settle settle;
  Join join;
  Chain() {
    source(spread);
    connect(spread, 0, sort);
    connect(spread, 1, join);
    connect(sort, 0, pairs);
    connect(sort, 1, join);
    connect(pairs, 0, settle);
    connect(settle, 0, join);
  }
};

// A list in batches feeds others: a bin ends with its last batch.
struct Gather : piko::Stage<size, size, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 9, p.y));
  }
  void schedule(piko::BinId) { batch(4); }
  void process(const piko::List<Point> &list) {
    for (const Point &p : list) {
      glm::ivec2 at = glm::clamp(glm::ivec2(p.x, p.y), binLo(), binHi() - 1);
      emit({at.x, at.y, p.value, int(list.size())}, 0);
      emit({at.x, at.y, p.value, int(list.size())}, 1);
    }
  }
};
struct Lists : piko::Pipe<State> {
  Gather gather;
  Sort sort;
  Settle settle;
  Settle second;
  Join join;
  Lists() {
    source(gather);
    connect(gather, 0, sort);
    connect(gather, 1, settle);
    connect(sort, 0, second);
    connect(sort, 1, join);
    connect(settle, 0, join);
    connect(second, 0, join);
  }
};

// Each point covers the pixels of a bin, and all of a bin are composed at its end.
struct Cover : piko::Stage<size, size, 64, Point, Point> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    for (int y = binLo().y; y < binHi().y; ++y)
      for (int x = binLo().x; x < binHi().x; ++x)
        emit({x, y, p.value * float(y - p.y), p.tag});
  }
};
struct Compose : piko::Stage<size, size, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void process(const piko::List<Point> &list) {
    for (int64_t i = list.size(); i > 0; --i)
      update(state().image, glm::ivec2(list[i - 1].x, list[i - 1].y),
             [&](Pixel &pixel) {
               pixel.sum = pixel.sum * 0.5f + list[i - 1].value;
             });
  }
};
struct Layers : piko::Pipe<State> {
  Cover cover;
  Compose compose;
  Layers() {
    source(cover);
    connect(cover, 0, compose);
  }
};

// One thread runs all of the screen.
struct Whole : piko::Stage<0, 0, 64, Point, Point> {
  void schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  void process(const Point &p) {
    if (isOnScreen(p, domain()))
      emit(p);
  }
};
struct Last : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void schedule(piko::BinId) {
    specifySchedule(piko::Serialize);
    endBin();
  }
  void process(const piko::List<Point> &list) {
    for (int64_t i = list.size(); i > 0; --i)
      update(state().image, glm::ivec2(list[i - 1].x, list[i - 1].y),
             [&](Pixel &pixel) {
               pixel.sum = pixel.sum * 0.5f + list[i - 1].value;
             });
  }
};
struct Serial : piko::Pipe<State> {
  Whole whole;
  Last last;
  Serial() {
    source(whole);
    connect(whole, 0, last);
  }
};
