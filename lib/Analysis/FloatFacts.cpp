//===- FloatFacts.cpp - Floats that are numbers of cells ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A float is either *exact*, a multiple of a power of two that the linear
// system knows, or *opaque*: then its floor is a variable, and so is whether it
// is NaN.
//
//===----------------------------------------------------------------------===//

#include "Piko/Analysis/LinearFacts.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;
using llvm::DynamicAPInt;

static constexpr int maxShift = 16;

static DynamicAPInt powerOfTwo(int exponent) {
  return DynamicAPInt(int64_t(1) << exponent);
}

/// How many bits whole numbers may have that a type holds exactly.
static int getPrecision(Type type) {
  return APFloat::semanticsPrecision(cast<FloatType>(type).getFloatSemantics());
}

//===----------------------------------------------------------------------===//
// Exact floats
//===----------------------------------------------------------------------===//

/// A finite constant as a multiple of 2^-maxShift; none if it is no such number
/// or too large to be of interest.
static std::optional<int64_t> getScaled(Value value) {
  APFloat constant(0.0);
  if (!matchPattern(value, m_ConstantFloat(&constant)) || !constant.isFinite())
    return std::nullopt;
  bool losesInfo;
  constant.convert(APFloat::IEEEdouble(), APFloat::rmNearestTiesToEven,
                   &losesInfo);
  double scaled = std::ldexp(constant.convertToDouble(), maxShift);
  if (losesInfo || std::fabs(scaled) > std::ldexp(1.0, 60) ||
      std::floor(scaled) != scaled)
    return std::nullopt;
  return int64_t(scaled);
}

std::optional<FloatFacts::Exact> FloatFacts::fitExact(Exact number, Type type) {
  Linear most = Linear(1) * powerOfTwo(std::min(getPrecision(type), 60));
  if (number.shift > maxShift ||
      !core.isSurelyAtLeastZero(number.scaled + most) ||
      !core.isSurelyAtLeastZero(most - number.scaled))
    return std::nullopt;
  return number;
}

template <typename Exact> static Exact add(const Exact &a, const Exact &b) {
  int shift = std::max(a.shift, b.shift);
  return {a.scaled * powerOfTwo(shift - a.shift) +
              b.scaled * powerOfTwo(shift - b.shift),
          shift};
}

template <typename Exact> static Exact negate(const Exact &a) {
  return {Linear(0) - a.scaled, a.shift};
}

/// None if neither is a constant.
template <typename Exact>
static std::optional<Exact> multiply(const Exact &a, const Exact &b) {
  for (const auto &[x, y] : {std::pair(a, b), std::pair(b, a)})
    if (std::optional<DynamicAPInt> factor = y.scaled.getConstant())
      return Exact{x.scaled * *factor, x.shift + y.shift};
  return std::nullopt;
}

std::optional<FloatFacts::Exact> FloatFacts::getExact(Id id) {
  if (auto found = exacts.find(id); found != exacts.end())
    return found->second;
  std::optional<Exact> exact = findExact(id);
  exacts[id] = exact;
  return exact;
}

std::optional<FloatFacts::Exact> FloatFacts::findExact(Id id) {
  auto [value, frame] = core.values[id];
  if (std::optional<int64_t> scaled = getScaled(value)) {
    int shift = maxShift;
    for (; shift > 0 && *scaled % 2 == 0; --shift)
      *scaled /= 2;
    return Exact{Linear(*scaled), shift};
  }
  Operation *op = value.getDefiningOp();
  if (!op)
    return std::nullopt;
  auto exactOf = [&, frame = frame](unsigned operand) {
    return getExact(core.number(op->getOperand(operand), frame));
  };
  Type type = value.getType();
  if (isa<arith::SIToFPOp, arith::UIToFPOp>(op)) {
    if (op->getOperand(0).getType().isInteger(1))
      return std::nullopt;
    Linear integer = core.get(op->getOperand(0), frame);
    if (isa<arith::UIToFPOp>(op) && !core.isSurelyAtLeastZero(integer))
      return std::nullopt;
    return fitExact({integer, 0}, type);
  }
  if (isa<arith::AddFOp, arith::SubFOp>(op)) {
    std::optional<Exact> a = exactOf(0), b = exactOf(1);
    if (!a || !b)
      return std::nullopt;
    return fitExact(isa<arith::AddFOp>(op) ? add(*a, *b) : add(*a, negate(*b)),
                    type);
  }
  if (isa<arith::MulFOp, math::FmaOp>(op)) {
    std::optional<Exact> a = exactOf(0), b = exactOf(1);
    std::optional<Exact> product = a && b ? multiply(*a, *b) : std::nullopt;
    std::optional<Exact> addend = Exact{Linear(0), 0};
    if (isa<math::FmaOp>(op))
      addend = exactOf(2);
    // Only the sum is rounded.
    return product && addend ? fitExact(add(*product, *addend), type)
                             : std::nullopt;
  }
  if (isa<arith::NegFOp>(op)) {
    std::optional<Exact> a = exactOf(0);
    // The negative of 0 compares as 0 does.
    return a ? std::optional(negate(*a)) : std::nullopt;
  }
  if (isa<arith::ExtFOp>(op))
    return exactOf(0);
  if (isa<math::FloorOp>(op)) {
    std::optional<Exact> a = exactOf(0);
    if (!a || a->shift == 0)
      return a;
    return Exact{core.divide(a->scaled, powerOfTwo(a->shift)), 0};
  }
  if (auto select = dyn_cast<arith::SelectOp>(op)) {
    std::optional<Exact> a = exactOf(1), b = exactOf(2);
    if (!a || !b)
      return std::nullopt;
    int shift = std::max(a->shift, b->shift);
    Linear result = core.system.addVariable();
    std::vector<LinearFact> cases;
    for (const auto &[truth, arm] :
         {std::pair(true, *a), std::pair(false, *b)}) {
      LinearFact fact =
          core.conditions.describe(select.getCondition(), truth, frame);
      fact.addZero(result - arm.scaled * powerOfTwo(shift - arm.shift));
      cases.push_back(std::move(fact));
    }
    core.facts->choices.push_back(std::move(cases));
    return Exact{result, shift};
  }
  return std::nullopt;
}

//===----------------------------------------------------------------------===//
// Opaque floats
//===----------------------------------------------------------------------===//

FloatFacts::Opaque FloatFacts::getOpaque(Id id) {
  if (auto found = opaques.find(id); found != opaques.end())
    return found->second;
  auto [value, frame] = core.values[id];
  Opaque opaque;
  if (auto floor = value.getDefiningOp<math::FloorOp>()) {
    opaque = getOpaque(core.number(floor.getOperand(), frame));
    opaque.isWhole = true;
  } else {
    opaque = {core.system.addVariable(), core.system.addVariable(), false};
    core.facts->addBetween(Linear(0), opaque.isNaN, Linear(1));
    auto get = value.getDefiningOp<GetOp>();
    if (get && get.getElements().empty() &&
        core.bin.isItem(get.getPrim(), frame))
      for (int64_t dim = 0, e = core.stage.getBins().size(); dim < e; ++dim)
        if (core.provider.isFieldInBin(core.stage, get.getField(), dim)) {
          auto [low, high] = core.bin.getBin(dim);
          core.facts->addBetween(low, opaque.floor, high - Linear(1));
          core.facts->addZero(opaque.isNaN);
        }
  }
  opaques[id] = opaque;
  return opaque;
}

Linear FloatFacts::getCell(Value coordinate, unsigned frame,
                           std::optional<Linear> &unknown) {
  if (!isa<FloatType>(coordinate.getType()))
    return core.get(coordinate, frame);
  Id id = core.number(coordinate, frame);
  if (std::optional<Exact> exact = getExact(id))
    return exact->shift == 0
               ? exact->scaled
               : core.divide(exact->scaled, powerOfTwo(exact->shift));
  Opaque opaque = getOpaque(id);
  unknown = opaque.isNaN;
  return opaque.floor;
}

/// A cast truncates towards 0. Of what is out of the type's range nothing is
/// said.
Linear FloatFacts::expandFloatCast(Operation *op, unsigned frame, Id id) {
  Value operand = op->getOperand(0);
  if (!isa<FloatType>(operand.getType()) ||
      core.valueOf(id).getType().isInteger(1))
    return core.atom(id);
  Id from = core.number(operand, frame);
  Linear result = core.atom(id);
  Type type = core.valueOf(id).getType();
  unsigned width = type.isIndex() ? 64 : type.getIntOrFloatBitWidth();
  Linear end = Linear(1) * powerOfTwo(std::min(width - 1, 62u));
  LinearFact below, inside, above, nan;
  Linear floor;
  bool isWhole, isExact = false;
  if (std::optional<Exact> exact = getExact(from)) {
    isExact = true;
    floor = exact->shift == 0
                ? exact->scaled
                : core.divide(exact->scaled, powerOfTwo(exact->shift));
    isWhole = exact->shift == 0;
    nan.addContradiction();
  } else {
    Opaque opaque = getOpaque(from);
    floor = opaque.floor;
    isWhole = opaque.isWhole;
    nan.addZero(opaque.isNaN - Linear(1));
    inside.addZero(opaque.isNaN);
  }
  // With a fraction, and without a sign, it is the floor only from 0 on.
  Linear least =
      isWhole && isa<arith::FPToSIOp>(op) ? Linear(0) - end : Linear(0);
  if (isExact && core.isSurelyAtLeastZero(floor - least) &&
      core.isSurelyAtLeastZero(end - Linear(1) - floor))
    return floor;
  below.addAtLeastZero(least - floor - Linear(1));
  inside.addAtLeastZero(floor - least);
  inside.addZero(result - floor);
  above.addAtLeastZero(floor - end);
  core.facts->choices.push_back({inside, below, above, nan});
  return result;
}

//===----------------------------------------------------------------------===//
// Comparisons
//===----------------------------------------------------------------------===//

namespace {
/// A comparison without what it says of NaN.
enum class Relation { eq, ne, lt, le, gt, ge };
} // namespace

static Relation opposite(Relation relation) {
  switch (relation) {
  case Relation::eq:
    return Relation::ne;
  case Relation::ne:
    return Relation::eq;
  case Relation::lt:
    return Relation::ge;
  case Relation::le:
    return Relation::gt;
  case Relation::gt:
    return Relation::le;
  case Relation::ge:
    return Relation::lt;
  }
  llvm_unreachable("all relations are listed");
}

static Relation swap(Relation relation) {
  switch (relation) {
  case Relation::lt:
    return Relation::gt;
  case Relation::le:
    return Relation::ge;
  case Relation::gt:
    return Relation::lt;
  case Relation::ge:
    return Relation::le;
  default:
    return relation;
  }
}

/// The relation, and whether it holds of NaN; none where nothing is compared.
static std::optional<std::pair<Relation, bool>>
getRelation(arith::CmpFPredicate predicate) {
  using P = arith::CmpFPredicate;
  switch (predicate) {
  case P::OEQ:
    return std::pair(Relation::eq, false);
  case P::ONE:
    return std::pair(Relation::ne, false);
  case P::OLT:
    return std::pair(Relation::lt, false);
  case P::OLE:
    return std::pair(Relation::le, false);
  case P::OGT:
    return std::pair(Relation::gt, false);
  case P::OGE:
    return std::pair(Relation::ge, false);
  case P::UEQ:
    return std::pair(Relation::eq, true);
  case P::UNE:
    return std::pair(Relation::ne, true);
  case P::ULT:
    return std::pair(Relation::lt, true);
  case P::ULE:
    return std::pair(Relation::le, true);
  case P::UGT:
    return std::pair(Relation::gt, true);
  case P::UGE:
    return std::pair(Relation::ge, true);
  default:
    return std::nullopt;
  }
}

/// That `value RELATION 0`.
static LinearFact compareToZero(Relation relation, const Linear &value) {
  LinearFact fact, other;
  switch (relation) {
  case Relation::eq:
    fact.addZero(value);
    break;
  case Relation::lt:
    fact.addAtLeastZero(Linear(-1) - value);
    break;
  case Relation::le:
    fact.addAtLeastZero(Linear(0) - value);
    break;
  case Relation::gt:
    fact.addAtLeastZero(value - Linear(1));
    break;
  case Relation::ge:
    fact.addAtLeastZero(value);
    break;
  case Relation::ne: {
    LinearFact less = compareToZero(Relation::lt, value);
    LinearFact more = compareToZero(Relation::gt, value);
    fact.choices.push_back({less, more});
    break;
  }
  }
  return fact;
}

/// What it says of the floor of `x` that `x RELATION whole`.
static LinearFact compareFloor(Relation relation, const Linear &floor,
                               const Linear &whole, bool isWhole) {
  if (isWhole || relation == Relation::lt || relation == Relation::ge)
    return compareToZero(relation, floor - whole);
  if (relation == Relation::gt)
    return compareToZero(Relation::ge, floor - whole);
  if (relation == Relation::le || relation == Relation::eq)
    return compareToZero(relation, floor - whole);
  return LinearFact(); // something else than a whole number
}

std::optional<bool> FloatFacts::decide(Value condition, unsigned frame) {
  using P = arith::CmpFPredicate;
  auto compare = condition.getDefiningOp<arith::CmpFOp>();
  if (!compare)
    return std::nullopt;
  std::optional<Exact> a = getExact(core.number(compare.getLhs(), frame)),
                       b = getExact(core.number(compare.getRhs(), frame));
  if (!a || !b)
    return std::nullopt;
  P predicate = compare.getPredicate();
  if (predicate == P::UNO || predicate == P::ORD)
    return predicate == P::ORD;
  auto relation = getRelation(predicate);
  if (!relation || relation->first == Relation::eq ||
      relation->first == Relation::ne)
    return std::nullopt;
  int shift = std::max(a->shift, b->shift);
  Linear above = a->scaled * powerOfTwo(shift - a->shift) -
                 b->scaled * powerOfTwo(shift - b->shift);
  bool isLess =
      relation->first == Relation::lt || relation->first == Relation::le;
  if (isLess)
    above = Linear(0) - above;
  bool isStrict =
      relation->first == Relation::lt || relation->first == Relation::gt;
  if (core.isSurelyAtLeastZero(above - Linear(isStrict)))
    return true;
  if (core.isSurelyAtLeastZero(Linear(isStrict ? 0 : -1) - above))
    return false;
  return std::nullopt;
}

LinearFact FloatFacts::describeFloat(arith::CmpFOp compare, bool truth,
                                     unsigned frame) {
  using P = arith::CmpFPredicate;
  P predicate = compare.getPredicate();
  Id left = core.number(compare.getLhs(), frame);
  Id right = core.number(compare.getRhs(), frame);
  std::optional<Exact> a = getExact(left), b = getExact(right);
  LinearFact fact;
  if (predicate == P::UNO || predicate == P::ORD) {
    bool isNaN = (predicate == P::UNO) == truth;
    if (!a && left == right)
      fact.addZero(getOpaque(left).isNaN - Linear(isNaN ? 1 : 0));
    else if (a && b && isNaN)
      fact.addContradiction();
    return fact;
  }
  auto relation = getRelation(predicate);
  if (!relation)
    return core.conditions.describeUnknown(compare, truth, frame);
  Relation holds = truth ? relation->first : opposite(relation->first);
  bool holdsOfNaN = relation->second == truth;
  if (a && b) {
    int shift = std::max(a->shift, b->shift);
    return compareToZero(holds, a->scaled * powerOfTwo(shift - a->shift) -
                                    b->scaled * powerOfTwo(shift - b->shift));
  }
  if (a && !b) {
    std::swap(a, b);
    std::swap(left, right);
    holds = swap(holds);
  }
  if (a || !b || b->shift != 0)
    return core.conditions.describeUnknown(compare, truth, frame);
  Opaque opaque = getOpaque(left);
  fact = compareFloor(holds, opaque.floor, b->scaled, opaque.isWhole);
  fact.addZero(opaque.isNaN);
  if (!holdsOfNaN)
    return fact;
  LinearFact either, nan;
  nan.addZero(opaque.isNaN - Linear(1));
  either.choices.push_back({fact, nan});
  return either;
}
