// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Owners.h - Which rank owns which bins ------------------------------===//
//
// Stages with bins of one size, whose owners are found in one way, have the
// same owners. All ranks find the same, each by itself.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_RANKS_OWNERS_H
#define PIKO_RUNTIME_RANKS_OWNERS_H

#include "common/Pipeline.h"
#include "pikort/ranks.h"

#include <deque>

namespace piko::rt {

/// Bins of one size.
struct OwnedGrid {
  std::array<int64_t, 4> binSize{}, grid{};
  int32_t way = 0; ///< A pikort_owners.
  std::vector<int32_t> owners;
  std::vector<bool> ran;     ///< In this run, here.
  std::vector<int64_t> load; ///< Primitives in them, in this run, here.
  /// Bins so that neighbours follow each other, if the way asks for that.
  std::vector<int32_t> order;
  int64_t moved = 0; ///< Bins that have changed their owner, over all runs.
};

class Owners {
public:
  Owners(const pikort_pipeline &p, int32_t ranks) : p_(p), ranks_(ranks) {}

  /// When grids are known: owners by another way, or of other grids, and
  /// nothing has run. What the host has not said follows $PIKO_RANK_OWNERS;
  /// throws.
  void beginRun();
  /// Of a stage that is divided by bins.
  OwnedGrid &of(const Stage &stage);
  /// Those that are owned by load.
  std::deque<OwnedGrid> &grids() { return grids_; }
  /// Gives all ranks bins with as many primitives as the others. `load` is that
  /// of all ranks.
  void balance(OwnedGrid &grid, const std::vector<int64_t> &load) const;

private:
  int32_t wayOf(const Stage &stage) const;
  void assign(OwnedGrid &grid) const;

  const pikort_pipeline &p_;
  int32_t ranks_;
  int32_t environment_ = 0;     ///< A pikort_owners.
  std::deque<OwnedGrid> grids_; // which stay where they are
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_RANKS_OWNERS_H
