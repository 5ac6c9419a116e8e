// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=EMPTY
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=QUOTE
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=TWO
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=SAME
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=MEMBER
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=BIN
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=VARIABLE
#include <piko.h>

struct State {
  int constant;
};
struct One : piko::Stage<0, 0, 64, int, int>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyName("First pass"); }
  void process(const int &i) { emit(i); }
};
struct Two : piko::Stage<8, 8, 64, int>, piko::Uses<State> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId bin) {
#if CASE == 1
    // EMPTY: errors-labels.cpp:[[#@LINE + 1]]:5: error: expected a name of letters, digits, spaces and _-.(), but got ''
    specifyName("");
#elif CASE == 2
    // QUOTE: errors-labels.cpp:[[#@LINE + 1]]:5: error: expected a name of letters, digits, spaces and _-.(), but got 'a "pass"'
    specifyName("a \"pass\"");
#elif CASE == 3
    // TWO: errors-labels.cpp:[[#@LINE + 2]]:5: error: expected one name of stage 'two', but got "Second pass" and "Last pass"
    specifyName("Second pass");
    specifyName("Last pass");
#elif CASE == 4
    // SAME: errors-labels.cpp:[[#@LINE + 2]]:5: error: expected a name that no other stage has, but got "First pass"
    // SAME: errors-labels.cpp:[[#@LINE + 17]]:7: note: stage 'one' is declared here
    specifyName("First pass");
#elif CASE == 5
    // MEMBER: errors-labels.cpp:[[#@LINE + 1]]:5: error: expected a name that no other stage has, but got "one"
    specifyName("one");
#elif CASE == 6
    // BIN: errors-labels.cpp:[[#@LINE + 2]]:7: error: expected specifyName for every bin, because it may not depend on the bin
    if (bin.index)
      specifyName("Second pass");
#elif CASE == 7
    // VARIABLE: errors-labels.cpp:[[#@LINE + 1]]:5: error: expected a name to be a constant
    specifyName(&"Second pass"[state().constant]);
#endif
  }
  void process(const int &) {}
};
struct Pipeline : piko::Pipe<State> {
  One one;
  Two two;
  Pipeline() {
    source(one);
    connect(one, 0, two);
  }
};
