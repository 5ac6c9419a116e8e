// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations that meet, few enough for the lanes of a vector, run in lockstep and
// give the reference executor's numbers, and its errors.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Nearest --count 400
// CASE: --pipe Sums --count 400
// CASE: --pipe Network --count 400
// CASE: --pipe Newton --count 400
// CASE: --pipe Columns --count 400
// CASE: --pipe Kinds --count 400
// CASE: --pipe Emits --count 400
// CASE: --pipe EmitsBefore --count 400
// CASE: --pipe Scans --count 400
// CASE: --pipe Cells --domain 37 21 --count 400
// CASE: --pipe Orders --domain 37 21 --count 400
// CASE: --pipe Corners --count 400
// CASE: --pipe Changes --count 400
// CASE: --pipe ChangesOfAll --count 400
// CASE: --pipe ChangesOfItems --count 400
// RUN: %if all %{ piko-compare %s --pipe Nearest --count 400 --runs 1 --without vectorize -O0 | FileCheck %s %}
// What iterations emit in strips lies where others' was.
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe EmitsBefore --domain 64 64 --count 60 --runs 1 --threads 2 --target cuda --gpu-threads 8 --strip 7 | FileCheck %s
// CHECK: equal
// RUN: not piko-compare %s --pipe Outside --count 400 --runs 1 --threads 2 | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: got: stage 'stage', bin 0: expected an index into 'in' in [0, 400), but got 405
// RUN: not piko-compare %s --pipe Parts --count 400 --runs 1 --threads 1 | FileCheck %s --check-prefix=PARTS
// PARTS: got: stage 'stage', bin 0: expected every iteration of parallelFor to call any() as often as iteration 0, but iteration 3 does not
//
// RUN: pikoc %s --pipe Nearest,Network,Newton,Columns,Kinds,Emits,Cells,Corners,Scans --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=LANES
// LANES-COUNT-9: remark: stage '{{.*}}': these iterations are vectorized for 16 at once
// LANES-NOT: remark: stage '{{.*}}': these iterations are vectorized for 16 at once
// RUN: pikoc %s --pipe Sums --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=FEW
// FEW: remark: stage '{{.*}}': these iterations are vectorized for 16 at once
// FEW: remark: stage '{{.*}}': these iterations are vectorized for 8 at once
// RUN: pikoc %s --pipe EmitsBefore --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=EMITS
// EMITS: remark: stage '{{.*}}': these iterations are not vectorized: it keeps the order of iterations, and a barrier follows
#include <piko.h>

#include <climits>

struct Particle {
  int x, y;
  float value;
  int serial;
};

struct Cell {
  float sum = 0;
  int count = 0;
};

struct Box {
  float corner[2][3];
};

struct State {
  piko::Buffer<float> in, out;
  piko::Buffer<int> counts;
  piko::Buffer<Box> boxes;
  piko::Image<Cell> image;
};

template <class S> struct Buffers : piko::Pipe<State> {
  S stage;
  Buffers() {
    source(stage);
    allocateForSource(state().in, 0);
    allocateForSource(state().out, 0);
    allocateForSource(state().counts, 0);
    allocateForSource(state().boxes, 0);
  }
};

template <class... Out>
struct Alone : piko::Stage<0, 0, 64, Particle, Out...>, piko::Uses<State> {
protected:
  /// A number of an iteration, from -2 to 2.
  static float numberOf(const Particle &p, int i) {
    return p.value * 0.5f + float((p.serial * 7 + i * 5) % 23) * 0.1f - 1;
  }
};

// The nearest number in a tree of 4 children a node, all iterations together: a
// stack that they share, and votes on what to look at.
struct Near : Alone<> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      float wanted = numberOf(p, i), best = 2;
      int stack[64], top = 0, visits = 0;
      stack[top++] = 0;
      while (top > 0) {
        int node = stack[--top];
        ++visits;
        float low = float(node % 17) * 0.2f - 2;
        if (!any(glm::abs(low - wanted) < best + 0.5f))
          continue;
        best = glm::min(best, glm::abs(low - wanted));
        for (int k = 1; k <= 4; ++k)
          if (node * 4 + k < 85)
            stack[top++] = node * 4 + k;
      }
      if (i == 0)
        state().out[p.serial] = best + float(visits);
      else
        piko::atomicAdd(state().counts[p.serial], int(best * 100) + visits);
    });
  }
};
struct Nearest : Buffers<Near> {};

// Sums of floats are a tree over the index, also of a number of iterations that
// is no power of two.
struct Sum : Alone<> {
  void process(const Particle &p) {
    auto add = [](float a, float b) { return a + b; };
    float sums[2] = {0, 0};
    parallelFor(13, [&](int i) {
      float sum = reduce(numberOf(p, i) * 1.7f, add);
      float most = reduce(numberOf(p, i),
                          [](float a, float b) { return piko::max(a, b); });
      if (i == 3)
        sums[0] = sum + most;
    });
    parallelFor(5, [&](int i) {
      float product =
          reduce(numberOf(p, i) + 1.5f, [](float a, float b) { return a * b; });
      sync();
      if (i == 4)
        sums[1] = product * numberOf(p, i);
    });
    state().out[p.serial] = sums[0] - sums[1];
  }
};
struct Sums : Buffers<Sum> {};

// A bitonic sorting network on an array that the iterations share.
struct Sorter : Alone<> {
  void process(const Particle &p) {
    float shared[16];
    parallelFor(16, [&](int i) {
      shared[i] = numberOf(p, i * 3);
      sync();
      for (int size = 2; size <= 16; size *= 2)
        for (int distance = size / 2; distance > 0; distance /= 2) {
          int other = i ^ distance;
          float mine = shared[i], its = shared[other];
          bool wantsLess = ((i & size) == 0) == (i < other);
          sync();
          shared[i] = wantsLess ? piko::min(mine, its) : piko::max(mine, its);
          sync();
        }
    });
    float sum = 0;
    for (int i = 0; i < 16; ++i)
      sum = sum * 0.5f + shared[i];
    state().out[p.serial] = sum;
  }
};
struct Network : Buffers<Sorter> {};

// Until all have converged; a switch and a loop of its own for each in between.
struct Root : Alone<> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      float a = numberOf(p, i) + 3, x = a;
      int steps = 0;
      do {
        x = 0.5f * (x + a / x);
        switch (i % 3) {
        case 0:
          x += 1e-3f / float(steps + 1);
          break;
        case 1:
          for (int k = 0; k < i; ++k)
            x = x * 0.999f + 0.001f;
          break;
        }
        ++steps;
      } while (any(glm::abs(x * x - a) > 0.5f) && steps < 30);
      piko::atomicAdd(state().counts[p.serial], int(x * 1000) + steps);
    });
  }
};
struct Newton : Buffers<Root> {};

// Local arrays, of what differs and of what does not.
struct Column : Alone<> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      float own[8], same[8];
      for (int k = 0; k < 8; ++k) {
        own[k] = numberOf(p, i + k);
        same[k] = float(count(own[k] > 0)) + float(k);
      }
      if (all(own[0] > -3)) // the same way for all
        same[2] = 7;
      if (own[1] > 0.2f) // not so
        own[int(same[1]) % 8] = same[i % 8];
      float sum = 0;
      for (int k = 0; k < 8; ++k)
        sum = sum * 0.7f + own[k] * same[k] + same[(k * i) % 8];
      float most =
          reduce(sum, [](float a, float b) { return piko::max(a, b); });
      piko::atomicAdd(state().counts[p.serial], int(sum * 10) + int(most));
    });
  }
};
struct Columns : Buffers<Column> {};

// Numbers of all kinds, and several at once.
struct Extent {
  float lo, hi;
  int64_t sum;
};
struct Kind : Alone<> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      float v = numberOf(p, i);
      Extent all =
          reduce(Extent{v, v, i * 3000000000ll}, [](Extent a, Extent b) {
            return Extent{piko::min(a.lo, b.lo), piko::max(a.hi, b.hi),
                          a.sum + b.sum};
          });
      double d =
          reduce(double(v), [](double a, double b) { return a * b - b; });
      uint32_t bits =
          reduce(1u << i, [](uint32_t a, uint32_t b) { return a | b; });
      int least =
          reduce(int(v * 100), [](int a, int b) { return a < b ? a : b; });
      uint8_t small = reduce(
          uint8_t(i * 37), [](uint8_t a, uint8_t b) { return uint8_t(a + b); });
      bool odd = reduce((i + p.serial) % 3 == 0,
                        [](bool a, bool b) { return a != b; });
      if (i == 15)
        state().out[p.serial] = all.lo + all.hi * 2 + float(all.sum % 1000) +
                                float(d) + float(bits) + float(least) +
                                float(small) + float(odd);
    });
  }
};
struct Kinds : Buffers<Kind> {};

// Emissions after the last barrier, of some.
struct Emitter : Alone<Particle, Particle> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      float v = numberOf(p, i);
      float least = reduce(v, [](float a, float b) { return piko::min(a, b); });
      if (v > 0.5f)
        return;
      emit(Particle{i, p.y, v - least, p.serial}, 0);
      if (v < 0)
        emit(Particle{i, p.y, least, p.serial}, 1);
    });
  }
};
struct Last : Alone<> {
  void process(const Particle &p) {
    piko::atomicAdd(state().counts[p.serial], p.x + int(p.value * 50));
  }
};
template <class S> struct Emitting : piko::Pipe<State> {
  S stage;
  Last first, second;
  Emitting() {
    source(stage);
    connect(stage, 0, first);
    connect(stage, 1, second);
    allocateForSource(state().in, 0);
    allocateForSource(state().out, 0);
    allocateForSource(state().counts, 0);
    allocateForSource(state().boxes, 0);
  }
};
struct Emits : Emitting<Emitter> {};

// Before a barrier.
struct EmitterBefore : Alone<Particle, Particle> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      emit(Particle{i, p.y, numberOf(p, i), p.serial}, 0);
      int n = int(count(numberOf(p, i) > 0));
      emit(Particle{n, p.y, numberOf(p, i), p.serial}, 1);
    });
  }
};
struct EmitsBefore : Emitting<EmitterBefore> {};

// An array that is the same for all, and changes between what keeps its order.
struct Changer : Alone<Particle, Particle> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      int same[2] = {1, 2};
      sync();
      for (int k = 0; k < 9; ++k) {
        emit(Particle{i + same[k % 2], p.y, p.value, p.serial}, 0);
        same[k % 2] += 3;
      }
    });
  }
};
struct Changes : Emitting<Changer> {};

struct ChangerOfAll : Alone<Particle, Particle> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Particle &p) {
    parallelFor(50, [&](int i) {
      int same[2] = {1, 2};
      for (int k = 0; k < 9; ++k) {
        emit(Particle{i + same[k % 2], p.y, numberOf(p, i), p.serial}, 0);
        same[k % 2] += 3;
      }
    });
  }
};
struct ChangesOfAll : Emitting<ChangerOfAll> {};

struct ChangerOfItems : Alone<Particle, Particle> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Particle &p) {
    int same[4] = {1, 2, 3, 4};
    float v = piko::sqrt(numberOf(p, 3) + 4);
    for (int k = 0; k < 9; ++k) {
      emit(Particle{p.x + same[k % 4], p.y, v, p.serial}, 0);
      same[(k + 1) % 4] += same[k % 4];
    }
  }
};
struct ChangesOfItems : Emitting<ChangerOfItems> {};

// Scans and sorts.
struct Scanner : Alone<> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      int rank = int(sort(numberOf(p, i)));
      int before = scan(rank * i, [](int a, int b) { return a + b; });
      if (any(before > 100))
        piko::atomicAdd(state().counts[p.serial], before * (i + 1));
    });
  }
};
struct Scans : Buffers<Scanner> {};

// A block of pixels at a time, of bins that may be partial.
struct Block : piko::Stage<8, 8, 64, Particle>, piko::Uses<State> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Particle &p) {
    glm::ivec2 lo = binLo(), hi = binHi();
    for (int y = lo.y; y < hi.y; y += 4)
      for (int x = lo.x; x < hi.x; x += 4)
        parallelFor(16, [&](int i) {
          glm::ivec2 at(x + i % 4, y + i / 4);
          bool isIn = at.x < hi.x && at.y < hi.y;
          glm::vec2 away = glm::vec2(at - glm::ivec2(p.x, p.y)) * p.value;
          float d = isIn ? glm::dot(away, away) : 100.0f;
          if (!any(d < 9))
            return;
          float least =
              reduce(d, [](float a, float b) { return piko::min(a, b); });
          if (isIn && d < 9)
            update(state().image, at, [&](Cell &c) {
              c.sum = c.sum * 0.5f + d - least;
              c.count += 1;
            });
        });
  }
};
struct Cells : Buffers<Block> {};

// Updates on both sides of a barrier, of one pixel by all.
struct Updater : piko::Stage<8, 8, 64, Particle>, piko::Uses<State> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      auto note = [&](float v) {
        update(state().image, glm::ivec2(p.x, p.y), [&](Cell &c) {
          c.sum = c.sum * 0.75f + v;
          c.count += i;
        });
      };
      note(float(i));
      int n = int(count(i % 3 == p.serial % 3));
      note(float(n));
    });
  }
};
struct Orders : Buffers<Updater> {};

// Components by a number that differs between iterations.
struct Corner : Alone<> {
  void process(const Particle &p) {
    Box &b = state().boxes[p.serial];
    for (int k = 0; k < 6; ++k)
      b.corner[k / 3][k % 3] = numberOf(p, k);
    parallelFor(16, [&](int i) {
      const Box &box = state().boxes[p.serial];
      float v = box.corner[1][(i + p.serial) % 3] - box.corner[i % 2][2];
      float most = reduce(v, [](float a, float b) { return piko::max(a, b); });
      piko::atomicAdd(state().counts[p.serial], int(v * 100) + int(most * 10));
    });
  }
};
struct Corners : Buffers<Corner> {};

struct OutsideOne : Alone<> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      int n = int(count(i < 5));
      float v = state().in[i == 7 && p.serial == 390 ? 400 + n : p.serial];
      if (any(v > 5))
        piko::atomicAdd(state().counts[p.serial], 1);
    });
  }
};
struct Outside : Buffers<OutsideOne> {};

struct Parted : Alone<> {
  void process(const Particle &p) {
    parallelFor(16, [&](int i) {
      if (i != 3 && any(i == 2))
        piko::atomicAdd(state().counts[p.serial], 1);
    });
  }
};
struct Parts : Buffers<Parted> {};
