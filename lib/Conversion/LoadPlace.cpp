// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where a load takes registers for no longer than it saves loads.

#include "LoadPlace.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Interfaces/LoopLikeInterface.h"

using namespace mlir;
using namespace piko;

static bool holdsOtherLoop(LoopLikeOpInterface loop, Operation *op) {
  return loop
      ->walk([&](LoopLikeOpInterface inner) {
        return inner->isAncestor(op) ? WalkResult::advance()
                                     : WalkResult::interrupt();
      })
      .wasInterrupted();
}

/// Whether a run that comes here fails.
static bool fails(Block *block) {
  return llvm::any_of(*block, [](Operation &op) {
    return op.hasTrait<Failure>() || op.hasAttr(marks::fails);
  });
}

Operation *piko::findLoadPlace(Operation *user, Operation *around) {
  for (Operation *op = user; around->isProperAncestor(op);
       op = op->getParentOp())
    if (fails(op->getBlock()))
      return op;
  Operation *place = user;
  while (auto loop = place->getParentOfType<LoopLikeOpInterface>()) {
    if (!around->isProperAncestor(loop) || holdsOtherLoop(loop, place))
      break;
    place = loop;
  }
  return place;
}
