// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How the iterations of a parallel loop run as lanes of vectors.

#ifndef PIKO_LIB_TRANSFORMS_ITERATIONLANES_H
#define PIKO_LIB_TRANSFORMS_ITERATIONLANES_H

#include "Vectorize/Analysis/LaneOrder.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace piko {

struct Cycles; // LaneCycles.h

/// All of it, and what it takes.
class IterationLanes : public LaneOrder {
public:
  /// Of a loop whose iterations are independent but for barriers; with these it
  /// has at most as many iterations as there are lanes.
  IterationLanes(mlir::scf::ForOp loop, int64_t laneCount);

  /// Whether a side of a condition is short, and may be computed for nothing;
  /// with `isNested` also if there are conditions in it, of which scalar code
  /// would make branches.
  bool isCheap(mlir::Region &region, bool isNested = false) const;
  /// Estimates for as many iterations as there are lanes, in cycles.
  struct Cost {
    double vectors = 0, serial = 0; ///< at once, and one after the other
    double slowVectors = 0, slowSerial = 0; ///< Of these, in slow paths.
    double lines = 0;      ///< Of `vectors`, what lanes take of the cache.
    bool computes = false; ///< Or iterations clear or copy.
    /// What costs most where lanes take turns, or are in other places.
    std::multimap<double, mlir::Operation *, std::greater<>> obstacles;
    /// Of `serial`, what inner loops take.
    llvm::DenseMap<mlir::Operation *, double> loops;
    bool isWorthwhile() const { return vectors < serial; }
    /// What to multiply `vectors` and `serial` by to have the geometric means
    /// of what it takes where slow paths mostly run, and where they never do.
    double weighVectors() const { return weigh(slowVectors, vectors); }
    double weighSerial() const { return weigh(slowSerial, serial); }
    static double weigh(double slow, double all) {
      return slow > 0 ? std::sqrt(std::max(0.0, 1 - slow / all)) : 1;
    }
  };
  Cost getCost() const;
  /// The same by other constants.
  Cost getCost(const Cycles &cycles) const;
  /// How many iterations each lane makes of a loop that lanes leave at
  /// different times, as far as is known.
  double getOwnIterations(mlir::Operation *inner) const;
  /// How many iterations a lane makes of any loop, as far as is known.
  double getIterations(mlir::Operation *inner) const;
  /// How many iterations all lanes together make of a loop that is made of
  /// these two, as far as is known.
  double getFlatIterations(mlir::Operation *outer,
                           mlir::Operation *inner) const;

private:
  void analyze();
  /// Whether there were any.
  bool splitArraysOfIterations();
  bool addInstructions(mlir::Region &region, bool isOfStrip, bool isNested,
                       int64_t &count) const;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_ITERATIONLANES_H
