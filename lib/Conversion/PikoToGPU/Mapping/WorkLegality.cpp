// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a block may share. The iterations of a parallel loop are
// independent but for the order of their emissions, which the log restores, and
// of their updates: these must be of one pixel for each iteration. The
// primitives of a bin are independent unless their stage updates pixels.
// Iterations that meet at barriers are threads under the same condition.

#include "PikoToGPU/Mapping/WorkLegality.h"

#include "PikoToGPU/PikoToGPU.h"

#include "Piko/Analysis/IterationPixels.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/Matchers.h"
#include "llvm/ADT/StringSet.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// How many iterations there are
//===----------------------------------------------------------------------===//

static constexpr int64_t unbounded = std::numeric_limits<int32_t>::max();

/// A constant that a value is not above.
static int64_t getBound(Value value, int depth = 0) {
  APInt constant;
  if (matchPattern(value, m_ConstantInt(&constant)))
    return std::clamp<int64_t>(constant.getSExtValue(), 0, unbounded);
  Operation *op = value.getDefiningOp();
  if (!op || depth > 8)
    return unbounded;
  auto operand = [&](unsigned i) {
    return getBound(op->getOperand(i), depth + 1);
  };
  if (isa<arith::MinSIOp>(op))
    return std::min(operand(0), operand(1));
  if (isa<arith::MaxSIOp>(op))
    return std::max(operand(0), operand(1));
  if (isa<arith::SelectOp>(op))
    return std::max(operand(1), operand(2));
  if (isa<arith::IndexCastOp, arith::ExtSIOp>(op))
    return operand(0);
  return unbounded;
}

/// The operands of a tree of minima, or of maxima, without casts.
template <typename OpT>
static void collectOperands(Value value, SmallVectorImpl<Value> &operands) {
  while (auto cast = value.getDefiningOp<arith::IndexCastOp>())
    value = cast.getIn();
  auto choice = value.getDefiningOp<OpT>();
  if (!choice)
    return operands.push_back(value);
  collectOperands<OpT>(choice.getLhs(), operands);
  collectOperands<OpT>(choice.getRhs(), operands);
}

/// A constant that `hi - lo` is not above: both are clipped to a bin.
static int64_t getBound(Value lo, Value hi) {
  SmallVector<Value> floors, ceilings;
  collectOperands<arith::MaxSIOp>(lo, floors);
  collectOperands<arith::MinSIOp>(hi, ceilings);
  int64_t bound = unbounded;
  APInt first, last;
  for (Value ceiling : ceilings) {
    if (auto sum = ceiling.getDefiningOp<arith::AddIOp>())
      if (llvm::is_contained(floors, sum.getLhs()))
        bound = std::min(bound, getBound(sum.getRhs()));
    for (Value floor : floors)
      if (matchPattern(floor, m_ConstantInt(&first)) &&
          matchPattern(ceiling, m_ConstantInt(&last)))
        bound = std::min(bound, std::max<int64_t>(0, last.getSExtValue() -
                                                         first.getSExtValue()));
  }
  return bound;
}

int64_t piko::getMostIterations(ParallelLoopOpInterface loop) {
  if (auto counted = dyn_cast<ParallelForOp>(*loop))
    return getBound(counted.getCount());
  auto pixels = dyn_cast<ParallelPixelsOp>(*loop);
  if (!pixels)
    return unbounded; // another dialect's, which the conversion refuses
  int64_t product = 1;
  for (auto [lo, hi] : llvm::zip(pixels.getLo(), pixels.getHi()))
    product = std::min(product * getBound(lo, hi), unbounded);
  return product;
}

//===----------------------------------------------------------------------===//
// Loops
//===----------------------------------------------------------------------===//

bool piko::isChecked(Operation *op) {
  return contains(op->getParentOfType<KernelOp>(), [](Operation *inner) {
    return inner->hasTrait<CheckingMode>();
  });
}

bool piko::isIndependent(Operation *loop) {
  auto meets = [](Operation *inner) { return isa<BarrierOpInterface>(inner); };
  return !isChecked(loop) && !contains(loop, meets) && updatesOwnPixels(loop);
}

bool piko::canShareByCount(ItemsOp items) {
  bool hasLoop = false, updates = false;
  items->walk([&](Operation *op) {
    hasLoop |= isa<ParallelLoopOpInterface>(op);
    updates |= isa<UpdateOp>(op); // own of a primitive, not of an iteration
  });
  return hasLoop && !updates && isIndependent(items);
}

bool piko::canRunInLockstep(ParallelLoopOpInterface loop, int64_t threads) {
  return !isChecked(loop) && updatesOwnPixels(loop) &&
         getMostIterations(loop) <= threads;
}

/// Whether a thread has a primitive, or an iteration, to itself already.
static bool isInSharedWork(Operation *op) {
  if (op->getParentOfType<ParallelLoopOpInterface>())
    return true;
  auto work = op->getParentOfType<WorkOpInterface>();
  auto mark = work ? work->getAttrOfType<ThreadMappingAttr>(marks::threads)
                   : ThreadMappingAttr();
  return mark && mark.getValue() != ThreadMapping::One &&
         mark.getValue() != ThreadMapping::ByCount;
}

bool piko::isLegal(Operation *op, ThreadMapping mapping, int64_t threads) {
  auto loop = dyn_cast<ParallelLoopOpInterface>(op);
  if (loop && mapping != ThreadMapping::One && isInSharedWork(op))
    return false;
  switch (mapping) {
  case ThreadMapping::One:
    return !loop || !loop.hasBarriers();
  case ThreadMapping::Shared:
    return isIndependent(op);
  case ThreadMapping::Lockstep:
    return loop && canRunInLockstep(loop, threads);
  case ThreadMapping::Pieces:
  case ThreadMapping::PiecesOfOne:
    return loop != nullptr;
  case ThreadMapping::ByCount:
    return isa<ItemsOp>(op) && canShareByCount(cast<ItemsOp>(op)) &&
           op->hasAttr(marks::fewest);
  case ThreadMapping::Pixels:
  case ThreadMapping::Collapsed:
    return isa<ItemsOp>(op) &&
           updatesPixelsAlone(op->getParentOfType<KernelOp>());
  }
  llvm_unreachable("no other mapping");
}

//===----------------------------------------------------------------------===//
// Kernels that update pixels alone
//===----------------------------------------------------------------------===//

/// What pixels cannot be shared with.
static bool isObstacle(Operation *op) {
  if (isa<EmissionOpInterface, PlaceOp, BarrierOpInterface>(op) ||
      op->hasTrait<CheckingMode>())
    return true;
  if (auto work = dyn_cast<WorkOpInterface>(op))
    return work.takesList() || work.getProducerAttr();
  if (auto access = dyn_cast<StateAccessOpInterface>(op)) {
    auto atomic = dyn_cast<AtomicOp>(op);
    bool isKnown = isa<LoadOp, StoreOp, UpdateOp>(op);
    return atomic ? bool(atomic.getOld()) : !isKnown;
  }
  auto array = dyn_cast<memref::AllocaOp>(op);
  return array && !array.getType().hasStaticShape();
}

bool piko::updatesPixelsAlone(KernelOp kernel) {
  llvm::StringSet<> written;
  bool updates = false;
  kernel.walk([&](StateAccessOpInterface access) {
    if (access.getAccessKinds() != StateAccess::reads)
      written.insert(access.getAccessedState().getValue());
    updates |= isa<UpdateOp>(*access);
  });
  return updates &&
         !kernel
              .walk([&](Operation *op) {
                auto access = dyn_cast<StateAccessOpInterface>(op);
                bool readsOwn =
                    access && access.getAccessKinds() == StateAccess::reads &&
                    written.contains(access.getAccessedState().getValue());
                return readsOwn || isObstacle(op) ? WalkResult::interrupt()
                                                  : WalkResult::advance();
              })
              .wasInterrupted();
}

Value piko::getCoordinateRoot(Value coordinate) {
  while (Operation *op = coordinate.getDefiningOp()) {
    if (!isa<arith::IndexCastOp, arith::ExtSIOp, arith::TruncIOp>(op))
      break;
    coordinate = op->getOperand(0);
  }
  return coordinate;
}
