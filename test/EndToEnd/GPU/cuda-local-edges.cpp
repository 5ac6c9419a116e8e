// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What stages after local edges emit, and the one before them, is merged
// with others by its lineage, in one submission.
// REQUIRES: all
// DEFINE: %{compare} = piko-compare %s --count 300 --domain 67 35 --runs 2 --threads 2 --target cuda --gpu-threads 64
// RUN: pikoc %s --pipe Layers --emit=kernels | FileCheck %s --check-prefix=KERNEL
// KERNEL-DAG: piko.local_barrier @spread[0] -> @sort
// KERNEL-DAG: piko.local_barrier @sort[0] -> @settle
//
// RUN: %compare_targets %s --pipe Layers --count 300 --domain 67 35 --runs 1 | FileCheck %s --check-prefix=EQUAL
// EQUAL: {{^equal}}
// RUN: export PIKO_TEST_DRIVER_COUNTS=1
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 %{compare} --pipe Layers 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Layers --count 900 1 40 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Layers --count 0 30 0 2>&1 | FileCheck %s
// CHECK-DAG: {{^equal$}}
// CHECK-DAG: host: 0 launches of kernels, 2 of graphs with {{[0-9]+}} kernels, {{[0-9]+}} copies, {{[0-9]+}} fills, 4 waits
#include "../Inputs/ports.h"

struct State {
  piko::Image<float> image;
};

struct Spread : piko::Stage<8, 8, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 3, p.y + 3));
  }
  void process(const Point &p) {
    for (int y = glm::max(p.y, binLo().y); y < glm::min(p.y + 3, binHi().y);
         ++y)
      for (int x = glm::max(p.x, binLo().x); x < glm::min(p.x + 3, binHi().x);
           ++x) {
        if ((p.tag + x) % 5 == 0)
          emit({x, y, p.value, p.tag + 100}, 1);
        emit({x, y, p.value * float(x + 1), p.tag + x}, 0);
      }
  }
};

// Those with an odd tag first.
struct Sort : piko::Stage<8, 8, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    if (p.tag % 7 != 3) // may stay behind
      assignToPreviousBins(p);
  }
  void schedule(piko::BinId) {
    endBin();
    everyBin();
  }
  void process(const piko::List<Point> &list) {
    int size = int(list.size());
    if (size == 0)
      emit({binLo().x, binLo().y, 2, 9}, 1);
    for (int odd = 1; odd >= 0; --odd)
      for (int i = 0; i < size; ++i)
        if ((list[i].tag & 1) == odd) {
          emit({list[i].x, list[i].y, list[i].value, list[i].tag + i}, 0);
          if (i % 3 == 0)
            emit(list[i], 1);
        }
  }
};

struct Settle : piko::Stage<8, 8, 64, Point, Point> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void schedule(piko::BinId) { endBin(); }
  void process(const Point &p) {
    if (p.tag % 4 != 1)
      emit({p.x, p.y, p.value + 1, p.tag});
  }
};

struct Blend : piko::Stage<16, 16, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y),
           [&](float &sum) { sum = sum * 0.75f + p.value; });
  }
};

// Its own emissions need the keys of what comes in.
struct Shift : piko::Stage<32, 8, 64, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 2, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    emit({(p.x + 5) % 67, (p.y + int(bin().index)) % 35, p.value, p.tag});
  }
};

struct Layers : piko::Pipe<State> {
  Spread spread;
  Sort sort;
  Settle settle;
  Shift shift;
  Blend blend;
  Layers() {
    source(spread);
    source(shift);
    source(blend);
    connect(spread, 0, sort);
    connect(spread, 1, shift);
    connect(sort, 0, settle);
    connect(sort, 1, shift);
    connect(settle, 0, shift);
    connect(shift, 0, blend);
  }
};
