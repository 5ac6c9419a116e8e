// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Nested choices among elements of one local record, each with an index of its
// own: instcombine makes one load of them, through a pointer chosen by a phi.
// Atomics through references to one of several things.
// RUN: %compare_targets %s --count 3000 --wide | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Entry {
  int64_t amount;
  bool flag;
};
struct Record {
  Entry entries[2];
  int x, y, z, w, serial;
};
struct Result {
  int64_t first, second;
};
struct State {
  piko::Buffer<Result> results;
  piko::Buffer<int> even, odd;
};

struct Choose : piko::Stage<0, 0, 64, Record>, piko::Uses<State> {
  static uint32_t half(int x) { return uint32_t(x) % 2u; }
  void process(const Record &p) {
    Record q = p;
    q.entries[half(p.x)].amount =
        (p.y & 1) ? q.entries[half(p.z)].amount
        : q.entries[half(p.w)].flag
            ? q.entries[half(p.entries[half(p.y)].flag ? p.z * 3 : p.x)].amount
            : q.entries[half(p.w >> 1)].amount;
    Entry &chosen = (p.y & 2) ? q.entries[half(p.z)] : q.entries[half(p.w)];
    chosen.flag = !chosen.flag;
    int64_t &amount =
        (p.w & 2) ? chosen.amount
                  : q.entries[half(q.entries[0].flag ? p.x : p.y)].amount;
    amount += 3;
    int local = 5;
    piko::atomicMax((p.x & 4) ? local : q.z, p.y);
    piko::atomicAdd(q.entries[half(local)].amount, int64_t(q.z));
    piko::atomicAdd(p.serial % 2 ? state().odd[p.serial / 2 & 7]
                                 : state().even[p.serial / 2 & 7],
                    p.w);
    state().results[p.serial] = {q.entries[0].amount, q.entries[1].amount};
  }
};
struct ChosenElements : piko::Pipe<State> {
  Choose choose;
  ChosenElements() {
    source(choose);
    allocateForSource(state().results, 0);
    allocateForSource(state().even, 0);
    allocateForSource(state().odd, 0);
  }
};
