// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Control flow of lanes. What all lanes agree on stays as it is; elsewhere
// conditions become masks, and loops run as long as some lane does.

#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

void IterationWriter::writeStructure(Operation *op) {
  if (auto choice = dyn_cast<scf::IfOp>(op))
    return writeIf(choice);
  if (auto choice = dyn_cast<scf::IndexSwitchOp>(op))
    return writeSwitch(choice);
  bool isShared = lanes.isSharedLoop(op);
  if (auto inner = dyn_cast<scf::ForOp>(op)) {
    if (!lanes.getNest(inner).empty())
      return writeNest(inner);
    return isShared ? writeFor(inner) : writeVaryingFor(inner);
  }
  auto inner = cast<scf::WhileOp>(op);
  return isShared ? writeWhile(inner) : writeVaryingWhile(inner);
}

//===----------------------------------------------------------------------===//
// Conditions
//===----------------------------------------------------------------------===//

void IterationWriter::writeShared(Region &from, Block *to, ValueRange like) {
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToEnd(to);
  if (from.empty())
    return;
  writeBlock(from.front());
  SmallVector<Value> results;
  for (auto [target, value] :
       llvm::zip_equal(like, from.front().getTerminator()->getOperands()))
    results.push_back(getCarriedAs(target, value));
  scf::YieldOp::create(builder, loc, results);
}

/// Whether lanes come to a region that were elected to.
static bool isElection(Region &region) {
  auto choice = dyn_cast<scf::IfOp>(region.getParentOp());
  auto elect =
      choice ? choice.getCondition().getDefiningOp<ElectOp>() : ElectOp();
  return elect && elect->getBlock() == choice->getBlock() &&
         choice.getCondition() == elect.getTakes() &&
         &region == &choice.getThenRegion();
}

/// Whether a value that elected lanes have is `kept` in all others, since only
/// those of them change it that are elected again.
static bool keepsOthers(Value value, Value kept) {
  if (value == kept)
    return true;
  auto choice = value.getDefiningOp<scf::IfOp>();
  auto elect =
      choice ? choice.getCondition().getDefiningOp<ElectOp>() : ElectOp();
  // Only lanes that come to where others are elected are among these.
  if (!elect || elect->getBlock() != choice->getBlock())
    return false;
  unsigned number = cast<OpResult>(value).getResultNumber();
  bool isSide = choice.getCondition() == elect.getSide();
  return keepsOthers(choice.elseYield().getOperand(number), kept) &&
         (!isSide || keepsOthers(choice.thenYield().getOperand(number), kept));
}

SmallVector<Value> IterationWriter::writeSide(Region &region, Value mask,
                                              ValueRange like) {
  Operation *end = region.front().getTerminator();
  SmallVector<Value> values;
  auto collect = [&] {
    for (auto [result, value] : llvm::zip_equal(like, end->getOperands()))
      values.push_back(getCarriedAs(result, value));
  };
  Value outer = active;
  active = mask;
  // Some lane is always elected.
  bool isElected = isElection(region);
  if (isElected || lanes.isCheap(region, /*isNested=*/true)) {
    writeBlock(region.front());
    collect();
    active = outer;
    return values;
  }
  SmallVector<Type> types;
  for (Value result : like)
    types.push_back(getCarriedType(result));
  auto some = scf::IfOp::create(builder, loc, types, any(mask),
                                /*addThenBlock=*/true,
                                /*addElseBlock=*/!types.empty());
  {
    OpBuilder::InsertionGuard guard(builder);
    Block *then = some.thenBlock();
    if (!then->empty())
      then->getTerminator()->erase();
    builder.setInsertionPointToEnd(then);
    writeBlock(region.front());
    collect();
    scf::YieldOp::create(builder, loc, values);
    if (!types.empty()) {
      builder.setInsertionPointToEnd(some.elseBlock());
      SmallVector<Value> nothing;
      for (Type type : types)
        nothing.push_back(zeros(type));
      scf::YieldOp::create(builder, loc, nothing);
    }
  }
  active = outer;
  return SmallVector<Value>(some.getResults());
}

/// Lanes wait until three eighths of all do, or no other lane is left.
Value IterationWriter::writeWaiting(Value goesOn) {
  constexpr int64_t eighths = 3;
  Value waiting = getBits(both(active, invert(goesOn))),
        others = getBits(both(active, goesOn));
  Type word = waiting.getType();
  auto compare = [&](arith::CmpIPredicate predicate, Value bits, int64_t to) {
    Value number = arith::ConstantOp::create(builder, loc,
                                             builder.getIntegerAttr(word, to));
    return arith::CmpIOp::create(builder, loc, predicate, bits, number);
  };
  Value count = math::CtPopOp::create(builder, loc, waiting);
  Value areFew = compare(arith::CmpIPredicate::ult, count,
                         std::max<int64_t>(1, laneCount * eighths / 8));
  Value areOthers = compare(arith::CmpIPredicate::ne, others, 0);
  Value wait = arith::AndIOp::create(builder, loc, areFew, areOthers);
  return arith::OrIOp::create(builder, loc, goesOn, splat(wait));
}

/// By cross-multiplication, so that nothing is divided.
void IterationWriter::writeElect(ElectOp elect) {
  constexpr int64_t all = 8;
  Value first = get(elect.getCondition());
  Value ofFirst = getBits(both(active, first)),
        ofSecond = getBits(both(active, invert(first)));
  Type word = ofFirst.getType();
  auto weigh = [&](Value bits, int64_t weight) -> Value {
    Value factor = arith::ConstantOp::create(
        builder, loc, builder.getIntegerAttr(word, weight));
    return arith::MulIOp::create(
        builder, loc, math::CtPopOp::create(builder, loc, bits), factor);
  };
  auto eighths = int64_t(elect.getEighths());
  Value side = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ugt,
                                     weigh(ofFirst, eighths),
                                     weigh(ofSecond, all - eighths));
  scalars.map(elect.getSide(), side);
  vectors.map(elect.getTakes(), getMask(arith::SelectOp::create(
                                    builder, loc, side, ofFirst, ofSecond)));
}

void IterationWriter::writeVote(VoteOp vote) {
  Value no = any(both(active, invert(get(vote.getCondition()))));
  Value never = arith::ConstantIntOp::create(builder, loc, 0, 1);
  Value all =
      arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq, no, never);
  scalars.map(vote.getResult(),
              arith::AndIOp::create(builder, loc, any(active), all));
}

void IterationWriter::writeIf(scf::IfOp choice) {
  if (!lanes.isVarying(choice.getCondition())) {
    SmallVector<Type> types;
    for (Value result : choice.getResults())
      types.push_back(getCarriedType(result));
    bool hasElse = !choice.getElseRegion().empty();
    auto made = scf::IfOp::create(
        builder, loc, types, getUniform(choice.getCondition()), true, hasElse);
    if (choice.getCondition().getDefiningOp<VoteOp>())
      setProbability(made, getProbability(choice, choice.getThenRegion()));
    for (Region &region : made->getRegions())
      if (!region.empty() && !region.front().empty())
        region.front().getTerminator()->erase();
    writeShared(choice.getThenRegion(), made.thenBlock(), choice.getResults());
    if (hasElse)
      writeShared(choice.getElseRegion(), made.elseBlock(),
                  choice.getResults());
    for (auto [from, to] : llvm::zip(choice.getResults(), made.getResults()))
      setCarried(from, to);
    return;
  }
  Value condition = get(choice.getCondition());
  if (choice->hasAttr(marks::advances))
    condition = writeWaiting(condition);
  SmallVector<Value> yes = writeSide(choice.getThenRegion(),
                                     both(active, condition),
                                     choice.getResults()),
                     no;
  if (!choice.getElseRegion().empty())
    no = writeSide(choice.getElseRegion(), both(active, invert(condition)),
                   choice.getResults());
  bool isElected = isElection(choice.getThenRegion());
  for (auto [i, result] : llvm::enumerate(choice.getResults())) {
    if (isElected && keepsOthers(choice.thenYield().getOperand(i),
                                 choice.elseYield().getOperand(i))) {
      setCarried(result, yes[i]);
      continue;
    }
    if (lanes.isVarying(result)) {
      vectors.map(result, choose(condition, yes[i], no[i]));
      continue;
    }
    // The other side's is poison.
    Value first = choice.thenYield().getOperand(i);
    bool isFirst =
        findOnlyValue(first, choice.elseYield().getOperand(i)) == first;
    scalars.map(result, isFirst ? yes[i] : no[i]);
  }
}

void IterationWriter::writeSwitch(scf::IndexSwitchOp choice) {
  if (!lanes.isVarying(choice.getArg())) {
    SmallVector<Type> types;
    for (Value result : choice.getResults())
      types.push_back(getCarriedType(result));
    auto made = scf::IndexSwitchOp::create(
        builder, loc, types, getUniform(choice.getArg()), choice.getCases(),
        choice.getNumCases());
    for (auto [from, to] : llvm::zip(choice->getRegions(), made->getRegions()))
      writeShared(from, &to.emplaceBlock(), choice.getResults());
    for (auto [from, to] : llvm::zip(choice.getResults(), made.getResults()))
      setCarried(from, to);
    return;
  }
  Value argument = get(choice.getArg()), left = active;
  SmallVector<Value> results;
  SmallVector<std::pair<Value, SmallVector<Value>>> cases;
  for (auto [i, label] : llvm::enumerate(choice.getCases())) {
    Value one = arith::ConstantIndexOp::create(builder, loc, label);
    Value isCase = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                         argument, splat(one));
    cases.emplace_back(isCase,
                       writeSide(choice.getCaseRegions()[i],
                                 both(active, isCase), choice.getResults()));
    left = both(left, invert(isCase));
  }
  results = writeSide(choice.getDefaultRegion(), left, choice.getResults());
  for (auto &[isCase, values] : cases)
    for (auto [result, value] : llvm::zip(results, values))
      result = choose(isCase, value, result);
  for (auto [from, to] : llvm::zip(choice.getResults(), results))
    vectors.map(from, to);
}

//===----------------------------------------------------------------------===//
// Loops
//===----------------------------------------------------------------------===//

void IterationWriter::writeFor(scf::ForOp inner) {
  SmallVector<Value> inits;
  for (auto [variable, init] :
       llvm::zip(inner.getRegionIterArgs(), inner.getInitArgs()))
    inits.push_back(getCarriedAs(variable, init));
  auto made = scf::ForOp::create(
      builder, loc, getUniform(inner.getLowerBound()),
      getUniform(inner.getUpperBound()), getUniform(inner.getStep()), inits);
  made.setUnsignedCmp(inner.getUnsignedCmp());
  Block *body = made.getBody();
  if (!body->empty())
    body->getTerminator()->erase();
  scalars.map(inner.getInductionVar(), made.getInductionVar());
  for (auto [from, to] :
       llvm::zip(inner.getRegionIterArgs(), made.getRegionIterArgs()))
    setCarried(from, to);
  writeShared(inner.getRegion(), body, inner.getRegionIterArgs());
  for (auto [from, to] : llvm::zip(inner.getResults(), made.getResults()))
    setCarried(from, to);
}

/// A loop that goes on with `types`, the last of which is the mask of the lanes
/// that do.
static scf::WhileOp createWhile(OpBuilder &builder, Location loc,
                                ValueRange inits, TypeRange results) {
  auto made = scf::WhileOp::create(builder, loc, results, inits);
  SmallVector<Location> before(inits.size(), loc), after(results.size(), loc);
  builder.createBlock(&made.getBefore(), {}, inits.getTypes(), before);
  builder.createBlock(&made.getAfter(), {}, results, after);
  return made;
}

void IterationWriter::writeVaryingFor(scf::ForOp inner) {
  // Its variables are the number, which all lanes share that began alike, what
  // it carries, and the mask.
  Value variable = inner.getInductionVar();
  Value lower = getCarriedAs(variable, inner.getLowerBound()),
        step = getCarriedAs(variable, inner.getStep()),
        upper = get(inner.getUpperBound());
  auto widen = [&](Value number) {
    return isa<VectorType>(number.getType()) ? number : splat(number);
  };
  using P = arith::CmpIPredicate;
  P below = inner.getUnsignedCmp() ? P::ult : P::slt;
  SmallVector<Value> inits{lower};
  // What is the same for the lanes that go on, and what it was for those that
  // do not.
  SmallVector<unsigned> shared;
  for (auto [i, argument, init] :
       llvm::enumerate(inner.getRegionIterArgs(), inner.getInitArgs())) {
    inits.push_back(getCarriedAs(argument, init));
    if (!lanes.isVarying(argument) && !inner.getResult(i).use_empty())
      shared.push_back(i);
  }
  for (unsigned i : shared)
    inits.push_back(get(inner.getInitArgs()[i]));
  inits.push_back(both(
      active, arith::CmpIOp::create(builder, loc, below, widen(lower), upper)));
  scf::WhileOp made =
      createWhile(builder, loc, inits, ValueRange(inits).getTypes());
  Block *before = made.getBeforeBody(), *after = made.getAfterBody();
  builder.setInsertionPointToEnd(before);
  scf::ConditionOp::create(builder, loc, any(before->getArguments().back()),
                           before->getArguments());
  builder.setInsertionPointToEnd(after);
  Value outer = active, number = after->getArgument(0);
  active = after->getArguments().back();
  setCarried(variable, number);
  for (auto [argument, carried] :
       llvm::zip(inner.getRegionIterArgs(), after->getArguments().drop_front()))
    setCarried(argument, carried);
  writeBlock(*inner.getBody());
  // What is left tells, since the next number may be too large.
  Value rest = arith::SubIOp::create(builder, loc, upper, widen(number));
  SmallVector<Value> next{arith::AddIOp::create(builder, loc, number, step)};
  for (auto [argument, value] :
       llvm::zip(inner.getRegionIterArgs(), inner.getYieldedValues()))
    next.push_back(lanes.isVarying(argument)
                       ? choose(active, get(value), get(argument))
                       : getUniform(value));
  size_t atEnd = 1 + inner.getNumRegionIterArgs();
  for (auto [at, i] : llvm::enumerate(shared))
    next.push_back(choose(active, get(inner.getYieldedValues()[i]),
                          after->getArgument(atEnd + at)));
  next.push_back(both(
      active, arith::CmpIOp::create(builder, loc, P::ugt, rest, widen(step))));
  scf::YieldOp::create(builder, loc, next);
  active = outer;
  builder.setInsertionPointAfter(made);
  for (auto [i, result] : llvm::enumerate(inner.getResults()))
    if (lanes.isVarying(inner.getRegionIterArg(i)))
      vectors.map(result, made.getResult(1 + i));
  for (auto [at, i] : llvm::enumerate(shared))
    vectors.map(inner.getResult(i), made.getResult(atEnd + at));
}

void IterationWriter::writeWhile(scf::WhileOp inner) {
  SmallVector<Value> inits;
  for (auto [variable, init] :
       llvm::zip(inner.getBeforeArguments(), inner.getInits()))
    inits.push_back(getCarriedAs(variable, init));
  SmallVector<Type> types;
  for (Value result : inner.getResults())
    types.push_back(getCarriedType(result));
  scf::WhileOp made = createWhile(builder, loc, inits, types);
  builder.setInsertionPointToEnd(made.getBeforeBody());
  for (auto [from, to] :
       llvm::zip(inner.getBeforeArguments(), made.getBeforeArguments()))
    setCarried(from, to);
  writeBlock(*inner.getBeforeBody());
  scf::ConditionOp condition = inner.getConditionOp();
  SmallVector<Value> leaving;
  for (auto [like, value] : llvm::zip(inner.getResults(), condition.getArgs()))
    leaving.push_back(getCarriedAs(like, value));
  scf::ConditionOp::create(builder, loc, getUniform(condition.getCondition()),
                           leaving);
  for (auto [from, to] :
       llvm::zip(inner.getAfterArguments(), made.getAfterArguments()))
    setCarried(from, to);
  writeShared(inner.getAfter(), made.getAfterBody(),
              inner.getBeforeArguments());
  builder.setInsertionPointAfter(made);
  for (auto [from, to] : llvm::zip(inner.getResults(), made.getResults()))
    setCarried(from, to);
}

void IterationWriter::writeVaryingWhile(scf::WhileOp inner) {
  // Its variables are those of the loop, what it left for each lane that has
  // ended, and the mask. After the mask the condition hands on what is the
  // same for the lanes that go on.
  SmallVector<Value> inits;
  for (auto [variable, init] :
       llvm::zip(inner.getBeforeArguments(), inner.getInits()))
    inits.push_back(getCarriedAs(variable, init));
  SmallVector<Type> types;
  for (Value result : inner.getResults()) {
    types.push_back(getVectorType(result.getType()));
    inits.push_back(zeros(types.back()));
  }
  inits.push_back(active);
  types.push_back(active.getType());
  for (Value variable : inner.getAfterArguments())
    if (!lanes.isVarying(variable))
      types.push_back(variable.getType());
  Value outer = active;
  scf::WhileOp made = createWhile(builder, loc, inits, types);

  builder.setInsertionPointToEnd(made.getBeforeBody());
  size_t count = inner.getInits().size(), left = inner.getNumResults();
  ValueRange given = made.getBeforeArguments();
  for (auto [variable, value] :
       llvm::zip(inner.getBeforeArguments(), given.take_front(count)))
    setCarried(variable, value);
  active = given.back();
  writeBlock(*inner.getBeforeBody());
  scf::ConditionOp condition = inner.getConditionOp();
  SmallVector<Value> leaving;
  for (auto [result, value, old] : llvm::zip(
           inner.getResults(), condition.getArgs(), given.drop_front(count)))
    leaving.push_back(result.use_empty() ? get(value)
                                         : choose(active, get(value), old));
  Value goingOn = both(active, get(condition.getCondition()));
  leaving.push_back(goingOn);
  for (auto [variable, value] :
       llvm::zip(inner.getAfterArguments(), condition.getArgs()))
    if (!lanes.isVarying(variable))
      leaving.push_back(getUniform(value));
  scf::ConditionOp::create(builder, loc, any(goingOn), leaving);

  builder.setInsertionPointToEnd(made.getAfterBody());
  ValueRange going = made.getAfterArguments();
  ValueRange shared = going.drop_front(left + 1);
  for (auto [variable, value] : llvm::zip(inner.getAfterArguments(), going)) {
    bool isVarying = lanes.isVarying(variable);
    setCarried(variable, isVarying ? value : shared.front());
    shared = isVarying ? shared : shared.drop_front();
  }
  active = going[left];
  writeBlock(*inner.getAfterBody());
  SmallVector<Value> next;
  for (auto [variable, value] :
       llvm::zip(inner.getBeforeArguments(), inner.getYieldOp().getOperands()))
    next.push_back(getCarriedAs(variable, value));
  llvm::append_range(next, going.take_front(left + 1));
  scf::YieldOp::create(builder, loc, next);

  active = outer;
  builder.setInsertionPointAfter(made);
  for (auto [result, value] : llvm::zip(inner.getResults(), made.getResults()))
    vectors.map(result, value);
}

//===----------------------------------------------------------------------===//
// The loop
//===----------------------------------------------------------------------===//

/// In 32 bits, which are as many as a vector has for each lane.
Value IterationWriter::writeActive(Value left) {
  Value most = arith::ConstantOp::create(
      builder, loc, builder.getIntegerAttr(left.getType(), laneCount));
  left = arith::MinUIOp::create(builder, loc, left, most);
  Type word = builder.getI32Type();
  if (!left.getType().isIndex())
    left = arith::IndexCastUIOp::create(builder, loc, builder.getIndexType(),
                                        left);
  return getFirstLanes(arith::IndexCastOp::create(builder, loc, word, left));
}

void IterationWriter::write(OpBuilder::InsertPoint place) {
  builder.restoreInsertionPoint(place);
  Value upper = loop.getUpperBound();
  Type type = upper.getType();
  Value first = loop.getLowerBound();
  Block *body;
  if (isOneVector(loop, laneCount)) {
    Value isAny = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                        first, upper);
    auto made = scf::IfOp::create(builder, loc, isAny, /*withElse=*/false);
    outermost = made;
    body = made.thenBlock();
  } else {
    Value step = arith::ConstantOp::create(
        builder, loc, builder.getIntegerAttr(type, laneCount));
    auto made = scf::ForOp::create(builder, loc, first, upper, step);
    outermost = made;
    body = made.getBody();
    first = made.getInductionVar();
  }
  loop.walk([&](memref::AllocaOp array) { writePrivate(array); });
  builder.setInsertionPointToStart(body);
  // Step by what is left: a number after the last may be too large.
  firsts.map(loop.getInductionVar(), first);
  Value steps = vector::StepOp::create(builder, loc,
                                       getVectorType(builder.getIndexType()));
  if (!type.isIndex())
    steps =
        arith::IndexCastOp::create(builder, loc, getVectorType(type), steps);
  vectors.map(loop.getInductionVar(),
              arith::AddIOp::create(builder, loc, splat(first), steps));
  active = writeActive(arith::SubIOp::create(builder, loc, upper, first));
  active.getDefiningOp()->setAttr(marks::lastLanes, builder.getUnitAttr());
  createMasks();
  writeBlock(*loop.getBody());
  writeLate();
  writeLastFlushes();
}
