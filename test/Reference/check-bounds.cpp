// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What plain C++ has for arrays: a sanitizer that says where an index is
// outside.
// RUN: %cxx_reference -fsanitize=bounds -fno-sanitize-recover=bounds %s -o %t
// RUN: not %t 2>&1 | FileCheck %s
#include <piko.h>

#include <vector>

struct State {
  piko::Buffer<int> out;
};
struct Far : piko::Stage<0, 0, 1, int>, piko::Uses<State> {
  void process(const int &i) {
    int values[4] = {1, 2, 3, 4};
    // CHECK: check-bounds.cpp:[[#@LINE+1]]:22: runtime error: index 7 out of bounds for type 'int[4]'
    state().out[0] = values[i];
  }
};
struct FarPipe : piko::Pipe<State> {
  Far far;
  FarPipe() { source(far); }
};

int main() {
  std::vector<int> in{7}, out(1);
  FarPipe pipe;
  pipe.setDomain({1, 1});
  pipe.state().out.bind(out.data(), 1);
  pipe.feed(pipe.far, in);
  pipe.run();
}
