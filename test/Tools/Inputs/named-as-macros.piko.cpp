// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A pipeline whose names are macros of X11's and Windows's headers.
#include <piko.h>

namespace Bool {

struct Complex {
  float near, far;
  int None;
};

struct Success {
  Complex Always;
  piko::Buffer<int> OUT;
  piko::Buffer<Complex> IN;
  piko::Image<float, 2> TRANSPARENT;
};

struct Convex : piko::Stage<0, 0, 64, Complex>, piko::Uses<Success> {
  void process(const Complex &i) {
    state().OUT[i.None] = state().Always.None + int(state().IN[i.None].near);
    this->update(state().TRANSPARENT, piko::Cells<2>(0),
                 [&](float &sum) { sum += i.far; });
  }
};

struct ERROR : piko::Pipe<Success> {
  Convex interface;
  ERROR() { source(interface); }
};

} // namespace Bool
