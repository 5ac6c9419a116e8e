// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops of a primitive that change state by atomics alone: on a GPU, threads put
// them off until many wait, and take those of about the same length at a time.
// REQUIRES: all
// DEFINE: %{gpu} = --domain 67 35 --runs 1 --gpu-threads 64
// RUN: export PIKO_CUDA_DRIVER=%test_driver
// RUN: %compare_targets %s --cases %s --domain 67 35 --count 900 --runs 1
// CASE: --pipe Boxes
// CASE: --pipe Rows
// CASE: --pipe Digits
// CASE: --pipe Both
// CASE: --pipe Binned
// RUN: piko-compare %s --pipe Boxes --count 900 %{gpu} --target cuda | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=4 piko-compare %s --pipe Boxes --count 700 --strip 150 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Rows --count 900 %{gpu} --target gpu-on-cpu --gpu-seed 3 | FileCheck %s
// RUN: piko-compare %s --pipe Digits --count 900 %{gpu} --target gpu-on-cpu | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=5 piko-compare %s --pipe Both --count 900 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Both --count 900 %{gpu} --target gpu-on-cpu | FileCheck %s
// RUN: piko-compare %s --pipe Binned --count 900 %{gpu} --target cuda | FileCheck %s
// RUN: piko-compare %s --pipe Seen --count 900 %{gpu} --target gpu-on-cpu | FileCheck %s
// CHECK: {{^equal$}}
//
// The error is the processor's, though other primitives may come to one before.
// RUN: not piko-compare %s --pipe Far --count 900 --domain 67 35 --runs 1 | FileCheck %s --check-prefix=FAR
// RUN: env PIKO_TEST_DRIVER_SEED=6 not piko-compare %s --pipe Far --count 900 %{gpu} --target cuda | FileCheck %s --check-prefix=FAR
// FAR-COUNT-3: got: stage 'far', bin 0: expected an index into 'image' in [0, 67), but got -64{{$}}
#include <piko.h>

struct Shape {
  int x, y, width, height;
};
struct Pixel {
  unsigned most = 0;
  int count = 0;
};
struct State {
  piko::Image<Pixel> image;
};

inline unsigned mix(const Shape &s, int x, int y) {
  return unsigned(s.x * 31 + s.y * 17 + x * 5 + y * 3) & 0xffff;
}

// The pixels of a box, of some primitives: two loops, of which one may not run.
struct Box : piko::Stage<0, 0, 64, Shape>, piko::Uses<State> {
  void process(const Shape &s) {
    int width = s.width & 7, height = s.height & 3;
    bool isOdd = s.x & 1;
    if ((s.width & 3) == 2)
      return;
    for (int y = 0; y <= height; ++y)
      for (int x = 0; x < width; ++x)
        if (unsigned number = mix(s, x, y); isOdd || (number & 1)) {
          glm::ivec2 p = {(s.x & 31) + x, (s.y & 15) + y};
          piko::atomicMax(this->state().image(p).most, number);
          piko::atomicAdd(this->state().image(p).count, 1);
        }
  }
};

// One loop, in no branch.
struct Row : piko::Stage<0, 0, 64, Shape>, piko::Uses<State> {
  void process(const Shape &s) {
    for (int x = 0; x < (s.width & 63); ++x)
      piko::atomicAdd(state().image({x, s.y & 31}).count, s.x & 7);
  }
};

// Nobody knows in front how often it runs.
struct Digit : piko::Stage<0, 0, 64, Shape>, piko::Uses<State> {
  void process(const Shape &s) {
    if (s.y & 1)
      for (unsigned rest = unsigned(s.x) & 0xfffff; rest; rest /= 7)
        piko::atomicAdd(state().image({int(rest % 7), s.y & 31}).count, 1);
  }
};

// Some primitives go on to another stage, in order.
struct Split : piko::Stage<0, 0, 64, Shape, Shape>, piko::Uses<State> {
  void process(const Shape &s) {
    if (s.width & 4)
      emit({s.x + 1, s.y, s.width, s.height}, 0);
    if (s.height & 1)
      return;
    for (int x = 0; x <= (s.width & 15); ++x)
      piko::atomicMax(state().image({x, s.y & 31}).most, mix(s, x, 0));
    if (s.width & 8)
      emit({s.x, s.y + 1, s.width, s.height}, 0);
  }
};
struct Blend : piko::Stage<8, 8, 64, Shape>, piko::Uses<State> {
  static glm::ivec2 at(const Shape &s) { return {s.x & 63, s.y & 31}; }
  void assignBin(const Shape &s) { assignToBin(s, binFromPosition(at(s))); }
  void process(const Shape &s) {
    update(state().image, at(s),
           [&](Pixel &p) { p.count = p.count * 3 + (s.width & 255); });
  }
};

// In bins, of which each has a queue that is empty when it ends.
struct BinnedBox : piko::Stage<16, 16, 64, Shape>, piko::Uses<State> {
  void assignBin(const Shape &s) {
    assignToBin(s, binFromPosition({s.x & 63, s.y & 31}));
  }
  void process(const Shape &s) {
    for (int y = 0; y < (s.height & 3); ++y)
      for (int x = 0; x < (s.width & 3); ++x)
        piko::atomicAdd(state().image({(s.x & 31) + x, (s.y & 15) + y}).count,
                        1);
  }
};

// It is seen after the loop what that has done: not put off. So is what other
// primitives have done, which breaks the rules of state, and has the reference's
// order where the CPU emulates the GPU alone.
struct See : piko::Stage<0, 0, 1, Shape>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  void process(const Shape &s) {
    for (int x = 0; x < (s.width & 7); ++x)
      piko::atomicAdd(state().image({x, s.y & 15}).count, 1);
    piko::atomicAdd(state().image({s.x & 31, 16}).count,
                    state().image({0, s.y & 15}).count);
  }
};

// Some primitives come to pixels outside.
struct Beyond : piko::Stage<0, 0, 64, Shape>, piko::Uses<State> {
  void process(const Shape &s) {
    if (s.y & 3)
      return;
    for (int x = s.width & 7; x >= 0 && x < 9; ++x)
      piko::atomicAdd(state().image({(s.x & 2047) - 64 + x, s.y & 15}).count,
                      1);
    for (int x = 0; x < (s.height & 7); ++x)
      piko::atomicAdd(state().image({(s.x & 2047) - 64 + x, s.y & 15}).count,
                      1);
  }
};

template <class S> struct Pipe : piko::Pipe<State> {
  S stage;
  Pipe() { this->source(stage); }
};
struct Boxes : Pipe<Box> {};
struct Rows : Pipe<Row> {};
struct Digits : Pipe<Digit> {};
struct Binned : Pipe<BinnedBox> {};
struct Seen : Pipe<See> {};
struct Far : piko::Pipe<State> {
  Beyond far;
  Far() { source(far); }
};
struct Both : piko::Pipe<State> {
  Split split;
  Blend blend;
  Both() {
    source(split);
    connect(split, 0, blend);
  }
};
