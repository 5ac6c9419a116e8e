// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Edges on which nothing is ever emitted still say in which order stages run, and
// what are rounds: results are those of the reference.
//
// REQUIRES: all
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Rounds --count 20
// CASE: --pipe Order --count 20
// CASE: --pipe Row --count 20
// CASE: --pipe Dropped --count 20
//
// A stage that nothing can reach is dropped, with its cycle.
// RUN: pikoc %s --pipe Dropped --emit=kernels | FileCheck %s --check-prefix=DROPPED
// DROPPED-LABEL: piko.pipeline @Dropped
// DROPPED-NOT: piko.stage @follow
//
// A circle of waits is an error, though nothing goes along one of its edges.
// RUN: not pikoc %s --pipe Circle --emit=kernels 2>&1 | FileCheck %s --check-prefix=CIRCLE
// CIRCLE: error: stage 'first' waits for stage 'second', which cannot finish before it
#include <piko.h>

struct Item {
  int value;
};

struct State {
  piko::Buffer<int> out;
};

constexpr bool traces = false; // a switch of the text

// Sends each item two ways.
struct Fork : piko::Stage<0, 0, 64, Item, Item, Item> {
  void process(const Item &i) {
    emit({i.value * 10}, 0);
    emit({i.value * 10 + 1}, 1);
  }
};

template <int Add> struct Pass : piko::Stage<0, 0, 64, Item, Item> {
  void process(const piko::List<Item> &list) {
    for (const Item &i : list)
      this->emit({i.value + Add});
  }
};

// The second port is for tracing.
template <int Add> struct Tap : piko::Stage<0, 0, 64, Item, Item, Item> {
  void process(const piko::List<Item> &list) {
    for (const Item &i : list) {
      this->emit({i.value + Add}, 0);
      if constexpr (traces)
        this->emit(i, 1);
    }
  }
};

// Shows in which order items come.
struct Hash : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const piko::List<Item> &list) {
    int hash = 0;
    for (const Item &i : list)
      hash = hash * 31 + i.value;
    state().out[0] = hash;
  }
};

struct Order : piko::Pipe<State> {
  Fork fork;
  Pass<1000> pass;
  Tap<2000> tap;
  Hash hash;
  Order() {
    source(fork);
    connect(fork, 0, pass);
    connect(fork, 1, tap);
    connect(tap, 1, pass); // never
    connect(pass, 0, hash);
    connect(tap, 0, hash);
  }
};

// Waits for another stage, and is never fed.
template <class Before> struct Late : piko::Stage<0, 0, 64, Item, Item> {
  void schedule(piko::BinId) { this->template endStage<Before>(); }
  void process(const Item &i) { this->emit(i); }
};

struct Row : piko::Pipe<State> {
  Fork fork;
  Late<Tap<2000>> late;
  Pass<1000> pass;
  Tap<2000> tap;
  Hash hash;
  Row() {
    source(fork);
    connect(fork, 0, pass);
    connect(fork, 1, tap);
    connect(tap, 1, late); // never
    connect(late, 0, pass);
    connect(pass, 0, hash);
    connect(tap, 0, hash);
  }
};

// Counts its calls: one for each round.
struct Collect : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void process(const piko::List<Item> &list) {
    piko::atomicAdd(state().out[0], 1);
    if constexpr (traces)
      emit(list[0]);
  }
};

struct Rounds : piko::Pipe<State> {
  Fork fork;
  Collect collect;
  Pass<1> pass;
  Rounds() {
    source(fork);
    connect(fork, 0, collect);
    connect(fork, 1, pass);
    connect(pass, 0, collect);
    connect(collect, 0, pass); // never
  }
};

struct Shade : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void process(const Item &i) {
    piko::atomicAdd(state().out[0], i.value);
    if constexpr (traces)
      emit(i);
  }
};

struct Dropped : piko::Pipe<State> {
  Shade shade;
  Pass<1> follow;
  Dropped() {
    source(shade);
    connect(shade, 0, follow); // never
    connect(follow, 0, shade);
  }
};

struct Sum : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &i) { piko::atomicAdd(state().out[0], i.value); }
};

struct First : piko::Stage<0, 0, 64, Item, Item> {
  void schedule(piko::BinId) { endStage<Sum>(); }
  void process(const Item &i) {
    if constexpr (traces)
      emit(i);
  }
};

struct Circle : piko::Pipe<State> {
  Fork fork;
  First first;
  Sum second;
  Circle() {
    source(fork);
    connect(fork, 0, first);
    connect(fork, 1, second);
    connect(first, 0, second); // never
  }
};
