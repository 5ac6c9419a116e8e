// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A product of two matrices, a row of it for each primitive.
#include <piko.h>

struct Row {
  int i;
};
struct State {
  int n = 0;
  piko::Buffer<float> a, b, c;
};

struct Multiply : piko::Stage<0, 0, 1, Row>, piko::Uses<State> {
  void process(const Row &row) {
    int n = state().n;
    for (int j = 0; j < n; ++j)
      state().c[row.i * n + j] = 0;
    for (int k = 0; k < n; ++k) {
      float a = state().a[row.i * n + k];
      for (int j = 0; j < n; ++j)
        state().c[row.i * n + j] += a * state().b[k * n + j];
    }
  }
};
struct Matmul : piko::Pipe<State> {
  Multiply multiply;
  Matmul() { source(multiply); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int n = 192;
  std::vector<Row> rows;
  std::vector<float> a, b, c = std::vector<float>(n * n);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < n * n; ++i) {
      a.push_back(random.in(-1, 1));
      b.push_back(random.in(-1, 1));
    }
    for (int i = 0; i < n; ++i)
      rows.push_back({i});
    pipe.setDomain({1, 1});
    pipe.state().n = n;
    bodies::bind(pipe.state().a, a);
    bodies::bind(pipe.state().b, b);
    bodies::bind(pipe.state().c, c);
    pipe.feed(pipe.multiply, rows);
  }
  // A product and a sum for each step.
  double flops() const { return 2.0 * n * n * n; }
  // a and b are read, c is written.
  double bytes() const { return 3.0 * n * n * sizeof(float); }
  uint64_t result(auto &) { return bodies::hash(c); }
};
PIKO_BODY_MAIN(Matmul, Host)
#endif
