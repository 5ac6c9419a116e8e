// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records of 252 bytes, through three stages that change a few fields each.
#include <piko.h>

struct Item {
  glm::vec3 position, velocity, color;
  float weights[16];
  int neighbours[16];
  glm::mat4 frame;
  float more[4];
  int id, kind;
};
static_assert(sizeof(Item) == 252);
struct State {
  float dt = 0.25f;
  piko::Buffer<Item> out;
};

struct Move : piko::Stage<0, 0, 1, Item, Item>, piko::Uses<State> {
  void process(const Item &item) {
    Item next = item;
    next.position += state().dt * item.velocity;
    next.weights[item.id & 15] += 1;
    emit(next);
  }
};
struct Tint : piko::Stage<8, 8, 1, Item, Item> {
  void assignBin(const Item &item) {
    assignToBin(item, binFromPosition(glm::vec2(item.position)));
  }
  void process(const Item &item) {
    Item next = item;
    next.color = next.color * 0.5f + glm::vec3(next.frame[3]) * 0.25f;
    next.kind += 1;
    emit(next);
  }
};
struct Keep : piko::Stage<0, 0, 1, Item>, piko::Uses<State> {
  void process(const Item &item) { state().out[item.id] = item; }
};
struct Records : piko::Pipe<State> {
  Move move;
  Tint tint;
  Keep keep;
  Records() {
    source(move);
    connect(move, 0, tint);
    connect(tint, 0, keep);
  }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Item> items, out;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 20000; ++i) {
      Item item = {};
      item.position = {random.in(8, 56), random.in(8, 56), 0};
      item.velocity = {random.in(-1, 1), random.in(-1, 1), 1};
      item.color = {random.unit(), random.unit(), random.unit()};
      item.frame = glm::mat4(random.unit());
      item.id = i;
      items.push_back(item);
    }
    out.resize(items.size());
    pipe.setDomain({64, 64});
    pipe.state().dt = 0.25f;
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.move, items);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Records, Host)
#endif
