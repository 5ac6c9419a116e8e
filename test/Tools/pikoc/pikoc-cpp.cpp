// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
// RUN: pikoc %s --list-pipes | FileCheck %s --check-prefix=LIST
// RUN: pikoc %s --pipe Small --emit=authored | FileCheck %s --check-prefix=SMALL
// RUN: pikoc %s --pipe Large --emit=authored -DBIN=16 | FileCheck %s --check-prefix=LARGE
// RUN: pikoc %s --pipe Small -I %S/../Inputs -DUSE_HEADER --emit=authored | FileCheck %s --check-prefix=HEADER
// RUN: not pikoc %s 2>&1 | FileCheck %s --check-prefix=WHICH
// RUN: not pikoc %s --pipe None 2>&1 | FileCheck %s --check-prefix=UNKNOWN
// Pipelines are chosen by name; -D and -I reach the C++.
// RUN: pikoc %s --pipe Large,Small --emit=authored -o %t.both
// RUN: FileCheck %s --check-prefix=BOTH --input-file %t.both
// RUN: piko-opt --split-input-file %t.both | FileCheck %s --check-prefix=BOTH
// RUN: not pikoc %s --pipe Small,None -o %t.ll 2>&1 | FileCheck %s --check-prefix=UNKNOWN
// RUN: not pikoc %s --pipe Small,Large -o %t.o 2>&1 | FileCheck %s --check-prefix=ONE
// What is written of several is a text, one after the other.

#include <piko.h>

#ifndef BIN
#define BIN 8
#endif
#ifdef USE_HEADER
#include "bin-size.h"
#else
constexpr int smallBin = 4;
#endif

struct Dot {
  glm::ivec2 position;
};

template <int Size> struct Drop : piko::Stage<Size, Size, 64, Dot> {
  void assignBin(const Dot &d) {
    this->assignToBin(d, this->binFromPosition(d.position));
  }
  void process(const Dot &) {}
};

// LIST: {{^Small$}}
// LIST-NEXT: {{^Large$}}
// SMALL: piko.pipeline @Small rank 2
// SMALL: bins [4, 4]
// HEADER: bins [32, 32]
struct Small : piko::Pipe<> {
  Drop<smallBin> drop;
  Small() { source(drop); }
};

// LARGE: piko.pipeline @Large rank 2
// LARGE: bins [16, 16]
struct Large : piko::Pipe<> {
  Drop<BIN> drop;
  Large() { source(drop); }
};

// BOTH: piko.pipeline @Large
// BOTH: // -----
// BOTH: piko.pipeline @Small
// ONE: error: --pipe: expected one pipeline, because only text is written of several in a file, but got 'Small,Large'

// WHICH: pikoc-cpp.cpp:1:1: error: expected the name of one of the file's 2
// WHICH: pikoc-cpp.cpp:[[#@LINE-18]]:8: note: pipeline 'Small' is defined here
// WHICH: pikoc-cpp.cpp:[[#@LINE-12]]:8: note: pipeline 'Large' is defined here
// UNKNOWN: pikoc-cpp.cpp:1:1: error: {{.*}}'None'
