// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Functions that need not be exact are as near as the stage asks, and give the same
// bits on any number of threads, in vectors, in their remainders and in scalar code,
// contracted or not, and on a GPU. Those that are exact stay so beside them.
// RUN: piko-compare %s --pipe Within1 --count 1003 --tolerance 1e-6 > %t.one
// RUN: piko-compare %s --pipe Within4 --count 1003 --tolerance 1e-6 > %t.four
// RUN: FileCheck %s --check-prefix=ONE --input-file %t.one
// RUN: FileCheck %s --check-prefix=FOUR --input-file %t.four
// RUN: piko-compare %s --pipe Contracted --count 1003 --tolerance 1e-6 | diff - %t.four
// RUN: piko-compare %s --pipe Within4 --count 1003 --tolerance 1e-6 --target gpu-on-cpu | diff - %t.four
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe Within4 --count 1003 --tolerance 1e-6 --target cuda --runs 1 | diff - %t.four
// RUN: %if all %{ %if x86_64 %{ piko-compare %s --pipe Within4 --count 1003 --tolerance 1e-6 --cpu x86-64-v3 | diff - %t.four %} %}
// RUN: %if all %{ piko-compare %s --pipe Within1 --count 1003 --tolerance 1e-6 --without vectorize,if-convert | diff - %t.one %}
// RUN: %if all %{ piko-compare %s --pipe Within4 --count 1003 --tolerance 1e-6 --without vectorize,if-convert | diff - %t.four %}
// RUN: %if all %{ %if x86_64 %{ piko-compare %s --pipe Within1 --count 1003 --tolerance 1e-6 --cpu x86-64 | diff - %t.one %} %}
#include <piko.h>

// ONE-NOT: {{[2-9]}} ULP
// ONE-NOT: 'out.tangent'
// ONE-DAG: 'out.exponential': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, 1 ULP
// ONE-DAG: 'out.power': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, 1 ULP
// ONE-DAG: 'out.logarithm': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, 1 ULP
// ONE-DAG: 'out.sine': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, 1 ULP
// ONE:     {{^}}equal in all runs{{$}}

// FOUR-NOT: {{[5-9]|[0-9][0-9]}} ULP
// FOUR-NOT: 'out.tangent'
// FOUR-DAG: 'out.exponential': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, {{[1-4]}} ULP
// FOUR-DAG: 'out.power': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, {{[1-4]}} ULP
// FOUR-DAG: 'out.decimal': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, {{[2-4]}} ULP
// FOUR-DAG: 'out.cosine': {{[0-9]+}} of 1003 numbers differ, by at most {{.*}}, {{[2-4]}} ULP
// FOUR:     {{^}}equal in all runs{{$}}

struct In {
  float a, b;
  int serial;
};
struct Out {
  float exponential, binary, logarithm, decimal, power, sine, cosine, inverse,
      tangent;
};
struct State {
  piko::Buffer<Out> out;
};

template <int Ulps, bool Contracts = false>
struct Apply : piko::Stage<0, 0, 64, In>, piko::Uses<State> {
  void schedule(piko::BinId) {
    specifyUlps(Ulps);
    if (Contracts)
      specifyPrecision(piko::Precision::Contracted);
  }
  void process(const In &in) {
    Out &out = state().out[in.serial];
    out.exponential = piko::exp(in.a);
    out.binary = piko::exp2(in.a);
    out.logarithm = piko::log(in.a);
    out.decimal = piko::log10(in.a);
    out.power = piko::pow(piko::abs(in.a), in.b);
    out.sine = piko::sin(in.a);
    out.cosine = piko::cos(in.a);
    out.inverse = piko::rsqrt(in.a);
    out.tangent = piko::tan(in.a);
  }
};
template <int Ulps, bool Contracts = false> struct Pipe : piko::Pipe<State> {
  Apply<Ulps, Contracts> apply;
  Pipe() {
    this->source(apply);
    this->allocateForSource(this->state().out, 0);
  }
};
struct Within1 : Pipe<1> {};
struct Within4 : Pipe<4> {};
struct Contracted : Pipe<4, true> {};
