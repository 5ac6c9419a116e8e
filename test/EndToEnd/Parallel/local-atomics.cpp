// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A local variable is its call's own: an atomic on it is a plain change.
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Ordered --count 8 --seed 1
// CASE: --pipe Ordered --count 8 --seed 2
// CASE: --pipe Fetches --count 64
// RUN: pikoc %s --pipe Ordered --emit=kernels -o - | FileCheck %s --check-prefix=KERNEL
// KERNEL-NOT: piko.atomic
#include <piko.h>

struct Seed {
  int serial, x, y;
  float value;
};
struct State {
  piko::Buffer<int> sums, own;
  piko::Buffer<unsigned> bits;
  piko::Buffer<float> floats;
  piko::Buffer<uint64_t> wide;
};

struct Extent {
  int least = 1000, most[2] = {-1000, -1000};
};
inline void grow(Extent &extent, int v) {
  piko::atomicMin(extent.least, v);
  piko::atomicMax(extent.most[v & 1], v);
}

struct Count : piko::Stage<0, 0, 64, Seed>, piko::Uses<State> {
  void process(const Seed &p) {
    int counts[4] = {0, 0, 0, 0};
    uint64_t high = uint64_t(1) << 40;
    unsigned all = ~0u, any = 0, odd = 5, low = 7;
    Extent extent;
    for (int i = 0; i < 16; ++i) {
      piko::atomicAdd(counts[(p.x + i * i) % 4], i);
      piko::atomicAdd(high, p.y + i);
      piko::atomicAnd(all, unsigned(p.x + i));
      piko::atomicOr(any, unsigned(p.y * i));
      piko::atomicXor(odd, unsigned(p.x * i));
      piko::atomicMin(low, unsigned(p.x - i)); // of unsigned numbers
      grow(extent, p.x - 3 * i);
    }
    int at = p.serial;
    state().sums[at] = counts[p.y % 4] * 100 + counts[0];
    state().wide[at] = high;
    state().bits[at] = all ^ any * 3 ^ odd * 7 ^ low;
    parallelFor(8, [&](int i) {
      int own[3] = {i, p.x, 2};
      piko::atomicAdd(own[i % 3], 4);
      state().own[p.serial * 8 + i] = own[0] * 100 + own[1] * 10 + own[2];
    });
    state().sums[at] += extent.least + extent.most[0] * 3 + extent.most[1];
  }
};
struct Ordered : piko::Pipe<State> {
  Count count;
  Ordered() { source(count); }
};

struct Fetch : piko::Stage<0, 0, 64, Seed>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyOrder(piko::Unordered); }
  void process(const Seed &p) {
    int next = 0, places[4] = {0, 0, 0, 0};
    float sum = 0;
    for (int i = 0; i < 9; ++i) {
      int place = piko::atomicAddFetch(next, i % 2);
      piko::atomicXorFetch(places[place % 4], p.x + i);
      piko::atomicAdd(sum, p.value);
    }
    state().sums[p.serial] = places[p.y % 4] + next;
    state().floats[p.serial] = sum;
  }
};
struct Fetches : piko::Pipe<State> {
  Fetch fetch;
  Fetches() { source(fetch); }
};
