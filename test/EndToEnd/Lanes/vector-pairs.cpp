// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops whose iterations differ between primitives, and hand on nothing, fill vectors
// with pairs of a primitive and an iteration: of boxes that are empty, small and large,
// in loops of several kinds, with numbers of several widths.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1 --threads 2
// RUN: %if x86_64 %{ piko-compare %s --cases %s --runs 1 --threads 2 --cpu x86-64-v2 %}
// CASE: --pipe Boxes --domain 67 35 --count 2000
// CASE: --pipe Cells --domain 67 35 --count 2000
// CASE: --pipe Rows --domain 67 35 --count 2000
// CASE: --pipe Long --domain 67 35 --count 40
// CASE: --pipe Widths --domain 67 35 --count 2000
// CASE: --pipe Tests --domain 67 35 --count 2000
// CASE: --pipe Kinds --domain 67 35 --count 2000
// CASE: --pipe Down --domain 67 35 --count 2000
// RUN: not piko-compare %s --pipe Outside --domain 67 35 --count 2000 --runs 1 | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: got: stage 'stage', bin 0: expected an index into 'sums' in [0, 64), but got 64
//
// RUN: pikoc %s --pipe Boxes --emit=target -o - | FileCheck %s --check-prefix=PAIRS
// RUN: pikoc %s --pipe Cells --emit=target -o - | FileCheck %s --check-prefix=PAIRS
// RUN: pikoc %s --pipe Rows --emit=target -o - | FileCheck %s --check-prefix=PAIRS
// PAIRS: vector.shuffle %{{.*}}, %{{.*}} [{{4, 4, 0, 1|8, 8, 8, 8, 0, 1, 2, 3}}]
#include <piko.h>

struct Box {
  glm::ivec2 lo;
  uint16_t width;
  int8_t height;
  float value;
  int64_t wide;
  int serial;
};

struct State {
  piko::Image<int> sums;
  piko::Image<uint64_t> most;
  piko::Buffer<int> own;
};

struct Base : piko::Stage<0, 0, 64, Box>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }

protected:
  // A box inside of the domain, of at most so many cells in a row or a column.
  static glm::ivec4 boxOf(const Box &b, int most) {
    glm::ivec2 lo = glm::abs(b.lo % 60), size(b.width % most, b.height % most);
    return {lo.x, lo.y % 30, size.x, size.y};
  }
  void add(int x, int y, int value) {
    glm::ivec2 at = {piko::min(x, 66), piko::min(y, 34)};
    piko::atomicAdd(state().sums(at), value);
  }
};

struct BoxesStage : Base {
  void process(const Box &b) {
    glm::ivec4 box = boxOf(b, 7);
    for (int y = 0; y <= box.w; ++y)
      for (int x = 0; x < box.z; ++x)
        add(box.x + x, box.y + y, x * 3 + y);
  }
};

struct CellsStage : Base {
  void process(const Box &b) {
    glm::ivec4 box = boxOf(b, 7);
    parallelForPixels(glm::ivec2(box.x, box.y),
                      glm::ivec2(box.x + box.z, box.y + box.w),
                      [&](glm::ivec2 p) { add(p.x, p.y, p.x * b.width + 1); });
  }
};

struct RowsStage : Base {
  void process(const Box &b) {
    glm::ivec4 box = boxOf(b, 30);
    float value = piko::sqrt(b.value * b.value + 1.0f);
    for (int x = box.x; x < box.x + box.z; ++x)
      if (piko::sqrt(value * float(x)) < 9.0f)
        add(x, box.y, piko::toInt(value) + x);
    parallelFor(box.w, [&](int i) { add(box.x, box.y + i, i); });
  }
};

// More iterations than pairs are made of.
struct LongStage : Base {
  void process(const Box &b) {
    int turns = b.width % 3 == 0 ? 5000 + b.width % 100 : b.width % 5;
    for (int x = 0; x < turns; ++x)
      for (int y = 0; y < 2; ++y)
        add(x % 67, y, x ^ b.height);
  }
};

struct WidthsStage : Base {
  void process(const Box &b) {
    glm::ivec4 box = boxOf(b, 9);
    bool isOdd = b.width % 2 != 0;
    double third = double(b.value) / 3.0;
    for (int64_t i = 0; i < box.z; ++i) {
      uint64_t key = uint64_t(b.wide) + uint64_t(i) * 1000003u +
                     uint64_t(b.height) + (isOdd ? b.width : 1u);
      if (third > double(i) - 1000.0)
        piko::atomicMax(state().most({box.x, box.y}), key);
    }
  }
};

struct TestsStage : Base {
  void process(const Box &b) {
    if (b.value != b.value)
      return;
    glm::ivec4 box = boxOf(b, 12);
    if (b.width % 4 != 1) {
      for (int y = 0; y < box.w; ++y) {
        int row = y * y;
        for (int x = 0; x < box.z; ++x) {
          if ((x + row) % 3 == 0)
            continue;
          for (int k = 0; k < x % 3; ++k)
            add(box.x + k, box.y + y, row);
        }
      }
    } else {
      add(box.x, box.y, 7);
    }
  }
};

// No loop of these is one of which turns can be counted, or change places.
struct DownStage : Base {
  void process(const Box &b) {
    glm::ivec4 box = boxOf(b, 9);
    int sum = 0;
    for (int x = box.z; x > 0; --x)
      sum += x * b.width;
    for (int x = 0; x < box.w; ++x) {
      if (x * x > sum)
        break;
      add(box.x + x, box.y, sum);
    }
    for (int x = 0; x != box.z; x += 1)
      add(box.x, box.y, x);
  }
};

// A sum and a maximum of an element that one primitive has, iteration after iteration.
struct KindsStage : Base {
  void process(const Box &b) {
    glm::ivec4 box = boxOf(b, 9);
    for (int x = 0; x < box.z; ++x) {
      piko::atomicMax(state().own[b.serial], 3 * x);
      piko::atomicAdd(state().own[b.serial], -x);
    }
  }
};

struct OutsideState {
  piko::Buffer<int> sums;
};

struct OutsideStage : piko::Stage<0, 0, 64, Box>, piko::Uses<OutsideState> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Box &b) {
    for (int x = 0; x < b.width % 40; ++x)
      piko::atomicAdd(state().sums[state().sums.size() - 38 + x], 1);
  }
};

template <class S, class T = State> struct Pipe : piko::Pipe<T> {
  S stage;
  Pipe() {
    this->source(stage);
    if constexpr (std::is_same_v<T, State>)
      this->allocateForSource(this->state().own, 0);
  }
};
struct Boxes : Pipe<BoxesStage> {};
struct Cells : Pipe<CellsStage> {};
struct Rows : Pipe<RowsStage> {};
struct Long : Pipe<LongStage> {};
struct Widths : Pipe<WidthsStage> {};
struct Tests : Pipe<TestsStage> {};
struct Kinds : Pipe<KindsStage> {};
struct Down : Pipe<DownStage> {};
struct Outside : Pipe<OutsideStage, OutsideState> {};
