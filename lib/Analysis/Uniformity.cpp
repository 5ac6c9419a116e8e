// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Starts from primitives, lists and the numbers of iterations, and narrows all
// that follows from them, until nothing is new.

#include "Piko/Analysis/Uniformity.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

bool piko::isBarrier(Operation *op) { return isa<BarrierOpInterface>(op); }

Operation *piko::findBarrier(Operation *op) {
  Operation *found = nullptr;
  op->walk<WalkOrder::PreOrder>([&](Operation *inner) {
    if (isa<ParallelLoopOpInterface>(inner))
      return WalkResult::skip();
    if (!isBarrier(inner))
      return WalkResult::advance();
    found = inner;
    return WalkResult::interrupt();
  });
  return found;
}

StringRef piko::getBarrierName(Operation *op) {
  Operation *found = nullptr;
  op->walk<WalkOrder::PreOrder>([&](BarrierOpInterface barrier) {
    if (isa<GroupedOp>(*barrier))
      return WalkResult::advance();
    found = barrier;
    return WalkResult::interrupt();
  });
  return getCppName(found ? found : findBarrier(op));
}

Value piko::findOnlyValue(Value yes, Value no) {
  // Lanes have no primitives to hand on where no one comes.
  if (!yes.getType().isIntOrIndexOrFloat())
    return {};
  if (no.getDefiningOp<ub::PoisonOp>())
    return yes;
  return yes.getDefiningOp<ub::PoisonOp>() ? no : Value();
}

/// Whether memory is accessed at a place that follows from a number.
static bool isForPlaces(Value number, unsigned depth = 6) {
  return depth > 0 && llvm::any_of(number.getUses(), [&](OpOperand &use) {
           Operation *user = use.getOwner();
           if (auto store = dyn_cast<memref::StoreOp>(user))
             return llvm::is_contained(store.getIndices(), number);
           if (isa<memref::LoadOp, LoadOp>(user))
             return true;
           if (auto condition = dyn_cast<scf::ConditionOp>(user))
             return use.getOperandNumber() > 0 &&
                    isForPlaces(
                        cast<scf::WhileOp>(condition->getParentOp())
                            .getAfterArguments()[use.getOperandNumber() - 1],
                        depth - 1);
           return isa<arith::ArithDialect>(user->getDialect()) &&
                  user->getResult(0).getType().isIntOrIndex() &&
                  isForPlaces(user->getResult(0), depth - 1);
         });
}

Uniformity::Uniformity(Operation *root, ArrayRef<Root> roots, bool isLockstep)
    : isLockstep(isLockstep), root(root) {
  if (auto kernel = root->getParentOfType<KernelOp>())
    kernel.walk([&](StateAccessOpInterface access) {
      if (access.getAccessKinds() != StateAccess::reads)
        written.insert(access.getAccessedState());
    });
  findMeetings();
  for (auto [value, level] : roots)
    mark(value, level);
  for (bool changed = true; changed;) {
    changed = false;
    root->walk<WalkOrder::PreOrder>([&](Operation *op) {
      if (isa<WorkOpInterface>(op))
        changed |= markArguments(op->getRegion(0).front(), Uniform::Item);
      else if (auto loop = dyn_cast<ParallelLoopOpInterface>(op))
        changed |= markArguments(*loop.getBodyBlock(), Uniform::Iteration);
      else if (op != root)
        changed |= visit(op);
    });
  }
}

/// All at once: each round asks for every store how its surroundings part.
void Uniformity::findMeetings() {
  root->walk([&](Operation *barrier) {
    if (!isBarrier(barrier))
      return;
    for (Operation *at = barrier; !isa<ParallelLoopOpInterface>(at) &&
                                  meetings.insert(at).second && at != root;)
      at = at->getParentOp();
  });
}

bool Uniformity::mark(Value value, Uniform level) {
  if (level <= get(value))
    return false;
  levels[value] = level;
  return true;
}

bool Uniformity::markArguments(Block &block, Uniform level) {
  bool changed = false;
  for (Value argument : block.getArguments())
    changed |= mark(argument, level);
  return changed;
}

Uniform Uniformity::get(ValueRange values) const {
  Uniform level = Uniform::Bin;
  for (Value value : values)
    level = std::max(level, get(value));
  return level;
}

bool Uniformity::flow(ValueRange sources, ValueRange targets, Uniform least) {
  bool changed = false;
  for (auto [source, target] : llvm::zip(sources, targets))
    changed |= mark(target, std::max(least, get(source)));
  return changed;
}

bool Uniformity::flowInside(ValueRange sources, ValueRange targets,
                            Uniform parts) {
  bool changed = false;
  for (auto [source, target] : llvm::zip(sources, targets)) {
    bool isShared = isLockstep && isForPlaces(target);
    changed |=
        mark(target, std::max(isShared ? Uniform::Bin : parts, get(source)));
  }
  return changed;
}

Uniform Uniformity::getDeciding(Operation *op) const {
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return get({loop.getLowerBound(), loop.getUpperBound(), loop.getStep()});
  if (auto loop = dyn_cast<scf::WhileOp>(op))
    return get(loop.getConditionOp().getCondition());
  if (isa<scf::IfOp, scf::IndexSwitchOp>(op))
    return get(op->getOperands());
  return Uniform::Iteration; // It is not known.
}

Uniform Uniformity::getParting(Operation *op) const {
  Uniform level = getDeciding(op);
  // Iterations that meet inside are compared; others may part ways.
  return meetings.contains(op) ? std::min(level, Uniform::Item) : level;
}

Operation *Uniformity::findParting(Operation *op, Region &region) const {
  for (Operation *at = op->getParentOp();
       at && region.isAncestor(at->getParentRegion()); at = at->getParentOp())
    if (getDeciding(at) == Uniform::Iteration)
      return at;
  return nullptr;
}

bool Uniformity::visitControlFlow(Operation *op) {
  Uniform parts = getParting(op);
  if (auto loop = dyn_cast<scf::ForOp>(op)) {
    Value lower = loop.getLowerBound(), step = loop.getStep();
    bool changed = mark(loop.getInductionVar(), get({lower, step}));
    for (ValueRange sources :
         {ValueRange(loop.getInitArgs()), loop.getYieldedValues()}) {
      changed |= flowInside(sources, loop.getRegionIterArgs(), parts);
      changed |= flow(sources, loop.getResults(), parts);
    }
    return changed;
  }
  if (auto loop = dyn_cast<scf::WhileOp>(op)) {
    bool changed =
        flowInside(loop.getInits(), loop.getBeforeArguments(), parts);
    changed |= flowInside(loop.getYieldOp().getOperands(),
                          loop.getBeforeArguments(), parts);
    ValueRange leaving = loop.getConditionOp().getArgs();
    changed |= flow(leaving, loop.getAfterArguments(),
                    isLockstep ? Uniform::Bin : parts);
    return flow(leaving, loop.getResults(), parts) || changed;
  }
  // scf.if, scf.index_switch
  if (auto choice = dyn_cast<scf::IfOp>(op); choice && isLockstep)
    return visitIf(choice, parts);
  bool changed = false;
  for (Region &region : op->getRegions())
    if (!region.empty())
      changed |= flow(region.front().getTerminator()->getOperands(),
                      op->getResults(), parts);
  return changed;
}

bool Uniformity::visitIf(scf::IfOp choice, Uniform parts) {
  bool changed = false;
  for (OpResult result : choice.getResults()) {
    Value yes = choice.thenYield().getOperand(result.getResultNumber()),
          no = choice.elseYield().getOperand(result.getResultNumber());
    Value only = findOnlyValue(yes, no);
    changed |=
        mark(result, only ? get(only) : std::max({parts, get(yes), get(no)}));
  }
  return changed;
}

bool Uniformity::isInside(Value array) const {
  Operation *made = array.getDefiningOp<memref::AllocaOp>();
  return made && root->isProperAncestor(made);
}

/// Whether an operation accesses an array, and does not hand it on.
static bool accesses(Operation *op, Value array) {
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return store.getValue() != array;
  return isa<memref::LoadOp, vector::LoadOp, vector::StoreOp,
             vector::MaskedLoadOp, vector::MaskedStoreOp, vector::GatherOp,
             vector::ScatterOp, vector::CompressStoreOp, PushOp>(op);
}

/// Whether an array is filled before the root, which only reads it. What filled
/// it may have become vectors.
bool Uniformity::isFinished(Value array) const {
  auto made = array.getDefiningOp<memref::AllocaOp>();
  return made && llvm::all_of(made->getUsers(), [&](Operation *user) {
           return isa<memref::LoadOp>(user) ||
                  (accesses(user, array) && !root->isAncestor(user));
         });
}

/// What is stored into a private array is in it from then on, wherever
/// iterations went on together.
bool Uniformity::visitArrayAccess(Operation *op) {
  if (auto array = dyn_cast<memref::AllocaOp>(op)) {
    bool isKnown = llvm::all_of(array->getUsers(), [&](Operation *user) {
      auto store = dyn_cast<memref::StoreOp>(user);
      return isa<memref::LoadOp>(user) ||
             (store && store.getValue() != array.getResult());
    });
    return !isKnown && mark(array, Uniform::Iteration);
  }
  if (auto load = dyn_cast<memref::LoadOp>(op))
    return mark(load.getResult(),
                isInside(load.getMemRef()) || isFinished(load.getMemRef())
                    ? get(load->getOperands())
                    : Uniform::Iteration);
  auto store = cast<memref::StoreOp>(op);
  if (!isInside(store.getMemRef()))
    return false;
  Uniform level = std::max(get(store.getValue()), get(store.getIndices()));
  Block *scope = store.getMemRef().getParentBlock();
  for (Operation *at = op->getParentOp(); at != scope->getParentOp();
       at = at->getParentOp())
    level = std::max(level, getParting(at));
  return mark(store.getMemRef(), level);
}

bool Uniformity::visit(Operation *op) {
  if (isa<scf::ForOp, scf::WhileOp, scf::IfOp, scf::IndexSwitchOp>(op))
    return visitControlFlow(op);
  if (isa<memref::AllocaOp, memref::LoadOp, memref::StoreOp>(op))
    return visitArrayAccess(op);
  Uniform level = get(op->getOperands());
  auto load = dyn_cast<LoadOp>(op);
  if (auto elect = dyn_cast<ElectOp>(op)) {
    bool changed = mark(elect.getSide(), std::min(level, Uniform::Item));
    return mark(elect.getTakes(), level) || changed;
  }
  if (isa<VoteOp>(op))
    return false;        // one result for all lanes, whatever they are given
  if (isa<ReduceOp>(op)) // one result for all iterations
    level = Uniform::Item;
  else if (load ? written.contains(load.getStateAttr())
                : (op->getNumRegions() != 0 || isa<ScanOp, SortOp>(op) ||
                   (!isMemoryEffectFree(op) && !isa<ListAtOp>(op))))
    level = Uniform::Iteration;
  bool changed = false;
  for (Value result : op->getResults())
    changed |= mark(result, level);
  return changed;
}
