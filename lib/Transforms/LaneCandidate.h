// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which of the loops that lanes may share they do share.

#ifndef PIKO_LIB_TRANSFORMS_LANECANDIDATE_H
#define PIKO_LIB_TRANSFORMS_LANECANDIDATE_H

#include "LaneNests.h"

namespace piko {

/// Whether so many lanes are expected to take less than one, by as much as
/// estimates may be wrong.
bool isSurelyFaster(const IterationLanes::Cost &cost, int64_t laneCount);

/// The number of lanes of vectors that have enough registers for two of each.
constexpr int64_t widestLanes = 16;

/// Begins a remark at a loop that names its stage.
mlir::InFlightDiagnostic remarkStage(mlir::scf::ForOp loop);

/// A loop that lanes may share.
class LaneCandidate {
public:
  explicit LaneCandidate(mlir::scf::ForOp loop);

  /// Whether lanes are given its turns.
  bool isChosen() const { return chosen; }
  /// Whether it becomes vectors, which a remark tells; `flat` is what lanes may
  /// do instead.
  bool decide(const IterationLanes &lanes, const FlatLoop &flat = {});
  /// Whether it becomes vectors of twice as many lanes.
  bool isPaired() const { return paired; }

private:
  mlir::InFlightDiagnostic refuse();
  /// Whether it is expected to take less otherwise, which a remark tells.
  bool isRefused(const IterationLanes &lanes, const FlatLoop &flat);
  /// Whether two vectors at once are expected to take much less.
  bool paysInPairs(const IterationLanes &lanes, const FlatLoop &flat) const;
  void remarkVectors(const IterationLanes &lanes, const FlatLoop &flat);
  /// Whether it takes less to run primitives one after the other, and to give
  /// lanes the iterations of loops in them.
  bool isFasterInside(const IterationLanes &lanes,
                      const IterationLanes::Cost &cost);

  mlir::scf::ForOp loop;
  bool ofPrimitives;
  bool chosen = false;
  bool paired = false;
  bool said = false; ///< By the schedule, or by barriers, whatever it costs.
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANECANDIDATE_H
