// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// parallelForPixels(lo, hi, f) in one and in three dimensions.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s
// CASE: --pipe One --domain 53 --count 200
// CASE: --pipe Three --domain 33 18 7 --count 200
#include <piko.h>

struct Seed {
  int x, y, z, size;
};
struct Sum {
  int total = 0, last = 0;
};

struct Line {
  piko::Image<Sum, 1> sums;
};
struct Mark : piko::BasicStage<piko::Bins<8>, 64, Seed>, piko::Uses<Line> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void process(const Seed &s) {
    int first = s.x % 60 - 3, last = first + (s.size & 15);
    if (s.y % 7 == 0)
      last = INT32_MAX;
    // By numbers, and by cells.
    parallelForPixels(first, last, [&](glm::ivec1 p) {
      update(state().sums, p, [&](Sum &sum) {
        sum.total += s.size;
        sum.last = sum.last * 31 + p.x;
      });
    });
    parallelForPixels(glm::ivec1(INT32_MIN), binLo() + 1, [&](glm::ivec1 p) {
      int before = reduce(p.x, [](int a, int b) { return a * 3 + b; });
      update(state().sums, p, [&](Sum &sum) { sum.last += before; });
    });
  }
};
struct One : piko::Pipe<Line> {
  Mark mark;
  One() { source(mark); }
};

struct Volume {
  piko::Image<Sum, 3> sums;
};
struct Fill : piko::BasicStage<piko::Bins<8, 8, 4>, 64, Seed>,
              piko::Uses<Volume> {
  void assignBin(const Seed &s) { assignToAll(s); }
  void process(const Seed &s) {
    glm::ivec3 lo(s.x % 40 - 3, s.y % 20 - 2, s.z % 8), hi = lo + (s.size & 7);
    if (s.size % 5 == 0)
      hi.z = INT32_MAX;
    if (s.size % 7 == 0)
      lo.y = INT32_MIN;
    parallelForPixels(lo, hi, [&](glm::ivec3 p) {
      int number = scan(1, [](int a, int b) { return a + b; });
      update(state().sums, p, [&](Sum &sum) {
        sum.total = sum.total * 17 + number;
        sum.last = p.x + p.y * 100 + p.z * 10000;
      });
    });
    // Loops that count become the same.
    glm::ivec3 from = glm::max(lo, binLo()), to = glm::min(hi, binHi() - 1);
    for (int z = from.z; z <= to.z; ++z)
      for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x)
          update(state().sums, {x, y, z}, [&](Sum &sum) { sum.total ^= x; });
  }
};
struct Three : piko::Pipe<Volume> {
  Fill fill;
  Three() { source(fill); }
};
