// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// On a GPU, collectives of iterations that are threads of a block: the tree of a
// float reduction and scan is the language's, sorts are stable and put NaN last,
// and threads without an iteration take no part.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Collected --count 700
// CASE: --pipe Collected --count 30 --seed 4
// RUN: piko-compare %s --pipe Collected --count 700 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 128 --gpu-seed 3 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=9 piko-compare %s --pipe Collected --count 700 --gpu-threads 128 --target cuda --runs 1 --threads 2 | FileCheck %s
// With fewer threads the loop is cut, and they share the steps of each collective.
// RUN: piko-compare %s --pipe Collected --count 700 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 8 --gpu-seed 5 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 piko-compare %s --pipe Collected --count 700 --gpu-threads 16 --target cuda --runs 1 --threads 2 | FileCheck %s
// CHECK: equal
// RUN: pikoc %s --pipe Collected --emit=gpu --gpu-threads 64 --remarks 2>&1 | FileCheck %s --check-prefix=THREADS
// THREADS-NOT: remark: what iterations keep across barriers is in memory
// Iterations that do not all come to a barrier are an error, that of the
// reference.
// RUN: not piko-compare %s --pipe Parted --count 100 --runs 1 --threads 1 2 --target gpu-on-cpu --gpu-threads 64 | FileCheck %s --check-prefix=PARTED
// PARTED: got: stage 'stage', bin 0: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration 3 does not
#include "../Inputs/ports.h"

#include <limits>

struct Totals {
  float sum = 0;
  int count = 0;
};
struct State {
  piko::Image<Totals> image;
  piko::Buffer<int> out;
};

struct Collect : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 9, p.y - 9), glm::ivec2(p.x, p.y));
  }
  void process(const piko::List<Point> &list) {
    int n = glm::min(int(list.size()), 61);
    parallelFor(n, [&](int i) {
      const Point &p = list[i];
      float key = p.tag % 5 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                 : float(p.tag % 11) - 4;
      int rank = int(sort(key));
      float before =
          scan(p.value, [](float a, float b) { return a * 0.5f + b; });
      float sum = reduce(p.value * 3, [](float a, float b) { return a + b; });
      double wide =
          scan(double(p.tag), [](double a, double b) { return a - b; });
      Point out = list[rank];
      for (int k = 0; k < 2 + count(p.tag % 3 == 0) % 3; ++k)
        if (any(p.tag % 7 == k) && !all(p.tag % 2 == 0))
          out.value += before + float(wide);
      out.tag = rank;
      out.value += sum;
      if (i % 3)
        emit(out);
    });
  }
};
struct Blend : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y), [&](Totals &pixel) {
      pixel.sum = pixel.sum * 0.75f + p.value;
      pixel.count += p.tag;
    });
  }
};
struct Collected : piko::Pipe<State> {
  Collect collect;
  Blend blend;
  Collected() {
    source(collect);
    connect(collect, 0, blend);
  }
};

struct Part : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &list) {
    int seen[64] = {};
    parallelFor(glm::min(int(list.size()), 40), [&](int i) {
      seen[i] = i;
      // Iterations from the third on leave earlier.
      int rounds = i < 3 ? 4 : 2;
      for (int k = 0; k < rounds; ++k) {
        sync();
        if (k == 3)
          piko::atomicAdd(state().out[0], seen[39 - i]);
      }
    });
  }
};
struct Parted : piko::Pipe<State> {
  Part stage;
  Parted() { source(stage); }
};
