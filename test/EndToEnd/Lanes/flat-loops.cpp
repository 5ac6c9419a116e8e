// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Nests of loops that lanes go through each on its own: probes of a hash table,
// cells of a grid with lists, searches that end early, rows of a sparse matrix,
// three loops, ranges that are empty, counters that all change, and what stays
// as it is, because its order shows.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Probes --domain 8 8 --count 1003
// CASE: --pipe Cells --domain 8 8 --count 700
// CASE: --pipe Collatz --domain 8 8 --count 333
// CASE: --pipe Rows --domain 8 8 --count 1003
// CASE: --pipe Digits --domain 8 8 --count 500
// CASE: --pipe Three --domain 8 8 --count 300
// CASE: --pipe Empty --domain 8 8 --count 300
// CASE: --pipe Counts --domain 8 8 --count 700
// CASE: --pipe Paints --domain 8 8 --count 300
// CASE: --pipe Emits --domain 8 8 --count 300
// CASE: --pipe Orbits --domain 8 8 --count 1003
// CASE: --pipe Orbits --domain 8 8 --count 17
// CASE: --pipe Orbits --domain 8 8 --count 5
// CASE: --pipe Trees --domain 8 8 --count 1003
// CASE: --pipe Chains --domain 8 8 --count 777
//
// RUN: pikoc %s --pipe Probes --cpu x86-64-v4 --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=REMARK
// RUN: pikoc %s --pipe Trees --cpu x86-64-v4 --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=TREES
// TREES: process is vectorized for 16 primitives at once
// TREES: flat-loops.cpp:[[# @LINE + 23]]:{{.*}} lanes go on in this loop each by itself
// REMARK: process is vectorized for 32 primitives at once
// REMARK: flat-loops.cpp:[[# @LINE + 50]]:{{.*}} lanes go on in this loop each by itself
#include <piko.h>

#include <cstdint>

struct Prim {
  int x, y, z, w, serial;
};
struct Result {
  int a, b;
};
struct State {
  piko::Buffer<Result> results;
  piko::Buffer<Prim> prims;
  piko::Buffer<int> counts;
  piko::Image<int> picture;
  int size = 61;
};

template <class Body>
struct Stage : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    state().results[p.serial] = Body().run(state(), p);
  }
};
template <class Body> struct Pipe : piko::Pipe<State> {
  Stage<Body> stage;
  Pipe() {
    source(stage);
    allocateForSource(state().results, 0);
    allocateForSource(state().prims, 0);
  }
};

/// Eight look-ups with linear probing.
struct Probe {
  int find(const State &state, uint32_t key) {
    uint32_t n = uint32_t(state.prims.size()), slot = key * 2654435761u % n;
    for (int probe = 0; probe < 24; ++probe) {
      uint32_t entry = (slot * 40503u) >> 7 & 7;
      if (entry == (key & 7))
        return int(slot) + state.prims[slot].x;
      if (entry == 0)
        return -probe;
      slot = (slot + 1) % n;
    }
    return 7;
  }
  Result run(const State &state, const Prim &p) {
    Result r{0, 0};
    for (int i = 0; i < 8; ++i)
      r.a = r.a * 31 + find(state, uint32_t(p.x + i * p.y));
    return r;
  }
};
struct Probes : Pipe<Probe> {};

/// A walk from cell to cell, each of which has a list, until something is hit.
struct Walk {
  Result run(const State &state, const Prim &p) {
    float best = 1e30f, at = 0, step = float((p.y & 63) + 1) * 0.03f;
    uint32_t cell = uint32_t(p.x);
    int cells = 0;
    while (true) {
      uint32_t hash = cell * 747796405u + 2891336453u;
      int begin = int(hash >> 28) - 9, end = int(hash >> 24 & 15) - 9;
      for (int i = begin; i < end; ++i) {
        float d = float((p.z ^ i) & 1023) - at;
        if (d < 0)
          continue;
        float t = piko::sqrt(d) * 8.0f + at;
        if (t < best)
          best = t;
      }
      if (best < at || ++cells > 40)
        break;
      at += step;
      cell += 17;
    }
    return {int(best < 1e9f ? best * 16 : -1), cells};
  }
};
struct Cells : Pipe<Walk> {};

/// The longest of a few sequences: the inner loop has no bound.
struct Sequence {
  Result run(const State &, const Prim &p) {
    Result r{0, 0};
    for (uint32_t first = uint32_t(p.x & 1023) + 1, i = 0; i < 9; ++i) {
      uint32_t n = first + i;
      int steps = 0;
      while (n != 1) {
        n = n & 1 ? 3 * n + 1 : n / 2;
        ++steps;
      }
      if (steps > r.a)
        r = {steps, int(first + i)};
    }
    return r;
  }
};
struct Collatz : Pipe<Sequence> {};

/// Rows of a sparse matrix, some of which are empty.
struct Multiply {
  Result run(const State &state, const Prim &p) {
    int n = int(state.prims.size()), total = 0;
    float sum = 0;
    for (int row = p.serial % n; row < p.serial % n + (p.w & 15); ++row) {
      int begin = row * 7 % 13, end = begin + (row * 5 ^ p.z) % 7;
      float part = 0;
      for (int k = begin; k < end; ++k)
        part += float(state.prims[k % n].y & 255) * 0.25f;
      sum += part * 0.5f;
      total += end > begin ? end - begin : 0;
    }
    return {int(sum), total};
  }
};
struct Rows : Pipe<Multiply> {};

/// do .. while in do .. while.
struct Sums {
  Result run(const State &, const Prim &p) {
    uint32_t number = uint32_t(p.x), rounds = 0, digits = 0;
    do {
      uint32_t sum = 0;
      do {
        sum += number % 10;
        number /= 10;
        ++digits;
      } while (number > 0);
      number = sum;
      ++rounds;
    } while (number > 9);
    return {int(number), int(rounds * 100 + digits)};
  }
};
struct Digits : Pipe<Sums> {};

/// Three loops, two of which end early.
struct Nest {
  Result run(const State &state, const Prim &p) {
    Result r{0, 1};
    for (int i = 0; i < (p.x & 7); ++i)
      for (int j = i; j * j < (p.y & 255); ++j) {
        for (int k = 0; k < j; ++k) {
          r.a = r.a * 31 + (i ^ j ^ k);
          if ((r.a & 63) == state.size)
            break;
        }
        if ((r.a & 31) == 5)
          break;
        ++r.b;
      }
    return r;
  }
};
struct Three : Pipe<Nest> {};

/// Loops that many primitives do not enter.
struct Enter {
  Result run(const State &, const Prim &p) {
    Result r{-1, -2};
    int n = (p.x & 3) == 0 ? p.y & 7 : 0;
    for (int i = 0; i < n; ++i) {
      uint32_t m = uint32_t(p.z) >> (i * 4 & 31) & 12;
      while (m > 8) {
        m -= 3;
        r.a ^= int(m) * i;
      }
      r.b += int(m);
    }
    return r;
  }
};
struct Empty : Pipe<Enter> {};

/// Primitives whose loops end at different times: what is read of them, and
/// stored, is that of the next one.
struct Orbit {
  Result run(const State &, const Prim &p) {
    float x = float(p.x & 255) * 0.01f - 2, y = float(p.y & 255) * 0.01f - 1;
    float a = 0, b = 0, c = 1;
    int turns = 0;
    while (a * a + b * b < 8 && turns < 90) {
      float next = a * a - b * b + x;
      b = 2 * a * b + y;
      a = next;
      for (int i = 0; i < 6; ++i)
        c = piko::sqrt((c * c + b) / (a * a + 1) + 9) / (c * b + 2.5f) - 1;
      c = c > 4 || c < -4 ? 1 : c;
      ++turns;
    }
    return {turns + (p.z & 1), int(c * 64)};
  }
};
struct Orbits : Pipe<Orbit> {};

/// A traversal with a stack.
struct Traverse {
  Result run(const State &, const Prim &p) {
    int stack[24];
    int top = 0;
    Result r{0, 0};
    stack[top++] = 1;
    while (top > 0) {
      int node = stack[--top];
      float d = float((node * 37 ^ p.x) & 255) - float(p.y & 127);
      float e = piko::sqrt(d * d + float(p.w & 15)) * 0.5f + d * 0.25f;
      for (int i = 0; i < 5; ++i)
        e = piko::sqrt(e * e + d) / (e + 7) * (d / (e * e + 3) + 1);
      ++r.a;
      if (node >= 512) {
        r.b = r.b * 31 + node;
        continue;
      }
      if (e < 9)
        stack[top++] = node * 2;
      if (e > 2)
        stack[top++] = node * 2 + 1;
    }
    return r;
  }
};
struct Trees : Pipe<Traverse> {};

/// Links of other primitives, of which a loop reads lists.
struct Follow {
  Result run(const State &state, const Prim &p) {
    int n = int(state.prims.size());
    uint32_t at = uint32_t(p.x);
    Result r{0, 0};
    for (int hops = 0; hops < 30; ++hops) {
      int sum = 0;
      for (uint32_t i = 0; i < (at >> 9 & 7); ++i)
        sum += state.prims[int((at + i) % uint32_t(n))].y ^ int(i * at);
      r.a = r.a * 31 + sum;
      at = at * 1664525u + 1013904223u + uint32_t(sum);
      if ((at >> 27) == 3)
        break;
      ++r.b;
    }
    return r;
  }
};
struct Chains : Pipe<Follow> {};

/// Atomic operations in the inner loop, whose order does not show.
struct Count : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    int n = int(state().counts.size());
    for (int i = 0; i < (p.x & 7); ++i)
      for (uint32_t m = uint32_t(p.y ^ i); m > 3; m >>= (m & 3) + 1)
        piko::atomicAdd(state().counts[int(m % uint32_t(n))], i + 1);
  }
};
struct Counts : piko::Pipe<State> {
  Count count;
  Counts() {
    source(count);
    allocateForSource(state().counts, 0);
  }
};

/// What is painted last is seen: lanes wait.
struct Paint : piko::Stage<8, 8, 64, Prim>, piko::Uses<State> {
  void assignBin(const Prim &p) {
    assignToBin(p, binFromPosition(glm::vec2(p.x & 7, p.y & 7)));
  }
  void process(const Prim &p) {
    for (int i = 0; i < (p.z & 7); ++i)
      for (uint32_t m = uint32_t(p.w ^ i); m > 3; m >>= (m & 3) + 1)
        update(state().picture, glm::ivec2(p.x & 7, m & 7),
               [&](int &pixel) { pixel = pixel * 31 + p.serial; });
  }
};
struct Paints : piko::Pipe<State> {
  Paint paint;
  Paints() { source(paint); }
};

/// What is emitted keeps its order, too.
struct Store : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const piko::List<Prim> &list) {
    int hash = 0;
    for (const Prim &p : list)
      hash = hash * 31 + p.x * 7 + p.y;
    state().counts[0] = hash;
  }
};
struct Emit : piko::Stage<0, 0, 1, Prim, Prim> {
  void process(const Prim &p) {
    for (int i = 0; i < (p.z & 3); ++i)
      for (uint32_t m = uint32_t(p.w ^ i); m > 3; m >>= (m & 3) + 5)
        emit(Prim{int(m), i, 0, 0, 0}, 0);
  }
};
struct Emits : piko::Pipe<State> {
  Emit first;
  Store store;
  Emits() {
    source(first);
    connect(first, 0, store);
    allocateForSource(state().counts, 0);
  }
};
