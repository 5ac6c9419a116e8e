// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Authored/PixelLoops.h"

#include "Support/StateAccess.h"

#include "Piko/Analysis/Uniformity.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
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

static void refuse(LoopOverPixels &loop, Operation *at, const Twine &why) {
  if (!loop.refusal.at)
    loop.refusal = {at, why.str()};
}

/// What an scf.while hands on from one iteration to the next, but its counter.
static void refuseCarried(scf::WhileOp loop, LoopOverPixels &result) {
  auto made = [&](Value value, Operation *otherwise) {
    return value.getDefiningOp() ? value.getDefiningOp() : otherwise;
  };
  for (auto [number, next] : llvm::enumerate(loop.getYieldOp().getResults()))
    if (number != result.number)
      refuse(result, made(next, loop),
             "this value goes from one iteration to the next; compute it from "
             "the pixel");
  for (auto [after, value] :
       llvm::zip(loop.getAfterArguments(), loop.getConditionOp().getArgs()))
    if (after != result.counter && !after.use_empty())
      refuse(result, made(value, loop),
             "this value is found by the test of the loop");
  for (Value value : loop.getResults())
    if (!value.use_empty())
      refuse(result, *value.getUsers().begin(),
             "this reads, after the loop, what its last iteration left");
  for (Operation &op : loop.getBeforeBody()->without_terminator())
    if (!isPure(&op))
      refuse(result, &op, "this is done by the test of the loop");
}

static std::optional<LoopOverPixels> findLoopOverPixels(Operation *op) {
  using P = arith::CmpIPredicate;
  std::optional<CountedLoop> counted = op ? findCountedLoop(op) : std::nullopt;
  if (!counted || !counted->counter.getType().isInteger(32))
    return std::nullopt;
  LoopOverPixels result{*counted, {}};
  for (const CountedLoop::Bound &bound : result.bounds) {
    if (llvm::is_contained({P::sgt, P::sge}, bound.predicate))
      refuse(result, bound.at, "it counts down");
    else if (!llvm::is_contained({P::slt, P::sle, P::ne}, bound.predicate))
      return std::nullopt;
  }
  if (auto repeated = dyn_cast<scf::WhileOp>(op))
    refuseCarried(repeated, result);
  else if (op->getNumResults())
    refuse(result, op,
           "a value goes from one iteration to the next; compute "
           "it from the pixel");
  if (!result.isByOne())
    refuse(result, result.getNext() ? result.getNext() : op,
           result.step && result.step->isNegative() ? "it counts down"
                                                    : "it leaves pixels out");
  return result;
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
    std::optional<LoopOverPixels> loop = findLoopOverPixels(at);
    if (!loop)
      return false;
    if (loop->refusal.at && !refusal.at)
      refusal = loop->refusal;
    loops.insert(loops.begin(), *loop);
  }
  checkSpine();
  checkBounds();
  return true;
}

/// What is done between the loops moves into the body, where it may be done
/// more often, but not where it would not have been.
void PixelLoops::checkSpine() {
  for (unsigned dim = 1; dim < loops.size(); ++dim) {
    Operation *inner = loops[dim - 1].loop;
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
  Operation *op = value.getDefiningOp(), *outer = getOuter().loop;
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
  for (const LoopOverPixels &loop : loops) {
    SetVector<Operation *> slice;
    if (!collectInvariant(loop.first, slice))
      refuse(loop.loop, "its first pixel differs from row to row");
    for (const CountedLoop::Bound &bound : loop.bounds)
      if (!collectInvariant(bound.end, slice))
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
               getOuter().loop->isProperAncestor(owner);
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
