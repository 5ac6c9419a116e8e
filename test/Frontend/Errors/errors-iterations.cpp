// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A function that iterations cannot call is an error where it is written.
// RUN: not pikoc %s -DWRONG=1 --emit=authored 2>&1 | FileCheck %s --check-prefix=PIXELS
// RUN: not pikoc %s -DWRONG=2 --emit=authored 2>&1 | FileCheck %s --check-prefix=BOX
// RUN: not pikoc %s -DWRONG=3 --emit=authored 2>&1 | FileCheck %s --check-prefix=FOR
// RUN: not pikoc %s -DWRONG=4 --emit=authored 2>&1 | FileCheck %s --check-prefix=COMPLEX
#include <piko.h>

#include <complex>

struct State {
  piko::Buffer<float> out;
};
struct Put : piko::Stage<8, 8, 64, int>, piko::Uses<State> {
  void assignBin(const int &i) { assignToAll(i); }
  void process(const int &i) {
#if WRONG == 1
    // PIXELS: errors-iterations.cpp:[[#@LINE + 1]]:5: error: no matching member function for call to 'parallelForPixels'
    parallelForPixels([&](glm::ivec2, int){});
#elif WRONG == 2
    // BOX: errors-iterations.cpp:[[#@LINE + 1]]:5: error: no matching member function for call to 'parallelForPixels'
    parallelForPixels(binLo(), binHi(), [&](glm::ivec3){});
#elif WRONG == 3
    // FOR: errors-iterations.cpp:[[#@LINE + 1]]:5: error: no matching member function for call to 'parallelFor'
    parallelFor(8, [&](){});
#else
    std::complex<float> z(float(i), 1);
    // COMPLEX: errors-iterations.cpp:[[#@LINE + 1]]:7: error: not supported in Piko: a call of '__mulsc3', which has no body in this file, in a call of 'std::complex::operator*='; write its real and its imaginary part, for complex numbers recover infinities from NaNs here
    z *= z;
    state().out[i] = z.real();
#endif
  }
};
struct P : piko::Pipe<State> {
  Put put;
  P() { source(put); }
};
