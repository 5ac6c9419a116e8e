// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Updates are left from anywhere: from a switch, from a loop, by helpers that
// return early, and on a path that nobody takes.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Test --count 3000
// CASE: --pipe Loops --count 3000
// CASE: --pipe Never --count 3000
// CASE: --pipe Iterations --count 1000
#include "../Inputs/ports.h"

struct Pixel {
  float value = 0;
  int passes = 0;
};
struct State {
  piko::Image<Pixel> image;
  piko::Buffer<int> cells;
};

enum class Compare { Never, Less, Equal, Always };

static bool passes(Compare how, float a, float b) {
  switch (how) {
  case Compare::Never:
    return false;
  case Compare::Less:
    return a < b;
  case Compare::Equal:
    return a == b;
  case Compare::Always:
    return true;
  }
  __builtin_unreachable();
}

static int change(int how, int old, int value) {
  switch (how) {
  case 0:
    return old;
  case 1:
    if (old < 255)
      return old + 1;
    break;
  case 2:
    if (old > 0)
      return value;
    break;
  default:
    __builtin_unreachable();
  }
  for (int i = 0;; ++i) {
    if (old % 3 == 1)
      return old * 7 + i;
    if (old > 10000)
      break;
    old = old * 5 + i;
    if (i == value)
      return i;
  }
  return old % 256;
}

struct Drop : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    piko::atomicAdd(state().cells[p.tag % 64], p.x);
  }
};

template <class Stage> struct To : piko::Pipe<State> {
  Stage stage;
  Drop drop;
  To() {
    source(stage);
    connect(stage, 0, drop);
  }
};

struct TestStage : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    if (update(state().image, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
          if (!passes(Compare(p.tag % 4), p.value, pixel.value)) {
            pixel.passes = change(p.tag % 3, pixel.passes, p.tag % 7);
            return false;
          }
          switch (p.tag % 5) {
          case 0:
            pixel.value = p.value;
            return true;
          case 1:
            if (pixel.passes > 3)
              return false;
            [[fallthrough]];
          case 2:
            pixel.value += 1;
            break;
          default:
            while (true) {
              pixel.passes += 3;
              if (pixel.passes > 20)
                return pixel.value > 0.5f;
              if (pixel.passes % 5 == 0)
                break;
            }
          }
          ++pixel.passes;
          return true;
        }))
      emit(p);
  }
};
struct Test : To<TestStage> {};

// What an update gives says how the loop around it goes on.
struct LoopsStage : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    for (int i = 0; i < p.tag % 4; ++i) {
      int got =
          update(state().image, {(p.x + i) % domain().x, 0}, [&](Pixel &pixel) {
            switch (change(p.tag % 3, pixel.passes, p.tag % 7)) {
            case 0:
              pixel.passes += 2;
              return 1;
            case 1:
              pixel.value = float(i);
              break;
            case 2:
              pixel.passes ^= 5;
              return 2;
            default:
              pixel.passes = p.tag % 11;
              return 0;
            }
            return 3;
          });
      if (got == 0)
        return;
      if (got == 1)
        continue;
      if (got == 2)
        break;
      emit(p);
    }
    emit(p);
  }
};
struct Loops : To<LoopsStage> {};

struct NeverStage : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    bool passed = false;
    update(state().image, {p.x, p.y % domain().y}, [&](Pixel &pixel) {
      pixel.passes += change(p.tag % 3, pixel.passes, p.tag % 7);
      if (p.tag < 0)
        __builtin_unreachable();
      if (pixel.passes > 10)
        return;
      passed = true;
    });
    if (passed)
      emit(p);
  }
};
struct Never : To<NeverStage> {};

struct IterationsStage : piko::Stage<8, 8, 64, Point, Point>,
                         piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    parallelForPixels([&](glm::ivec2 at) {
      if (at.x % 3 == p.tag % 3)
        return;
      int got = update(state().image, at, [&](Pixel &pixel) {
        unsigned left = unsigned(p.tag + pixel.passes);
        while (left & 7) {
          switch (left & 3) {
          case 0:
            pixel.passes += 2;
            return 1;
          case 1:
            pixel.value = float(left);
            break;
          case 2:
            pixel.passes ^= 5;
            return 2;
          case 3:
            left >>= 3;
            continue;
          }
          left >>= 2;
        }
        ++pixel.passes;
        return 3;
      });
      if (got == 1)
        emit(p);
    });
  }
};
struct Iterations : To<IterationsStage> {};
