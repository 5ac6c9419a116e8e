// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// More inputs and outputs of a stage than a join merges at a time, in one
// submission and in the order of the reference executor.
// REQUIRES: all
// DEFINE: %{compare} = piko-compare %s --count 90 --domain 40 24 --runs 1 --threads 2 --target cuda --gpu-threads 32
// RUN: %compare_targets %s --cases %s --count 90 --domain 40 24 --runs 1
// CASE: --pipe Inputs
// CASE: --pipe Outputs
// RUN: export PIKO_TEST_DRIVER_COUNTS=1
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 %{compare} --pipe Inputs 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Inputs 2>&1 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_CUDA_ALONE=0 %{compare} --pipe Outputs 2>&1 | FileCheck %s
// CHECK-DAG: {{^equal$}}
// CHECK-DAG: host: 0 launches of kernels, 1 of graphs with {{[0-9]+}} kernels, {{[0-9]+}} copies, 0 fills, 2 waits
#include "../Inputs/ports.h"

struct State {
  piko::Image<float> image;
};

inline Point moved(const Point &p, int dx, int dy, int tag) {
  return {(p.x + dx) % 40, (p.y + dy) % 24, p.value + float(dx), tag};
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

// Ten ports and one; each of the ten leads to a stage of its own.
template <bool IsInLoop>
struct Fan : piko::Stage<0, 0, 64, Point, Point, Point, Point, Point, Point,
                         Point, Point, Point, Point, Point, Point> {
  void process(const Point &p) {
    if (p.tag % 3 != 1)
      this->emit(moved(p, 1, 1, p.tag), 10);
    if (IsInLoop && p.tag < 2)
      return;
    Point next = moved(p, 3, 2, IsInLoop ? p.tag / 2 : p.tag);
    switch (p.tag % 10) {
    case 0:
      this->emit(next, 9);
      return this->emit(next, 0);
    case 1:
      return this->emit(next, 1);
    case 2:
      return this->emit(next, 2);
    case 3:
      return this->emit(next, 3);
    case 4:
      return this->emit(next, 4);
    case 5:
      return this->emit(next, 5);
    case 6:
      return this->emit(next, 6);
    case 7:
      return this->emit(next, 7);
    case 8:
      return this->emit(next, 8);
    default:
      this->emit(next, 0);
      return this->emit(next, 9);
    }
  }
};

// Bins of its own keep it a kernel of its own.
template <int Number>
struct Tint : piko::Stage<8 + Number, 24, 32, Point, Point, Point> {
  void assignBin(const Point &p) {
    this->assignToBoundingBox(p, glm::ivec2(p.x, p.y),
                              glm::ivec2(p.x + 4, p.y));
  }
  void process(const Point &p) {
    if ((p.x + Number) % 4 != 0)
      this->emit(moved(p, Number, 1, p.tag), 0);
    if (p.x % 5 == Number % 5)
      this->emit(moved(p, 0, Number, p.tag), 1);
  }
};

// Its own emissions need the keys of what comes in by eleven ways.
struct Shift : piko::Stage<16, 24, 32, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) { emit(moved(p, 1, 1, p.tag)); }
};

#define TINTS                                                                  \
  Tint<0> tint0;                                                               \
  Tint<1> tint1;                                                               \
  Tint<2> tint2;                                                               \
  Tint<3> tint3;                                                               \
  Tint<4> tint4;                                                               \
  Tint<5> tint5;                                                               \
  Tint<6> tint6;                                                               \
  Tint<7> tint7;                                                               \
  Tint<8> tint8;                                                               \
  Tint<9> tint9
#define CONNECT(NUMBER, TO, EXIT)                                              \
  connect(fan, NUMBER, tint##NUMBER);                                          \
  connect(tint##NUMBER, 0, TO);                                                \
  connect(tint##NUMBER, 1, EXIT)
#define CONNECT_ALL(TO, EXIT)                                                  \
  CONNECT(0, TO, EXIT);                                                        \
  CONNECT(1, TO, EXIT);                                                        \
  CONNECT(2, TO, EXIT);                                                        \
  CONNECT(3, TO, EXIT);                                                        \
  CONNECT(4, TO, EXIT);                                                        \
  CONNECT(5, TO, EXIT);                                                        \
  CONNECT(6, TO, EXIT);                                                        \
  CONNECT(7, TO, EXIT);                                                        \
  CONNECT(8, TO, EXIT);                                                        \
  CONNECT(9, TO, EXIT)

struct Inputs : piko::Pipe<State> {
  TINTS;
  Fan<false> fan;
  Shift shift;
  Blend blend;
  Inputs() {
    source(fan);
    source(shift);
    source(blend);
    CONNECT_ALL(shift, blend);
    connect(fan, 10, blend);
    connect(shift, 0, blend);
  }
};

// A loop of eleven stages, each of which lets some out.
struct Outputs : piko::Pipe<State> {
  TINTS;
  Fan<true> fan;
  Blend blend;
  Outputs() {
    source(fan);
    CONNECT_ALL(fan, blend);
    connect(fan, 10, blend);
  }
};
