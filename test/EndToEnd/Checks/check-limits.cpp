// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Compiled, checking mode finds indices outside of arrays and loops that do not
// end, which plain C++ has no way to see; and it says where barriers part.
// HOLE: cuda: what is checked is written down on the host
// REQUIRES: all
// RUN: sed -n 's|^// STOP: ||p' %s > %t.stops
// RUN: %compare_checked %s --stops --cases %t.stops --runs 1 --threads 2 --check > %t.out
// RUN: sed -n '/^Local:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=LOCAL
// RUN: sed -n '/^Standard:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=STANDARD
// RUN: sed -n '/^Negative:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=NEGATIVE
// RUN: sed -n '/^Field:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=FIELD
// RUN: sed -n '/^Assign:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=ASSIGN
// RUN: sed -n '/^Endless:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=ENDLESS
// RUN: sed -n '/^Emitting:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=EMITTING
// RUN: sed -n '/^Part:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=PART
// RUN: sed -n '/^Turns:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=TURNS
// RUN: sed -n '/^Counts:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=COUNTS
// STOP: --pipe Local --count 1
// STOP: --pipe Standard --count 1
// STOP: --pipe Negative --count 1
// STOP: --pipe Field --count 1
// STOP: --pipe Assign --count 1
// STOP: --pipe Endless --count 1
// STOP: --pipe Emitting --count 1
// STOP: --pipe Part --count 1
// STOP: --pipe Turns --count 1
// STOP: --pipe Counts --count 1
// RUN: %compare_checked %s --pipe Inside --count 40 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=INSIDE
// INSIDE: {{^equal}}
#include "../Inputs/ports.h"

#include <array>

struct Table {
  int values[3][4];
};
struct State {
  piko::Buffer<int> cells;
  piko::Buffer<Table> tables;
};

template <class S> struct One : piko::Pipe<State> {
  S only;
  One() { source(only); }
};
struct Whole : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {};
/// 0, and nobody knows.
inline int zero(const Point &p) { return p.tag & 64; }

// LOCAL: got: stage 'only', bin 0: expected an index in [0, 4), but got 100
// LOCAL-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+5]]
// LOCAL-NEXT: lineage: source 0 primitive 0
struct LocalArray : Whole {
  void process(const Point &p) {
    int values[4] = {1, 2, 3, 4};
    piko::atomicAdd(state().cells[0], values[zero(p) + 100]);
  }
};
struct Local : One<LocalArray> {};

// STANDARD: got: stage 'only', bin 0: expected an index in [0, 4), but got 100
// STANDARD-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+4]]
struct StandardArray : Whole {
  void process(const Point &p) {
    std::array<int, 4> values{1, 2, 3, 4};
    values[zero(p) + 100] = p.x;
    piko::atomicAdd(state().cells[0], values[p.x % 4]);
  }
};
struct Standard : One<StandardArray> {};

// NEGATIVE: got: stage 'only', bin 0: expected an index in [0, 4), but got -1
// NEGATIVE-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+6]]
struct NegativeIndex : Whole {
  void process(const Point &p) {
    parallelFor(4, [&](int i) {
      int values[4] = {i, p.tag, p.x, p.y}, sum = 0;
      for (int k = 3; k >= -1; --k)
        sum += values[k];
      piko::atomicAdd(state().cells[i], sum);
    });
  }
};
struct Negative : One<NegativeIndex> {};

// Each dimension of a field by itself.
// FIELD: got: stage 'only', bin 0: expected an index in [0, 4), but got 5
// FIELD-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+4]]
struct FieldArray : Whole {
  void process(const Point &p) {
    int column = zero(p) + 5;
    piko::atomicAdd(state().cells[0], state().tables[1].values[1][column]);
  }
};
struct Field : One<FieldArray> {};

// ASSIGN: got: stage 'only': expected an index in [0, 2), but got 2
// ASSIGN-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+4]]
struct AssignArray : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    int bins[] = {3, 4};
    assignToBin(p, {bins[zero(p) + 2] & 7});
  }
  void process(const Point &p) { piko::atomicAdd(state().cells[0], p.tag); }
};
struct Assign : One<AssignArray> {};

// The reference would go on for ever: there it is left out.
#ifdef __PIKO__
constexpr bool leaves = false;
#else
constexpr bool leaves = true;
#endif

// ENDLESS: got: stage 'only', bin 0: expected a loop that ends, but it still runs after 268435456 iterations
// ENDLESS-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+5]]
// ENDLESS-NEXT: lineage: source 0 primitive 0
struct EndlessLoop : Whole {
  void process(const Point &p) {
    int x = 4;
    while (x != 3 && !leaves)
      x = x == 9 ? 4 : x + 1;
    state().cells[0] = x;
    while (x != p.tag + 100 && !leaves)
      x = x == 9 ? 4 : x + 1;
    state().cells[1] = x;
  }
};
struct Endless : One<EndlessLoop> {};

// EMITTING: got: stage 'only', bin 1: expected a loop that ends, but it still runs after 268435456 iterations
// EMITTING-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+6]]
struct Emits : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {1}); }
  void process(const Point &p) {
    int sum = 0;
    for (int i = 0; i < 4; ++i)
      for (int k = 8; k != 3 && !leaves; k = k == 12 ? 4 : k + 1)
        sum += k;
    piko::atomicAdd(state().cells[0], sum + p.tag);
  }
};
struct Emitting : One<Emits> {};

// PART: got: stage 'only', bin 0: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration 3 does not
// PART-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+6]]
// PART-NEXT: lineage: source 0 primitive 0
struct PartWays : Whole {
  void process(const Point &) {
    parallelFor(8, [&](int i) {
      if (i < 3)
        sync();
      state().cells[i] = i;
    });
  }
};
struct Part : One<PartWays> {};

// TURNS: got: stage 'only', bin 0: expected every iteration of parallelFor to call sync() as often as iteration 0, but iteration 1 does not
// TURNS-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+6]]
struct TurnApart : Whole {
  void process(const Point &) {
    parallelFor(8, [&](int i) {
      for (int k = 0; k < 5 || i == 0; k += (i == 0 ? 0 : 1)) {
        piko::atomicAdd(state().cells[i], k);
        sync();
      }
    });
  }
};
struct Turns : One<TurnApart> {};

// COUNTS: got: stage 'only', bin 0: expected every iteration of parallelFor to call any() as often as iteration 0, but iteration 1 does not
// COUNTS-NEXT: at {{.*}}check-limits.cpp:[[#@LINE+6]]
struct CountApart : Whole {
  void process(const Point &) {
    parallelFor(8, [&](int i) {
      for (int k = 0; k < i; ++k) {
        piko::atomicAdd(state().cells[i], k);
        any(k == 3);
      }
    });
  }
};
struct Counts : One<CountApart> {};

struct KeepsInside : Whole {
  void process(const Point &p) {
    int values[2][3] = {};
    for (int i = 0; i < 6; ++i)
      values[i / 3][i % 3] = p.tag + i;
    parallelFor(6, [&](int i) {
      int own[3] = {i, i + 1, i + 2};
      sync();
      piko::atomicAdd(state().cells[i], values[i % 2][i / 2] + own[i % 3]);
    });
    for (int column = 0; column < 4; ++column)
      piko::atomicAdd(state().cells[6], state().tables[2].values[2][column]);
  }
};
struct Inside : One<KeepsInside> {};
