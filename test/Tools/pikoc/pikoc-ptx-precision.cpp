// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// On a GPU, too, only what is said is contracted and approximated.
// RUN: pikoc %s --pipe Strict --emit=ptx | FileCheck %s --check-prefix=STRICT
// RUN: pikoc %s --pipe Contracted --emit=ptx | FileCheck %s --check-prefix=CONTRACTED
// RUN: pikoc %s --pipe Relaxed --emit=ptx -o %t.ptx
// RUN: FileCheck %s --check-prefix=RELAXED --input-file %t.ptx
// RUN: %if ptxas %{ ptxas -arch=sm_90 %t.ptx -o %t.cubin %}

// STRICT-NOT: {{fma\.|\.approx}}
// STRICT:     sqrt.rn.f32
// STRICT:     div.rn.f32
// STRICT-NOT: {{fma\.|\.approx}}

// CONTRACTED-NOT: .approx
// CONTRACTED:     fma.rn.f32
// CONTRACTED:     div.rn.f32
// CONTRACTED-NOT: .approx

// RELAXED-NOT: {{div\.rn|sqrt\.rn|\.extern|call}}
// RELAXED:     rsqrt.approx.ftz.f32
// RELAXED:     rcp.approx.ftz.f32
// RELAXED-NOT: {{div\.rn|sqrt\.rn|\.extern|call}}

#include <piko.h>

struct In {
  float a, b;
  int i;
};
struct State {
  piko::Buffer<float> out;
};

template <piko::Precision P>
struct Divide : piko::Stage<0, 0, 64, In>, piko::Uses<State> {
  void schedule(piko::BinId) { this->specifyPrecision(P); }
  void process(const In &in) {
    state().out[in.i] = in.a / (in.a * in.a + piko::sqrt(in.b));
  }
};
template <piko::Precision P> struct Pipe : piko::Pipe<State> {
  Divide<P> divide;
  Pipe() { this->source(divide); }
};
struct Strict : Pipe<piko::Precision::Strict> {};
struct Contracted : Pipe<piko::Precision::Contracted> {};
struct Relaxed : Pipe<piko::Precision::Relaxed> {};
