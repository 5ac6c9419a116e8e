// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tunables are found wherever they may stand, and have the values that
// PIKO_TUNED gives them: by hand with any compiler, or from a tuned file. Of
// those that nothing instantiates, too.
// RUN: pikoc %s --list-tunables | FileCheck %s --check-prefix=LIST --implicit-check-not=tunables.cpp:
// RUN: pikoc %s --emit=authored -o - | FileCheck %s --check-prefixes=CHECK,STANDARD
// RUN: pikoc %s '-DPIKO_TUNED="bin=16;step=-3;eps=1e-20;mode=5;more=true"' --emit=authored -o - | FileCheck %s --check-prefixes=CHECK,TUNED
// RUN: pikoc %s --no-cache '-DPIKO_TUNED="bin=16;step=-3;eps=1e-20;mode=5;more=1"' --emit=authored -o - | FileCheck %s --check-prefixes=CHECK,TUNED
// RUN: pikoc %s '-DPIKO_TUNED="bin=16;step=-3;eps=1e-20;mode=Exact;more=true;numbers=Strict"' --emit=authored -o - | FileCheck %s --check-prefixes=CHECK,TUNED
// RUN: %cxx_after_header -fsyntax-only %s
// RUN: %if all %{ %cxx_reference -fsyntax-only -DTUNED '-DPIKO_TUNED="bin=16;step=-3;eps=1e-20;mode=5;more=true"' %s %}
// RUN: %if all %{ %other_cxx -std=c++20 -I%piko_include -fsyntax-only -DTUNED '-DPIKO_TUNED="bin=16;step=-3;eps=1e-20;mode=5;more=true"' %s %}
#include <piko.h>

enum class Mode { Fast, Exact = 5 };

// LIST:      tunables.cpp:[[#@LINE+1]]:{{[0-9]+}}: bin = 8 | 16 | 0
constexpr int side = piko::tunable("bin", 8, 16, 0);

// LIST-NEXT: tunables.cpp:[[#@LINE+2]]:{{[0-9]+}}: more = false | true
template <int N> struct Unused {
  bool b = piko::tunable("more", false, true);
  // LIST-NEXT: tunables.cpp:[[#@LINE+1]]:{{[0-9]+}}: half = 2 | 3
  int default_(int i = N + piko::tunable("half", 2, 3));
};

struct State {
  piko::Buffer<float> out;
};

// LIST-NEXT: tunables.cpp:[[#@LINE+1]]:{{[0-9]+}}: threads = 64 | 32
template <int Threads = piko::tunable("threads", 64, 32)>
struct Draw : piko::Stage<side, side, Threads, int>, piko::Uses<State> {
  void assignBin(const int &) { this->assignToAll(0); }
  void process(const int &i) {
    // LIST-NEXT: tunables.cpp:[[#@LINE+1]]:{{[0-9]+}}: eps = 0.001 | 0.5 | 1e-20
    constexpr float e = piko::tunable("eps", 0.001f, 0.5f, 1e-20f);
    // LIST-NEXT: tunables.cpp:[[#@LINE+1]]:{{[0-9]+}}: mode = Fast | Exact
    if constexpr (piko::tunable("mode", Mode::Fast, Mode::Exact) == Mode::Exact)
      this->state().out[i] = e;
    else
      // LIST-NEXT: tunables.cpp:[[#@LINE+1]]:{{[0-9]+}}: step = 1 | -3 | 4
      this->state().out[i] = e * float(piko::tunable("step", 1, -3, 4));
  }
};

// LIST-NEXT: tunables.cpp:[[#@LINE+2]]:{{[0-9]+}}: numbers = Strict | Relaxed
constexpr auto numbers =
    piko::tunable("numbers", piko::Precision::Strict, piko::Precision::Relaxed);

// CHECK-LABEL: piko.pipeline @P
// STANDARD: piko.stage @draw bins [8, 8] threads 64
// STANDARD: 1.000000e-03
// TUNED: piko.stage @draw bins [16, 16] threads 64
// TUNED: 9.99999968E-21
struct P : piko::Pipe<State> {
  Draw<> draw;
  // The same again.
  static_assert(piko::tunable("bin", 8, 16, 0) == side);
  P() { source(draw); }
};

#ifdef TUNED
static_assert(side == 16 && numbers == piko::Precision::Strict);
static_assert(piko::tunable("step", 1, -3, 4) == -3);
static_assert(piko::tunable("eps", 0.001f, 0.5f, 1e-20f) == 1e-20f);
static_assert(piko::tunable("mode", Mode::Fast, Mode::Exact) == Mode::Exact);
static_assert(piko::tunable("more", false, true));
#endif

int main() {}
