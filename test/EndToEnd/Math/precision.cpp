// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages that need not be strict give the same bits on any number of threads,
// in vectors, in their remainders and in scalar code, fused or not, and on a
// GPU emulated on the CPU; what is only contracted, also without an instruction
// for it. They are near to the reference executor's, and the same where no other
// number is near: of divisions by 0, of roots of infinity, of NaNs.
// RUN: piko-compare %s --pipe Contracted --count 1003 --domain 9 9 --tolerance 1e-6 > %t.contracted
// RUN: piko-compare %s --pipe Relaxed --count 1003 --domain 9 9 --tolerance 1e-6 > %t.relaxed
// RUN: FileCheck %s --check-prefix=CONTRACTED --input-file %t.contracted
// RUN: FileCheck %s --check-prefix=RELAXED --input-file %t.relaxed
// RUN: %compare_targets %s --pipe Strict --count 1003 --domain 9 9 | FileCheck %s --check-prefix=STRICT
// RUN: %if all %{ piko-compare %s --pipe Contracted --count 1003 --domain 9 9 --without vectorize,if-convert,fuse-stages,fuse-kernels,infer-directives | diff - %t.contracted %}
// RUN: %if all %{ piko-compare %s --pipe Relaxed --count 1003 --domain 9 9 --without vectorize,if-convert,fuse-stages,fuse-kernels,infer-directives | diff - %t.relaxed %}
// RUN: piko-compare %s --pipe Relaxed --count 1003 --domain 9 9 --check | diff - %t.relaxed
// RUN: %if all %{ piko-compare %s --pipe Contracted --count 1003 --domain 9 9 --target gpu-on-cpu | diff - %t.contracted %}
// RUN: %if all %{ piko-compare %s --pipe Relaxed --count 1003 --domain 9 9 --target gpu-on-cpu | diff - %t.relaxed %}
// RUN: %if all %{ %if x86_64 %{ piko-compare %s --pipe Contracted --count 1003 --domain 9 9 --cpu x86-64 | diff - %t.contracted %} %}
// RUN: %if all %{ %if x86_64 %{ piko-compare %s --pipe Relaxed --count 1003 --domain 9 9 --cpu x86-64-v3 --tolerance 1e-6 | FileCheck %s --check-prefix=RELAXED %} %}
// RUN: %if all %{ %if x86_64 %{ piko-compare %s --pipe Special --count 1003 --domain 9 9 --cpu x86-64-v3 --wide --tolerance 1e-6 | FileCheck %s --check-prefix=SPECIAL %} %}
// RUN: piko-compare %s --pipe Special --count 1003 --domain 9 9 --wide --tolerance 1e-6 | FileCheck %s --check-prefix=SPECIAL
// RUN: not piko-compare %s --pipe Relaxed --count 1003 --domain 9 9 --tolerance 1e-9 | FileCheck %s --check-prefix=FAR
#include <piko.h>

// Of two stages that are one kernel only one is strict.
// CONTRACTED-NOT: quotient
// CONTRACTED-NOT: strict
// CONTRACTED:     'out.length': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, relatively {{.*}}, 1 ULP
// CONTRACTED:     'spread.value': {{[0-9]+}} of 1003 numbers differ
// CONTRACTED:     'sums.value': {{[0-9]+}} of 1003 numbers differ
// CONTRACTED-NOT: strict
// CONTRACTED:     {{^}}equal in all runs{{$}}

// RELAXED:     'out.quotient': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, relatively {{.*}}, {{[1-4]}} ULP
// RELAXED:     'out.inverse': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, relatively {{.*}}, {{[1-4]}} ULP
// RELAXED:     'out.root': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, relatively {{.*}}, {{[1-4]}} ULP
// RELAXED:     'spread.value': {{[0-9]+}} of 1003 numbers differ
// RELAXED:     'sums.value': {{[0-9]+}} of 1003 numbers differ
// RELAXED-NOT: strict
// RELAXED:     {{^}}equal in all runs{{$}}

// STRICT-NOT: differ
// STRICT:     {{^}}equal on

// What is no finite number, and what is 0, is exact.
// SPECIAL-NOT: finite in only one
// SPECIAL-NOT: 'edges.sign
// SPECIAL:     {{^}}equal in all runs{{$}}

// FAR: expected differences of at most 1e-09

struct In {
  float a, b, c;
  int serial;
};
struct Out {
  float quotient, inverse, root, length, third;
  double wide;
};
struct Edges {
  float overZero, overInfinity, root, inverse, nothing;
  int sign;
};
struct State {
  piko::Buffer<float> table; // 64
  piko::Buffer<Out> out;
  piko::Buffer<float> strict, sums, spread;
  piko::Buffer<Edges> edges;
};

template <piko::Precision P>
struct Compute : piko::Stage<0, 0, 1, In, In>, piko::Uses<State> {
  void schedule(piko::BinId) { this->specifyPrecision(P); }
  void process(const In &i) {
    float a = float(i.serial) + 1.37f, b = float(i.serial % 77) + 2.25f;
    Out &o = state().out[i.serial];
    o.quotient = a / b;
    o.inverse = piko::rsqrt(b);
    o.root = piko::sqrt(a);
    glm::vec3 v(a, b, 3.0f);
    o.length = glm::length(v);
    o.third = a / 3.0f;
    o.wide = double(a) * b + 0.1;
    this->emit(i);
  }
};

/// As strict as any that says nothing.
struct Exact : piko::Stage<0, 0, 1, In, In>, piko::Uses<State> {
  void process(const In &i) {
    float x = float(i.serial) * 0.7f + 0.1f;
    state().strict[i.serial] = x / 1.7f + piko::sqrt(x) * x;
    emit(i);
  }
};

/// A loop of its own, with a remainder.
template <piko::Precision P>
struct Add : piko::Stage<0, 0, 1, In>, piko::Uses<State> {
  void schedule(piko::BinId) { this->specifyPrecision(P); }
  void process(const In &i) {
    float sum = 0;
    for (int k = 0; k < 37; ++k) {
      float x = state().table[k] + 9.1f, y = float(i.serial + k) + 0.3f;
      sum += x * y + y / x;
    }
    state().sums[i.serial] = sum;
  }
};

/// Iterations as lanes, some of which are a remainder.
template <piko::Precision P>
struct Spread : piko::Stage<0, 0, 64, In>, piko::Uses<State> {
  void schedule(piko::BinId) {
    this->specifyLanes(piko::Lanes::Iterations);
    this->specifyPrecision(P);
  }
  void process(const In &i) {
    if (i.serial % 37 == 0)
      this->parallelFor(37, [&](int k) {
        float x = float(i.serial + k) + 0.7f;
        if (i.serial + k < 1003)
          this->state().spread[i.serial + k] =
              x / (piko::rsqrt(x) + 3.1f) * 1.7f + 0.3f;
      });
  }
};

template <piko::Precision P> struct Numbers : piko::Pipe<State> {
  Compute<P> compute;
  Exact exact;
  Add<P> add;
  Spread<P> spread;
  Numbers() {
    this->allocateForSource(this->state().out, 0);
    this->allocateForSource(this->state().strict, 0);
    this->allocateForSource(this->state().sums, 0);
    this->allocateForSource(this->state().spread, 0);
    this->source(compute);
    this->source(spread);
    this->connect(compute, 0, exact);
    this->connect(exact, 0, add);
  }
};
struct Strict : Numbers<piko::Precision::Strict> {};
struct Contracted : Numbers<piko::Precision::Contracted> {};
struct Relaxed : Numbers<piko::Precision::Relaxed> {};

/// Whether 0 is -0.
inline int signOf(float x) { return piko::copysign(1.0f, x) < 0 ? -1 : 1; }

struct Limits : piko::Stage<0, 0, 1, In>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyPrecision(piko::Precision::Relaxed); }
  void process(const In &i) {
    Edges &o = state().edges[i.serial];
    float zero = i.serial & 1 ? 0.0f : -0.0f, infinity = 1.0f / zero;
    o.overZero = i.a / zero;
    o.overInfinity = i.a / infinity;
    float x = i.serial & 2 ? zero : i.serial & 4 ? infinity : -3.0f;
    o.root = piko::sqrt(x);
    o.inverse = 1.0f / piko::sqrt(x);
    o.nothing = zero / (i.b * zero);
    o.sign = signOf(o.overInfinity * 0.0f) + 4 * signOf(piko::sqrt(zero)) +
             16 * signOf(1.0f / infinity) + 64 * signOf(piko::rsqrt(zero));
  }
};
struct Special : piko::Pipe<State> {
  Limits limits;
  Special() {
    allocateForSource(state().edges, 0);
    source(limits);
  }
};
