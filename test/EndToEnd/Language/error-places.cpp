// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An error of a run names the stage, and the bin if it is in a call of Process,
// in the same words in the reference ("expected") and compiled ("got"): also
// where a phase runs inside another stage's kernel.
// REQUIRES: all
// RUN: sed -n 's|^// STOP: ||p' %s > %t.stops
// RUN: %compare_targets %s --stops --cases %t.stops --runs 1 --threads 2 > %t.out
// RUN: sed -n '/^Read:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=READ
// RUN: sed -n '/^Store:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=STORE
// RUN: sed -n '/^Update:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=UPDATE
// RUN: sed -n '/^Item:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=ITEM
// RUN: sed -n '/^Part:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=PART
// RUN: sed -n '/^Assign:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=ASSIGN
// RUN: sed -n '/^Fused:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=FUSED
// RUN: sed -n '/^FusedAssign:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=FUSED-ASSIGN
// STOP: --pipe Read --count 1
// STOP: --pipe Store --count 1
// STOP: --pipe Update --count 1
// STOP: --pipe Item --count 1
// STOP: --pipe Part --count 1
// STOP: --pipe Assign --count 1
// STOP: --pipe Fused --count 1
// STOP: --pipe FusedAssign --count 1
// RUN: not piko-compare %s --pipe Fused --count 1 --runs 1 --threads 2 --without fuse-stages | FileCheck %s --check-prefix=FUSED
// RUN: pikoc %s --pipe Fused --emit=kernels -o - | FileCheck %s --check-prefix=KERNEL
// RUN: pikoc %s --pipe FusedAssign --emit=kernels -o - | FileCheck %s --check-prefix=KERNEL
// KERNEL: piko.stage @pass {{.*}} fused ["last"]
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> in, out;
  piko::Image<float> image;
};

struct Binned : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {5}); }
};
template <class S> struct One : piko::Pipe<State> {
  S only;
  One() { source(only); }
};

// READ: expected: {{.*}}stage 'ReadOutside'[[WHERE:, bin 5: expected an index into 'in' in \[0, 64\), but got -10000]]{{$}}
// READ: got: stage 'only'[[WHERE]]{{$}}
struct ReadOutside : Binned {
  void process(const Point &p) {
    piko::atomicAdd(state().out[0], state().in[p.tag - p.tag - 10000]);
  }
};
struct Read : One<ReadOutside> {};

// STORE: expected: {{.*}}stage 'StoreOutside'[[WHERE:, bin 5: expected an index into 'image' in \[0, 48\), but got 99]]{{$}}
// STORE: got: stage 'only'[[WHERE]]{{$}}
struct StoreOutside : Binned {
  void process(const Point &) { state().image.store({3, 99}, 1.0f); }
};
struct Store : One<StoreOutside> {};

// UPDATE: expected: {{.*}}stage 'UpdateOutside'[[WHERE:, bin 5: expected an update inside the stage's own bin, but got pixel \(1, 2\); the bin has \([0-9, ]+\) to \([0-9, ]+\)]]{{$}}
// UPDATE: got: stage 'only'[[WHERE]]{{$}}
struct UpdateOutside : Binned {
  void process(const Point &) {
    update(state().image, {1, 2}, [&](float &pixel) { pixel += 1; });
  }
};
struct Update : One<UpdateOutside> {};

// ITEM: expected: {{.*}}stage 'ItemOutside'[[WHERE:, bin 5: expected an index in \[0, 1\), but got 1]]{{$}}
// ITEM: got: stage 'only'[[WHERE]]{{$}}
struct ItemOutside : Binned {
  void process(const piko::List<Point> &list) {
    state().out[0] = list[list.size()].tag;
  }
};
struct Item : One<ItemOutside> {};

// PART: expected: {{.*}}stage 'PartWays'[[WHERE:, bin 5: expected every iteration of parallelFor to call sync\(\) as often as iteration 0, but iteration 3 does not]]{{$}}
// PART: got: stage 'only'[[WHERE]]{{$}}
struct PartWays : Binned {
  void process(const Point &) {
    parallelFor(8, [&](int i) {
      if (i < 3)
        sync();
      state().out[i] = i;
    });
  }
};
struct Part : One<PartWays> {};

struct PassOn : piko::Stage<8, 8, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, {5}); }
  void process(const Point &p) { emit(p); }
};
template <class S> struct Two : piko::Pipe<State> {
  PassOn pass;
  S last;
  Two() {
    source(pass);
    connect(pass, 0, last);
  }
};

// ASSIGN: expected: {{.*}}stage 'AssignOutside'[[WHERE:: expected an index into 'in' in \[0, 64\), but got 77777]]{{$}}
// ASSIGN: got: stage 'last'[[WHERE]]{{$}}
struct AssignOutside : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBin(p, {state().in[77777 + p.tag - p.tag] % 48});
  }
  void process(const Point &) {}
};
struct Assign : Two<AssignOutside> {};

// FUSED: expected: {{.*}}stage 'FusedRead'[[WHERE:, bin 5: expected an index into 'out' in \[0, 64\), but got 77777]]{{$}}
// FUSED: got: stage 'last'[[WHERE]]{{$}}
struct FusedRead : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void process(const Point &p) {
    piko::atomicAdd(state().out[77777 + p.tag - p.tag], 1);
  }
};
struct Fused : Two<FusedRead> {};

// FUSED-ASSIGN: expected: {{.*}}stage 'FusedAssignRead'[[WHERE:: expected an index into 'in' in \[0, 64\), but got 77777]]{{$}}
// FUSED-ASSIGN: got: stage 'last'[[WHERE]]{{$}}
struct FusedAssignRead : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (state().in[77777 + p.tag - p.tag] >= 0)
      assignToPreviousBins(p);
  }
  void process(const Point &p) { piko::atomicAdd(state().out[0], p.tag); }
};
struct FusedAssign : Two<FusedAssignRead> {};
