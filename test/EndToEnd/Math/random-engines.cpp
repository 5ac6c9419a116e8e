// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The engines of <random>: records whose arrays are indexed by a number of the
// same record.
// RUN: %compare_targets %s --count 48 | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <random>

struct Seed {
  int x, y, serial;
};
struct Result {
  uint64_t found[12];
};
struct State {
  piko::Buffer<Result> results;
};
struct Stack {
  int values[8] = {};
  int count = 0;
  void push(int v) { values[count++] = v; }
  int pop() { return values[--count]; }
};
struct Ring {
  int next = 0;
  int values[3] = {1, 2, 3};
  int last[2] = {0, 1};
  void put(int v) {
    values[next] = v + values[last[next & 1]];
    last[next & 1] = next;
    next = values[next] & 1 ? last[0] : (next + 1) % 3;
  }
};

struct Draw : piko::Stage<0, 0, 64, Seed>, piko::Uses<State> {
  void process(const Seed &p) {
    uint64_t *out = state().results[p.serial].found;
    out[0] = draw<std::mt19937>(p);
    out[1] = draw<std::mt19937_64>(p);
    out[2] = draw<std::minstd_rand>(p);
    out[3] = draw<std::minstd_rand0>(p);
    out[4] = draw<std::ranlux24_base>(p);
    out[5] = draw<std::ranlux48>(p);
    out[6] = draw<std::knuth_b>(p);
    std::mt19937 die(p.y);
    out[7] = die() % 6 + 1;
    out[8] = piko::toUint(float(die() >> 8) * 0x1p-24f * 1000);
    Stack stack;
    Ring ring;
    for (int i = 0; i < 5; ++i) {
      stack.push(p.x * i);
      ring.put(p.y + i);
    }
    out[9] = stack.pop() + 3 * stack.pop() + 100 * stack.count;
    out[10] = ring.values[ring.next] + 7 * ring.values[ring.last[1]];
  }
  template <typename Engine> static uint64_t draw(const Seed &p) {
    Engine engine(p.x & 0xffff);
    for (int i = 0; i < (p.y & 3); ++i)
      engine();
    return engine();
  }
};
struct Pipe : piko::Pipe<State> {
  Draw stage;
  Pipe() { source(stage); }
};
