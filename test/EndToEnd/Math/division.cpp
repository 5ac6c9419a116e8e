// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An integer division without a result stops the run in the same words in the
// reference ("expected") and compiled ("got"), in every phase, with the line in
// checking mode; one that has a result is the same, and one that is not reached
// does nothing.
// REQUIRES: all
// RUN: sed -n 's|^// STOP: ||p' %s > %t.stops
// RUN: %compare_targets %s --stops --cases %t.stops --runs 1 --threads 2 > %t.out
// RUN: sed -n '/^Quotient:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Remainder:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Overflow:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Long:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Unsigned:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Update:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Iteration:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Fiber:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Vector:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=IN-BIN
// RUN: sed -n '/^Assign:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=NO-BIN
// RUN: sed -n '/^Schedule:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=SCHEDULE
// RUN: sed -n '/^Fused:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=FUSED
// STOP: --pipe Quotient --count 3
// STOP: --pipe Remainder --count 3
// STOP: --pipe Overflow --count 3
// STOP: --pipe Long --count 3
// STOP: --pipe Unsigned --count 3
// STOP: --pipe Update --count 3
// STOP: --pipe Iteration --count 3
// STOP: --pipe Fiber --count 3
// STOP: --pipe Vector --count 3
// STOP: --pipe Assign --count 3
// STOP: --pipe Schedule --count 3
// STOP: --pipe Fused --count 3
// RUN: not piko-compare %s --pipe Fused --count 3 --runs 1 --threads 2 --without fuse-stages | FileCheck %s --check-prefix=FUSED
// RUN: pikoc %s --pipe Fused --emit=kernels -o - | FileCheck %s --check-prefix=KERNEL
// KERNEL: piko.stage @pass {{.*}} fused ["last"]
// RUN: %if all %{ not piko-compare %s --pipe Quotient --count 3 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=PLACE %}
// RUN: %if all %{ not piko-compare %s --pipe Assign --count 3 --runs 1 --threads 2 --check | FileCheck %s --check-prefix=ASSIGN-PLACE %}
// RUN: %compare_targets %s --cases %s --runs 1 --threads 1 2
// RUN: %if all %{ piko-compare %s --cases %s --runs 1 --threads 2 --check %}
// CASE: --pipe Guarded --count 300 --wide
// CASE: --pipe Many --count 500
// CASE: --pipe Constant --count 300 --wide
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> out;
  piko::Buffer<int64_t> large;
  piko::Image<int> image;
};

template <class S> struct One : piko::Pipe<State> {
  S only;
  One() { source(only); }
};
struct Binned : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {5}); }
};
/// 0, and nobody knows.
inline int zero(const Point &p) { return (p.tag & 64) + (p.x & 64); }

// IN-BIN: expected: {{.*}}stage '{{.*}}'[[WHERE:, bin 5: expected an integer division to have a result, but it divides by 0 or overflows]]{{$}}
// IN-BIN: got: stage 'only'[[WHERE]]{{$}}
// PLACE: expected: {{.*}}stage 'Quotients', bin 5: expected an integer division to have a result, but it divides by 0 or overflows
// PLACE-NEXT: lineage: source 0 primitive 0
// PLACE: got: stage 'only', bin 5: expected an integer division to have a result, but it divides by 0 or overflows
// PLACE-NEXT: at {{.*}}division.cpp:[[#@LINE+4]]
// PLACE-NEXT: lineage: source 0 primitive 0
struct Quotients : Binned {
  void process(const Point &p) {
    piko::atomicAdd(state().out[0], (p.y + 7) / zero(p));
  }
};
struct Quotient : One<Quotients> {};

struct Remainders : Binned {
  void process(const Point &p) {
    piko::atomicAdd(state().out[0], (p.y + 7) % zero(p));
  }
};
struct Remainder : One<Remainders> {};

struct Overflows : Binned {
  void process(const Point &p) {
    piko::atomicAdd(state().out[0], (INT32_MIN + zero(p)) / (zero(p) - 1));
  }
};
struct Overflow : One<Overflows> {};

struct Longs : Binned {
  void process(const Point &p) {
    piko::atomicAdd(state().large[0], (INT64_MIN + zero(p)) % (zero(p) - 1));
  }
};
struct Long : One<Longs> {};

struct Unsigneds : Binned {
  void process(const Point &p) {
    piko::atomicAdd(state().out[0],
                    int((uint32_t(p.y) + 7u) / uint32_t(zero(p))));
  }
};
struct Unsigned : One<Unsigneds> {};

struct Updates : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {5}); }
  void process(const Point &p) {
    update(state().image, binLo(),
           [&](int &pixel) { pixel += (p.y + 7) / zero(p); });
  }
};
struct Update : One<Updates> {};

struct Iterations : Binned {
  void process(const Point &p) {
    parallelFor(4, [&](int i) {
      piko::atomicAdd(state().out[i], (p.y + 7) / (zero(p) + 2 - i));
    });
  }
};
struct Iteration : One<Iterations> {};

// On a stack of its own, in the reference.
struct Fibers : Binned {
  void process(const Point &p) {
    parallelFor(4, [&](int i) {
      sync();
      piko::atomicAdd(state().out[i], (p.y + 7) / (zero(p) + 2 - i));
      sync();
    });
  }
};
struct Fiber : One<Fibers> {};

struct Vectors : Binned {
  void process(const Point &p) {
    glm::ivec3 v = glm::ivec3(7 + p.y, 8, 9) / glm::ivec3(1, zero(p), 2);
    piko::atomicAdd(state().out[0], v.x + v.y + v.z);
  }
};
struct Vector : One<Vectors> {};

// NO-BIN: expected: {{.*}}stage 'Assigns'[[WHERE:: expected an integer division to have a result, but it divides by 0 or overflows]]{{$}}
// NO-BIN: got: stage 'only'[[WHERE]]{{$}}
// ASSIGN-PLACE: got: stage 'only': expected an integer division to have a result, but it divides by 0 or overflows
// ASSIGN-PLACE-NEXT: at {{.*}}division.cpp:[[#@LINE+2]]
struct Assigns : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {(p.y + 7) % zero(p) & 3}); }
  void process(const Point &p) { piko::atomicAdd(state().out[0], p.tag); }
};
struct Assign : One<Assigns> {};

// SCHEDULE: expected: {{.*}}stage 'Schedules', bin 4: expected an integer division to have a result, but it divides by 0 or overflows
// SCHEDULE: got: stage 'only', bin 4: expected an integer division to have a result, but it divides by 0 or overflows
struct Schedules : Binned {
  void schedule(piko::BinId bin) { batch(20 + 7 / (bin.index - 4)); }
  void process(const piko::List<Point> &list) {
    piko::atomicAdd(state().out[0], int(list.size()));
  }
};
struct Schedule : One<Schedules> {};

// FUSED: expected: {{.*}}stage 'FusedQuotient'[[WHERE:, bin 5: expected an integer division to have a result, but it divides by 0 or overflows]]{{$}}
// FUSED: got: stage 'last'[[WHERE]]{{$}}
struct PassOn : piko::Stage<8, 8, 64, Point, Point> {
  void assignBin(const Point &p) { assignToBin(p, {5}); }
  void process(const Point &p) { emit(p); }
};
struct FusedQuotient : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void process(const Point &p) {
    piko::atomicAdd(state().out[0], (p.y + 7) / zero(p));
  }
};
struct Fused : piko::Pipe<State> {
  PassOn pass;
  FusedQuotient last;
  Fused() {
    source(pass);
    connect(pass, 0, last);
  }
};

// Divisions that are not reached where they have no result.
struct Guards : Binned {
  void process(const Point &p) {
    int q = p.y != 0 && p.y != -1 ? p.x / p.y : -1;
    if (p.y > 0)
      q ^= p.x % p.y;
    if (p.tag != 0 && p.tag != -1)
      q ^= p.x / p.tag - p.x % p.tag;
    q ^= int(uint32_t(p.x) / (uint32_t(p.y) | 1u));
    piko::atomicXor(state().out[p.tag & 15], q);
  }
};
struct Guarded : One<Guards> {};

// Much arithmetic, in which lanes that need no division have a divisor of 0.
struct Manies : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    float v = p.value;
    for (int k = 0; k < 8; ++k)
      v = v * 0.75f + piko::sqrt(piko::max(v, 0.0f)) * float(k) - p.value;
    int divisor = p.tag % 4, q = p.x;
    if (divisor != 0)
      q = (p.x * 100 + p.y) / divisor;
    for (int k = 0; k < 8; ++k)
      v = v * 0.5f + float(q) * 0.25f;
    piko::atomicAdd(state().out[p.tag % 16], piko::toInt(v) ^ q);
  }
};
struct Many : One<Manies> {};

// By constants, of which -1 makes of the smallest number itself.
struct Constants : Binned {
  void process(const Point &p) {
    int q = p.x / 7 ^ p.x % 10 ^ p.y / -3 ^ p.y % 8 ^ p.tag / 16;
    q ^= int(uint32_t(p.x) / 5u) ^ int(int64_t(p.y) * 3 / 11);
    piko::atomicXor(state().out[p.tag & 15], q);
  }
};
struct Constant : One<Constants> {};
