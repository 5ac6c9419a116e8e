// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Units of very unlike work: with LoadBalance a block takes the next one when it
// has ended its own, whether one at a time or several; with DirectMap block b of n
// has the units b, b + n, .., among which here are all that take long. Results are
// the same, and the longest of the blocks is shorter. There are as many as are
// resident, on one multiprocessor four.
// REQUIRES: all
// DEFINE: %{cuda} = --target cuda --runs 1 --threads 2 --domain 8192 --count 9000
// RUN: %compare_targets %s --cases %s --domain 8192 --count 900 --runs 1
// CASE: --pipe Balanced
// CASE: --pipe Mapped
// CASE: --pipe Emitted
// RUN: export PIKO_CUDA_DRIVER=%test_driver
// RUN: export PIKO_TEST_DRIVER_MULTIPROCESSORS=1
// RUN: env PIKO_TEST_DRIVER_COUNTS=%t.balanced piko-compare %s --pipe Balanced %{cuda} | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_COUNTS=%t.mapped piko-compare %s --pipe Mapped %{cuda} | FileCheck %s
// RUN: %python -c 'import json, sys; a, b = (json.load(open(f))["kernels"] for f in sys.argv[1:]); assert 3 * a["Balanced_kernel_stage"]["longestWarps"] < b["Mapped_kernel_stage"]["longestWarps"], (a, b)' %t.balanced %t.mapped
// RUN: env PIKO_TEST_DRIVER_SEED=4 piko-compare %s --pipe Balanced %{cuda} | FileCheck %s
// What is emitted is in the order of units, whoever runs them.
// RUN: piko-compare %s --pipe Emitted %{cuda} | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=5 piko-compare %s --pipe Emitted %{cuda} --strip 1500 | FileCheck %s
// The emulator's blocks, each after the other, of a grid that has fewer than units.
// RUN: piko-compare %s --pipe Balanced --domain 8192 --count 900 --runs 1 --target gpu-on-cpu --gpu-threads 32 --gpu-blocks 3 | FileCheck %s
// RUN: piko-compare %s --pipe Emitted --domain 8192 --count 900 --runs 1 --target gpu-on-cpu --gpu-threads 32 --gpu-blocks 7 --gpu-seed 3 | FileCheck %s
// RUN: piko-compare %s --pipe Mapped --domain 8192 --count 900 --runs 1 --target gpu-on-cpu --gpu-threads 32 --gpu-blocks 3 | FileCheck %s
// Kernels with a second launch, which has a counter of its own.
// RUN: piko-compare %S/gpu-rare-rounds.cpp --pipe Ordered --count 900 --runs 1 --target gpu-on-cpu --gpu-threads 32 --gpu-blocks 2 | FileCheck %s
// RUN: piko-compare %S/gpu.cpp --pipe Boxes --count 600 --runs 1 --target gpu-on-cpu --gpu-threads 32 --gpu-blocks 2 | FileCheck %s
// CHECK: {{^equal$}}
// RUN: pikoc %s --pipe Mapped --explain --target cuda | FileCheck %s --check-prefix=EXPLAIN
// EXPLAIN: Units of work, of n blocks that fill the device:
// EXPLAIN-NEXT: source_0_stage: block b takes the units b, b + n, ..
// EXPLAIN-NEXT: kernel_stage: block b takes the units b, b + n, ..
#include <piko.h>

struct Item {
  int serial;
};
struct Sum {
  unsigned value = 0;
};
struct State {
  piko::Buffer<unsigned> sums;
  piko::Image<Sum, 1> last;
};

inline int binOf(const Item &i) { return i.serial & 2047; }

/// A chain of steps, long in every 32nd bin.
inline unsigned work(const Item &i) {
  unsigned value = i.serial;
  int turns = binOf(i) % 32 == 0 ? 2000 : 1;
  for (int turn = 0; turn < turns; ++turn)
    value = value * 1664525u + 1013904223u;
  return value;
}

template <class Self, class... Outputs>
struct Works : piko::BasicStage<piko::Bins<4>, 64, Item, Outputs...>,
               piko::Uses<State> {
  void assignBin(const Item &i) { this->assignToBin(i, piko::BinId{binOf(i)}); }
};

struct Balance : Works<Balance> {
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }
  void process(const Item &i) {
    piko::atomicAdd(state().sums[binOf(i) & 63], work(i));
  }
};
struct Balanced : piko::Pipe<State> {
  Balance stage;
  Balanced() { source(stage); }
};

struct Map : Works<Map> {
  void schedule(piko::BinId) { specifySchedule(piko::DirectMap); }
  void process(const Item &i) {
    piko::atomicAdd(state().sums[binOf(i) & 63], work(i));
  }
};
struct Mapped : piko::Pipe<State> {
  Map stage;
  Mapped() { source(stage); }
};

struct Emit : Works<Emit, Item> {
  void process(const Item &i) { emit(Item{int(work(i))}); }
};
struct Last : piko::BasicStage<piko::Bins<0>, 64, Item>, piko::Uses<State> {
  void process(const Item &i) {
    update(state().last, glm::ivec1(i.serial & 63),
           [&](Sum &sum) { sum.value = sum.value * 31 + unsigned(i.serial); });
  }
};
struct Emitted : piko::Pipe<State> {
  Emit stage;
  Last last;
  Emitted() {
    source(stage);
    connect(stage, 0, last);
  }
};
