// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is wrong with a graph is said where the pipeline says it.
// RUN: not piko-translate --cpp-to-piko --pipe=Unconnected %s 2>&1 | FileCheck %s --check-prefix=UNCONNECTED
// RUN: not piko-translate --cpp-to-piko --pipe=Twice %s 2>&1 | FileCheck %s --check-prefix=TWICE
// RUN: not piko-translate --cpp-to-piko --pipe=Mismatch %s 2>&1 | FileCheck %s --check-prefix=MISMATCH
// RUN: not piko-translate --cpp-to-piko --pipe=NoPort %s 2>&1 | FileCheck %s --check-prefix=NOPORT
// RUN: not piko-translate --cpp-to-piko --pipe=NoSource %s 2>&1 | FileCheck %s --check-prefix=NOSOURCE
// RUN: not piko-translate --cpp-to-piko --pipe=NoProcess %s 2>&1 | FileCheck %s --check-prefix=NOPROCESS
// RUN: not piko-translate --cpp-to-piko --pipe=NoAssign %s 2>&1 | FileCheck %s --check-prefix=NOASSIGN
// RUN: not piko-translate --cpp-to-piko --pipe=Nothing %s 2>&1 | FileCheck %s --check-prefix=NAME
// RUN: not piko-translate --cpp-to-piko %s 2>&1 | FileCheck %s --check-prefix=SEVERAL
#include <piko.h>

struct A {
  float x;
};
struct B {
  float y;
};
struct Pass : piko::Stage<0, 0, 1, A, A> {
  void process(const A &a) { emit(a); }
};
struct DrainA : piko::Stage<0, 0, 1, A> {
  void process(const A &) {}
};
struct DrainB : piko::Stage<0, 0, 1, B> {
  void process(const B &) {}
};

struct Unconnected : piko::Pipe<> {
  // UNCONNECTED: errors-graph.cpp:[[#@LINE + 1]]:8: error: port 0 of stage 'pass' is not connected
  Pass pass;
  Unconnected() { source(pass); }
};

struct Twice : piko::Pipe<> {
  Pass pass;
  DrainA drain;
  Twice() {
    source(pass);
    // TWICE: errors-graph.cpp:[[#@LINE + 4]]:5: error: port 0 of stage 'pass' is connected twice
    // TWICE: errors-graph.cpp:[[#@LINE + 2]]:5: note: it is connected here, and a port has one edge
    // TWICE: errors-graph.cpp:[[#@LINE - 6]]:8: note: for two edges give the stage a port more, 'A', 'A' behind its input in piko::Stage<...>, and emit to both: emit(value, 0), emit(value, 1)
    connect(pass, 0, drain);
    connect(pass, 0, drain);
  }
};

struct Mismatch : piko::Pipe<> {
  Pass pass;
  // MISMATCH: errors-graph.cpp:[[#@LINE + 5]]:5: error: expected an edge between equal types, but port 0 of stage 'pass' emits 'A' and stage 'drain' takes 'B'
  // MISMATCH: errors-graph.cpp:[[#@LINE + 1]]:10: note: stage 'drain' is declared here; a stage takes one type, the first in piko::Stage<...>, and those behind it are its ports'
  DrainB drain;
  Mismatch() {
    source(pass);
    connect(pass, 0, drain);
  }
};

struct NoPort : piko::Pipe<> {
  Pass pass;
  DrainA drain;
  NoPort() {
    source(pass);
    // NOPORT: errors-graph.cpp:[[#@LINE + 1]]:5: error: expected one of the 1 ports of stage 'pass', but got port 1
    connect(pass, 1, drain);
  }
};

// NOSOURCE: errors-graph.cpp:[[#@LINE + 1]]:8: error: expected pipeline 'NoSource' to have a source
struct NoSource : piko::Pipe<> {
  DrainA drain;
};

// NOPROCESS: errors-graph.cpp:[[#@LINE + 1]]:8: error: expected stage 'idle' to have a process phase, but 'Idle' has none
struct Idle : piko::Stage<0, 0, 1, A> {};
struct NoProcess : piko::Pipe<> {
  Idle idle;
  NoProcess() { source(idle); }
};

// NOASSIGN: errors-graph.cpp:[[#@LINE + 1]]:8: error: expected stage 'tiled' to have an assignBin phase, because its bins are smaller than the domain
struct Tiled : piko::Stage<8, 8, 1, A> {
  void process(const A &) {}
};
struct NoAssign : piko::Pipe<> {
  Tiled tiled;
  NoAssign() { source(tiled); }
};

// NAME: errors-graph.cpp:1:1: error: expected the name of a pipeline, but got 'Nothing'
// NAME: note: pipeline 'Unconnected' is defined here
// SEVERAL: errors-graph.cpp:1:1: error: expected the name of one of the file's 7 pipelines
// SEVERAL: note: pipeline 'NoAssign' is defined here
