// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A product of two matrices by inner products, with matrices as arrays in
// records.
#include <piko.h>

struct Pair {
  float a[8][8], b[8][8];
};
struct Product {
  float c[8][8];
};
struct State {
  piko::Buffer<float> traces;
};

struct Multiply : piko::Stage<0, 0, 1, Pair, Product> {
  void process(const Pair &p) {
    Product out;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        float sum = 0;
        for (int k = 0; k < 8; ++k)
          sum += p.a[i][k] * p.b[k][j];
        out.c[i][j] = sum;
      }
    emit(out);
  }
};
struct Trace : piko::Stage<0, 0, 1, Product>, piko::Uses<State> {
  void process(const piko::List<Product> &list) {
    for (int64_t n = 0; n < list.size(); ++n) {
      float trace = 0;
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
          trace += list[n].c[i][j] * list[n].c[j][i];
      state().traces[n] = trace;
    }
  }
};
struct Dots : piko::Pipe<State> {
  Multiply multiply;
  Trace trace;
  Dots() {
    source(multiply);
    connect(multiply, 0, trace);
  }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Pair> pairs = std::vector<Pair>(5000);
  std::vector<float> traces = std::vector<float>(5000);
  void bind(auto &pipe) {
    bodies::Random random;
    for (Pair &p : pairs)
      for (int i = 0; i < 64; ++i) {
        p.a[i / 8][i % 8] = random.in(-1, 1);
        p.b[i / 8][i % 8] = random.in(-1, 1);
      }
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().traces, traces);
    pipe.feed(pipe.multiply, pairs);
  }
  uint64_t result(auto &) { return bodies::hash(traces); }
};
PIKO_BODY_MAIN(Dots, Host)
#endif
