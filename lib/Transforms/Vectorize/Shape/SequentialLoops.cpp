// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops in order, as lanes and in compacted form. Iterations may emit, and
// append to lists (Appends), which keeps its order in lanes, too.
//
// Stream compaction: where all that an iteration does stands under a condition,
// and has a loop of its own, a first loop finds which of 1,024 iterations have
// something to do, a second one lists them without branches, and a third one
// does it, so that its vectors are full.

#include "Vectorize/Shape/SequentialLoops.h"

#include "Vectorize/Analysis/IterationLanes.h"
#include "Vectorize/Analysis/Lanes.h"
#include "Vectorize/Analysis/LoopStreams.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Independence
//===----------------------------------------------------------------------===//

namespace {

/// What the iterations of a loop do to memory.
class Effects {
public:
  explicit Effects(scf::ForOp loop) : loop(loop) {
    loop.walk([&](StoreOp store) { written.insert(store.getStateAttr()); });
    loop.walk([&](memref::StoreOp store) { stored.insert(store.getMemRef()); });
  }
  bool areIndependent();

private:
  bool isOwn(Value array) const {
    return loop->isAncestor(array.getParentBlock()->getParentOp());
  }
  bool isOnce(StoreOp store);
  bool isOfIteration(AppendBinOp place);
  bool isKnown(Operation *op);

  scf::ForOp loop;
  llvm::DenseSet<Attribute> written; // state
  llvm::DenseSet<Value> stored;      // arrays
  llvm::DenseSet<std::pair<Attribute, Attribute>> fields;
};

} // namespace

/// Whether an iteration stores a number at most once, and no other store does.
bool Effects::isOnce(StoreOp store) {
  for (Operation *at = store->getParentOp(); at != loop; at = at->getParentOp())
    if (isa<scf::ForOp, scf::WhileOp>(at))
      return false;
  return store.getElements().empty() &&
         fields.insert({store.getStateAttr(), store.getFieldAttr()}).second;
}

/// Whether what is put into a bin was emitted in the same iteration.
bool Effects::isOfIteration(AppendBinOp place) {
  bool isEmitted = false;
  loop.walk([&](AppendOp append) {
    isEmitted |= append.getWriter() == place.getWriter() &&
                 append.getPort() == place.getPort();
  });
  return isEmitted;
}

/// What is emitted keeps its order in lanes, too.
bool Effects::isKnown(Operation *op) {
  if (auto place = dyn_cast<AppendBinOp>(op))
    return isOfIteration(place);
  if (isa<AppendOp, PushOp>(op)) // of a list that nothing else here knows
    return true;
  if (auto store = dyn_cast<StoreOp>(op))
    return isOnce(store);
  if (auto load = dyn_cast<LoadOp>(op))
    return !written.contains(load.getStateAttr());
  if (auto load = dyn_cast<memref::LoadOp>(op))
    return isOwn(load.getMemRef()) || !stored.contains(load.getMemRef());
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return isOwn(store.getMemRef());
  if (op->getNumRegions() != 0)
    return isStructure(op) && !op->hasAttr(marks::lanes);
  return isMemoryEffectFree(op) || isPrefetch(op) || op->hasTrait<Failure>() ||
         isa<memref::AllocaOp>(op);
}

bool Effects::areIndependent() {
  return !loop.walk([&](Operation *op) {
                return op == loop || isKnown(op) ? WalkResult::advance()
                                                 : WalkResult::interrupt();
              })
              .wasInterrupted();
}

static bool isIndependent(scf::ForOp loop) {
  return loop.getNumResults() == 0 && Effects(loop).areIndependent();
}

/// Whether it iterates less often than there are lanes, as far as is known.
static bool isShort(scf::ForOp loop, int64_t laneCount) {
  std::optional<APInt> count = loop.getStaticTripCount();
  return count && count->slt(laneCount);
}

/// What is cast to another width or kind.
static Value stripAllCasts(Value value) {
  while (Operation *op = value.getDefiningOp()) {
    if (!isa<CastOpInterface>(op))
      break;
    value = op->getOperand(0);
  }
  return value;
}

/// Whether an operation computes a number, and not a place in memory alone.
static bool computes(Operation *op) {
  if (isa<scf::ForOp, scf::WhileOp, PushOp>(op))
    return true;
  if (op->getNumOperands() == 0 || op->getNumResults() != 1 || !isPure(op) ||
      isa<CastOpInterface>(op))
    return false;
  auto isRead = [](Value operand) {
    return isa_and_nonnull<LoadOp, memref::LoadOp>(
        stripAllCasts(operand).getDefiningOp());
  };
  return op->getResult(0).getType().isFloat() ||
         llvm::any_of(op->getOperands(), isRead);
}

/// Whether iterations only clear or copy, which LLVM does well.
static bool onlyMoves(scf::ForOp loop) {
  return !loop.getBody()
              ->walk([](Operation *op) {
                return computes(op) ? WalkResult::interrupt()
                                    : WalkResult::advance();
              })
              .wasInterrupted();
}

/// Whether a loop begins at a place in memory or a number of 32 bits, so that
/// steps of several iterations do not leave 64. A user's own 64 may be the last
/// ones.
static bool beginsEarly(scf::ForOp loop) {
  Value lower = loop.getLowerBound();
  while (isa_and_nonnull<arith::IndexCastOp, arith::IndexCastUIOp,
                         arith::ExtSIOp, arith::ExtUIOp>(lower.getDefiningOp()))
    lower = lower.getDefiningOp()->getOperand(0);
  if (std::optional<int64_t> known = getConstantIntValue(lower))
    return llvm::isInt<32>(*known);
  return !lower.getType().isInteger(64);
}

bool piko::mayRunInOrder(scf::ForOp loop, int64_t laneCount) {
  return beginsEarly(loop) && isIndependent(loop) &&
         !isShort(loop, laneCount) && !onlyMoves(loop) &&
         !hasVectorsAlong(loop) && !isOverBox(loop);
}

//===----------------------------------------------------------------------===//
// Compaction
//===----------------------------------------------------------------------===//

/// The condition that all an iteration does stands after, if it has a loop.
static scf::IfOp findOnlyCondition(scf::ForOp loop) {
  scf::IfOp only;
  for (Operation &op : loop.getBody()->without_terminator()) {
    if (isMemoryEffectFree(&op) || isa<LoadOp>(op))
      continue;
    auto choice = dyn_cast<scf::IfOp>(op);
    if (only || !choice)
      return {};
    only = choice;
  }
  if (!only || only.getNumResults() > 0 || !only.getElseRegion().empty() ||
      !loop->isAncestor(only.getCondition().getParentBlock()->getParentOp()))
    return {};
  bool hasLoop = only->walk([](Operation *op) {
                       return isa<scf::ForOp, scf::WhileOp>(op)
                                  ? WalkResult::interrupt()
                                  : WalkResult::advance();
                     })
                     .wasInterrupted();
  return hasLoop ? only : scf::IfOp();
}

namespace {

/// Writes the loops before the one that they stand for.
class Compactor {
public:
  Compactor(scf::ForOp loop, scf::IfOp condition)
      : loop(loop), condition(condition), builder(loop), loc(loop.getLoc()) {}
  Compaction write();

private:
  Value constant(int64_t value) {
    return arith::ConstantIndexOp::create(builder, loc, value);
  }
  Value allocate(Type type) {
    return memref::AllocaOp::create(builder, loc,
                                    MemRefType::get({stripSize}, type));
  }
  /// What an iteration does before its condition.
  IRMapping writeTurn(Value place);
  scf::ForOp writeFinds(Value count, Value flags);
  Value writePlaces(Value count, Value flags, Value places);
  scf::ForOp writeDoes(Value count, Value places);

  static constexpr int64_t stripSize = 1024;
  scf::ForOp loop;
  scf::IfOp condition;
  OpBuilder builder;
  Location loc;
  Value first; ///< of a strip
};

} // namespace

IRMapping Compactor::writeTurn(Value place) {
  IRMapping mapping;
  mapping.map(loop.getInductionVar(),
              arith::AddIOp::create(builder, loc, first, place));
  for (Operation &op : loop.getBody()->without_terminator())
    if (&op != condition)
      builder.clone(op, mapping);
  return mapping;
}

scf::ForOp Compactor::writeFinds(Value count, Value flags) {
  auto finds =
      scf::ForOp::create(builder, loc, constant(0), count, constant(1));
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(finds.getBody());
  IRMapping mapping = writeTurn(finds.getInductionVar());
  Value flag = arith::ExtUIOp::create(builder, loc, builder.getI8Type(),
                                      mapping.lookup(condition.getCondition()));
  memref::StoreOp::create(builder, loc, flag, flags, finds.getInductionVar());
  return finds;
}

/// All places are written, and those kept whose turn has something to do: there
/// is no branch.
Value Compactor::writePlaces(Value count, Value flags, Value places) {
  auto made = scf::ForOp::create(builder, loc, constant(0), count, constant(1),
                                 ValueRange{constant(0)});
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(made.getBody());
  Value place = made.getInductionVar(), known = made.getRegionIterArg(0);
  memref::StoreOp::create(
      builder, loc,
      arith::IndexCastOp::create(builder, loc, builder.getI32Type(), place),
      places, known);
  Value flag = memref::LoadOp::create(builder, loc, flags, place);
  Value next = arith::AddIOp::create(
      builder, loc, known,
      arith::IndexCastUIOp::create(builder, loc, builder.getIndexType(), flag));
  scf::YieldOp::create(builder, loc, next);
  return made.getResult(0);
}

scf::ForOp Compactor::writeDoes(Value count, Value places) {
  auto does = scf::ForOp::create(builder, loc, constant(0), count, constant(1));
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(does.getBody());
  Value place =
      memref::LoadOp::create(builder, loc, places, does.getInductionVar());
  IRMapping mapping = writeTurn(
      arith::IndexCastOp::create(builder, loc, builder.getIndexType(), place));
  for (Operation &op : condition.thenBlock()->without_terminator())
    builder.clone(op, mapping);
  return does;
}

Compaction Compactor::write() {
  Value flags = allocate(builder.getI8Type()),
        places = allocate(builder.getI32Type());
  Value upper = loop.getUpperBound(), size = constant(stripSize);
  Compaction made;
  made.strips =
      scf::ForOp::create(builder, loc, loop.getLowerBound(), upper, size);
  builder.setInsertionPointToStart(made.strips.getBody());
  first = made.strips.getInductionVar();
  Value count = arith::MinUIOp::create(
      builder, loc, arith::SubIOp::create(builder, loc, upper, first), size);
  made.finds = writeFinds(count, flags);
  made.does = writeDoes(writePlaces(count, flags, places), places);
  return made;
}

std::optional<Compaction> piko::compact(scf::ForOp loop) {
  scf::IfOp condition = findOnlyCondition(loop);
  if (!condition || !loop.getUpperBound().getType().isIndex() ||
      !matchPattern(loop.getStep(), m_One()) || loop.getUnsignedCmp())
    return std::nullopt;
  return Compactor(loop, condition).write();
}
