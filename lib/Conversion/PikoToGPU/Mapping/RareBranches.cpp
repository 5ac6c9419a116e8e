// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A thread that has a primitive of its own may come to a branch that keeps
// arrays, which the other way does not: clipping. Such a branch is *rare* if it
// is there for its effects; one that finds a number may be as usual as the
// other. One that the text calls likely is not rare.

#include "PikoToGPU/Mapping/RareBranches.h"

#include "PikoToGPU/PikoToGPU.h"

#include "Piko/Analysis/BranchProbability.h"

using namespace mlir;
using namespace piko;

/// The arrays that a region uses and `op`, which it is of, does not hold.
static SmallVector<memref::AllocaOp> findArraysOutside(Operation *op,
                                                       Region &region) {
  SmallVector<memref::AllocaOp> arrays;
  region.walk([&](Operation *inner) {
    for (Value operand : inner->getOperands()) {
      auto array = operand.getDefiningOp<memref::AllocaOp>();
      if (array && !op->isAncestor(array) && !llvm::is_contained(arrays, array))
        arrays.push_back(array);
    }
  });
  return arrays;
}

/// The way of a condition in a loop that has arrays of its iteration for
/// itself, where the other one uses none; null if there is no such way.
static Region *findRareWay(scf::IfOp branch, Operation *loop) {
  SmallVector<Region *> ways;
  for (Region &region : branch->getRegions()) {
    if (region.empty())
      return nullptr;
    SmallVector<memref::AllocaOp> arrays = findArraysOutside(branch, region);
    if (arrays.empty())
      continue;
    bool isOwn = llvm::all_of(arrays, [&](memref::AllocaOp array) {
      return loop->isAncestor(array) &&
             llvm::all_of(array->getUsers(), [&](Operation *user) {
               return region.isAncestor(user->getParentRegion());
             });
    });
    if (!isOwn)
      return nullptr;
    if (getProbability(branch, region).value_or(0) > 0.5)
      return nullptr;
    ways.push_back(&region);
  }
  return ways.size() == 1 ? ways.front() : nullptr;
}

SmallVector<Region *> piko::findRareWays(Operation *loop) {
  SmallVector<Region *> rare;
  loop->walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (llvm::is_contained(rare, op->getParentRegion()))
      return WalkResult::skip();
    if (auto branch = dyn_cast<scf::IfOp>(op); branch && !op->getNumResults())
      if (Region *way = findRareWay(branch, loop))
        rare.push_back(way);
    return WalkResult::advance();
  });
  return rare;
}

bool piko::hasRareIterationsOnly(Operation *loop) {
  SmallVector<Region *> rare = findRareWays(loop);
  bool all = true;
  loop->walk([&](ParallelLoopOpInterface parallel) {
    all &= llvm::any_of(rare, [&](Region *way) {
      return way->isAncestor(parallel->getParentRegion());
    });
  });
  return all && !rare.empty();
}
