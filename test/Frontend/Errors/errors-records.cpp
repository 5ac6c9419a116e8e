// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a primitive cannot hold is said at the member that holds it.
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe1 %s 2>&1 | FileCheck %s --check-prefix=POINTER
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe2 %s 2>&1 | FileCheck %s --check-prefix=LONGDOUBLE
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe3 %s 2>&1 | FileCheck %s --check-prefix=BITFIELD
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe4 %s 2>&1 | FileCheck %s --check-prefix=TRIVIAL
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe5 %s 2>&1 | FileCheck %s --check-prefix=STATE
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe6 %s 2>&1 | FileCheck %s --check-prefix=ARRAY
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe7 %s 2>&1 | FileCheck %s --check-prefix=VECTOR
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe8 %s 2>&1 | FileCheck %s --check-prefix=PACKED
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe9 %s 2>&1 | FileCheck %s --check-prefix=PRAGMA
// RUN: not piko-translate --cpp-to-piko --pipe=Pipe10 %s 2>&1 | FileCheck %s --check-prefix=LATER
#include <piko.h>
#include <string>
#include <vector>

struct Inner {
  // ARRAY: errors-records.cpp:[[#@LINE + 2]]:10: error: not supported in Piko: a pointer or reference in type 'Inner[2]', member 'nodes.next'
  // POINTER: errors-records.cpp:[[#@LINE + 1]]:10: error: not supported in Piko: a pointer or reference in type 'Outer', member 'inner.next'
  float *next;
};
struct Outer {
  float x;
  Inner inner[2];
};
struct Long {
  // LONGDOUBLE: errors-records.cpp:[[#@LINE + 1]]:15: error: not supported in Piko: a value of type 'long double' in type 'Long', member 'value'
  long double value;
};
struct Bits {
  // BITFIELD: errors-records.cpp:[[#@LINE + 1]]:7: error: not supported in Piko: a bit-field in type 'Bits', member 'flag'
  int flag : 1;
};
struct __attribute__((packed)) Packed {
  char kind;
  // PACKED: errors-records.cpp:[[#@LINE + 1]]:9: error: not supported in Piko: a packed member in type 'Packed', member 'depth'
  float depth;
};
#pragma pack(push, 4)
struct Four {
  // PRAGMA: errors-records.cpp:[[#@LINE + 1]]:10: error: not supported in Piko: a packed member in type 'Four', member 'depth'
  double depth;
};
#pragma pack(pop)
struct Owner {
  // TRIVIAL-DAG: errors-records.cpp:[[#@LINE + 1]]:3: note: this constructor of 'Owner' is not trivial
  Owner(const Owner &);
};
struct Named {
  // VECTOR-DAG: errors-records.cpp:[[#@LINE + 1]]:15: note: member 'name' of type 'std::string' is not trivially copyable
  std::string name;
};
struct Mesh {
  float x;
  // VECTOR-DAG: errors-records.cpp:[[#@LINE + 1]]:20: note: member 'indices' of type 'std::vector<int>' is not trivially copyable
  std::vector<int> indices;
  // VECTOR-DAG: errors-records.cpp:[[#@LINE + 1]]:9: note: member 'parts' of type 'Named[2]' is not trivially copyable
  Named parts[2];
};
template <class T> struct Drain : piko::Stage<0, 0, 1, T> {
  void process(const T &) {}
};
template <class T> struct Pipeline : piko::Pipe<> {
  // TRIVIAL-DAG: errors-records.cpp:[[#@LINE + 2]]:12: error: expected a trivially copyable type, but got 'Owner'
  // VECTOR-DAG: errors-records.cpp:[[#@LINE + 1]]:12: error: expected a trivially copyable type, but got 'Mesh'
  Drain<T> drain;
  Pipeline() { source(drain); }
};
struct PointerState {
  // STATE: errors-records.cpp:[[#@LINE + 1]]:10: error: not supported in Piko: a pointer or reference in type 'float *', member 'table'
  float *table;
};
struct ArrayState {
  piko::Buffer<float> lights;
  Inner nodes[2];
};
template <class S> struct WithState : piko::Pipe<S> {
  Drain<int> drain;
  WithState() { this->source(drain); }
};
using Pipe1 = Pipeline<Outer>;
using Pipe2 = Pipeline<Long>;
using Pipe3 = Pipeline<Bits>;
using Pipe4 = Pipeline<Owner>;
using Pipe5 = WithState<PointerState>;
using Pipe6 = WithState<ArrayState>;
using Pipe7 = Pipeline<Mesh>;
using Pipe8 = Pipeline<Packed>;
using Pipe9 = Pipeline<Four>;
struct Later;
// LATER: error: expected a type that is defined, but got 'Later'
struct LaterDrain : piko::Stage<0, 0, 64, Later> {
  void process(const Later &) {}
};
struct Pipe10 : piko::Pipe<> {
  LaterDrain drain;
  Pipe10() { source(drain); }
};
