// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pipelines in namespaces and classes: a name that is one's own needs nothing before it, and where several have one, each is called by what it is in.
// RUN: pikoc %s --list-pipes | FileCheck %s --check-prefix=LIST
// LIST: {{^}}near::P{{$}}
// LIST-NEXT: {{^}}Only{{$}}
// LIST-NEXT: {{^}}far::P{{$}}
// LIST-NEXT: {{^}}far::away::P{{$}}
// LIST-NEXT: {{^}}Inner{{$}}
// LIST-NEXT: {{^}}Hidden{{$}}
// LIST-NEXT: {{^}}Alias{{$}}
// RUN: pikoc %s --pipe near::P --emit=authored | FileCheck %s --check-prefix=NEAR
// NEAR: piko.pipeline @"near::P"
// RUN: pikoc %s --pipe away::P --emit=authored | FileCheck %s --check-prefix=AWAY
// AWAY: piko.pipeline @"far::away::P"
// RUN: pikoc %s --pipe near::Only --emit=authored | FileCheck %s --check-prefix=ONLY
// RUN: pikoc %s --pipe Only --emit=authored | FileCheck %s --check-prefix=ONLY
// ONLY: piko.pipeline @Only
// RUN: pikoc %s --pipe Outer::Inner --emit=authored | FileCheck %s --check-prefix=INNER
// INNER: piko.pipeline @Inner
// RUN: not pikoc %s --pipe P --emit=authored 2>&1 | FileCheck %s --check-prefix=WHICH
// WHICH: error: expected the name of one pipeline, but 'P' is that of 3
// WHICH: note: pipeline 'near::P' is defined here
// WHICH: note: pipeline 'far::P' is defined here
// WHICH: note: pipeline 'far::away::P' is defined here
// WHICH-NOT: note
// RUN: not pikoc %s --pipe other::P --emit=authored 2>&1 | FileCheck %s --check-prefix=NONE
// NONE: error: expected the name of a pipeline, but got 'other::P'
//
// Each runs, on all kinds of targets, beside its reference.
// RUN: piko-compare %s --pipe far::away::P --count 9 --runs 1
// RUN: piko-compare %s --pipe near::P --count 9 --runs 1 --target gpu-on-cpu
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe far::P --count 9 --runs 1 --target cuda
// RUN: piko-compare %s --pipe Inner --count 9 --runs 1
// RUN: piko-compare %s --pipe Hidden --count 9 --runs 1
// RUN: pikoc %s --pipe far::P -o %t.o --header %t.h && FileCheck %s --check-prefix=HEADER < %t.h
// HEADER: class P : public piko::rt::CompiledPipeline
#include <piko.h>

namespace near {
struct State {
  piko::Buffer<int> out;
};
struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) { state().out[i & 63] = 2 * (i & 63); }
};
struct P : piko::Pipe<State> {
  Set set;
  P() { source(set); }
};
struct Only : P {};
} // namespace near

namespace far {
struct State {
  piko::Buffer<float> out;
};
struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) { state().out[i & 63] = 0.5f * float(i & 63); }
};
struct P : piko::Pipe<State> {
  Set set;
  P() { source(set); }
};
namespace away {
struct P : far::P {};
} // namespace away
} // namespace far

class Outer {
public:
  struct Inner : near::P {};
};

namespace {
struct Hidden : far::P {};
} // namespace

template <class S> struct Made : piko::Pipe<near::State> {
  S set;
  Made() { this->source(set); }
};
using Alias = Made<near::Set>;
