// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where the host's numbers are expected to be indices, programs give the same
// without a test in a kernel.
// RUN: %compare_targets %s --pipe Mesh --count 500 | FileCheck %s
// RUN: %compare_targets %s --pipe Chains --count 500 | FileCheck %s
// RUN: %compare_targets %s --pipe Trees --count 500 | FileCheck %s
// RUN: %compare_targets %s --pipe Orders --count 500 | FileCheck %s
// RUN: %compare_targets %s --pipe Lists --count 500 | FileCheck %s
// RUN: %compare_targets %s --pipe Hops --count 200 | FileCheck %s
// CHECK: equal
//
// RUN: pikoc %s --pipe Mesh --emit kernels -o - | FileCheck %s --check-prefix=CODE
// RUN: pikoc %s --pipe Chains --emit kernels -o - | FileCheck %s --check-prefix=CODE
// RUN: pikoc %s --pipe Trees --emit kernels -o - | FileCheck %s --check-prefix=CODE
// RUN: pikoc %s --pipe Orders --emit kernels -o - | FileCheck %s --check-prefix=CODE
// RUN: pikoc %s --pipe Hops --emit kernels -o - | FileCheck %s --check-prefix=CODE
// CODE: piko.kernel
// CODE-NOT: piko.{{load|store}} {{(%[^,]*, )?}}@{{.*\[.*\]}}
// CODE: piko.program
#include <piko.h>

struct Item {
  glm::ivec3 corner;
  uint32_t node;
  int64_t far;
  float value;
  int serial;
};
struct Vertex {
  float x, y;
  uint16_t material;
};
struct Node {
  int next, child[4];
  float value;
};
struct State {
  piko::Buffer<Vertex> vertices;
  piko::Buffer<Node> nodes;
  piko::Buffer<float> shine;
  piko::Buffer<int64_t> order;
  piko::Buffer<float> out; // one for each item
};

template <class Stage> struct Pipe : piko::Pipe<State> {
  Stage first;
  Pipe() {
    source(first);
    allocateForSource(state().out, 0);
    expectIndex<&Item::serial>(0, state().out);
    expectIndex<&Item::corner>(0, state().vertices);
    expectIndex<&Item::node>(0, state().nodes);
    expectIndex<&Item::far>(0, state().order);
    expectIndex<&Vertex::material>(state().vertices, state().shine);
    expectIndex<&Node::next>(state().nodes, state().nodes);
    expectIndex<&Node::child>(state().nodes, state().nodes);
    expectIndex(state().order, state().shine);
  }
};

// Triangles that another stage fetches, and their bins.
struct Send : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void process(const Item &i) {
    if (state().vertices[i.corner.z].x > -4)
      emit(i);
  }
};
struct Look : piko::Stage<8, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &i) {
    const Vertex &v = state().vertices[i.corner.y];
    assignToBoundingBox(i, {v.x, v.y}, {v.x, v.y});
  }
  void process(const Item &i) {
    float sum = 0;
    for (int c = 0; c < 3; ++c) {
      const Vertex &v = state().vertices[i.corner[c]];
      sum += v.x * state().shine[v.material] + v.y;
    }
    state().out[i.serial] = sum;
  }
};
struct Mesh : Pipe<Send> {
  Look look;
  Mesh() { connect(first, 0, look); }
};

// Linked lists, from the item's node on; the loop's index is carried.
struct Follow : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &i) {
    float sum = i.value;
    int at = int(state().nodes[i.node].next);
    for (int step = 0; step < 9 && sum < 20; ++step) {
      sum += state().nodes[at].value;
      at = state().nodes[at].next;
    }
    state().out[i.serial] = sum;
  }
};
struct Chains : Pipe<Follow> {};

// From the root down, by a choice of children.
struct Descend : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &i) {
    int64_t at = 0;
    float key = i.value;
    while (state().nodes[at].value < key) {
      const Node &n = state().nodes[at];
      at = key > 4 ? n.child[1] : key > 0 ? n.child[2] : n.next;
      key -= 3;
    }
    state().out[i.serial] = key + float(at);
  }
};
struct Trees : Pipe<Descend> {};

// Through a buffer of indices.
struct Reorder : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &i) {
    float sum = 0;
    for (int64_t k = 0; k < state().order.size(); ++k)
      sum += state().shine[state().order[k]] * i.value;
    parallelFor(4, [&](int k) {
      if (k == i.serial % 4)
        state().out[i.serial] = sum + state().shine[state().order[i.far]];
    });
  }
};
struct Orders : Pipe<Reorder> {};

// A bin's list.
struct All : piko::Stage<8, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &i) {
    assignToBoundingBox(i, {i.value + 8, 3}, {i.value + 8, 3});
  }
  void process(const piko::List<Item> &list) {
    parallelFor(int(list.size()), [&](int i) {
      const Item &item = list[i];
      state().out[item.serial] = state().vertices[item.corner.x].x;
    });
  }
};
struct Lists : Pipe<All> {};

// Indices that go round a cycle, each time the next one.
struct Hop : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void process(const Item &i) {
    const Node &n = state().nodes[i.corner.x];
    Item next = i;
    next.corner = {n.next, state().nodes[i.corner.y].next, n.child[3]};
    next.far = i.far - 5;
    if (i.far > 0)
      return emit(next);
    state().out[i.serial] = n.value + state().nodes[i.corner.y].value;
  }
};
struct Hops : piko::Pipe<State> {
  Hop hop;
  Hops() {
    source(hop);
    connect(hop, 0, hop);
    allocateForSource(state().out, 0);
    expectIndex<&Item::serial>(0, state().out);
    expectIndex<&Item::corner>(0, state().nodes);
    expectIndex<&Node::next>(state().nodes, state().nodes);
    expectIndex<&Node::child>(state().nodes, state().nodes);
  }
};
