// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the tests of vectorized iterations share.
#pragma once
#include <piko.h>

struct Item {
  int x, y;
  float value;
  int serial;
};
struct Found {
  int x, y;
  int serial, iteration, ordinal;
};
struct Pixel {
  float sum;
  int count;
};

// A cell of the domain.
inline glm::ivec2 wrap(int x, int y, glm::ivec2 size) {
  return {int(unsigned(x) % unsigned(size.x)),
          int(unsigned(y) % unsigned(size.y))};
}

struct State {
  piko::Buffer<float> floats;
  piko::Buffer<double> doubles;
  piko::Buffer<int> ints;
  piko::Image<Pixel> picture;
};

template <class S> struct Alone : piko::Pipe<State> {
  S stage;
  Alone() {
    source(stage);
    allocateForSource(state().floats, 0);
    allocateForSource(state().doubles, 0);
    allocateForSource(state().ints, 0);
  }
};
