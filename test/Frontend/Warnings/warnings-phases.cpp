// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A member that nothing calls, and that is spelled almost as a phase is, was
// meant as one.
// RUN: piko-translate --cpp-to-piko -DCASE=0 %s 2>&1 | FileCheck %s --implicit-check-not=warning:
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=PROCESS
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=ASSIGN
#include <piko.h>

struct A {
  float x;
};
struct Shade : piko::Stage<0, 0, 1, A, A> {
  // CHECK: warnings-phases.cpp:[[#@LINE + 2]]:8: warning: expected a phase of stage 'Shade' to be called 'schedule', but got 'Schedule', which nothing calls{{$}}
  // CHECK: warnings-phases.cpp:[[#@LINE + 1]]:8: note: write 'schedule(piko::BinId)'
  void Schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  // CHECK: warnings-phases.cpp:[[#@LINE + 2]]:8: warning: expected a phase of stage 'Shade' to be called 'assignBin', but got 'assign_bin', which nothing calls
  // CHECK: warnings-phases.cpp:[[#@LINE + 1]]:8: note: write 'assignBin(const A &)'
  void assign_bin(const A &a) { assignToAll(a); }
  // CHECK: warnings-phases.cpp:[[#@LINE + 1]]:8: warning: {{.*}} but got 'assingBin'
  void assingBin(const A &a) { assignToAll(a); }
  // CHECK: warnings-phases.cpp:[[#@LINE + 1]]:27: warning: {{.*}} but got 'shedule'
  template <class T> void shedule(T) {}
  // Called, or not alike.
  void process1(const A &a) { emit(a); }
  void progress(int, int) {}
  void discuss(const A &) {}
  void process(const A &a) { process1(a); }
};
struct ToBins : piko::Stage<8, 8, 1, A> {
#if CASE == 1
  // PROCESS: warnings-phases.cpp:[[#@LINE - 2]]:8: error: expected stage 'b' to have a process phase, but 'ToBins' has none
  // PROCESS: warnings-phases.cpp:[[#@LINE + 1]]:8: note: 'Process' is here; write 'process'
  void Process(const A &) {}
#else
  void process(const A &) {}
#endif
#if CASE == 2
  // ASSIGN: warnings-phases.cpp:[[#@LINE - 9]]:8: error: expected stage 'b' to have an assignBin phase, because its bins are smaller than the domain
  // ASSIGN: warnings-phases.cpp:[[#@LINE + 1]]:8: note: 'assignbin' is here; write 'assignBin'
  void assignbin(const A &a) { assignToAll(a); }
#else
  void assignBin(const A &a) { assignToAll(a); }
#endif
};
struct Pipeline : piko::Pipe<> {
  Shade a;
  ToBins b;
  Pipeline() {
    source(a);
    connect(a, 0, b);
  }
};
