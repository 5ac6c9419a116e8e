// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins in one dimension: cells are a glm::ivec1 and positions a glm::vec1, in the
// reference executor and compiled.
// REQUIRES: all
// RUN: %compare_targets %s --domain 53 --count 500 --runs 1 | FileCheck %s
// CHECK: equal
// RUN: %cxx_after_header -Wall -Wextra -Werror -DMAIN %s -o %t && %t | FileCheck %s --check-prefix=REFERENCE
// REFERENCE: 7 22 53
//
// The host of a compiled one does the same.
// RUN: rm -rf %t.dir && mkdir %t.dir && pikoc %s -o %t.dir/p.o --header %t.dir/p.h
// RUN: %cxx_quick_host -DHOST -I %t.dir %s %t.dir/p.o %link_host -o %t.host && %t.host | FileCheck %s --check-prefix=REFERENCE
#ifdef HOST
#include "p.h"
#else
#include <piko.h>

struct Item {
  float at;
  int value;
};
struct Sum {
  int total = 0, last = -1;
};
struct State {
  piko::Image<Sum, 1> sums;
  piko::Image<int, 1> copied;
};

struct Add : piko::BasicStage<piko::Bins<8>, 64, Item, Item>,
             piko::Uses<State> {
  void assignBin(const Item &i) {
    glm::vec1 at(i.at);
    if (binFromPosition(at).index >= 0)
      assignToBoundingBox(i, at, at);
  }
  void process(const Item &i) {
    update(state().sums, {piko::toInt(i.at)}, [&](Sum &s) {
      s.total += i.value;
      s.last = i.value;
    });
    emit(i);
  }
};

struct Copy : piko::BasicStage<piko::Bins<8>, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &i) {
    assignToBoundingBox(i, glm::ivec1(0), glm::ivec1(piko::toInt(i.at)));
  }
  void schedule(piko::BinId) {
    everyBin();
    endStage<Add>();
  }
  void process(const piko::List<Item> &) {
    glm::ivec1 lo = binLo(), hi = binHi(), all = domain();
    parallelForPixels([&](glm::ivec1 p) {
      bool isInside = p.x >= lo.x && p.x < hi.x && hi.x <= all.x;
      state().copied.store(p, isInside ? state().sums(p).total : -1);
    });
  }
};

struct P : piko::Pipe<State> {
  Add add;
  Copy copy;
  P() {
    source(add);
    connect(add, 0, copy);
  }
};
#endif

#if defined(MAIN) || defined(HOST)
#include <cstdio>
#include <vector>
#ifdef HOST
using P = pipelines::P;
using Item = P::Item;
#endif

int main() {
  std::vector<Item> items{{1.5f, 3}, {19, 4}, {1, 4}, {52.9f, 22}, {53, 9}};
  P pipe;
  pipe.setDomain({53});
  pipe.feed(pipe.add, items);
#ifdef HOST
  if (auto status = pipe.run(); !status)
    return 1;
  auto copy = pipe.state().copied.view();
  std::printf("%d %d %d\n", copy(1), copy(52), int(copy.elements.size()));
#else
  pipe.run();
  auto &copy = pipe.state().copied;
  std::printf("%d %d %d\n", copy(glm::ivec1(1)), copy(glm::ivec1(52)),
              copy.extent().x);
#endif
}
#endif
