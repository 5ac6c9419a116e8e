// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
// Approximations are the instructions that the processor has, also where LLVM
// vectorizes the loop; a fused multiply-add that it has not is computed without
// a call, and approximations are exact then.
// RUN: pikoc %s -o - --emit=assembly --pipe Relaxed --cpu skylake-avx512 | FileCheck %s --check-prefix=AVX512
// RUN: pikoc %s -o - --emit=assembly --pipe Relaxed --cpu x86-64-v3 | FileCheck %s --check-prefix=AVX
// RUN: pikoc %s -o - --emit=assembly --pipe Relaxed --cpu x86-64 | FileCheck %s --check-prefix=SSE
// RUN: pikoc %s -o - --emit=assembly --pipe Contracted --cpu x86-64-v3 | FileCheck %s --check-prefix=FMA
// RUN: pikoc %s -o - --emit=assembly --pipe Contracted --cpu x86-64 | FileCheck %s --check-prefix=NO-FMA
// RUN: pikoc %s -o - --emit=assembly --pipe Strict --cpu x86-64-v3 | FileCheck %s --check-prefix=STRICT
// The same of what is compiled for several processors.
// RUN: pikoc %s -o %t.o --no-cache --pipe Contracted --cpu x86-64,x86-64-v3
// RUN: llvm-objdump -d %t.o | FileCheck %s --check-prefix=OBJECT
// OBJECT: vfmadd{{.*}}ps
// REQUIRES: x86_64

// AVX512-NOT: {{div[sp]s|sqrt[sp]s}}
// AVX512:     vr{{cp|sqrt}}14ps %ymm
// AVX512-NOT: {{div[sp]s|vsqrt[sp]s}}
// AVX-NOT:    {{v(div|sqrt)[sp]s}}
// AVX:        vr{{cp|sqrt}}ps %ymm
// AVX-NOT:    {{v(div|sqrt)[sp]s}}
// SSE-NOT:    {{rcp|rsqrt}}
// SSE:        divps
// SSE-NOT:    {{rcp|rsqrt}}
// SSE-NOT:    fmaf
// FMA:        vfmadd{{.*}}ps
// NO-FMA-NOT: fmaf
// NO-FMA:     cvtpd2ps
// NO-FMA-NOT: fmaf
// STRICT-NOT: fmadd
// STRICT:     vdivps
// STRICT-NOT: fmadd

#include <piko.h>

struct State {
  piko::Buffer<float> a;
  piko::Buffer<float> b;
};

template <piko::Precision P>
struct Divide : piko::Stage<0, 0, 1, int>, piko::Uses<State> {
  void schedule(piko::BinId) { this->specifyPrecision(P); }
  void process(const int &first) {
    float x[64], y[64];
    for (int i = 0; i < 64; ++i)
      x[i] = state().a[first + i];
    for (int i = 0; i < 64; ++i)
      y[i] = x[i] * x[i] + x[i] / (1.0f + 1.0f / piko::sqrt(x[i]));
    for (int i = 0; i < 64; ++i)
      state().b[first + i] = y[i];
  }
};
template <piko::Precision P> struct Pipe : piko::Pipe<State> {
  Divide<P> divide;
  Pipe() { this->source(divide); }
};
struct Strict : Pipe<piko::Precision::Strict> {};
struct Contracted : Pipe<piko::Precision::Contracted> {};
struct Relaxed : Pipe<piko::Precision::Relaxed> {};
