// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which of the loops that lanes may share they do share.

#ifndef PIKO_LIB_TRANSFORMS_LANECANDIDATE_H
#define PIKO_LIB_TRANSFORMS_LANECANDIDATE_H

#include "Vectorize/Shape/LaneNests.h"

#include "Piko/Analysis/TargetModel.h"

namespace piko {

/// Whether so many lanes are expected to take less than one, by as much as
/// estimates may be wrong.
bool isSurelyFaster(const IterationLanes::Cost &cost, int64_t laneCount);

/// Begins a remark at a loop that names its stage.
mlir::InFlightDiagnostic remarkStage(mlir::Operation *loop);

/// A loop that lanes may share.
class LaneCandidate {
public:
  /// Where estimates are within the factor `window` of each other it may be
  /// held in two versions.
  explicit LaneCandidate(mlir::scf::ForOp loop, double window = 1);

  /// Whether lanes are given its iterations.
  bool isChosen() const { return chosen; }
  /// Whether it becomes vectors, which a remark tells; `flat` is what lanes may
  /// do instead.
  bool decide(const IterationLanes &lanes, const FlatLoop &flat = {});
  /// If it is to be held in two versions: what these are expected to take.
  struct Versions {
    double vectors, scalar; ///< In cycles.
    bool expected;          ///< Vectors are expected to be faster.
  };
  const std::optional<Versions> &getVersions() const { return versions; }
  /// The estimates by other constants than the processor's, which is not to be
  /// decided by.
  Versions estimate(const IterationLanes &lanes, const FlatLoop &flat,
                    const Cycles &cycles);
  /// Whether it becomes vectors of twice as many lanes.
  bool isPaired() const { return paired; }

private:
  mlir::InFlightDiagnostic refuse();
  /// Why it is expected to take less otherwise, for a remark; or nothing.
  struct Refusal {
    std::string why;
    bool byCycles = false; ///< Which are estimates.
  };
  Refusal findRefusal(const IterationLanes &lanes, const FlatLoop &flat);
  /// Whether the estimates are too close to say which version is faster.
  bool isDoubtful(const IterationLanes &lanes, const FlatLoop &flat,
                  bool isRefused);
  /// How much of the window is the loop's, on a logarithmic scale: less for
  /// large bodies.
  double getShareOfWindow(bool isRefused);
  /// Whether two vectors at once are expected to take much less.
  bool paysInPairs(const IterationLanes &lanes, const FlatLoop &flat) const;
  void remarkVectors(const IterationLanes &lanes, const FlatLoop &flat);
  /// What it takes to run primitives one after the other, and to give lanes the
  /// iterations of loops in them, in cycles.
  double getCostInside(const IterationLanes &lanes,
                       const IterationLanes::Cost &cost);

  /// What the scalar version takes for as many iterations as lanes have, of
  /// which the row of a box may have fewer; in cycles.
  double getScalarCost(const IterationLanes &lanes,
                       const IterationLanes::Cost &cost, const Cycles &cycles);

  mlir::scf::ForOp loop;
  bool ofPrimitives;
  bool chosen = false;
  bool preferred = true; ///< By piko-map-lanes, or nothing else is.
  double window;
  std::optional<Versions> versions;
  bool paired = false;
  bool said = false; ///< By the schedule, or by barriers, whatever it costs.
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANECANDIDATE_H
