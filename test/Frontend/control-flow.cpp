// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Early returns, switches that fall through, and nested loops with several
// exits are lifted to scf; no branch of cf is left.
// RUN: piko-translate --cpp-to-piko %s \
// RUN:   | FileCheck %s --implicit-check-not=cf.br --implicit-check-not=cond_br
#include <piko.h>

struct Item {
  int kind, count;
};
struct State {
  piko::Buffer<int> results;
};

// CHECK-LABEL: piko.stage @choose
struct Choose : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  // CHECK: scf.index_switch
  void process(const Item &item) {
    Item out = item;
    switch (item.kind) {
    case 0:
      out.count += state().results[1];
      [[fallthrough]];
    case 1:
      out.count *= state().results[2];
      break;
    case 7:
      return;
    default:
      out.count = state().results[3];
    }
    // CHECK: piko.emit 0
    emit(out, 0);
  }
};

// CHECK-LABEL: piko.stage @search
struct Search : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  // CHECK: scf.while
  // CHECK: scf.while
  // CHECK: piko.store
  void process(const Item &item) {
    int found = -1;
    for (int i = 0; i < item.count; ++i) {
      for (int j = 0;; ++j) {
        if (i * j == item.kind)
          continue;
        if (i + j > state().results[j])
          break;
        if (j > 100)
          return;
        found = i - j;
      }
      if (found == item.kind)
        break;
    }
    state().results[0] = found;
  }
};
struct Pipeline : piko::Pipe<State> {
  Choose choose;
  Search search;
  Pipeline() {
    source(choose);
    connect(choose, 0, search);
  }
};
