// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A phase that does not take what it is given is reported where the user wrote
// it.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=LIST
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=PRIMITIVE
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=NONE
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=ASSIGN
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=SCHEDULE
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=OTHER
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=OTHER-ASSIGN
// RUN: piko-translate --cpp-to-piko -DCASE=8 %s
#include <piko.h>

struct Stage : piko::Stage<8, 8, 1, float> {
#if CASE == 4
  // ASSIGN: errors-signatures.cpp:[[#@LINE + 2]]:25: error: expected assignBin(const float &){{$}}
  // ASSIGN: errors-signatures.cpp:[[#@LINE + 1]]:25: note: binding reference of type 'float' to value of type 'const float' drops 'const' qualifier
  void assignBin(float &f) { assignToAll(f); }
#elif CASE == 7
  // OTHER-ASSIGN: errors-signatures.cpp:[[#@LINE + 1]]:25: error: expected assignBin(const float &), but got assignBin(const double &)
  void assignBin(double f) { assignToAll(float(f)); }
#elif CASE == 8
  void assignBin(const auto &f) { assignToAll(f); }
#else
  void assignBin(const float &f) { assignToAll(f); }
#endif
#if CASE == 1
  // LIST: errors-signatures.cpp:[[#@LINE + 2]]:35: error: expected process(const piko::List<float> &){{$}}
  // LIST: errors-signatures.cpp:[[#@LINE + 1]]:35: note: non-const lvalue reference to type 'List<...>' cannot bind to a temporary of type 'List<...>'
  void process(piko::List<float> &list) {}
#elif CASE == 2
  // PRIMITIVE: errors-signatures.cpp:[[#@LINE + 2]]:23: error: expected process(const float &){{$}}
  // PRIMITIVE: errors-signatures.cpp:[[#@LINE + 1]]:23: note: binding reference of type 'float' to value of type 'const float' drops 'const' qualifier
  void process(float &f) {}
#elif CASE == 3
  // NONE: errors-signatures.cpp:[[#@LINE + 2]]:8: error: expected process(const float &){{$}}
  // NONE: errors-signatures.cpp:[[#@LINE + 1]]:8: note: too many arguments to function call, expected 0, have 1
  void process() {}
#elif CASE == 6
  // OTHER: errors-signatures.cpp:[[#@LINE + 1]]:27: error: expected process(const float &), but got process(const int &)
  void process(const int &i) {}
#elif CASE == 8
  void process(float) {}
#else
  void process(const float &) {}
#if CASE == 5
  // SCHEDULE: errors-signatures.cpp:[[#@LINE + 2]]:8: error: expected schedule(piko::BinId){{$}}
  // SCHEDULE: errors-signatures.cpp:[[#@LINE + 1]]:8: note: too many arguments to function call, expected 0, have 1
  void schedule() {}
#endif
#endif
};
struct Pipeline : piko::Pipe<> {
  Stage stage;
  Pipeline() { source(stage); }
};
