// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Analysis/IterationPixels.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/StringMap.h"

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

static Value skipCasts(Value value) {
  while (value.getDefiningOp() && isCast(value.getDefiningOp()))
    value = value.getDefiningOp()->getOperand(0);
  return value;
}

static std::optional<APInt> getConstant(Value value) {
  APInt constant;
  if (matchPattern(value, m_ConstantInt(&constant)))
    return constant;
  return std::nullopt;
}

static bool isSame(Value a, Value b) {
  std::optional<APInt> x = getConstant(a), y = getConstant(b);
  return a == b || (x && y && x->getSExtValue() == y->getSExtValue());
}

namespace {

/// A quotient or a remainder, by a divisor or else of so many low bits.
struct Division {
  enum Kind { Signed, Unsigned, Bits } kind;
  bool isRemainder;
  Value result, divisor = {};
  unsigned bits = 0;

  /// Whether both together say what the number is.
  bool completes(const Division &other) const {
    return isRemainder != other.isRemainder && kind == other.kind &&
           (kind == Bits ? bits == other.bits : isSame(divisor, other.divisor));
  }
};

} // namespace

static std::optional<Division> matchDivision(Operation *op, Value of) {
  if (op->getNumResults() != 1 || op->getNumOperands() < 2 ||
      op->getOperand(0) != of)
    return std::nullopt;
  Value divisor = op->getOperand(1), result = op->getResult(0);
  if (isa<arith::RemSIOp, arith::DivSIOp>(op))
    return Division{Division::Signed, isa<arith::RemSIOp>(op), result, divisor};
  if (isa<arith::RemUIOp, arith::DivUIOp>(op))
    return Division{Division::Unsigned, isa<arith::RemUIOp>(op), result,
                    divisor};
  if (auto divide = dyn_cast<DivideOp>(op)) {
    DivisionKind kind = divide.getKind();
    bool isUnsigned = kind == DivisionKind::QuotientU ||
                      kind == DivisionKind::RemainderU,
         isRemainder = kind == DivisionKind::RemainderS ||
                       kind == DivisionKind::RemainderU;
    return Division{isUnsigned ? Division::Unsigned : Division::Signed,
                    isRemainder, result, divisor};
  }
  std::optional<APInt> constant = getConstant(divisor);
  if (constant && isa<arith::AndIOp>(op) && constant->isMask())
    return Division{Division::Bits, true, result, {}, constant->countr_one()};
  if (constant && isa<arith::ShRUIOp, arith::ShRSIOp>(op) &&
      constant->ult(constant->getBitWidth()))
    return Division{
        Division::Bits, false, result, {}, unsigned(constant->getZExtValue())};
  return std::nullopt;
}

namespace {

/// The pixels that iterations of a loop access.
class IterationPixels {
public:
  explicit IterationPixels(Operation *loop)
      : loop(loop), counters(loop->getRegion(0).getArguments()) {}

  /// Whether coordinates say which iteration it is: each counter is one of them
  /// but for casts and for what is the same in all iterations, or they hold its
  /// quotient and its remainder.
  bool areOwn(ValueRange coordinates) const;
  /// The one iteration that reaches an operation, or null: a test of its number
  /// stands around it.
  Value findOnly(Operation *op) const;
  /// Whether an iteration updates the same pixel twice, or it is one and the
  /// same iteration that reaches both updates.
  bool agree(UpdateOp a, UpdateOp b) const;

private:
  bool isInvariant(Value value) const;
  Value getRoot(Value value) const;
  bool determine(ArrayRef<Value> roots, Value value, int depth = 0) const;

  Operation *loop;
  ValueRange counters;
};

} // namespace

bool IterationPixels::isInvariant(Value value) const {
  return !loop->isAncestor(value.getParentBlock()->getParentOp()) ||
         getConstant(value);
}

/// A number without casts, and without what it is added to or taken from in
/// each iteration alike.
Value IterationPixels::getRoot(Value value) const {
  while (Operation *op = value.getDefiningOp()) {
    bool isSum = isa<arith::AddIOp, arith::SubIOp>(op);
    if (isCast(op) || (isSum && isInvariant(op->getOperand(1))))
      value = op->getOperand(0);
    else if (isSum && isInvariant(op->getOperand(0)))
      value = op->getOperand(1);
    else
      break;
  }
  return value;
}

/// Whether `roots` say what `value` is: it is one of them, or they say what its
/// quotient and its remainder are.
bool IterationPixels::determine(ArrayRef<Value> roots, Value value,
                                int depth) const {
  if (llvm::is_contained(roots, value))
    return true;
  if (depth > 8)
    return false;
  SmallVector<Division> divisions;
  for (Operation *user : value.getUsers()) {
    if (isCast(user) && determine(roots, user->getResult(0), depth + 1))
      return true;
    std::optional<Division> division = matchDivision(user, value);
    if (division && (!division->divisor || isInvariant(division->divisor)) &&
        determine(roots, division->result, depth + 1))
      divisions.push_back(*division);
  }
  return llvm::any_of(divisions, [&](const Division &one) {
    return llvm::any_of(
        divisions, [&](const Division &other) { return one.completes(other); });
  });
}

bool IterationPixels::areOwn(ValueRange coordinates) const {
  SmallVector<Value> roots;
  for (Value coordinate : coordinates)
    roots.push_back(getRoot(coordinate));
  return llvm::all_of(counters,
                      [&](Value counter) { return determine(roots, counter); });
}

Value IterationPixels::findOnly(Operation *op) const {
  if (counters.size() != 1)
    return {};
  auto match = [&](Value condition, arith::CmpIPredicate wanted) -> Value {
    auto test = condition.getDefiningOp<arith::CmpIOp>();
    if (!test || test.getPredicate() != wanted)
      return {};
    for (auto [a, b] : {std::pair(test.getLhs(), test.getRhs()),
                        std::pair(test.getRhs(), test.getLhs())})
      if (skipCasts(a) == counters.front() && isInvariant(b))
        return b;
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

bool IterationPixels::agree(UpdateOp a, UpdateOp b) const {
  Value onlyOfA = findOnly(a), onlyOfB = findOnly(b);
  if (onlyOfA || onlyOfB)
    return onlyOfA && onlyOfB && isSame(onlyOfA, onlyOfB);
  return llvm::equal(a.getCoordinates(), b.getCoordinates());
}

bool piko::updatesOwnPixels(Operation *loop) {
  IterationPixels pixels(loop);
  llvm::StringMap<UpdateOp> known; // by image
  WalkResult result =
      loop->walk([&](StateAccessOpInterface access) -> WalkResult {
        if (!(access.getAccessKinds() & StateAccess::updates))
          return WalkResult::advance();
        auto update = dyn_cast<UpdateOp>(*access);
        if (!update)
          return WalkResult::interrupt(); // of a pixel that is not known
        auto [it, isFirst] = known.try_emplace(update.getImage(), update);
        return WalkResult(
            success(isFirst ? pixels.findOnly(update) ||
                                  pixels.areOwn(update.getCoordinates())
                            : pixels.agree(it->second, update)));
      });
  return !result.wasInterrupted();
}
