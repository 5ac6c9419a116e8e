// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Messages call stages, state and collectives what the user calls them: a stage
// may have the name of a piece of state, and run inside another one. Of
// collectives that not all iterations call, the message names the first.
// REQUIRES: all
// RUN: sed -n 's|^// STOP: ||p' %s > %t.stops
// RUN: not piko-compare %s --cases %t.stops --runs 1 --threads 1 > %t.out
// HOLE: x86-64-v3, x86-64, gpu-on-cpu, cuda: names in messages come from the frontend
// RUN: sed -n '/^Same:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=SAME
// RUN: sed -n '/^Any:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=any
// RUN: sed -n '/^All:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=all
// RUN: sed -n '/^Count:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=count
// RUN: sed -n '/^Reduce:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=reduce
// RUN: sed -n '/^Scan:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=scan
// RUN: sed -n '/^Sort:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=sort
// RUN: sed -n '/^Sync:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=sync
// RUN: sed -n '/^Types:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=scan
// RUN: sed -n '/^Calls:/,/^[A-Za-z]*:$/p' %t.out | FileCheck %s --check-prefix=CALL -DCALL=any
// STOP: --pipe Same --domain 8 8
// STOP: --pipe Any
// STOP: --pipe All
// STOP: --pipe Count
// STOP: --pipe Reduce
// STOP: --pipe Scan
// STOP: --pipe Sort
// STOP: --pipe Sync
// STOP: --pipe Types
// STOP: --pipe Calls
// RUN: not pikoc %s --pipe Waiting -o %t.o 2>&1 | FileCheck %s --check-prefix=WAIT
#include "../Inputs/ports.h"

struct State {
  piko::Buffer<int> out, smooth;
};

struct PassOn : piko::Stage<8, 8, 64, Point, Point> {
  void assignBin(const Point &p) { assignToAll(p); }
  void process(const Point &p) { emit(p); }
};
struct Smooth : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void process(const Point &p) { state().smooth[p.tag - p.tag - 7] = 1; }
};
// SAME: expected: {{.*}}stage 'Smooth'[[WHERE:, bin 0: expected an index into 'smooth' in \[0, 64\), but got -7]]{{$}}
// SAME: got: stage 'smooth'[[WHERE]]{{$}}
struct Same : piko::Pipe<State> {
  PassOn out; // each stage has the name of a buffer
  Smooth smooth;
  Same() {
    source(out);
    connect(out, 0, smooth);
  }
};

struct End : piko::Stage<0, 0, 1, Point>, piko::Uses<State> {
  void process(const Point &) {}
};
struct Early : piko::Stage<0, 0, 1, Point, Point>, piko::Uses<State> {
  void schedule(piko::BinId) { endStage<End>(); }
  void process(const Point &p) { emit(p); }
};
// WAIT: error: stage 'out' waits for stage 'smooth', which cannot finish before it
struct Waiting : piko::Pipe<State> {
  Early out;
  End smooth;
  Waiting() {
    source(out);
    connect(out, 0, smooth);
  }
};

/// F is called by the first three iterations alone.
template <class F>
struct Part : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &) {
    parallelFor(8, [&](int i) {
      if (i < 3)
        state().out[i] = F::call(*this, i);
    });
  }
};
template <class F> struct One : piko::Pipe<State> {
  Part<F> stage;
  One() { this->source(stage); }
};
// CALL: expected: {{.*}}stage '{{[^']*}}', bin 0: expected every iteration of parallelFor to call [[CALL]]() as often as iteration 0, but iteration 3 does not
// CALL: got: stage 'stage', bin 0: expected every iteration of parallelFor to call [[CALL]]() as often as iteration 0, but iteration 3 does not
inline int add(int a, int b) { return a + b; }
struct CallAny {
  static int call(auto &stage, int i) { return stage.any(i == 1); }
};
struct CallAll {
  static int call(auto &stage, int i) { return stage.all(i == 1); }
};
struct CallCount {
  static int call(auto &stage, int i) { return int(stage.count(i == 1)); }
};
struct CallReduce {
  static int call(auto &stage, int i) { return stage.reduce(i, add); }
};
struct CallScan {
  static int call(auto &stage, int i) { return stage.scan(i, add); }
};
struct CallSort {
  static int call(auto &stage, int i) { return int(stage.sort(-i)); }
};
struct CallSync {
  static int call(auto &stage, int i) {
    stage.sync();
    return i;
  }
};
struct Any : One<CallAny> {};
struct All : One<CallAll> {};
struct Count : One<CallCount> {};
struct Reduce : One<CallReduce> {};
struct Scan : One<CallScan> {};
struct Sort : One<CallSort> {};
struct Sync : One<CallSync> {};

/// All iterations call something, but not the same.
struct ScanTypes : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &) {
    parallelFor(8, [&](int i) {
      if (i < 3)
        state().out[i] = scan(i, [](int a, int b) { return a + b; });
      else
        state().out[i] =
            int(scan(float(i), [](float a, float b) { return a + b; }));
    });
  }
};
struct Types : piko::Pipe<State> {
  ScanTypes stage;
  Types() { source(stage); }
};
struct AnyOrAll : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &) {
    parallelFor(
        8, [&](int i) { state().out[i] = i < 3 ? any(i == 1) : all(i == 1); });
  }
};
struct Calls : piko::Pipe<State> {
  AnyOrAll stage;
  Calls() { source(stage); }
};
