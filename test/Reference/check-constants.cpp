// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// In checking mode a phase that changes a constant of the state or a member of
// its stage is found: which call it was, and the constant if it has a name.
// RUN: %cxx_reference -DPIKO_CHECK %s -o %t && %t | FileCheck %s
#include <piko.h>

#include <cstdio>
#include <vector>

struct State {
  piko::Image<int> image;
  glm::vec2 offset{0, 0};
  double named = 1;
  piko::Buffer<int> out;
};

enum Change { None, Offset, Named, Member, InIteration, InAssign, Before };
static Change change;

struct Early : piko::Stage<0, 0, 4, int, int>, piko::Uses<State> {
  void process(const int &i) {
    if (change == Before)
      state().named = 3;
    emit(i);
  }
};
struct Late : piko::Stage<0, 0, 4, int>, piko::Uses<State> {
  int member = 0;
  void assignBin(const int &i) {
    if (change == InAssign)
      state().named = 5;
    assignToAll(i);
  }
  void process(const int &i) {
    update(state().image, {0, 0}, [&](int &pixel) { pixel = i; });
    state().out[i] = i;
    if (change == Offset)
      state().offset.y = 1;
    if (change == Named)
      state().named = 2;
    if (change == Member)
      member = i;
    parallelFor(2, [&](int k) {
      sync();
      if (change == InIteration && k == 1)
        state().named = 4;
    });
  }
};
struct Pipe : piko::Pipe<State> {
  Early early;
  Late late;
  Pipe() {
    source(early);
    connect(early, 0, late);
  }
};

int main() {
  std::vector<int> in{1, 2};
  // CHECK: 0: {{$}}
  // CHECK: 1: stage 'Late', bin 0: expected phases to leave constants of the state as they are, but byte {{[0-9]+}} of 'State' was changed
  // CHECK-NEXT: lineage: source 0 primitive 0, 'Early' bin 0 emit 0
  // CHECK: 2: stage 'Late', bin 0: {{.*}}, but 'named' was changed
  // CHECK: 3: stage 'Late', bin 0: expected phases to leave members of a stage as they are, but byte {{[0-9]+}} of 'Late' was changed
  // CHECK: 4: stage 'Late', bin 0: {{.*}}, but 'named' was changed
  // CHECK: 5: stage 'Late': {{.*}}, but 'named' was changed
  // CHECK: 6: stage 'Early', bin 0: {{.*}}, but 'named' was changed
  // CHECK-NEXT: lineage: source 0 primitive 0
  for (int i = None; i <= Before; ++i) {
    change = Change(i);
    Pipe pipe;
    pipe.nameState(&pipe.state().named, "named");
    pipe.setDomain({2, 2});
    pipe.state().out.allocate(3);
    pipe.feed(0, in);
    std::printf("%d: %s\n", i, pipe.tryRun().message().c_str());
  }
}
