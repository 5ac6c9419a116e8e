// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops and rounds that a device repeats by itself, in the lineage order that
// the reference executor has: updates that do not commute show it.
// REQUIRES: all
// DEFINE: %{compare} = piko-compare %s --count 100 --domain 64 48 --runs 1 --threads 2 --target cuda --gpu-threads 64
// RUN: %compare_targets %s --cases %s --count 100 --domain 64 48 --runs 1
// CASE: --pipe Numbers
// CASE: --pipe Tree
// CASE: --pipe PingPong
// CASE: --pipe Chain
// CASE: --pipe Lists
// CASE: --pipe Turns
// CASE: --pipe Strips --strip 13
// RUN: export PIKO_TEST_DRIVER_COUNTS=1
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Numbers 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Tree 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 %{compare} --pipe PingPong 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 PIKO_CUDA_ALONE=0 %{compare} --pipe PingPong 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Chain 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Lists 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=4 %{compare} --pipe Turns 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=300 %{compare} --pipe Turns 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Chain --strip 40 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver %{compare} --pipe Strips --strip 13 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Strips --strip 13 2>&1 | FileCheck %s
// CHECK-DAG: {{^equal$}}
// CHECK-DAG: host: 0 launches of kernels, 1 of graphs with {{[0-9]+}} kernels, {{[0-9]+}} copies, 0 fills, 3 waits
//
// A driver without graphs gets the grids one by one, and waits for each wave.
// RUN: env PIKO_CUDA_DRIVER=%test_driver_11 %{compare} --pipe PingPong 2>&1 | FileCheck %s --check-prefix=OLD
// RUN: env PIKO_CUDA_DRIVER=%test_driver_11 %{compare} --pipe Turns 2>&1 | FileCheck %s --check-prefix=OLD
// So does one that refuses conditions.
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphAddNode:1:801 %{compare} --pipe Turns 2>&1 | FileCheck %s --check-prefix=OLD
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphInstantiateWithFlags:1:801 %{compare} --pipe Chain 2>&1 | FileCheck %s --check-prefix=OLD
// OLD-DAG: {{^equal$}}
// OLD-DAG: host: {{[0-9]+}} launches of kernels, 0 of graphs with 0 kernels, {{[0-9]+}} copies, 0 fills, {{[1-9][0-9]+}} waits
//
// A loop without an end is the error that a CPU reports.
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{compare} --pipe Numbers --loop-limit 5 2>&1 | FileCheck %s --check-prefix=HOPS
// RUN: env PIKO_CUDA_DRIVER=%test_driver not %{compare} --pipe Lists --loop-limit 1 2>&1 | FileCheck %s --check-prefix=ROUNDS
// HOPS: got: stage 'collatz', bin 0: a loop did not end within 5 hops
// ROUNDS: got: stage 'gather': a loop did not end within 1 rounds
//
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=much not %{compare} --pipe Lists 2>&1 | FileCheck %s --check-prefix=ALONE
// ALONE: PIKO_CUDA_ALONE: expected a number of at least 0, but got 'much'
//
// Any call may be what refuses them, and with any error but the loss of the device.
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphConditionalHandleCreate:1:999 %{compare} --pipe Chain 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuStreamGetCaptureInfo:2:999 %{compare} --pipe Chain 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphAddNode:2:999 %{compare} --pipe Chain 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuStreamUpdateCaptureDependencies:1:999 %{compare} --pipe Turns 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuStreamBeginCaptureToGraph:2:999 %{compare} --pipe Turns 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuStreamEndCapture:2:999 %{compare} --pipe Turns 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuGraphLaunch:1:999 %{compare} --pipe Chain 2>&1 | FileCheck %s --check-prefix=OLD --implicit-check-not="alive at the end"
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_FAIL=cuStreamEndCapture:2:719 not %{compare} --pipe Turns 2>&1 | FileCheck %s --check-prefix=FAILS
// FAILS-NOT: alive at the end
// FAILS: got: CUDA device 0 (Piko test device): {{.*}}a frame: CUDA_ERROR_LAUNCH_FAILED
// FAILS-NOT: alive at the end
#include "../Inputs/hops.h"

// Many hops, one child each, no bins.
struct Collatz : piko::Stage<0, 0, 64, Point, Point, Point> {
  void process(const Point &p) {
    if (p.tag <= 1)
      emit(p, 1);
    else
      emit(moved(p, 1, 0, p.value + 1,
                 p.tag % 2 == 0 ? p.tag / 2 : p.tag % 50 * 3 + 1),
           0);
  }
};
struct Numbers : piko::Pipe<State> {
  Collatz collatz;
  Blend blend;
  Numbers() {
    source(collatz);
    source(blend);
    connect(collatz, 0, collatz);
    connect(collatz, 1, blend);
  }
};

// A tree whose nodes lie in several bins, each of which emits for it.
struct Split : piko::Stage<16, 16, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - p.tag / 2, p.y),
                        glm::ivec2(p.x + p.tag / 3, p.y + p.tag / 4));
  }
  void process(const Point &p) {
    if (p.tag % 3 == 0)
      emit(moved(p, 3, 1, -p.value, p.tag), 1);
    for (int i = 0; i < p.tag % 4; ++i)
      if (p.tag > 4)
        emit(moved(p, 5 * i, i, p.value + i, p.tag / 3), 0);
      else
        emit(moved(p, i, i, p.value - i, p.tag), 1);
    if (p.tag % 5 == 1)
      emit(p, 1);
  }
};
struct Tree : piko::Pipe<State> {
  Split split;
  Blend blend;
  Tree() {
    source(split);
    connect(split, 0, split);
    connect(split, 1, blend);
  }
};

struct PingPong : piko::Pipe<State> {
  Ping ping;
  Pong pong;
  Shift shift;
  Blend blend;
  PingPong() {
    source(ping);
    source(shift);
    connect(ping, 0, pong);
    connect(pong, 0, ping);
    connect(ping, 1, blend);
    connect(pong, 1, blend);
    connect(ping, 2, shift);
    connect(pong, 2, shift);
    connect(shift, 0, blend);
  }
};

// What leaves one loop comes into another.
struct Chain : piko::Pipe<State> {
  Collatz collatz;
  Split split;
  Shift shift;
  Blend blend;
  Chain() {
    source(collatz);
    source(split);
    connect(collatz, 0, collatz);
    connect(collatz, 1, split);
    connect(split, 0, split);
    connect(split, 1, shift);
    connect(shift, 0, blend);
  }
};

// Lists in rounds; empty bins are called in the first one alone.
struct Gather : piko::Stage<16, 16, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 2, p.y), glm::ivec2(p.x, p.y));
  }
  void schedule(piko::BinId) {
    everyBin();
    batch(7);
  }
  void process(const piko::List<Point> &list) {
    if (list.size() == 0)
      emit(Point{int(bin().index) * 5 % 64, int(bin().index) % 48, 3, 9}, 0);
    parallelFor(int(list.size()), [&](int i) {
      const Point &p = list[i];
      if (p.tag > 3)
        emit(moved(p, i % 3, 1, p.value, p.tag / 3), 0);
      emit(moved(p, 0, i % 5, p.value * 0.5f, p.tag), 1);
    });
  }
};
struct Lists : piko::Pipe<State> {
  Gather gather;
  Blend blend;
  Lists() {
    source(gather);
    connect(gather, 0, gather);
    connect(gather, 1, blend);
  }
};

// Two stages collect in turn; between them, a loop and a stage that is none.
struct Turns : piko::Pipe<State> {
  Gather gather;
  Merge merge;
  Collatz collatz;
  Shift shift;
  Blend blend;
  Turns() {
    source(gather);
    source(shift);
    source(blend);
    connect(gather, 0, collatz);
    connect(collatz, 0, collatz);
    connect(collatz, 1, shift);
    connect(gather, 1, merge);
    connect(shift, 0, merge);
    connect(merge, 0, gather);
    connect(merge, 1, blend);
  }
};

// A source in strips, through rounds; what leaves them waits for a stage that
// collects.
struct Strips : piko::Pipe<State> {
  Shift shift;
  Split split;
  Merge merge;
  Blend blend;
  Strips() {
    source(shift);
    source(blend);
    connect(shift, 0, split);
    connect(split, 0, split);
    connect(split, 1, merge);
    connect(merge, 0, merge);
    connect(merge, 1, blend);
  }
};
