// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Vectorize/Analysis/LoadChains.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/DenseSet.h"

using namespace mlir;
using namespace piko;

namespace {

/// Goes back through what a value is computed from, in a loop.
class ChainSearch {
public:
  explicit ChainSearch(LoopLikeOpInterface loop) : loop(loop) {}
  /// Whether it comes to a load after what iterations hand on.
  bool find(Value value, bool isAfter = false);

private:
  bool findInArgument(BlockArgument argument, bool isAfter);
  bool findAny(ValueRange values, bool isAfter) {
    return llvm::any_of(values,
                        [&](Value value) { return find(value, isAfter); });
  }
  /// What is stored in an array in the loop.
  bool findInArray(Value array);

  LoopLikeOpInterface loop;
  std::array<llvm::DenseSet<Value>, 2> visited; ///< whether after
};

} // namespace

bool ChainSearch::findInArray(Value array) {
  return llvm::any_of(array.getUsers(), [&](Operation *user) {
    auto store = dyn_cast<memref::StoreOp>(user);
    return store && loop->isAncestor(store) &&
           find(store.getValueToStore(), /*isAfter=*/true);
  });
}

bool ChainSearch::findInArgument(BlockArgument argument, bool isAfter) {
  Operation *owner = argument.getOwner()->getParentOp();
  unsigned number = argument.getArgNumber();
  if (auto repeat = dyn_cast<scf::WhileOp>(owner)) {
    if (argument.getOwner() == repeat.getAfterBody())
      return find(repeat.getConditionOp().getArgs()[number], isAfter);
    return find(repeat.getYieldOp().getResults()[number],
                isAfter || owner == loop) ||
           (owner != loop && find(repeat.getInits()[number], isAfter));
  }
  auto range = dyn_cast<scf::ForOp>(owner);
  if (!range || number == 0)
    return range && owner != loop && find(range.getLowerBound(), isAfter);
  return find(range.getYieldedValues()[number - 1], isAfter || owner == loop) ||
         (owner != loop && find(range.getInitArgs()[number - 1], isAfter));
}

bool ChainSearch::find(Value value, bool isAfter) {
  if (loop.isDefinedOutsideOfLoop(value) ||
      !visited[isAfter].insert(value).second)
    return false;
  if (auto argument = dyn_cast<BlockArgument>(value))
    return findInArgument(argument, isAfter);
  Operation *op = value.getDefiningOp();
  if (isa<LoadOp>(op) && isAfter)
    return true;
  if (auto load = dyn_cast<memref::LoadOp>(op);
      load && findInArray(load.getMemRef()))
    return true;
  unsigned number = cast<OpResult>(value).getResultNumber();
  if (auto repeat = dyn_cast<scf::WhileOp>(op))
    return find(repeat.getConditionOp().getArgs()[number], isAfter);
  if (auto range = dyn_cast<scf::ForOp>(op))
    return findAny(
        {range.getYieldedValues()[number], range.getInitArgs()[number]},
        isAfter);
  // What decides is foreseen, or not: nothing waits for it.
  if (auto choice = dyn_cast<arith::SelectOp>(op))
    return findAny({choice.getTrueValue(), choice.getFalseValue()}, isAfter);
  if (isa<scf::IfOp, scf::IndexSwitchOp>(op))
    return llvm::any_of(op->getRegions(), [&](Region &region) {
      return find(region.front().getTerminator()->getOperand(number), isAfter);
    });
  return op->getNumRegions() == 0 && findAny(op->getOperands(), isAfter);
}

Operation *piko::findChase(LoadOp load) {
  for (auto loop = load->getParentOfType<LoopLikeOpInterface>(); loop;
       loop = loop->getParentOfType<LoopLikeOpInterface>()) {
    ChainSearch search(loop);
    if (llvm::any_of(load.getIndices(),
                     [&](Value index) { return search.find(index); }))
      return loop;
  }
  return nullptr;
}
