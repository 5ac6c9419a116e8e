// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a phase cannot call of a library, and what to write instead.
// RUN: not piko-translate --cpp-to-piko -DCALL='out = int(std::strlen(text))' %s 2>&1 | FileCheck %s -DFUNCTION=strlen -DREMEDY="write a loop over the elements"
// RUN: not piko-translate --cpp-to-piko -DCALL='out = std::memcmp(text, text + 1, 3)' %s 2>&1 | FileCheck %s -DFUNCTION=memcmp -DREMEDY="write a loop over the elements"
// RUN: not piko-translate --cpp-to-piko -DCALL='out = std::toupper(i)' %s 2>&1 | FileCheck %s -DFUNCTION=toupper -DREMEDY="compare the character with the first and the last of its kind"
// RUN: not piko-translate --cpp-to-piko -DCALL='out = int(erff(float(i)))' %s 2>&1 | FileCheck %s -DFUNCTION=erff -DREMEDY="compute it from functions of piko::"
// RUN: not piko-translate --cpp-to-piko -DCALL='std::puts(text)' %s 2>&1 | FileCheck %s -DFUNCTION=puts -DREMEDY="store in a buffer of the state what the host is to see"
// RUN: not piko-translate --cpp-to-piko -DCALL='out = std::rand()' %s 2>&1 | FileCheck %s -DFUNCTION=rand -DREMEDY="compute random numbers from a seed of the primitive's own"
// RUN: not piko-translate --cpp-to-piko -DCALL='std::exit(i)' %s 2>&1 | FileCheck %s -DFUNCTION=exit -DREMEDY="return, and let the host see why in a buffer of the state"
// RUN: not piko-translate --cpp-to-piko -DCALL='out = int(std::time(nullptr))' %s 2>&1 | FileCheck %s -DFUNCTION=time -DREMEDY="let the host set a constant of the state"
// RUN: not piko-translate --cpp-to-piko -DCALL='out = int(std::tgamma(float(i)))' %s 2>&1 | FileCheck %s --check-prefix=BEHIND
// RUN: not piko-translate --cpp-to-piko -DCALL='out = *static_cast<int *>(std::malloc(4)) = i' %s 2>&1 | FileCheck %s --check-prefix=MALLOC
#include <piko.h>

#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

struct State {
  piko::Buffer<int> out;
};
struct CallIt : piko::Stage<0, 0, 4, int>, piko::Uses<State> {
  void process(const int &i) {
    char text[4] = {char(i), 0};
    int &out = state().out[text[0]];
    // CHECK: errors-remedies.cpp:[[#@LINE+3]]:{{[0-9]+}}: error: not supported in Piko: a call of '[[FUNCTION]]', which has no body in this file; [[REMEDY]]{{$}}
    // BEHIND: errors-remedies.cpp:[[#@LINE+2]]:{{[0-9]+}}: error: not supported in Piko: a call of 'tgammaf', which has no body in this file, in a call of 'std::tgamma'; compute it from functions of piko::{{$}}
    // MALLOC: errors-remedies.cpp:[[#@LINE+1]]:{{[0-9]+}}: error: not supported in Piko: dynamic allocation; use an array of a fixed size, or a buffer of the state{{$}}
    CALL;
    out += 1;
  }
};
struct Pipe : piko::Pipe<State> {
  CallIt stage;
  Pipe() { source(stage); }
};
