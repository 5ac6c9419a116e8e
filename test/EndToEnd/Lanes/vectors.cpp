// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages that compute for several primitives at once give the reference executor's
// numbers, and its errors.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Averages --domain 67 35 --count 2000
// CASE: --pipe Addresses --domain 67 35 --count 2000
// CASE: --pipe Repeats --domain 67 35 --count 2000
// CASE: --pipe Guards --domain 67 35 --count 2000
// CASE: --pipe Tests --domain 67 35 --count 2000
// CASE: --pipe Kinds --domain 67 35 --count 2000
// CASE: --pipe Olds --domain 67 35 --count 2000
// RUN: %if all %{ piko-compare %s --pipe Tests --domain 67 35 --count 2000 --runs 1 --without vectorize -O0 | FileCheck %s %}
// CHECK: equal
// RUN: not piko-compare %s --pipe Outside --domain 67 35 --count 2000 --runs 1 --threads 2 | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: got: stage 'stage', bin 0: expected an index into 'in' in [0, 2000), but got 2013
//
// RUN: pikoc %s --pipe Averages,Addresses,Repeats,Guards,Tests,Kinds,Olds,Outside --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// VECTORS-COUNT-8: remark: stage 'stage': process is vectorized for {{4|8}} primitives at once
// VECTORS-NOT: remark: stage 'stage': process is vectorized for {{4|8}} primitives at once
#include <piko.h>

struct Particle {
  int x, y;
  float value;
  int serial;
};

struct State {
  piko::Buffer<float> in, other, out;
  piko::Buffer<int> counts;
  int count = 4;
};

template <class S> struct Buffers : piko::Pipe<State> {
  S stage;
  Buffers() {
    source(stage);
    allocateForSource(state().in, 0);
    allocateForSource(state().other, 0);
    allocateForSource(state().out, 0);
    allocateForSource(state().counts, 0);
  }
};

inline float work(float x, float y) {
  float a = x * y;
  a = a * a + x;
  a = piko::sqrt(a * a + 1.0f);
  a = a * x + y;
  return piko::sqrt(a * a + y * y);
}

inline float workMore(float x, float y) {
  for (int i = 0; i < 12; ++i) {
    float next = work(x, y);
    y = x;
    x = next;
  }
  return x;
}

// How often an inner loop went around is used after it.
struct Average : piko::Stage<0, 0, 64, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    float sum = 0;
    int i = 0;
    do {
      sum += work(p.value, float(i));
      ++i;
    } while (i < state().count * 2 + 3);
    state().out[p.serial] = sum / float(i);
  }
};
using Averages = Buffers<Average>;

// It leads to what is read next.
struct Address : piko::Stage<0, 0, 64, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    float sum = 0, t = 1;
    int i = 0;
    while (t < 1000 && i < 50) {
      sum += work(p.value, t);
      t = t * 1.5f + state().in[i];
      ++i;
    }
    if (p.serial < 1900)
      sum = work(sum, state().in[p.serial + i]);
    state().out[p.serial] = sum;
  }
};
using Addresses = Buffers<Address>;

// What an inner loop with effects reads is read again after it.
struct Repeat : piko::Stage<0, 0, 64, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    int i = 0;
    do {
      piko::atomicAdd(state().counts[p.serial], int(state().in[p.serial]) + i);
      ++i;
    } while (i < (p.serial & 3));
    float x = state().in[p.serial];
    state().out[p.serial] = workMore(p.value + x, state().other[p.serial]);
  }
};
using Repeats = Buffers<Repeat>;

// An inner loop that would not end, and that no primitive enters.
struct Guard : piko::Stage<0, 0, 64, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    float sum = workMore(p.value, state().in[p.serial]);
    state().out[p.serial] = sum;
    int twice = 2 * p.serial;
    if ((twice ^ state().counts[p.serial]) & 1) {
      int i = 0;
      do {
        sum = work(sum, p.value);
        i += state().count - 4;
      } while (i != 7);
      state().out[p.serial] = sum;
    }
  }
};
using Guards = Buffers<Guard>;

// Only the errors of primitives that read, each by its own index.
struct Reader : piko::Stage<0, 0, 64, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    float x = p.value;
    if (p.serial == 613)
      x = state().in[p.serial + 1400];
    state().out[p.serial] = workMore(x, p.value);
  }
};
using Outside = Buffers<Reader>;

// Work under a test that needs the primitive itself.
struct Fragment {
  int x, y;
  float z, weights[4];
  int choice, serial;
};
struct Images {
  piko::Image<float> depth, color;
};
struct Test : piko::Stage<8, 8, 64, Fragment>, piko::Uses<Images> {
  static glm::ivec2 at(const Fragment &f) { return {f.x & 31, f.y & 31}; }
  void assignBin(const Fragment &f) { assignToBin(f, binFromPosition(at(f))); }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Fragment &f) {
    bool passed = false;
    float old = 0;
    update(state().depth, at(f), [&](float &depth) {
      old = depth;
      passed = f.z > depth;
      depth = passed ? f.z : depth;
    });
    if (passed) {
      float sum = workMore(f.z, old) + f.weights[f.choice & 3];
      update(state().color, at(f), [&](float &color) { color = sum; });
    }
  }
};
struct Tests : piko::Pipe<Images> {
  Test stage;
  Tests() { source(stage); }
};

// A number that a primitive changes in two ways keeps the order of the two,
// around what runs in the order of primitives.
struct Numbers {
  piko::Image<float> sums;
  piko::Buffer<int> counts, olds, taken;
};
struct Kind : piko::Stage<8, 8, 64, Fragment>, piko::Uses<Numbers> {
  static glm::ivec2 at(const Fragment &f) { return {f.x & 31, f.y & 31}; }
  void assignBin(const Fragment &f) { assignToBin(f, binFromPosition(at(f))); }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Items); }
  void process(const Fragment &f) {
    float value = workMore(f.z, f.weights[0]);
    for (int i = 0; i <= (f.choice & 1); ++i) {
      update(state().sums, at(f),
             [&](float &sum) { sum = sum * 0.5f + value; });
      piko::atomicMax(state().counts[f.serial], 7 + i);
    }
    piko::atomicAdd(state().counts[f.serial], 3);
  }
};
struct Kinds : piko::Pipe<Numbers> {
  Kind stage;
  Kinds() {
    source(stage);
    allocateForSource(state().counts, 0);
  }
};

// So does one whose old values show.
struct Taken {
  int old;
  float value;
};
struct Old : piko::Stage<8, 8, 64, Fragment, Taken>, piko::Uses<Numbers> {
  void assignBin(const Fragment &f) {
    assignToBin(f, binFromPosition(Kind::at(f)));
  }
  void schedule(piko::BinId) {
    specifyOrder(piko::Unordered);
    specifyLanes(piko::Lanes::Items);
  }
  void process(const Fragment &f) {
    float value = workMore(f.z, 0.5f);
    for (int i = 0; i < 1 + (f.serial & 1); ++i)
      emit(Taken{piko::atomicAddFetch(state().counts[f.serial], i + 1), value});
    int old = piko::atomicAddFetch(state().counts[f.serial], 10);
    state().olds[f.serial] = old;
  }
};
struct Last : piko::Stage<0, 0, 64, Taken>, piko::Uses<Numbers> {
  void process(const Taken &t) {
    piko::atomicAdd(state().taken[t.old & 31], 1);
  }
};
struct Olds : piko::Pipe<Numbers> {
  Old stage;
  Last last;
  Olds() {
    source(stage);
    connect(stage, 0, last);
    allocateForSource(state().counts, 0);
    allocateForSource(state().olds, 0);
  }
};
