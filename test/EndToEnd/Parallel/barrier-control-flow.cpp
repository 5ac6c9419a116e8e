// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Barriers in every kind of control flow: in the test of a loop, in a switch, in
// branches, and in a loop that iterations count from different numbers.
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Barriers --count 400
// CASE: --pipe Barriers --count 20 --seed 5
// On a GPU an iteration is a thread where there are enough; otherwise the loop
// is cut.
// RUN: piko-compare %s --pipe Barriers --count 200 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 32 --gpu-seed 2 | FileCheck %s
// RUN: piko-compare %s --pipe Few --count 400 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 32 | FileCheck %s
// RUN: piko-compare %s --pipe Few --count 400 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 64 --gpu-seed 3 | FileCheck %s
// RUN: piko-compare %s --pipe Few --count 400 --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 16 | FileCheck %s
// CHECK: equal
// RUN: pikoc %s --pipe Few --emit=gpu --gpu-threads 32 --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=THREADS
// RUN: FileCheck %s --check-prefix=REGISTERS --input-file=%t.mlir
// RUN: pikoc %s --pipe Few --emit=gpu --gpu-threads 16 --remarks 2>&1 | FileCheck %s --check-prefix=PIECES
// THREADS-NOT: remark: what iterations keep across barriers is in memory
// PIECES: barrier-control-flow.cpp:[[#@LINE+20]]:5: remark: what iterations keep across barriers is in memory: they are not known to be at most 16, the threads of a block
// REGISTERS-LABEL: gpu.func @Few_kernel_mix
// REGISTERS-NOT: memref.view
// REGISTERS: gpu.return
#include "../Inputs/ports.h"
struct Pixel {
  float sum = 0;
};
struct State {
  piko::Image<Pixel> image;
};
template <int Most>
struct Mix : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 5, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const piko::List<Point> &list) {
    int n = glm::min(int(list.size()), Most);
    float shared[64];
    int kind = list[0].tag % 4;
    parallelFor(n, [&](int i) {
      const Point &p = list[i];
      float mine[4] = {p.value, 2 * p.value, 3 * p.value, 0};
      shared[i % 64] = p.value;
      sync();
      // The test of this loop comes after barriers.
      int round = 0;
      float sum = 0;
      do {
        float other = shared[(i + 1 + round) % n % 64];
        sync();
        shared[i % 64] = other + float(i);
        mine[(round + i) & 3] += other;
        sum += mine[round & 3];
        sync();
        ++round;
      } while (round < kind + 1);
      switch (kind) {
      case 0:
        sync();
        sum += shared[(i + 2) % n % 64];
        sync();
        break;
      case 1:
        emit({p.x, p.y, sum, 1});
        sync();
        sync();
        sum -= shared[(i + 3) % n % 64];
        sync();
        break;
      case 2:
        sum *= 2;
        break;
      default:
        for (int k = 0; k < 3; ++k) {
          shared[(i + k) % 64] = sum * float(k);
          sync();
          if (k == 1 && n > 3) {
            sum += shared[(i + 7) % n % 64];
            sync();
          } else {
            sum -= 1;
          }
        }
      }
      // Equally often, from different numbers.
      for (int k = i; k < i + 2; ++k) {
        shared[i % 64] = sum + float(k);
        sync();
        sum += shared[(i + k) % n % 64];
        sync();
      }
      emit({p.x, p.y, sum, n});
      if (sum > 0)
        emit({p.x, p.y, 1, n});
    });
  }
};
struct Blend : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.75f + p.value; });
  }
};
template <int Most> struct Mixed : piko::Pipe<State> {
  Mix<Most> mix;
  Blend blend;
  Mixed() {
    source(mix);
    connect(mix, 0, blend);
  }
};
struct Barriers : Mixed<1 << 30> {};
struct Few : Mixed<30> {};
