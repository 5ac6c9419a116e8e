// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Threads of a block share primitives that emit, some of which take a way with
// arrays of its own: on a GPU, a second launch goes on with units in which there
// are such primitives, or these call a function.
// REQUIRES: all
// DEFINE: %{gpu} = --domain 67 35 --runs 2 --gpu-threads 32
// RUN: export PIKO_CUDA_DRIVER=%test_driver
// RUN: %compare_targets %s --cases %s --domain 67 35 --count 900 --runs 1
// CASE: --pipe Ordered
// CASE: --pipe Local
// CASE: --pipe Lists --count 300
// CASE: --pipe Counted
// CASE: --pipe All --count 500
// CASE: --pipe Looped --count 300
// CASE: --pipe Chosen
// RUN: piko-compare %s --pipe Ordered --count 900 %{gpu} --target cuda | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=4 piko-compare %s --pipe Ordered --count 700 --strip 150 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Ordered --count 900 %{gpu} --target gpu-on-cpu --gpu-seed 3 | FileCheck %s
// RUN: piko-compare %s --pipe Local --count 900 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Local --count 900 %{gpu} --target gpu-on-cpu --gpu-seed 2 | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=5 piko-compare %s --pipe Lists --count 900 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Lists --count 300 %{gpu} --target gpu-on-cpu | FileCheck %s
// RUN: piko-compare %s --pipe Counted --count 900 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Counted --count 900 %{gpu} --target gpu-on-cpu | FileCheck %s
// RUN: piko-compare %s --pipe All --count 500 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Looped --count 300 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Chosen --count 900 %{gpu} --target cuda | FileCheck %s
// CHECK: {{^equal$}}
//
// The error is the processor's, though the second launch finds it.
// RUN: not piko-compare %s --pipe Far --count 900 --domain 67 35 --runs 1 | FileCheck %s --check-prefix=FAR
// RUN: not piko-compare %s --pipe Far --count 900 %{gpu} --target cuda | FileCheck %s --check-prefix=FAR
// FAR: got: stage 'fan', bin {{[0-9]+}}: expected an index into 'image' in [0, 67), but got 99{{$}}
#include <piko.h>

struct Shape {
  int x, y, width, height;
};
struct Mark {
  int x, y, value;
};
struct Pixel {
  int count = 0;
};
struct State {
  piko::Image<Pixel> image;
};

// Which primitives are rare.
enum class Rare { Some, Each, Counted, Far, Chosen };

// Emits a row of marks; of a rare primitive, numbers that are put in order.
template <Rare R, int Bin, class Out = Mark>
struct Fan : piko::Stage<Bin, Bin, 64, Shape, Out>, piko::Uses<State> {
  static glm::ivec2 at(const Shape &s) { return {s.x & 63, s.y & 31}; }
  static bool isRare(const Shape &s) {
    return R == Rare::Each || (s.width & 31) == 5;
  }

  void assignBin(const Shape &s) {
    if constexpr (Bin == 0)
      this->assignToBin(s, piko::BinId{0});
    else
      this->assignToBin(s, this->binFromPosition(at(s)));
  }

  void process(const Shape &s) {
    if constexpr (R == Rare::Counted)
      piko::atomicAdd(this->state().image({s.x & 31, 34}).count, 1);
    int sum = s.height & 255;
    if (!isRare(s)) {
      if constexpr (R == Rare::Chosen)
        sum += s.y & 7;
      else
        for (int i = 0; i < (s.width & 7); ++i)
          this->emit(Out{at(s).x, at(s).y, s.height + i}, 0);
    } else {
      int numbers[6], size = 0;
      for (int i = 0; i < 6; ++i)
        if (((s.x >> i) & 1) || i < 2)
          numbers[size++] = (s.y * (i + 3)) & 63;
      for (int i = 1; i < size; ++i)
        for (int j = i; j > 0 && numbers[j - 1] > numbers[j]; --j) {
          int other = numbers[j];
          numbers[j] = numbers[j - 1];
          numbers[j - 1] = other;
        }
      if constexpr (R == Rare::Far)
        piko::atomicAdd(this->state()
                            .image({s.height % 5 == 3 ? 99 : numbers[0], 33})
                            .count,
                        1);
      if constexpr (R == Rare::Chosen)
        sum += numbers[0] * size;
      else
        this->parallelFor(size, [&](int64_t i) {
          this->emit(Out{at(s).x, at(s).y, numbers[i]}, 0);
        });
    }
    if constexpr (R == Rare::Chosen)
      this->emit(Out{at(s).x, at(s).y, sum}, 0);
  }
};

// In the order of lineage.
template <int Bin, bool Waits>
struct Blend : piko::Stage<Bin, Bin, 64, Mark>, piko::Uses<State> {
  void assignBin(const Mark &m) {
    this->assignToBin(m, this->binFromPosition({m.x, m.y}));
  }
  void schedule(piko::BinId) {
    if constexpr (Waits)
      this->endBin();
  }
  void process(const Mark &m) {
    this->update(this->state().image, {m.x, m.y},
                 [&](Pixel &p) { p.count = p.count * 3 + (m.value & 1023); });
  }
};

// Of what a bin has, also where that is nothing.
struct BlendList : piko::Stage<16, 16, 64, Mark>, piko::Uses<State> {
  void assignBin(const Mark &m) { assignToBin(m, binFromPosition({m.x, m.y})); }
  void schedule(piko::BinId) {
    endBin();
    everyBin();
  }
  void process(piko::List<Mark> marks) {
    int sum = int(marks.size());
    for (const Mark &m : marks)
      sum = sum * 5 + (m.value & 1023);
    update(state().image, binLo(), [&](Pixel &p) { p.count = sum; });
  }
};

// Shapes again, some of which go round.
struct Loop : piko::Stage<16, 16, 64, Shape, Shape, Mark>, piko::Uses<State> {
  static glm::ivec2 at(const Shape &s) { return {s.x & 63, s.y & 31}; }
  void assignBin(const Shape &s) { assignToBin(s, binFromPosition(at(s))); }
  void process(const Shape &s) {
    if (s.width & 4) {
      if (s.width > 0 && s.width < 200)
        emit(Shape{s.x + 3, s.y, s.width / 2, s.height}, 0);
      emit(Mark{at(s).x, at(s).y, s.height}, 1);
    } else {
      int numbers[5], size = 0;
      for (int i = 0; i < 5; ++i)
        if ((s.x >> i) & 1)
          numbers[size++] = s.y * i;
      for (int i = size; i > 0; --i)
        emit(Mark{at(s).x, at(s).y, numbers[i - 1]}, 1);
    }
  }
};

template <class First, class Second> struct Pipe : piko::Pipe<State> {
  First fan;
  Second blend;
  Pipe() {
    this->source(fan);
    this->connect(fan, 0, blend);
  }
};
struct Ordered : Pipe<Fan<Rare::Some, 0>, Blend<8, false>> {};
struct Local : Pipe<Fan<Rare::Some, 16>, Blend<16, true>> {};
struct Lists : Pipe<Fan<Rare::Some, 16>, BlendList> {};
struct Counted : Pipe<Fan<Rare::Counted, 16>, Blend<16, true>> {};
struct All : Pipe<Fan<Rare::Each, 0>, Blend<8, false>> {};
struct Chosen : Pipe<Fan<Rare::Chosen, 0>, Blend<8, false>> {};
struct Far : Pipe<Fan<Rare::Far, 0>, Blend<8, false>> {};
struct Looped : piko::Pipe<State> {
  Loop loop;
  Blend<8, false> blend;
  Looped() {
    source(loop);
    connect(loop, 0, loop);
    connect(loop, 1, blend);
  }
};
