// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where a load takes registers for no longer than it saves loads.

#include "LoadPlace.h"

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

Operation *piko::findLoadPlace(Operation *user, Operation *around) {
  Operation *place = user;
  while (auto loop = place->getParentOfType<LoopLikeOpInterface>()) {
    if (!around->isProperAncestor(loop) || holdsOtherLoop(loop, place))
      break;
    place = loop;
  }
  return place;
}
