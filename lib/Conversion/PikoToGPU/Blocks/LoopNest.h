// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that count, as C++ has them.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_LOOPNEST_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_LOOPNEST_H

#include "Piko/Analysis/CountedLoop.h"

namespace piko {

/// for (i = first; i < bound or i <= bound; ++i), where the loop hands on
/// nothing else.
struct NestLoop {
  mlir::scf::WhileOp loop;
  mlir::Value first, bound;
  mlir::arith::CmpIPredicate predicate;

  bool isInclusive() const {
    return predicate == mlir::arith::CmpIPredicate::sle ||
           predicate == mlir::arith::CmpIPredicate::ule;
  }
  mlir::Block *body() { return loop.getAfterBody(); }
};

std::optional<NestLoop> findNestLoop(mlir::Operation *op);

/// The loop in another one that has nothing else with an effect in it, and
/// counts from and to the same in each of its iterations.
std::optional<NestLoop> matchInnerLoop(NestLoop outer);

/// Makes one loop of two that are nested (loop coalescing), in which a thread
/// that has come to the end of a row goes on with the next one at once.
void coalesceLoops(mlir::Operation *outer);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_LOOPNEST_H
