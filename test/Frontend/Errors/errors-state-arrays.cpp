// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Images and buffers that cannot be pieces of state, and phases that cannot be called.
// RUN: not pikoc %s --pipe Chosen --emit=authored 2>&1 | FileCheck %s --check-prefix=CHOSEN
// RUN: not pikoc %s --pipe Mixed --emit=authored 2>&1 | FileCheck %s --check-prefix=MIXED
// RUN: not pikoc %s --pipe Derived --emit=authored 2>&1 | FileCheck %s --check-prefix=DERIVED
// RUN: not pikoc %s --pipe Ranks --emit=authored 2>&1 | FileCheck %s --check-prefix=RANKS
// RUN: not pikoc %s --pipe Private --emit=authored 2>&1 | FileCheck %s --check-prefix=PRIVATE
#include <piko.h>

struct Layers {
  piko::Buffer<int> out[4];
};
struct Choose : piko::Stage<0, 0, 64, int>, piko::Uses<Layers> {
  void process(const int &i) {
    // CHOSEN: errors-state-arrays.cpp:[[#@LINE + 1]]:27: error: not supported in Piko: a buffer or image of an array whose index is not known when the pipeline is compiled; write one access for each, or take one image of one more dimension
    state().out[i & 3][i] = 1;
  }
};
struct Chosen : piko::Pipe<Layers> {
  Choose choose;
  Chosen() { source(choose); }
};

struct Surface {
  piko::Image<float> depth;
  // MIXED: errors-state-arrays.cpp:[[#@LINE + 1]]:9: error: expected a class of images or buffers to hold nothing else; put 'surface.scale' into the state itself
  float scale;
};
struct MixedState {
  Surface surface;
};
template <class S> struct Nothing : piko::Stage<0, 0, 64, int>, piko::Uses<S> {
  void process(const int &) {}
};
struct Mixed : piko::Pipe<MixedState> {
  Nothing<MixedState> nothing;
  Mixed() { source(nothing); }
};

struct More : Layers {
  piko::Buffer<int> more;
};
struct DerivedState {
  // DERIVED: errors-state-arrays.cpp:[[#@LINE + 1]]:8: error: not supported in Piko: a union or a class with bases that holds images or buffers, as 'more' is
  More more;
};
struct Derived : piko::Pipe<DerivedState> {
  Nothing<DerivedState> nothing;
  Derived() { source(nothing); }
};

class Put : public piko::Stage<0, 0, 64, int> {
  // PRIVATE: errors-state-arrays.cpp:[[#@LINE + 1]]:8: error: expected phase 'process' of stage 'put' to be public, because the executor calls it; write 'public:' before it
  void process(const int &) {}
};
struct Private : piko::Pipe<> {
  Put put;
  Private() { source(put); }
};

struct Volume {
  // RANKS: errors-state-arrays.cpp:[[#@LINE + 1]]:25: error: expected image 'fog' to have the 2 dimensions of the domain, which those of the bins are, but it has 3
  piko::Image<float, 3> fog;
};
// RANKS: errors-state-arrays.cpp:[[#@LINE + 2]]:19: note: stage 'nothing' is declared here
struct Ranks : piko::Pipe<Volume> {
  Nothing<Volume> nothing;
  Ranks() { source(nothing); }
};
