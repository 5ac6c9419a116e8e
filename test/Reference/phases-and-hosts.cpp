// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pikoc refuses the reference does not accept: buffers that a phase needs
// and nobody has bound, and the host's calls in a phase. A buffer that no phase
// uses need not be bound.
// RUN: %cxx_after_header %s -o %t && %t | FileCheck %s
#include <piko.h>

#include <cstdio>
#include <vector>

struct State {
  piko::Buffer<int> out, forgotten;
  piko::Buffer<float> unused;
  piko::Image<int> image;
};
static int which;

struct Use : piko::Stage<0, 0, 4, int>, piko::Uses<State> {
  void process(const int &) {
    int &out = state().out[0];
    switch (which) {
    case 1:
      out = state().forgotten[0];
      break;
    case 2:
      out = int(state().forgotten.size());
      break;
    case 3:
      for (int i : state().out)
        out += i;
      break;
    case 4:
      out = state().out.data()[1];
      break;
    case 5:
      out = int(state().image.size());
      break;
    case 6:
      out = state().image.data()[0];
      break;
    case 7:
      state().forgotten.allocate(3);
      break;
    case 8:
      out = state().out[2];
      break;
    case 9:
      out = state().image({1, 7});
      break;
    }
  }
};
struct UsePipe : piko::Pipe<State> {
  Use use;
  UsePipe() { source(use); }
};

int main() {
  // CHECK: 0: {{$}}
  // CHECK: 1: stage 'Use', bin 0: buffer 'forgotten' is not bound
  // CHECK: 2: stage 'Use', bin 0: buffer 'forgotten' is not bound
  // CHECK: 3: {{$}}
  // CHECK: 4: stage 'Use', bin 0: expected data() on the host's side,
  // CHECK: 5: stage 'Use', bin 0: expected size() of an image on the host's side,
  // CHECK: 6: stage 'Use', bin 0: expected data() on the host's side,
  // CHECK: 7: stage 'Use', bin 0: expected allocate() on the host's side,
  // CHECK: 8: stage 'Use', bin 0: expected an index into a buffer of 'int' in [0, 2), but got 2
  // CHECK: 9: stage 'Use', bin 0: expected an index into an image of 'int' in [0, 4), but got 7
  std::vector<int> in{1};
  for (which = 0; which < 10; ++which) {
    UsePipe pipe;
    pipe.nameState(&pipe.state().forgotten, "forgotten");
    pipe.setDomain({4, 4});
    pipe.state().out.allocate(2);
    pipe.feed(0, in);
    std::printf("%d: %s\n", which, pipe.tryRun().message().c_str());
  }
}
