//===- Expected.h - What the pipelines must give, computed by hand --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Plain sequential programs, which share nothing with the reference executor,
// the compiler or the runtime.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_CONFORMANCE_EXPECTED_H
#define PIKO_CONFORMANCE_EXPECTED_H

#include "Records.h"

#include <cstddef>
#include <vector>

namespace conformance {

using std::size_t;
using Dots = std::vector<Dot>;
using Walkers = std::vector<Walker>;
using Items = std::vector<Item>;

/// An image of the domain, x fastest.
template <class T> struct Grid {
  Grid(int width, int height)
      : width(width), height(height), cells(size_t(width) * height) {}
  bool has(int x, int y) const {
    return x >= 0 && y >= 0 && x < width && y < height;
  }
  T &at(int x, int y) { return cells[size_t(y) * width + x]; }
  friend bool operator==(const Grid &, const Grid &) = default;

  int width, height;
  std::vector<T> cells;
};
using Traces = Grid<Trace>;

Traces expectJoins(int width, int height, int bias, const Dots &split,
                   const Dots &draw);
/// What `trace` has; what Stacks has in `passed` is the same of other values.
Traces expectWalk(int width, int height, int bias, const Walkers &walkers);
Traces expectPassed(int width, int height, int bias, const Walkers &walkers);
/// The same of Crossings, where every other hop is seen: from the first one on
/// of `walkers`, and of `others` from the second one on.
Traces expectCrossed(int width, int height, int bias, const Walkers &walkers,
                     const Walkers &others);
Traces expectRounds(int width, int height, const Walkers &walkers);
Traces expectSchedules(int width, int height, const Dots &dots);
Traces expectPolicies(int width, int height, const Dots &dots);

struct FrameResult {
  std::vector<int32_t> sums, found;
  Items kept;
  Grid<Nearest> nearest;
  Grid<int32_t> touched;
};
/// `sums` is what the run begins with.
FrameResult expectFrame(int width, int height, int scale,
                        const std::vector<int32_t> &table,
                        std::vector<int32_t> sums, const Items &items,
                        const std::vector<int32_t> &finds);

} // namespace conformance

#endif // PIKO_CONFORMANCE_EXPECTED_H
