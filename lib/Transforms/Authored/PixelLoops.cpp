// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Authored/PixelLoops.h"

#include "Support/StateAccess.h"

#include "Piko/Analysis/Uniformity.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

Value piko::stripWidening(Value value) {
  auto isNarrow = [](Type type) {
    return type.isInteger() && type.getIntOrFloatBitWidth() < 32;
  };
  while (Operation *op = value.getDefiningOp()) {
    if (!isa<arith::IndexCastOp, arith::ExtSIOp>(op) ||
        isNarrow(value.getType()))
      break;
    value = op->getOperand(0);
  }
  return value;
}

//===----------------------------------------------------------------------===//
// Loops
//===----------------------------------------------------------------------===//

/// Takes a condition apart into bounds of one counter; false if it says more.
static bool addBounds(Value condition, BlockArgument &counter,
                      CountedLoop &loop) {
  using P = arith::CmpIPredicate;
  Operation *op = condition.getDefiningOp();
  if (isa_and_nonnull<arith::AndIOp>(op))
    return addBounds(op->getOperand(0), counter, loop) &&
           addBounds(op->getOperand(1), counter, loop);
  auto compare = dyn_cast_or_null<arith::CmpIOp>(op);
  if (!compare)
    return false;
  Value value = compare.getLhs(), bound = compare.getRhs();
  P predicate = compare.getPredicate();
  auto isCounter = [&](Value side) {
    auto argument = dyn_cast<BlockArgument>(side);
    return argument && argument.getOwner()->getParentOp() == loop.op &&
           (!counter || argument == counter);
  };
  if (!isCounter(value)) {
    if (!isCounter(bound))
      return false;
    std::swap(value, bound);
    predicate = predicate == P::sgt   ? P::slt
                : predicate == P::sge ? P::sle
                : predicate == P::slt ? P::sgt
                : predicate == P::sle ? P::sge
                                      : predicate;
  }
  counter = cast<BlockArgument>(value);
  switch (predicate) {
  case P::slt:
    loop.uppers.push_back({LoopBound::Exclusive, bound, compare});
    return true;
  case P::sle:
    loop.uppers.push_back({LoopBound::Inclusive, bound, compare});
    return true;
  case P::ne:
    loop.uppers.push_back({LoopBound::Unequal, bound, compare});
    return true;
  case P::sgt:
  case P::sge:
    if (!loop.refusal.at)
      loop.refusal = {compare, "it counts down"};
    return true;
  default:
    return false;
  }
}

static bool isStep(Value next, Value counter, APInt &step) {
  auto add = next.getDefiningOp<arith::AddIOp>();
  return add && add.getLhs() == counter &&
         matchPattern(add.getRhs(), m_ConstantInt(&step));
}

/// What hands `scf.while` on from one iteration to the next, but its counter.
static void findCarried(scf::WhileOp loop, BlockArgument before,
                        CountedLoop &result) {
  auto refuse = [&](Operation *at, const Twine &why) {
    if (!result.refusal.at)
      result.refusal = {at, why.str()};
  };
  for (auto [argument, next] :
       llvm::zip(loop.getBeforeArguments(), loop.getYieldOp().getResults()))
    if (argument != before)
      refuse(next.getDefiningOp() ? next.getDefiningOp() : loop,
             "this value goes from one iteration to the next; compute it from "
             "the pixel");
  for (auto [after, value] :
       llvm::zip(loop.getAfterArguments(), loop.getConditionOp().getArgs()))
    if (after != result.counter && !after.use_empty())
      refuse(value.getDefiningOp() ? value.getDefiningOp() : loop,
             "this value is found by the test of the loop");
  for (Value value : loop.getResults())
    if (!value.use_empty())
      refuse(*value.getUsers().begin(),
             "this reads, after the loop, what its last iteration left");
  for (Operation &op : loop.getBeforeBody()->without_terminator())
    if (!isPure(&op))
      refuse(&op, "this is done by the test of the loop");
}

static bool findCountedWhile(scf::WhileOp loop, CountedLoop &result) {
  result.op = loop;
  result.body = loop.getAfterBody();
  BlockArgument before;
  if (!addBounds(loop.getConditionOp().getCondition(), before, result))
    return false;
  for (auto [after, value] :
       llvm::zip(loop.getAfterArguments(), loop.getConditionOp().getArgs()))
    if (value == before)
      result.counter = after;
  APInt step;
  unsigned number = before.getArgNumber();
  if (!result.counter || !before.getType().isInteger(32) ||
      !isStep(loop.getYieldOp().getResults()[number], result.counter, step))
    return false;
  result.lower = loop.getInits()[number];
  findCarried(loop, before, result);
  if (!step.isOne() && !result.refusal.at)
    result.refusal = {loop.getYieldOp().getResults()[number].getDefiningOp(),
                      step.isNegative() ? "it counts down"
                                        : "it leaves pixels out"};
  return true;
}

static bool findCountedFor(scf::ForOp loop, CountedLoop &result) {
  if (!loop.getInductionVar().getType().isInteger(32) || loop.getUnsignedCmp())
    return false;
  result.op = loop;
  result.body = loop.getBody();
  result.counter = loop.getInductionVar();
  result.lower = loop.getLowerBound();
  result.uppers.push_back({LoopBound::Exclusive, loop.getUpperBound(), loop});
  if (loop.getNumResults())
    result.refusal = {loop, "a value goes from one iteration to the next; "
                            "compute it from the pixel"};
  else if (!matchPattern(loop.getStep(), m_One()))
    result.refusal = {loop, "it leaves pixels out"};
  return true;
}

static bool findCounted(Operation *op, CountedLoop &result) {
  if (auto loop = dyn_cast<scf::WhileOp>(op))
    return findCountedWhile(loop, result);
  auto loop = dyn_cast<scf::ForOp>(op);
  return loop && findCountedFor(loop, result);
}

/// The one loop in a block that is not in another one, or null.
static Operation *findOnlyLoop(Block *block) {
  Operation *only = nullptr;
  int64_t count = 0;
  block->walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (!isa<scf::WhileOp, scf::ForOp>(op))
      return WalkResult::advance();
    only = op;
    ++count;
    return WalkResult::skip();
  });
  return count == 1 ? only : nullptr;
}

bool PixelLoops::find(Operation *outer, int64_t rank) {
  Operation *at = outer;
  for (int64_t i = 0; i < rank; ++i) {
    if (i)
      at = findOnlyLoop(loops.front().body);
    CountedLoop loop;
    if (!at || !findCounted(at, loop))
      return false;
    if (loop.refusal.at && !refusal.at)
      refusal = loop.refusal;
    loops.insert(loops.begin(), loop);
  }
  checkSpine();
  checkBounds();
  return true;
}

/// What is done between the loops moves into the body, where it may be done
/// more often, but not where it would not have been.
void PixelLoops::checkSpine() {
  for (unsigned dim = 1; dim < loops.size(); ++dim) {
    Operation *inner = loops[dim - 1].op;
    if (inner->getBlock() != loops[dim].body)
      refuse(inner->getParentOp(), "a row is left out here");
    for (Operation &op : loops[dim].body->without_terminator()) {
      if (&op == inner || inner->getParentOp() == &op)
        continue;
      if (!isPure(&op))
        refuse(&op, "this is done once for a row, and not for a pixel");
    }
  }
}

bool PixelLoops::collectInvariant(Value value,
                                  SetVector<Operation *> &slice) const {
  Operation *op = value.getDefiningOp(), *outer = getOuter().op;
  if (!op)
    return !outer->isAncestor(value.getParentBlock()->getParentOp());
  if (!outer->isProperAncestor(op) || slice.contains(op))
    return true;
  if (!isPure(op) || op->getNumRegions() != 0)
    return false;
  for (Value operand : op->getOperands())
    if (!collectInvariant(operand, slice))
      return false;
  slice.insert(op);
  return true;
}

void PixelLoops::checkBounds() {
  for (const CountedLoop &loop : loops) {
    SetVector<Operation *> slice;
    if (!collectInvariant(loop.lower, slice))
      refuse(loop.op, "its first pixel differs from row to row");
    for (const LoopBound &bound : loop.uppers)
      if (!collectInvariant(bound.value, slice))
        refuse(bound.at, "this bound differs from row to row");
  }
}

//===----------------------------------------------------------------------===//
// Pixels
//===----------------------------------------------------------------------===//

scf::IfOp PixelLoops::findGuard() const {
  scf::IfOp guard;
  for (Operation &op : getBody()->without_terminator()) {
    if (isPure(&op) && op.getNumRegions() == 0)
      continue;
    auto branch = dyn_cast<scf::IfOp>(op);
    bool isTest = branch && !guard && branch.getNumResults() == 0 &&
                  (branch.getElseRegion().empty() ||
                   branch.elseBlock()->without_terminator().empty());
    if (!isTest)
      return {};
    guard = branch;
  }
  return guard;
}

bool PixelLoops::isOwnPixel(ValueRange coordinates) const {
  if (coordinates.size() != loops.size())
    return false;
  for (auto [coordinate, loop] : llvm::zip(coordinates, loops))
    if (stripWidening(coordinate) != loop.counter)
      return false;
  return true;
}

ValueRange piko::getPixel(Operation *op) {
  auto isImage = [&](FlatSymbolRefAttr state) {
    return bool(lookupInPipeline<ImageOp>(op, state));
  };
  if (auto update = dyn_cast<UpdateOp>(op))
    return update.getCoordinates();
  if (auto load = dyn_cast<LoadOp>(op); load && isImage(load.getStateAttr()))
    return load.getIndices();
  if (auto store = dyn_cast<StoreOp>(op);
      store && isImage(store.getStateAttr()))
    return store.getIndices();
  if (auto atomic = dyn_cast<AtomicOp>(op);
      atomic && isImage(atomic.getStateAttr()))
    return atomic.getIndices();
  return {};
}

bool PixelLoops::accessesPixels() const {
  return getBody()
      ->walk([&](Operation *op) {
        return isOwnPixel(getPixel(op)) ? WalkResult::interrupt()
                                        : WalkResult::advance();
      })
      .wasInterrupted();
}

//===----------------------------------------------------------------------===//
// Iterations
//===----------------------------------------------------------------------===//

Refusal PixelLoops::checkAccess(Operation *op) const {
  auto [state, kind] = getStateAccess(op);
  std::string name = ("'" + state.getValue() + "'").str();
  bool isOwn = isOwnPixel(getPixel(op));
  if (kind == StateAccess::reads) {
    Operation *other = changed.lookup(state.getAttr());
    if (!other || isOwn)
      return {};
    return {op, "this reads " + name +
                    ", which iterations change, at a pixel that may be "
                    "another's"};
  }
  if (auto atomic = dyn_cast<AtomicOp>(op)) {
    bool isSum =
        atomic->getNumResults() == 0 && atomic.getValue().getType().isInteger();
    return isSum ? Refusal()
                 : Refusal{op, "this change of " + name +
                                   " shows the order of iterations"};
  }
  if (isOwn)
    return {};
  return {op, "this changes " + name +
                  " at an element that another iteration may change"};
}

Refusal PixelLoops::checkArray(Operation *op, Value array) const {
  Operation *owner = array.getDefiningOp();
  bool isOwn = isa_and_nonnull<memref::AllocaOp>(owner) &&
               getOuter().op->isProperAncestor(owner);
  if (isOwn || !stored.contains(array))
    return {};
  return {op, "this uses an array that iterations share and store to"};
}

Refusal PixelLoops::checkOperation(Operation *op) const {
  if (isBarrier(op))
    return {op, "iterations of another loop meet here"};
  if (auto loop = dyn_cast<ParallelLoopOpInterface>(op))
    return loop.hasBarriers()
               ? Refusal{op, "iterations of this loop meet, so it cannot be "
                             "nested"}
               : Refusal();
  if (getStateAccess(op).first)
    return checkAccess(op);
  if (auto load = dyn_cast<memref::LoadOp>(op))
    return checkArray(op, load.getMemRef());
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return checkArray(op, store.getMemRef());
  if (isa<EmissionOpInterface, ListAtOp, DivideOp, YieldOp, memref::AllocaOp,
          scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp, scf::YieldOp,
          scf::ConditionOp>(op) ||
      (op->getNumRegions() == 0 && isMemoryEffectFree(op)))
    return {};
  return {op, "it is not known what '" + op->getName().getStringRef().str() +
                  "' does to other iterations"};
}

Refusal PixelLoops::checkIterations() {
  Block *body = getBody();
  body->walk([&](Operation *op) {
    if (auto [state, kind] = getStateAccess(op);
        state && kind != StateAccess::reads)
      changed.try_emplace(state.getAttr(), op);
    if (auto store = dyn_cast<memref::StoreOp>(op))
      stored.insert(store.getMemRef());
  });
  Refusal result;
  body->walk([&](Operation *op) {
    if (op != body->getTerminator())
      result = checkOperation(op);
    return result.at ? WalkResult::interrupt() : WalkResult::advance();
  });
  return result;
}
