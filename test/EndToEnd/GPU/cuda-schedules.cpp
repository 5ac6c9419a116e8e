// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Schedules that depend on the bin, and on constants, in one submission.
// REQUIRES: all
// DEFINE: %{compare} = piko-compare %s --count 400 --domain 61 43 --runs 2 --threads 2 --target cuda --gpu-threads 32
// RUN: %compare_targets %s --cases %s --count 400 --domain 61 43 --runs 1
// CASE: --pipe Bins
// CASE: --pipe Lists
// CASE: --pipe Rounds
// RUN: export PIKO_TEST_DRIVER_COUNTS=1
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 %{compare} --pipe Bins 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Bins --count 2000 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_DEFER=1 %{compare} --pipe Lists 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Bins --strip 90 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=4 %{compare} --pipe Lists 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Lists --count 7 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Rounds 2>&1 | FileCheck %s
// CHECK-DAG: {{^equal$}}
// CHECK-DAG: host: 0 launches of kernels, 2 of graphs with {{[0-9]+}} kernels, {{[0-9]+}} copies, {{[0-9]+}} fills, 6 waits
//
// What a schedule says is checked as on a CPU.
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{compare} --pipe Wrong 2>&1 | FileCheck %s --check-prefix=WRONG
// WRONG: got: stage 'wrong', bin 3: expected a batch of at least 1, but got 0
#include "../Inputs/ports.h"

struct State {
  int turn = 3;
  piko::Image<float> image, sizes;
};

inline Point moved(const Point &p, int dx, int tag) {
  return {(p.x + dx) % 61, p.y % 43, p.value + float(dx), tag};
}

struct Blend : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y),
           [&](float &sum) { sum = sum * 0.75f + p.value; });
  }
};

struct Spread : piko::Stage<16, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 9, p.y + 9));
  }
  void schedule(piko::BinId bin) {
    switch ((bin.index + state().turn) % 5) {
    case 0:
      return specifySchedule(piko::LoadBalance);
    case 1:
      return specifySchedule(piko::DirectMap);
    case 2:
      return specifySchedule(piko::Serialize);
    case 3:
      return specifySchedule(piko::All, 1);
    default:
      return specifySchedule(piko::All, 7);
    }
  }
  void process(const Point &p) {
    emit(moved(p, int(bin().index) % 7, p.tag));
    if (p.tag % 3 == 0)
      emit(moved(p, 1, p.tag));
  }
};

struct Bins : piko::Pipe<State> {
  Spread spread;
  Blend blend;
  Bins() {
    source(spread);
    source(blend);
    connect(spread, 0, blend);
  }
};

// Batches of other sizes, and not all empty bins.
struct Gather : piko::Stage<16, 16, 64, Point, Point, Point>,
                piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 2, p.y));
  }
  void schedule(piko::BinId bin) {
    if (bin.index % 3 != 1)
      batch(bin.index * 2 + state().turn);
    if (bin.index % 2 == 0)
      everyBin();
    if (bin.index % 4 == 0)
      specifySchedule(piko::Serialize);
  }
  void process(const piko::List<Point> &list) {
    int size = int(list.size());
    update(state().sizes, binLo(),
           [&](float &sum) { sum = sum * 0.5f + float(size + 1); });
    if (size == 0)
      emit(Point{int(bin().index), 2, 4, 5}, 0);
    for (int i = 0; i < size; ++i)
      if (list[i].tag > 3)
        emit(moved(list[i], size % 5, list[i].tag / 2), 0);
      else
        emit(list[i], 1);
  }
};

struct Lists : piko::Pipe<State> {
  Gather gather;
  Blend blend;
  Lists() {
    source(gather);
    connect(gather, 0, blend);
    connect(gather, 1, blend);
  }
};

struct Rounds : piko::Pipe<State> {
  Gather gather;
  Spread spread;
  Blend blend;
  Rounds() {
    source(gather);
    connect(gather, 0, spread);
    connect(spread, 0, gather);
    connect(gather, 1, blend);
  }
};

struct Stop : piko::Stage<32, 32, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToAll(p); }
  void schedule(piko::BinId bin) { batch(3 - int(bin.index)); }
  void process(const piko::List<Point> &list) {
    int size = int(list.size());
    update(state().sizes, binLo(), [&](float &sum) { sum += float(size); });
  }
};

struct Wrong : piko::Pipe<State> {
  Stop wrong;
  Wrong() { source(wrong); }
};
