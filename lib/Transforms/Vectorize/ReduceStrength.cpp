// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-reduce-strength: vectors that grow by the same from iteration to
// iteration become induction variables.

#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/DenseSet.h"

namespace piko {
#define GEN_PASS_DEF_REDUCESTRENGTH
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ReduceStrengthPass : piko::impl::ReduceStrengthBase<ReduceStrengthPass> {
  using ReduceStrengthBase::ReduceStrengthBase;
  void runOnOperation() override;
};

/// How a value changes from iteration to iteration of a loop.
enum class Growth {
  None,   ///< Not at all.
  Linear, ///< By a number that stays the same.
  Other
};

/// Looks at one loop that has no loop inside.
class Reducer {
public:
  Reducer(scf::ForOp loop, int64_t laneCount)
      : loop(loop), laneCount(laneCount), rewriter(loop) {}
  void run();

private:
  bool isOutside(Value value) const {
    return !loop->isAncestor(value.getParentBlock()->getParentOp());
  }
  Growth getGrowth(Value value);
  Growth findGrowth(Value value);
  Growth findGrowth(BlockArgument argument);
  /// What a variable of the loop grows by, or null.
  Value getStep(BlockArgument argument) const;
  bool isGrowing(Operation *op);
  /// The vectors that other operations than growing ones take.
  SmallVector<Value> findRoots();
  /// How many operations on vectors a root takes that no earlier one has.
  int64_t countOperations(Value root, llvm::DenseSet<Operation *> &seen);
  int64_t countRegisters(Value root) const;
  /// Before the loop: a value that does not grow, and what another one is
  /// in the first iteration and grows by.
  Value getInvariant(Value value);
  Value getFirst(Value value);
  Value getDifference(Value value);

  scf::ForOp loop;
  const int64_t laneCount;
  IRRewriter rewriter;
  llvm::DenseMap<Value, Growth> growths;
  IRMapping invariants, firsts, differences;
};

} // namespace

//===----------------------------------------------------------------------===//
// What grows
//===----------------------------------------------------------------------===//

Value Reducer::getStep(BlockArgument argument) const {
  auto loop = this->loop; // whose accessors are not const
  if (argument == loop.getInductionVar())
    return loop.getStep();
  if (argument.getOwner() != loop.getBody())
    return {};
  auto next = loop.getTiedLoopYieldedValue(argument)
                  ->get()
                  .getDefiningOp<arith::AddIOp>();
  if (!next)
    return {};
  Value step = next.getLhs() == argument   ? next.getRhs()
               : next.getRhs() == argument ? next.getLhs()
                                           : Value();
  return step && isOutside(step) ? step : Value();
}

Growth Reducer::findGrowth(BlockArgument argument) {
  return getStep(argument) ? Growth::Linear : Growth::Other;
}

Growth Reducer::findGrowth(Value value) {
  if (isOutside(value))
    return Growth::None;
  if (auto argument = dyn_cast<BlockArgument>(value))
    return findGrowth(argument);
  Operation *op = value.getDefiningOp();
  // A condition may say whether a primitive is there.
  if (op->getNumRegions() > 0 || op->getNumResults() != 1 || !isPure(op) ||
      isa<ItemOp, GetOp>(op))
    return Growth::Other;
  SmallVector<Growth> parts = llvm::map_to_vector(
      op->getOperands(), [&](Value part) { return getGrowth(part); });
  if (llvm::all_of(parts, [](Growth part) { return part == Growth::None; }))
    return Growth::None;
  // Modulo 2^n, as integers wrap around.
  bool isLinear =
      llvm::none_of(parts, [](Growth part) { return part == Growth::Other; });
  if (isa<arith::AddIOp, arith::SubIOp, vector::BroadcastOp>(op))
    return isLinear ? Growth::Linear : Growth::Other;
  if (isa<arith::MulIOp>(op))
    return isLinear && llvm::is_contained(parts, Growth::None) ? Growth::Linear
                                                               : Growth::Other;
  if (isa<arith::ShLIOp>(op))
    return isLinear && parts[1] == Growth::None ? Growth::Linear
                                                : Growth::Other;
  return Growth::Other;
}

Growth Reducer::getGrowth(Value value) {
  if (auto known = growths.find(value); known != growths.end())
    return known->second;
  Growth growth = findGrowth(value);
  return growths[value] = growth;
}

bool Reducer::isGrowing(Operation *op) {
  return op->getNumResults() == 1 &&
         getGrowth(op->getResult(0)) == Growth::Linear;
}

SmallVector<Value> Reducer::findRoots() {
  SmallVector<Value> roots;
  loop.getBody()->walk([&](Operation *op) {
    if (op->getNumResults() != 1 || !isGrowing(op))
      return;
    auto type = dyn_cast<VectorType>(op->getResult(0).getType());
    if (type && type.getElementType().isInteger() &&
        llvm::any_of(op->getUsers(),
                     [&](Operation *user) { return !isGrowing(user); }))
      roots.push_back(op->getResult(0));
  });
  return roots;
}

int64_t Reducer::countOperations(Value root,
                                 llvm::DenseSet<Operation *> &seen) {
  Operation *op = root.getDefiningOp();
  if (!op || isOutside(root) || !isa<VectorType>(root.getType()) ||
      getGrowth(root) != Growth::Linear || !seen.insert(op).second)
    return 0;
  int64_t count = 1;
  for (Value operand : op->getOperands())
    count += countOperations(operand, seen);
  return count;
}

int64_t Reducer::countRegisters(Value root) const {
  constexpr int64_t laneBits = 32; // of a register
  auto type = cast<VectorType>(root.getType());
  return llvm::divideCeil(type.getNumElements() * type.getElementTypeBitWidth(),
                          laneCount * laneBits);
}

//===----------------------------------------------------------------------===//
// Induction variables
//===----------------------------------------------------------------------===//

Value Reducer::getInvariant(Value value) {
  if (isOutside(value))
    return value;
  if (Value known = invariants.lookupOrNull(value))
    return known;
  Operation *op = value.getDefiningOp();
  for (Value operand : op->getOperands())
    invariants.map(operand, getInvariant(operand));
  return rewriter.clone(*op, invariants)->getResult(0);
}

Value Reducer::getFirst(Value value) {
  if (getGrowth(value) == Growth::None)
    return getInvariant(value);
  if (Value known = firsts.lookupOrNull(value))
    return known;
  Value first;
  if (value == loop.getInductionVar()) {
    first = loop.getLowerBound();
  } else if (auto argument = dyn_cast<BlockArgument>(value)) {
    first = loop.getTiedLoopInit(argument)->get();
  } else {
    // Without what the original knows of overflow.
    Operation *op = value.getDefiningOp();
    SmallVector<Value> operands = llvm::map_to_vector(
        op->getOperands(), [&](Value operand) { return getFirst(operand); });
    OperationState state(op->getLoc(), op->getName(), operands,
                         op->getResultTypes());
    first = rewriter.create(state)->getResult(0);
  }
  firsts.map(value, first);
  return first;
}

Value Reducer::getDifference(Value value) {
  if (Value known = differences.lookupOrNull(value))
    return known;
  Value difference;
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    difference = getStep(argument);
  } else {
    Operation *op = value.getDefiningOp();
    Location loc = op->getLoc();
    Value a = op->getOperand(0);
    bool aGrows = getGrowth(a) == Growth::Linear;
    if (isa<vector::BroadcastOp>(op)) {
      difference = vector::BroadcastOp::create(rewriter, loc, value.getType(),
                                               getDifference(a));
    } else {
      Value b = op->getOperand(1);
      bool bGrows = getGrowth(b) == Growth::Linear;
      Value da = aGrows ? getDifference(a) : Value(),
            db = bGrows ? getDifference(b) : Value();
      if (isa<arith::MulIOp>(op)) {
        difference = arith::MulIOp::create(rewriter, loc, aGrows ? da : db,
                                           getInvariant(aGrows ? b : a));
      } else if (isa<arith::ShLIOp>(op)) {
        difference = arith::ShLIOp::create(rewriter, loc, da, getInvariant(b));
      } else if (isa<arith::SubIOp>(op)) {
        if (!da)
          da = arith::ConstantOp::create(rewriter, loc,
                                         rewriter.getZeroAttr(value.getType()));
        difference =
            db ? arith::SubIOp::create(rewriter, loc, da, db).getResult() : da;
      } else {
        difference =
            da && db ? arith::AddIOp::create(rewriter, loc, da, db).getResult()
                     : (da ? da : db);
      }
    }
  }
  differences.map(value, difference);
  return difference;
}

void Reducer::run() {
  // More do not fit into registers beside what the loop has.
  int64_t registers = laneCount >= 16 ? 12 : 5;
  constexpr int64_t least = 2; // One sum is left.
  SmallVector<Value> roots, first, steps;
  llvm::DenseSet<Operation *> seen;
  for (Value root : findRoots()) {
    int64_t needed = countRegisters(root);
    llvm::DenseSet<Operation *> with = seen;
    if (needed > registers || countOperations(root, with) < least)
      continue;
    seen = std::move(with);
    registers -= needed;
    roots.push_back(root);
  }
  if (roots.empty())
    return;
  rewriter.setInsertionPoint(loop);
  for (Value root : roots) {
    first.push_back(getFirst(root));
    steps.push_back(getDifference(root));
  }
  auto next = [&](OpBuilder &builder, Location loc,
                  ArrayRef<BlockArgument> variables) {
    SmallVector<Value> values;
    for (auto [variable, step] : llvm::zip(variables, steps))
      values.push_back(arith::AddIOp::create(builder, loc, variable, step));
    return values;
  };
  unsigned count = loop.getNumRegionIterArgs();
  FailureOr<LoopLikeOpInterface> made = loop.replaceWithAdditionalYields(
      rewriter, first, /*replaceInitOperandUsesInLoop=*/false, next);
  assert(succeeded(made) && "scf.for can hand on more values");
  auto reduced = cast<scf::ForOp>(**made);
  for (auto [root, variable] :
       llvm::zip(roots, reduced.getRegionIterArgs().drop_front(count)))
    root.replaceAllUsesWith(variable);
}

static bool hasLoops(scf::ForOp loop) {
  return loop.getBody()
      ->walk([](LoopLikeOpInterface) { return WalkResult::interrupt(); })
      .wasInterrupted();
}

void ReduceStrengthPass::runOnOperation() {
  if (!llvm::is_contained({4, 8, 16}, laneCount)) {
    getOperation().emitError("expected 4, 8 or 16 lanes, but got ")
        << int64_t(laneCount);
    return signalPassFailure();
  }
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    SmallVector<scf::ForOp> loops;
    kernel.walk([&](scf::ForOp loop) {
      if (!hasLoops(loop))
        loops.push_back(loop);
    });
    for (scf::ForOp loop : loops)
      Reducer(loop, laneCount).run();
  }
}
