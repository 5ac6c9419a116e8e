// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that count, as all passes find them. One that rewrites each loop it
// can, and asks for no more, has upstream's scf::upliftWhileToForLoop
// (MapThreads.cpp).

#ifndef PIKO_ANALYSIS_COUNTEDLOOP_H
#define PIKO_ANALYSIS_COUNTEDLOOP_H

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Interfaces/LoopLikeInterface.h"

#include <optional>

namespace piko {

/// for (i = first; i < end && ...; i += step): an scf.for, or an scf.while that
/// compares a number to which each iteration adds a constant. What else goes
/// from iteration to iteration, or is done by the test, callers ask for.
struct CountedLoop {
  /// It goes on while the counter compares so with a number.
  struct Bound {
    mlir::arith::CmpIPredicate predicate;
    mlir::Value end;
    mlir::Operation *at; ///< The comparison, or the scf.for.
  };

  mlir::LoopLikeOpInterface loop;
  mlir::Block *body = nullptr;
  mlir::BlockArgument counter; ///< Of the body.
  mlir::Value first;
  llvm::SmallVector<Bound, 1> bounds;
  std::optional<llvm::APInt> step; ///< Where that is a constant.
  unsigned number = 0;             ///< Which operand of the scf.while it is.

  bool isByOne() const { return step && step->isOne(); }
  /// The only bound, if that is the same in all iterations; null if not.
  const Bound *getBound() const;
  /// Whether an scf.while does nothing but to compare before its body, and
  /// hands all that it has on to it; an scf.for always does.
  bool onlyCompares() const;
  /// Of an scf.while, what makes the next number; null of an scf.for.
  mlir::Operation *getNext() const;
};

std::optional<CountedLoop> findCountedLoop(mlir::Operation *op);

} // namespace piko

#endif // PIKO_ANALYSIS_COUNTEDLOOP_H
