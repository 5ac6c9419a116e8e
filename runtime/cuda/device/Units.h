// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Units.h - Cuts positions into calls and units ----------------------===//
//
// A unit is what a block takes at a time: a cell, or a part of one that may be
// split; where Process takes a list, a call, or all of a bin. How units are cut
// is never seen in a result.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_UNITS_H
#define PIKO_RUNTIME_CUDA_DEVICE_UNITS_H

#include "cuda/device/Binning.h"

namespace piko::cuda {

class Cutter {
public:
  Cutter(Grid &grid, const JoinArgs &args, const Binning &bins, bool everyBin)
      : grid_(grid), args_(args), everyBin_(everyBin),
        positions_(bins.positions), offsets_(bins.offsets) {}

  pikoir_unit *units = nullptr;
  pikoir_call *calls = nullptr;
  int64_t unitCount = 0, callCount = 0;

  /// Between two barriers; all results are uniform.
  void run() {
    if (args_.takesList)
      return cutCalls();
    if (args_.serialize)
      return addWhole(args_.shape.cells, 0, positions_,
                      positions_ > 0 || args_.visitsAll);
    int64_t chunk = unitSize();
    cut(
        args_.shape.cells,
        [&](int64_t cell) {
          int64_t count = countOf(cell), least = args_.visitsAll ? 1 : 0;
          return larger(least, args_.splits ? ceilDivide(count, chunk)
                                            : smaller<int64_t>(count, 1));
        },
        unitCount);
    units = grid_.take<pikoir_unit>(unitCount);
    if (!grid_.hasFailed())
      grid_.forEach(unitCount, [&](int64_t u) {
        int64_t cell = groupOf(u, args_.shape.cells), begin = offsets_[cell],
                end = offsets_[cell + 1];
        if (args_.splits) {
          begin += (u - starts_[cell]) * chunk;
          end = smaller(end, begin + chunk);
        }
        units[u] = {cell, cell + 1, begin, end, -1};
      });
    grid_.sync();
  }

private:
  int64_t countOf(int64_t cell) const {
    return offsets_[cell + 1] - offsets_[cell];
  }

  int64_t unitSize() const {
    if (args_.tileSplit > 0)
      return args_.tileSplit;
    int64_t share = ceilDivide(positions_ / args_.unitsAtOnce, 64) * 64;
    return smaller<int64_t>(larger<int64_t>(share, 64), 1024);
  }

  /// `starts_` becomes the first piece of each group, of piecesOf(group) each.
  template <class Count>
  void cut(int64_t groups, const Count &piecesOf, int64_t &pieces) {
    starts_ = grid_.take<uint32_t>(groups + 1);
    if (grid_.hasFailed())
      return;
    grid_.forEach(groups + 1, [&](int64_t g) {
      starts_[g] = g < groups ? static_cast<uint32_t>(piecesOf(g)) : 0;
    });
    pieces = grid_.exclusiveScan(starts_, groups + 1);
  }

  /// The group of a piece: the last one that begins at or before it.
  int64_t groupOf(int64_t piece, int64_t groups) const {
    int64_t low = 0, high = groups;
    while (high - low > 1) {
      int64_t middle = (low + high) / 2;
      (starts_[middle] <= piece ? low : high) = middle;
    }
    return low;
  }

  /// Everything is one unit, if there is any.
  void addWhole(int64_t end, int64_t begin, int64_t positions, bool any) {
    unitCount = any;
    units = grid_.take<pikoir_unit>(unitCount);
    if (any && !grid_.hasFailed() && Grid::isFirst())
      units[0] = {0, end, begin, positions, -1};
    grid_.sync();
  }

  int64_t batchOf(int64_t count) const {
    int64_t batch = args_.batch > 0 ? args_.batch : count;
    return smaller<int64_t>(larger<int64_t>(batch, 1), UINT32_MAX);
  }

  void cutCalls() {
    cut(
        args_.shape.cells,
        [&](int64_t bin) {
          int64_t count = countOf(bin), least = everyBin_ ? 1 : 0;
          return larger(least, ceilDivide(count, batchOf(count)));
        },
        callCount);
    calls = grid_.take<pikoir_call>(callCount);
    if (grid_.hasFailed())
      return;
    grid_.forEach(callCount, [&](int64_t c) {
      int64_t bin = groupOf(c, args_.shape.cells),
              batch = batchOf(countOf(bin));
      int64_t begin = offsets_[bin] + (c - starts_[bin]) * batch;
      calls[c] = {bin, begin, smaller(offsets_[bin + 1], begin + batch)};
    });
    grid_.sync();
    if (args_.serialize)
      return addWhole(callCount, 0, positions_, callCount > 0);
    const uint32_t *firstCalls = starts_;
    if (!args_.splits)
      cut(
          args_.shape.cells,
          [&](int64_t bin) -> int64_t {
            return firstCalls[bin + 1] > firstCalls[bin];
          },
          unitCount);
    else
      unitCount = callCount;
    units = grid_.take<pikoir_unit>(unitCount);
    if (grid_.hasFailed())
      return;
    grid_.forEach(unitCount, [&](int64_t u) {
      int64_t first = u, end = u + 1;
      if (!args_.splits) {
        int64_t bin = groupOf(u, args_.shape.cells);
        first = firstCalls[bin];
        end = firstCalls[bin + 1];
      }
      units[u] = {first, end, calls[first].begin, calls[end - 1].end, -1};
    });
    grid_.sync();
  }

  Grid &grid_;
  const JoinArgs &args_;
  bool everyBin_;
  int64_t positions_;
  const int64_t *offsets_;
  uint32_t *starts_ = nullptr;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_UNITS_H
