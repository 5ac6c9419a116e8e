// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-thread-jumps: what only one side of a condition needs stands after it.

#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_THREADJUMPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ThreadJumpsPass : piko::impl::ThreadJumpsBase<ThreadJumpsPass> {
  using ThreadJumpsBase::ThreadJumpsBase;
  void runOnOperation() override;
};

/// What is only needed if the first half of a conjunction holds.
struct Conjunction {
  Value first, second;
  llvm::SetVector<Operation *> work; ///< in the order of the block
  int64_t weight = 0;
};

} // namespace

//===----------------------------------------------------------------------===//
// Short-circuit evaluation
//===----------------------------------------------------------------------===//

/// About how many instructions on numbers an operation is.
static int64_t getWeight(Operation &op) {
  int64_t weight = 0;
  op.walk([&](Operation *inner) {
    if (isa<arith::DivFOp, arith::DivSIOp, arith::DivUIOp>(inner))
      weight += 8;
    else if (!isa<arith::ConstantOp, arith::ExtSIOp, arith::ExtUIOp,
                  arith::TruncIOp, arith::IndexCastOp, arith::BitcastOp,
                  scf::YieldOp>(inner))
      ++weight;
  });
  return weight;
}

/// What of the block before a condition serves nothing but the second half
/// and the sides of the condition.
static Conjunction collectWork(scf::IfOp choice, Value first, Value second) {
  Conjunction found{first, second, {}, 0};
  Operation *both = choice.getCondition().getDefiningOp();
  SmallVector<Operation *> work;
  llvm::DenseSet<Operation *> known{both, choice};
  auto isNeeded = [&](Operation *user) {
    Operation *here = choice->getBlock()->findAncestorOpInBlock(*user);
    // What the other side yields is needed where the first half fails.
    return here && known.contains(here) &&
           (here != choice ||
            choice.getThenRegion().isAncestor(user->getParentRegion()));
  };
  for (Operation *op = choice->getPrevNode(); op; op = op->getPrevNode()) {
    bool isFirst = llvm::is_contained(op->getResults(), first);
    if (op == both || isFirst || op->use_empty() ||
        isa<arith::ConstantOp>(op) || !isMemoryEffectFree(op) ||
        !llvm::all_of(op->getUsers(), isNeeded))
      continue;
    known.insert(op);
    work.push_back(op);
    found.weight += getWeight(*op);
  }
  found.work.insert(work.rbegin(), work.rend());
  return found;
}

/// scf.if %a & %b { .. }  =>  scf.if %a { work scf.if %b { .. } }, where the
/// work is for %b and what depends on it.
static bool splitConjunction(scf::IfOp choice, int64_t least) {
  auto both = choice.getCondition().getDefiningOp<arith::AndIOp>();
  if (!both || !both->hasOneUse() || both->getBlock() != choice->getBlock())
    return false;
  bool hasElse = !choice.getElseRegion().empty();
  if (hasElse && !llvm::hasSingleElement(*choice.elseBlock()))
    return false;
  // As the text has it, if it has: the left one first.
  auto isEnough = [&](const Conjunction &found) {
    // Work without the second half would only sink into the sides.
    return found.weight >= least &&
           found.work.contains(found.second.getDefiningOp());
  };
  Conjunction found = collectWork(choice, both.getLhs(), both.getRhs());
  if (!isEnough(found))
    found = collectWork(choice, both.getRhs(), both.getLhs());
  if (!isEnough(found))
    return false;
  OpBuilder builder(choice);
  Location loc = choice.getLoc();
  auto outer = scf::IfOp::create(builder, loc, choice.getResultTypes(),
                                 found.first, hasElse);
  if (hasElse) {
    builder.setInsertionPointToEnd(outer.elseBlock());
    if (choice.getNumResults() != 0)
      scf::YieldOp::create(builder, loc, choice.elseYield().getOperands());
  }
  choice.replaceAllUsesWith(outer.getResults());
  Block *inside = outer.thenBlock();
  if (!inside->empty())
    inside->getTerminator()->erase();
  for (Operation *op : found.work)
    op->moveBefore(inside, inside->end());
  choice->moveBefore(inside, inside->end());
  choice.getConditionMutable().assign(found.second);
  both->erase();
  builder.setInsertionPointToEnd(inside);
  scf::YieldOp::create(builder, loc, choice.getResults());
  return true;
}

//===----------------------------------------------------------------------===//
// Jump threading
//===----------------------------------------------------------------------===//

/// The constant that a condition is where `from` yields the constants of one
/// side; nothing if that is not known.
static std::optional<bool> foldCondition(Value condition, scf::IfOp from,
                                         scf::YieldOp side) {
  auto valueOf = [&](Value value) -> std::optional<APInt> {
    if (auto result = dyn_cast<OpResult>(value);
        result && result.getOwner() == from)
      value = side.getOperand(result.getResultNumber());
    APInt number;
    if (matchPattern(value, m_ConstantInt(&number)))
      return number;
    return {};
  };
  if (std::optional<APInt> number = valueOf(condition))
    return !number->isZero();
  auto compare = condition.getDefiningOp<arith::CmpIOp>();
  if (!compare)
    return {};
  std::optional<APInt> lhs = valueOf(compare.getLhs()),
                       rhs = valueOf(compare.getRhs());
  if (!lhs || !rhs)
    return {};
  return arith::applyCmpPredicate(compare.getPredicate(), *lhs, *rhs);
}

static bool isNothing(Region &side) {
  return side.empty() || llvm::hasSingleElement(side.front());
}

/// Whether a condition does nothing on one side of an earlier one.
static bool doesNothing(scf::IfOp later, scf::IfOp from, scf::YieldOp side) {
  std::optional<bool> holds = foldCondition(later.getCondition(), from, side);
  return holds &&
         isNothing(*holds ? later.getThenRegion() : later.getElseRegion());
}

/// %x = scf.if %c { .. yield %y } else { yield 0 }; scf.if %x != 0 { work }
/// =>  scf.if %c { .. scf.if %y != 0 { work } }
static bool thread(scf::IfOp later) {
  if (later.getNumResults() != 0)
    return false;
  scf::IfOp from;
  for (Operation *op = later->getPrevNode(); op && !from;
       op = op->getPrevNode()) {
    from = dyn_cast<scf::IfOp>(op);
    bool isSource = from && from.getNumResults() != 0 &&
                    (doesNothing(later, from, from.thenYield()) ||
                     doesNothing(later, from, from.elseYield()));
    if (!isSource)
      from = {};
    if (!isSource && !isMemoryEffectFree(op))
      return false;
  }
  if (!from)
    return false;
  scf::YieldOp side = doesNothing(later, from, from.elseYield())
                          ? from.thenYield()
                          : from.elseYield();
  // What stands between is made again there, as far as it is needed.
  IRMapping mapping;
  mapping.map(from.getResults(), side.getOperands());
  OpBuilder builder(side);
  for (Operation *op = from->getNextNode(); op != later; op = op->getNextNode())
    builder.clone(*op, mapping);
  later->moveBefore(side);
  auto update = [&](OpOperand &operand) {
    operand.set(mapping.lookupOrDefault(operand.get()));
  };
  later->walk([&](Operation *op) {
    for (OpOperand &operand : op->getOpOperands())
      update(operand);
  });
  return true;
}

//===----------------------------------------------------------------------===//
// Conditions that are known
//===----------------------------------------------------------------------===//

/// Whether a float is known not to be 0 where an operation stands: a condition
/// around it compares it with 0.
static bool isNonZeroAt(Value number, Operation *at) {
  using P = arith::CmpFPredicate;
  for (; !isa<KernelOp>(at); at = at->getParentOp()) {
    auto choice = dyn_cast<scf::IfOp>(at->getParentOp());
    auto compare = choice ? choice.getCondition().getDefiningOp<arith::CmpFOp>()
                          : arith::CmpFOp();
    if (compare && choice.getThenRegion().isAncestor(at->getParentRegion()) &&
        compare.getLhs() == number &&
        matchPattern(compare.getRhs(), m_AnyZeroFloat()) &&
        llvm::is_contained({P::OGT, P::OLT, P::ONE}, compare.getPredicate()))
      return true;
  }
  return false;
}

/// Whether some bit of an integer is known to be set where an operation stands.
static bool hasBitsAt(Value number, Operation *at, unsigned depth = 8) {
  APInt constant;
  if (matchPattern(number, m_ConstantInt(&constant)))
    return !constant.isZero();
  Operation *op = number.getDefiningOp();
  if (!op || depth == 0)
    return false;
  auto has = [&](Value value) { return hasBitsAt(value, at, depth - 1); };
  if (isa<arith::OrIOp>(op))
    return has(op->getOperand(0)) || has(op->getOperand(1));
  if (isa<arith::ExtUIOp, arith::ExtSIOp>(op))
    return has(op->getOperand(0));
  if (auto bits = dyn_cast<arith::BitcastOp>(op))
    return bits.getIn().getType().isFloat() && isNonZeroAt(bits.getIn(), at);
  // What a shift does not lose.
  auto shift = dyn_cast<arith::ShLIOp>(op);
  auto wide =
      shift ? shift.getLhs().getDefiningOp<arith::ExtUIOp>() : arith::ExtUIOp();
  return wide && matchPattern(shift.getRhs(), m_ConstantInt(&constant)) &&
         constant.ule(wide.getType().getIntOrFloatBitWidth() -
                      wide.getIn().getType().getIntOrFloatBitWidth()) &&
         has(wide.getIn());
}

/// scf.if %x > 0.0 { scf.if bits(%x) != 0 { .. } }  =>  scf.if %x > 0.0 { .. }
static void foldKnown(scf::IfOp choice) {
  auto compare = choice.getCondition().getDefiningOp<arith::CmpIOp>();
  if (!compare || compare.getPredicate() != arith::CmpIPredicate::ne ||
      !matchPattern(compare.getRhs(), m_Zero()) ||
      !hasBitsAt(compare.getLhs(), choice))
    return;
  OpBuilder builder(choice);
  choice.getConditionMutable().assign(arith::ConstantOp::create(
      builder, choice.getLoc(), builder.getBoolAttr(true)));
}

void ThreadJumpsPass::runOnOperation() {
  bool changed = true;
  while (changed) {
    changed = false;
    SmallVector<scf::IfOp> choices;
    getOperation().walk<WalkOrder::PreOrder>([&](KernelOp kernel) {
      kernel.walk<WalkOrder::PreOrder>(
          [&](scf::IfOp choice) { choices.push_back(choice); });
    });
    for (scf::IfOp choice : choices) {
      changed |= splitConjunction(choice, minWeight);
      changed |= thread(choice);
    }
  }
  getOperation().walk([&](KernelOp kernel) {
    kernel.walk([&](scf::IfOp choice) { foldKnown(choice); });
  });
}
