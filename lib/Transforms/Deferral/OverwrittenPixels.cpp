// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Deferral/OverwrittenPixels.h"
#include "Support/StateAccess.h"

#include "mlir/Interfaces/LoopLikeInterface.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SmallBitVector.h"

using namespace mlir;
using namespace piko;

/// Whether an update makes of a pixel what it was, or what has nothing to do
/// with that.
static bool overwrites(UpdateOp update) {
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  if (!update.getResults().empty())
    return false;
  for (auto [old, value] : llvm::zip(body.getArguments(), yield.getPixel()))
    for (OpOperand &use : old.getUses())
      if (use.getOwner() != yield || use.get() != value)
        return false;
  return true;
}

/// The numbers of a pixel that an update reads or changes.
static llvm::SmallBitVector getTouched(UpdateOp update) {
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  llvm::SmallBitVector touched(body.getNumArguments());
  for (auto [number, old] : llvm::enumerate(body.getArguments()))
    touched[number] = !old.hasOneUse() || *old.user_begin() != yield ||
                      yield.getPixel()[number] != old;
  return touched;
}

/// The images that a kernel overwrites numbers of, of which it sees nothing,
/// with what overwrites them.
static llvm::MapVector<StringAttr, SmallVector<UpdateOp>>
findOverwritten(Operation *kernel) {
  llvm::MapVector<StringAttr, SmallVector<UpdateOp>> overwritten;
  SmallVector<UpdateOp> changes;
  llvm::DenseSet<StringAttr> others;
  kernel->walk([&](Operation *op) {
    auto [state, kind] = getStateAccess(op);
    auto update = dyn_cast<UpdateOp>(op);
    if (update && overwrites(update))
      overwritten[state.getAttr()].push_back(update);
    else if (update)
      changes.push_back(update);
    else if (state)
      others.insert(state.getAttr());
  });
  overwritten.remove_if([&](auto &image) {
    return others.contains(image.first) ||
           llvm::any_of(changes, [&](UpdateOp change) {
             return change.getImageAttr().getAttr() == image.first &&
                    llvm::any_of(image.second, [&](UpdateOp update) {
                      return getTouched(change).anyCommon(getTouched(update));
                    });
           });
  });
  return overwritten;
}

SmallVector<SmallVector<Site>> piko::findSites(Operation *kernel) {
  SmallVector<SmallVector<Site>> groups;
  auto isOverwrittenWith = [](ArrayRef<Site> sites,
                              ArrayRef<UpdateOp> updates) {
    return llvm::equal(sites, updates, [](const Site &site, UpdateOp update) {
      return site.updates.front()->getBlock() == update->getBlock() &&
             llvm::equal(site.getCoordinates(), update.getCoordinates());
    });
  };
  for (auto &[image, updates] : findOverwritten(kernel)) {
    SmallVector<Site> *group = llvm::find_if(
        groups, [&](auto &sites) { return isOverwrittenWith(sites, updates); });
    if (group == groups.end())
      group = &groups.emplace_back(updates.size());
    for (auto [site, update] : llvm::zip(*group, updates))
      site.updates.push_back(update);
  }
  return groups;
}

// It stands in one loop, over pixels, of a phase that takes the bin's list.
bool piko::overwritesOnce(Operation *work, const Site &site) {
  Operation *loop = nullptr;
  for (Operation *at = site.updates.front()->getParentOp(); at != work;
       at = at->getParentOp())
    if (isa<LoopLikeOpInterface, ParallelLoopOpInterface>(at)) {
      if (loop || !isa<ParallelPixelsOp>(at))
        return false;
      loop = at;
    }
  return isa<ListsOp>(work);
}

Operation *piko::findOverwritingWork(BinsOp bins, ArrayRef<Site> sites) {
  Operation *only = nullptr;
  for (const Site &site : sites) {
    Operation *work =
        bins.getBodyBlock()->findAncestorOpInBlock(*site.updates.front());
    if (!work || (only && only != work))
      return nullptr;
    only = work;
  }
  return isa<WorkOpInterface>(only) ? only : nullptr;
}
