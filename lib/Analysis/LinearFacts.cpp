//===- LinearFacts.cpp - What is known of integers at a place -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/LinearFacts.h"

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Analysis/Repeatable.h"

#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;
using llvm::DynamicAPInt;

static DynamicAPInt power(unsigned exponent) {
  DynamicAPInt result(1);
  for (unsigned i = 0; i < exponent; ++i)
    result *= DynamicAPInt(2);
  return result;
}

static bool isConstant(Value value, APInt &constant) {
  return matchPattern(value, m_ConstantInt(&constant));
}

LinearFacts::LinearFacts(Operation *at, FactsProvider &provider,
                         llvm::function_ref<void(LinearFacts &)> assume)
    : at(at), provider(provider), stage(getPhaseStage(at)),
      pipeline(getPipeline(at)), facts(&system.getFacts()) {
  if (assume)
    assume(*this);
  auto process = at->getParentOfType<ProcessOp>();
  if (process && !stage.getTakesList()) {
    items.push_back(process.getBody().getArgument(0));
    bin.assumeAssigned(items.front());
  }
  assumeReached(at);
  if (process && stage.getTakesList()) {
    bin.findItems();
    for (Value item : items)
      bin.assumeAssigned(item);
  }
}

unsigned LinearFacts::addAssign(AssignOp assign, EmissionOpInterface emit) {
  frames.push_back({assign.getBody().getArgument(0), /*same=*/Value(), emit});
  return frames.size() - 1;
}

unsigned LinearFacts::addAssign(AssignOp assign, Value item) {
  frames.push_back({assign.getBody().getArgument(0), item, /*emit=*/{}});
  return frames.size() - 1;
}

void LinearFacts::assumeReached(Operation *place, unsigned frame) {
  SmallVector<std::pair<Value, bool>> conditions; // outermost last
  for (Operation *op = place; op && !isa<ProcessOp, AssignOp, ScheduleOp>(op);
       op = op->getParentOp()) {
    Region *region = op->getParentRegion();
    Operation *parent = op->getParentOp();
    if (auto branch = dyn_cast_or_null<scf::IfOp>(parent))
      conditions.emplace_back(branch.getCondition(),
                              region == &branch.getThenRegion());
    if (auto loop = dyn_cast_or_null<scf::WhileOp>(parent);
        loop && region == &loop.getAfter())
      conditions.emplace_back(loop.getConditionOp().getCondition(), true);
  }
  for (auto [condition, truth] : llvm::reverse(conditions))
    assume(condition, truth, frame);
}

void LinearFacts::assume(Value condition, bool truth, unsigned frame) {
  facts->add(conditions.describe(condition, truth, frame));
}

//===----------------------------------------------------------------------===//
// Numbers of values
//===----------------------------------------------------------------------===//

LinearFacts::Id LinearFacts::create(Value value, unsigned frame) {
  values.emplace_back(value, frame);
  return values.size() - 1;
}

/// Whether an operation gives the same wherever it runs from the same operands,
/// if it runs at all. Each use of poison may be another number.
static bool isComputed(Operation *op) {
  return (isRepeatable(op) && !isa<ub::PoisonOp>(op)) ||
         isa<BinOp, GetOp, ListAtOp>(op);
}

/// The value that an emission gives the element of a field; null if the element
/// is not known.
static Value getEmitted(EmissionOpInterface emit, GetOp get) {
  auto type = cast<PrimType>(get.getPrim().getType());
  RecordOp record = lookupRecord(get, type.getRecord());
  int64_t place = 0, element = 0;
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    if (field.getName() != get.getField()) {
      place += field.getElementCount();
      continue;
    }
    for (auto [index, count] :
         llvm::zip(get.getElements(), field.getCounts())) {
      APInt constant;
      if (!isConstant(index, constant) || constant.uge(count))
        return {};
      element = element * count + constant.getSExtValue();
    }
    return emit.getNumbers()[place + element];
  }
  return {};
}

LinearFacts::Id LinearFacts::number(Value value, unsigned frame) {
  if (auto found = ids.find({value, frame}); found != ids.end())
    return found->second;
  Id id;
  const Scope at = frames[frame];
  Operation *op = value.getDefiningOp();
  auto get = dyn_cast_or_null<GetOp>(op);
  Value emitted = get && at.emit && get.getPrim() == at.primitive
                      ? getEmitted(at.emit, get)
                      : Value();
  if (value == at.primitive && at.same) {
    id = number(at.same, 0);
  } else if (emitted) {
    id = number(emitted, 0);
  } else if (op && isComputed(op)) {
    std::vector<uintptr_t> key{
        uintptr_t(op->getName().getAsOpaquePointer()),
        // Whether an index is tested changes no primitive.
        isa<ListAtOp>(op)
            ? 0
            : uintptr_t(op->getAttrDictionary().getAsOpaquePointer()),
        uintptr_t(value.getType().getAsOpaquePointer()),
        cast<OpResult>(value).getResultNumber()};
    if (isa<BinOp>(op))
      key.push_back(frame);
    for (Value operand : op->getOperands())
      key.push_back(number(operand, frame));
    auto [found, isNew] = idsByKey.try_emplace(key, values.size());
    id = isNew ? create(value, frame) : found->second;
  } else {
    id = create(value, frame);
  }
  ids[{value, frame}] = id;
  return id;
}

Linear LinearFacts::get(Value value, unsigned frame) {
  return expand(number(value, frame));
}

Linear LinearFacts::expand(Id id) {
  if (auto found = expressions.find(id); found != expressions.end())
    return found->second;
  auto [value, frame] = values[id];
  Linear result;
  if (APInt constant; isConstant(value, constant))
    result =
        Linear(value.getType().isInteger(1) ? int64_t(constant.getZExtValue())
                                            : constant.getSExtValue());
  else if (auto argument = dyn_cast<BlockArgument>(value))
    result = expandArgument(argument, frame, id);
  else
    result = expandOperation(value.getDefiningOp(), frame, id);
  expressions[id] = result;
  return result;
}

//===----------------------------------------------------------------------===//
// Ranges
//===----------------------------------------------------------------------===//

/// The numbers that a type has, and for those of 64 bits fewer: sums of them
/// are of no interest.
static std::pair<Linear, Linear> getRange(Type type) {
  unsigned width = type.isIndex() ? 64 : type.getIntOrFloatBitWidth();
  Linear end = Linear(1) * power(width == 64 ? 62 : width - 1);
  return {Linear(0) - end, end - Linear(1)};
}

Linear LinearFacts::atom(Type type) {
  Linear value = system.addVariable();
  if (type.isInteger(1))
    facts->addBetween(Linear(0), value, Linear(1));
  else if (type.isInteger() && type.getIntOrFloatBitWidth() < 64) {
    auto [low, high] = getRange(type);
    facts->addBetween(low, value, high);
  }
  return value;
}

bool LinearFacts::fits(const Linear &value, Type type) {
  auto [low, high] = getRange(type);
  return isSurelyAtLeastZero(value - low) && isSurelyAtLeastZero(high - value);
}

Linear LinearFacts::fit(const Linear &value, Id id) {
  return fits(value, valueOf(id).getType()) ? value : atom(id);
}

Linear LinearFacts::divide(const Linear &value, const DynamicAPInt &by) {
  Linear quotient = system.addVariable();
  Linear rest = value - quotient * by;
  facts->addBetween(Linear(0), rest, Linear(1) * by - Linear(1));
  return quotient;
}

//===----------------------------------------------------------------------===//
// Arguments of loops
//===----------------------------------------------------------------------===//

Linear LinearFacts::expandArgument(BlockArgument argument, unsigned frame,
                                   Id id) {
  Operation *parent = argument.getOwner()->getParentOp();
  if (!argument.getType().isIntOrIndex())
    return system.addVariable();
  if (auto parallel = dyn_cast<ParallelForOp>(parent)) {
    Linear i = atom(id);
    facts->addBetween(Linear(0), i,
                      get(parallel.getCount(), frame) - Linear(1));
    return i;
  }
  if (auto pixels = dyn_cast<ParallelPixelsOp>(parent)) {
    unsigned dim = argument.getArgNumber();
    Linear at = atom(id);
    facts->addBetween(get(pixels.getLo()[dim], frame), at,
                      get(pixels.getHi()[dim], frame) - Linear(1));
    return at;
  }
  if (auto loop = dyn_cast<scf::ForOp>(parent);
      loop && argument == loop.getInductionVar() && !loop.getUnsignedCmp()) {
    Linear low = get(loop.getLowerBound(), frame);
    Linear high = get(loop.getUpperBound(), frame);
    Linear i = atom(id);
    facts->addBetween(low, i, high - Linear(1));
    if (APInt step; isConstant(loop.getStep(), step)) {
      Linear iteration = system.addVariable();
      facts->addAtLeastZero(iteration);
      facts->addZero(i - low - iteration * DynamicAPInt(step.getSExtValue()));
    }
    return i;
  }
  auto loop = dyn_cast<scf::WhileOp>(parent);
  if (!loop) {
    Linear value = atom(id);
    bin.assumeContract(argument, frame, value, /*isWidened=*/false);
    return value;
  }
  unsigned i = argument.getArgNumber();
  if (argument.getOwner() == loop.getAfterBody())
    return get(loop.getConditionOp().getArgs()[i], frame);
  return expandCarried(argument, loop.getInits()[i], frame, id);
}

Linear LinearFacts::expandCarried(BlockArgument argument, Value init,
                                  unsigned frame, Id id) {
  Linear value = atom(id), first = get(init, frame);
  bin.assumeContract(argument, frame, value, /*isWidened=*/false);
  const Recurrence recurrence = getRecurrence(argument);
  if (recurrence.ceiling)
    facts->addAtLeastZero(get(recurrence.ceiling, frame) - value);
  if (recurrence.floor)
    facts->addAtLeastZero(value - get(recurrence.floor, frame));
  if (recurrence.step) {
    Linear iteration = system.addVariable();
    facts->addAtLeastZero(iteration);
    facts->addZero(value - first - iteration * DynamicAPInt(*recurrence.step));
    return value;
  }
  if (recurrence.rises)
    facts->addAtLeastZero(value - first);
  if (recurrence.falls)
    facts->addAtLeastZero(first - value);
  return value;
}

const Recurrence &LinearFacts::getRecurrence(BlockArgument argument) {
  auto found = provider.recurrences.find(argument);
  if (found == provider.recurrences.end()) {
    // Nothing is known of it while it is being found out.
    provider.recurrences[argument] = Recurrence();
    Recurrence recurrence = findRecurrence(argument, provider);
    found = provider.recurrences.insert_or_assign(argument, recurrence).first;
  }
  return found->second;
}

//===----------------------------------------------------------------------===//
// Operations
//===----------------------------------------------------------------------===//

Linear LinearFacts::expandOperation(Operation *op, unsigned frame, Id id) {
  if (!valueOf(id).getType().isIntOrIndex())
    return system.addVariable();
  if (valueOf(id).getType().isInteger(1))
    return atom(id); // what it says is another question
  return llvm::TypeSwitch<Operation *, Linear>(op)
      .Case<arith::AddIOp, arith::SubIOp>(
          [&](auto) { return expandArithmetic(op, frame, id); })
      .Case([&](arith::MulIOp) { return expandProduct(op, frame, id); })
      .Case([&](arith::AndIOp) { return expandMask(op, frame, id); })
      .Case<arith::ShLIOp, arith::ShRSIOp, arith::ShRUIOp>(
          [&](auto) { return expandShift(op, frame, id); })
      .Case<arith::DivUIOp, arith::DivSIOp, arith::RemUIOp, arith::RemSIOp>(
          [&](auto) {
            return expandQuotient(op->getOperand(0), op->getOperand(1),
                                  isa<arith::DivSIOp, arith::RemSIOp>(op),
                                  isa<arith::RemUIOp, arith::RemSIOp>(op),
                                  frame, id);
          })
      .Case([&](DivideOp divide) {
        DivisionKind kind = divide.getKind();
        bool isRemainder = kind == DivisionKind::RemainderS ||
                           kind == DivisionKind::RemainderU;
        bool isSigned =
            kind == DivisionKind::QuotientS || kind == DivisionKind::RemainderS;
        return expandQuotient(divide.getLhs(), divide.getRhs(), isSigned,
                              isRemainder, frame, id);
      })
      .Case<arith::MaxSIOp, arith::MinSIOp>(
          [&](auto) { return expandExtremum(op, frame, id); })
      .Case([&](arith::SelectOp select) {
        return expandSelect(select, frame, id);
      })
      .Case<arith::IndexCastOp, arith::ExtSIOp, arith::TruncIOp>([&](auto) {
        if (op->getOperand(0).getType().isInteger(1))
          return atom(id);
        Linear value = get(op->getOperand(0), frame);
        if (fits(value, valueOf(id).getType()))
          return value;
        // The low bits of what is not negative are no more than it.
        Linear low = atom(id);
        if (isSurelyAtLeastZero(value))
          facts->addAtLeastZero(value - low);
        return low;
      })
      .Case<arith::IndexCastUIOp, arith::ExtUIOp>([&](auto) {
        Value narrow = op->getOperand(0);
        if (narrow.getType().isInteger(1)) {
          Linear value = atom(narrow.getType());
          LinearFact yes = conditions.describe(narrow, true, frame);
          LinearFact no = conditions.describe(narrow, false, frame);
          yes.addZero(value - Linear(1));
          no.addZero(value);
          facts->choices.push_back({yes, no});
          return value;
        }
        Linear value = get(narrow, frame);
        if (isSurelyAtLeastZero(value))
          return fit(value, id);
        Linear result = atom(id);
        if (auto type = dyn_cast<IntegerType>(narrow.getType());
            type && type.getWidth() < 63)
          facts->addBetween(Linear(0), result,
                            Linear(1) * power(type.getWidth()) - Linear(1));
        bin.assumeContract(narrow, frame, result,
                           /*isWidened=*/true);
        return result;
      })
      .Case<arith::FPToSIOp, arith::FPToUIOp>(
          [&](auto) { return floats.expandFloatCast(op, frame, id); })
      .Case<BinLoOp, BinHiOp>([&](auto bound) {
        if (bin.isOwnBin(bound.getBin(), frame)) {
          auto [low, high] = bin.getBin(bound.getDim());
          return isa<BinLoOp>(op) ? low : high;
        }
        return atom(id); // of what may be no bin
      })
      .Case([&](DomainOp domain) { return bin.getDomain(domain.getDim()); })
      .Case([&](ExtentOp extent) {
        return bin.getExtent(extent.getState(), extent.getDim());
      })
      .Case([&](ListSizeOp size) { return bin.getListSize(size.getList()); })
      .Case([&](GetOp get) { return expandField(get, frame, id); })
      .Case([&](LoadOp load) {
        Linear value = atom(id);
        bin.assumeContract(load, frame, value, /*isWidened=*/false);
        return value;
      })
      .Case([&](scf::IfOp choice) {
        return expandBranch(
            choice, cast<OpResult>(valueOf(id)).getResultNumber(), frame, id);
      })
      .Case([&](scf::WhileOp loop) {
        // As it was when the loop ended.
        scf::ConditionOp condition = loop.getConditionOp();
        assume(condition.getCondition(), false, frame);
        return get(
            condition.getArgs()[cast<OpResult>(valueOf(id)).getResultNumber()],
            frame);
      })
      .Default([&](Operation *) { return atom(id); });
}

Linear LinearFacts::expandArithmetic(Operation *op, unsigned frame, Id id) {
  Linear a = get(op->getOperand(0), frame), b = get(op->getOperand(1), frame);
  return fit(isa<arith::AddIOp>(op) ? a + b : a - b, id);
}

Linear LinearFacts::expandProduct(Operation *op, unsigned frame, Id id) {
  Linear a = get(op->getOperand(0), frame), b = get(op->getOperand(1), frame);
  if (std::optional<DynamicAPInt> factor = b.getConstant())
    return fit(a * *factor, id);
  if (std::optional<DynamicAPInt> factor = a.getConstant())
    return fit(b * *factor, id);
  Linear product = atom(id);
  if (!isSurelyAtLeastZero(a) || !isSurelyAtLeastZero(b))
    return product;
  products.push_back({product, a, b});
  // Even if it wraps around, it is not 0 without a reason.
  LinearFact left, right, neither;
  left.addZero(a);
  left.addZero(product);
  right.addZero(b);
  right.addZero(product);
  neither.addAtLeastZero(a - Linear(1));
  neither.addAtLeastZero(b - Linear(1));
  facts->choices.push_back({left, right, neither});
  return product;
}

Linear LinearFacts::expandMask(Operation *op, unsigned frame, Id id) {
  for (auto [value, mask] : {std::pair(op->getOperand(0), op->getOperand(1)),
                             std::pair(op->getOperand(1), op->getOperand(0))}) {
    APInt bits;
    if (!isConstant(mask, bits))
      continue;
    Linear number = get(value, frame);
    if (bits.isAllOnes())
      return number;
    if (bits.isMask()) { // the lowest
      DynamicAPInt size = power(bits.countTrailingOnes());
      return number - divide(number, size) * size;
    }
    if (bits.isNegatedPowerOf2()) { // all but the lowest
      DynamicAPInt size = power(bits.countTrailingZeros());
      return divide(number, size) * size;
    }
  }
  Linear a = get(op->getOperand(0), frame), b = get(op->getOperand(1), frame);
  Linear result = atom(id);
  for (const Linear &operand : {a, b})
    if (isSurelyAtLeastZero(operand))
      facts->addBetween(Linear(0), result, operand);
  return result;
}

Linear LinearFacts::expandShift(Operation *op, unsigned frame, Id id) {
  unsigned width = valueOf(id).getType().isIndex()
                       ? 64
                       : valueOf(id).getType().getIntOrFloatBitWidth();
  APInt by;
  if (!isConstant(op->getOperand(1), by) || by.uge(width))
    return atom(id);
  unsigned count = by.getZExtValue();
  Linear value = get(op->getOperand(0), frame);
  if (isa<arith::ShLIOp>(op))
    return fit(value * power(count), id);
  if (isa<arith::ShRSIOp>(op) || isSurelyAtLeastZero(value))
    return divide(value, power(count));
  Linear result = atom(id);
  if (count > 0)
    facts->addBetween(Linear(0), result,
                      Linear(1) * power(width - count) - Linear(1));
  return result;
}

std::optional<Linear> LinearFacts::findOtherFactor(const Linear &of,
                                                   const Linear &by) {
  for (const auto &[product, a, b] : products)
    if ((a == by || b == by) && isSurelyAtLeastZero(product - of - Linear(1)))
      return a == by ? b : a;
  return std::nullopt;
}

Linear LinearFacts::expandQuotient(Value dividend, Value divisor, bool isSigned,
                                   bool isRemainder, unsigned frame, Id id) {
  Linear of = get(dividend, frame), by = get(divisor, frame);
  Linear last = by - Linear(1);
  if (!isSurelyAtLeastZero(last))
    return atom(id);
  if (!isSurelyAtLeastZero(of)) {
    Linear result = atom(id);
    if (isRemainder)
      facts->addBetween(isSigned ? Linear(0) - last : Linear(0), result, last);
    return result;
  }
  if (std::optional<DynamicAPInt> constant = by.getConstant()) {
    Linear quotient = divide(of, *constant);
    return isRemainder ? of - quotient * *constant : quotient;
  }
  Linear result = atom(id);
  facts->addBetween(Linear(0), result, of);
  if (isRemainder)
    facts->addAtLeastZero(last - result);
  else if (std::optional<Linear> other = findOtherFactor(of, by))
    facts->addAtLeastZero(*other - result - Linear(1));
  return result;
}

Linear LinearFacts::expandExtremum(Operation *op, unsigned frame, Id id) {
  Linear a = get(op->getOperand(0), frame), b = get(op->getOperand(1), frame);
  Linear result = atom(id);
  std::vector<LinearFact> cases(2);
  for (auto [fact, operand] : llvm::zip(cases, std::array{a, b})) {
    fact.addZero(result - operand);
    facts->addAtLeastZero(isa<arith::MaxSIOp>(op) ? result - operand
                                                  : operand - result);
  }
  facts->choices.push_back(std::move(cases));
  return result;
}

Linear LinearFacts::expandSelect(arith::SelectOp select, unsigned frame,
                                 Id id) {
  if (!select.getCondition().getType().isInteger(1))
    return atom(id);
  // A case less, where conversions test what is exact.
  if (std::optional<bool> truth = floats.decide(select.getCondition(), frame))
    return get(*truth ? select.getTrueValue() : select.getFalseValue(), frame);
  return chooseBetween(select.getCondition(), select.getTrueValue(),
                       select.getFalseValue(), frame, id);
}

Linear LinearFacts::chooseBetween(Value condition, Value ifTrue, Value ifFalse,
                                  unsigned frame, Id id) {
  Linear result = atom(id);
  std::vector<LinearFact> cases;
  for (bool truth : {true, false}) {
    LinearFact fact = conditions.describe(condition, truth, frame);
    if (Value value = truth ? ifTrue : ifFalse) {
      LinearFact *outer = std::exchange(facts, &fact);
      Linear chosen = get(value, frame);
      facts = outer;
      fact.addZero(result - chosen);
    }
    cases.push_back(std::move(fact));
  }
  facts->choices.push_back(std::move(cases));
  return result;
}

/// What holds of what an arm computes holds only if it runs.
Linear LinearFacts::expandBranch(scf::IfOp choice, unsigned number,
                                 unsigned frame, Id id) {
  // Of a constant that is no number, such as poison, nothing is known.
  auto known = [&](scf::YieldOp yield) {
    Value value = yield.getOperand(number);
    bool isOther = matchPattern(value, m_Constant()) &&
                   !matchPattern(value, m_Op<arith::ConstantOp>());
    return isOther ? Value() : value;
  };
  for (scf::YieldOp yield : {choice.thenYield(), choice.elseYield()})
    expandAhead(choice, yield.getOperand(number), frame);
  return chooseBetween(choice.getCondition(), known(choice.thenYield()),
                       known(choice.elseYield()), frame, id);
}

void LinearFacts::expandAhead(scf::IfOp branch, Value value, unsigned frame) {
  constexpr size_t most = 64; // values that are looked at
  llvm::SmallSetVector<Value, 16> found;
  found.insert(value);
  for (size_t i = 0; i < found.size() && i < most; ++i) {
    Value at = found[i];
    Operation *op = at.getDefiningOp();
    bool isAhead =
        !branch->isProperAncestor(op ? op : at.getParentBlock()->getParentOp());
    if (isAhead && at.getType().isIntOrIndex() && !at.getType().isInteger(1))
      get(at, frame);
    else if (op)
      found.insert_range(op->getOperands());
  }
}

Linear LinearFacts::expandField(GetOp get, unsigned frame, Id id) {
  Linear value = atom(id);
  bin.assumeContract(get, frame, value, /*isWidened=*/false);
  if (get.getElements().empty() && bin.isItem(get.getPrim(), frame))
    for (int64_t dim = 0, e = stage.getBins().size(); dim < e; ++dim)
      if (provider.isFieldInBin(stage, get.getField(), dim)) {
        auto [low, high] = bin.getBin(dim);
        facts->addBetween(low, value, high - Linear(1));
      }
  return value;
}
