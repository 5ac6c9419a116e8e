// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a block may share. The iterations of a parallel loop are
// independent but for the order of their emissions, which the log restores, and
// of their updates: these must be of one pixel for each iteration. The
// primitives of a bin are independent unless their stage updates pixels.
// Iterations that meet at barriers are threads under the same condition.

#include "PikoToGPU/Mapping/WorkLegality.h"

#include "PikoToGPU/PikoToGPU.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/Matchers.h"
#include "llvm/ADT/StringMap.h"
#include "llvm/ADT/StringSet.h"

using namespace mlir;
using namespace piko;

/// Whether the number of an iteration, which 32 bits hold, is the same after
/// an operation.
static bool isCast(Operation *op) {
  return isa<arith::IndexCastOp, arith::IndexCastUIOp, arith::TruncIOp,
             arith::ExtSIOp, arith::ExtUIOp>(op) &&
         !llvm::any_of(op->getResultTypes(), [](Type type) {
           return type.isInteger() && type.getIntOrFloatBitWidth() < 32;
         });
}

/// A number without casts and without what is added to it in each iteration
/// alike.
static Value getRoot(Value value, Operation *loop) {
  auto isInvariant = [&](Value other) {
    return !loop->isAncestor(other.getParentBlock()->getParentOp()) ||
           matchPattern(other, m_Constant());
  };
  while (Operation *op = value.getDefiningOp()) {
    if (isCast(op))
      value = op->getOperand(0);
    else if (isa<arith::AddIOp>(op) && isInvariant(op->getOperand(0)))
      value = op->getOperand(1);
    else if (isa<arith::AddIOp, arith::SubIOp>(op) &&
             isInvariant(op->getOperand(1)))
      value = op->getOperand(0);
    else
      break;
  }
  return value;
}

namespace {
/// A quotient or a remainder.
struct Division {
  bool isRemainder;
  Value divisor, result;
};
} // namespace

static std::optional<Division> matchDivision(Operation *op, Value of) {
  if (op->getNumResults() != 1 || op->getNumOperands() < 2 ||
      op->getOperand(0) != of)
    return std::nullopt;
  Value divisor = op->getOperand(1), result = op->getResult(0);
  if (isa<arith::RemUIOp, arith::RemSIOp>(op))
    return Division{true, divisor, result};
  if (isa<arith::DivUIOp, arith::DivSIOp>(op))
    return Division{false, divisor, result};
  if (auto divide = dyn_cast<DivideOp>(op))
    return Division{divide.getKind() == DivisionKind::RemainderS ||
                        divide.getKind() == DivisionKind::RemainderU,
                    divisor, result};
  return std::nullopt;
}

static bool isSame(Value a, Value b) {
  APInt x, y;
  return a == b || (matchPattern(a, m_ConstantInt(&x)) &&
                    matchPattern(b, m_ConstantInt(&y)) &&
                    x.getSExtValue() == y.getSExtValue());
}

/// Whether `roots` say what `value` is: it is one of them, or they say what its
/// quotient and its remainder are.
static bool determine(ArrayRef<Value> roots, Value value, int depth = 0) {
  if (llvm::is_contained(roots, value))
    return true;
  if (depth > 8)
    return false;
  SmallVector<Division> divisions;
  for (Operation *user : value.getUsers()) {
    if (isCast(user) && determine(roots, user->getResult(0), depth + 1))
      return true;
    if (auto division = matchDivision(user, value))
      divisions.push_back(*division);
  }
  for (const Division &quotient : divisions)
    for (const Division &remainder : divisions)
      if (!quotient.isRemainder && remainder.isRemainder &&
          isSame(quotient.divisor, remainder.divisor) &&
          determine(roots, quotient.result, depth + 1) &&
          determine(roots, remainder.result, depth + 1))
        return true;
  return false;
}

/// The one iteration of `loop` that reaches an operation, or null: a test of
/// its number stands around it.
static Value findOnlyIteration(Operation *op, Operation *loop) {
  if (loop->getRegion(0).getNumArguments() != 1)
    return {};
  Value iteration = loop->getRegion(0).getArgument(0);
  auto isInvariant = [&](Value value) {
    return !loop->isAncestor(value.getParentBlock()->getParentOp()) ||
           matchPattern(value, m_Constant());
  };
  auto match = [&](Value condition, arith::CmpIPredicate wanted) -> Value {
    auto test = condition.getDefiningOp<arith::CmpIOp>();
    if (!test || test.getPredicate() != wanted)
      return {};
    for (auto [a, b] : {std::pair(test.getLhs(), test.getRhs()),
                        std::pair(test.getRhs(), test.getLhs())}) {
      while (a.getDefiningOp() && isCast(a.getDefiningOp()))
        a = a.getDefiningOp()->getOperand(0);
      if (a == iteration && isInvariant(b))
        return b;
    }
    return {};
  };
  for (; op != loop; op = op->getParentOp()) {
    auto choice = dyn_cast<scf::IfOp>(op->getParentOp());
    if (!choice)
      continue;
    bool isThen = op->getParentRegion() == &choice.getThenRegion();
    SmallVector<Value> conditions = {choice.getCondition()};
    while (!conditions.empty()) {
      Value condition = conditions.pop_back_val();
      auto both = condition.getDefiningOp<arith::AndIOp>();
      if (both && isThen) // in the other region either may be false
        llvm::append_values(conditions, both.getLhs(), both.getRhs());
      else if (Value only = match(condition, isThen ? arith::CmpIPredicate::eq
                                                    : arith::CmpIPredicate::ne))
        return only;
    }
  }
  return {};
}

bool piko::updatesOwnPixels(Operation *loop) {
  llvm::StringMap<UpdateOp> known; // by image
  WalkResult result =
      loop->walk([&](StateAccessOpInterface access) -> WalkResult {
        if (!(access.getAccessKinds() & StateAccess::updates))
          return WalkResult::advance();
        auto update = dyn_cast<UpdateOp>(*access);
        if (!update)
          return WalkResult::interrupt(); // of a pixel that is not known
        auto [it, isFirst] = known.try_emplace(update.getImage(), update);
        Value only = findOnlyIteration(update, loop);
        if (!isFirst) {
          Value other = findOnlyIteration(it->second, loop);
          return WalkResult(
              success(only || other ? only && other && isSame(only, other)
                                    : llvm::equal(it->second.getCoordinates(),
                                                  update.getCoordinates())));
        }
        if (only)
          return WalkResult::advance();
        SmallVector<Value> roots;
        for (Value coordinate : update.getCoordinates())
          roots.push_back(getRoot(coordinate, loop));
        return WalkResult(success(llvm::all_of(
            loop->getRegion(0).getArguments(),
            [&](Value argument) { return determine(roots, argument); })));
      });
  return !result.wasInterrupted();
}

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
