// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From the innermost loop outwards, in three steps for each nest of two.
//
//   1. Each loop becomes one that tests a flag which it carries: its work
//      stands in its body (loop rotation). Where a test is more than a few
//      operations, it is work.
//   2. What stands under conditions, with the inner loop in it, is split at the
//      loop, whose flag is false where the conditions are:
//
//        if (c) { A; while (flag) B; C }
//          =>  flag = false; if (c) A; while (flag) B; if (c) C
//
//   3. Two loops are merged. A turn is one of either loop:
//
//        while (outer) {               begins = true; flag = false
//          A                           while (outer)
//          while (flag) B       =>       if (flag) B
//          C                             else {
//        }                                 if (not begins) C
//                                          begins = false
//                                          if (outer) A
//                                        }
//
// The state of the loop that is made is that of both, and what A computes for
// the inner loop and for C. Which of the two steps is taken, lanes elect
// (iteration delaying). Where A and C are short, beside what stands in the
// inner loop, they are done at once (loop flattening): B is that of three loops
// or more.

#include "Vectorize/Shape/MergeLoops.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Vectorize/Analysis/LaneForms.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

using Values = SmallVector<Value>;

static bool isLoop(Operation *op) { return isa<scf::ForOp, scf::WhileOp>(op); }

static Value createPoison(OpBuilder &builder, Location loc, Type type) {
  return ub::PoisonOp::create(builder, loc, type);
}

static Values createPoison(OpBuilder &builder, Location loc, TypeRange types) {
  return llvm::map_to_vector(
      types, [&](Type type) { return createPoison(builder, loc, type); });
}

/// Moves the operations of a block but its terminator to where a builder
/// stands.
static void moveBody(Block &from, OpBuilder &builder) {
  builder.getBlock()->getOperations().splice(builder.getInsertionPoint(),
                                             from.getOperations(), from.begin(),
                                             std::prev(from.end()));
}

//===----------------------------------------------------------------------===//
// What is merged
//===----------------------------------------------------------------------===//

/// The type that a loop counts in: 32 bits, where its bounds have no more.
static Type getCounterType(scf::ForOp loop) {
  auto isWord = [](Value bound) {
    std::optional<int64_t> known = getConstantIntValue(bound);
    auto cast = bound.getDefiningOp<arith::IndexCastOp>();
    return known ? llvm::isInt<32>(*known)
                 : cast && cast.getIn().getType().isInteger(32);
  };
  Type type = loop.getInductionVar().getType();
  return type.isIndex() && isWord(loop.getLowerBound()) &&
                 isWord(loop.getUpperBound()) && isOneInteger(loop.getStep())
             ? IntegerType::get(loop.getContext(), 32)
             : type;
}

/// Whether a loop hands on numbers, and the number after its last is none that
/// wraps around.
static bool isMergeable(Operation *loop) {
  auto isNumber = [](Value value) {
    return value.getType().isIntOrIndexOrFloat();
  };
  if (auto counted = dyn_cast<scf::ForOp>(loop)) {
    std::optional<int64_t> step = getConstantIntValue(counted.getStep());
    bool isWide = counted.getInductionVar().getType().isIndex();
    if (!step || (*step != 1 && !isWide) || counted.getUnsignedCmp())
      return false;
  }
  return llvm::all_of(loop->getOperands(), isNumber) &&
         llvm::all_of(loop->getResults(), isNumber);
}

/// Whether only conditions stand between a loop and the one around it.
static bool isUnderConditions(Operation *inner, Operation *outer) {
  for (Region *at = inner->getParentRegion(); at->getParentOp() != outer;
       at = at->getParentRegion())
    if (!isa<scf::IfOp>(at->getParentOp()) || isFallback(*at))
      return false;
  return true;
}

static int64_t countOperations(Operation *loop) {
  int64_t count = 0;
  loop->walk([&](Operation *) { ++count; });
  return count;
}

Operation *piko::findMergeable(Operation *outer,
                               llvm::function_ref<bool(Operation *)> mayPart) {
  Operation *found = nullptr;
  int64_t most = 0;
  for (Region &region : outer->getRegions())
    region.walk<WalkOrder::PreOrder>([&](Operation *op) {
      if (!isLoop(op))
        return WalkResult::advance();
      int64_t count = countOperations(op);
      if (count > most && isUnderConditions(op, outer) && isMergeable(op) &&
          mayPart(op)) {
        most = count;
        found = op;
      }
      return WalkResult::skip();
    });
  return found;
}

//===----------------------------------------------------------------------===//
// Loops that test a flag
//===----------------------------------------------------------------------===//

/// A loop that carries its flag first, and goes on while that is true.
static scf::WhileOp createFlagged(OpBuilder &builder, Location loc,
                                  ValueRange inits) {
  OpBuilder::InsertionGuard guard(builder);
  auto made = scf::WhileOp::create(builder, loc, inits.getTypes(), inits);
  SmallVector<Location> places(inits.size(), loc);
  Block *test =
      builder.createBlock(&made.getBefore(), {}, inits.getTypes(), places);
  scf::ConditionOp::create(builder, loc, test->getArgument(0),
                           test->getArguments());
  builder.createBlock(&made.getAfter(), {}, inits.getTypes(), places);
  return made;
}

static Value getBound(OpBuilder &builder, scf::ForOp loop, Value bound) {
  Type type = getCounterType(loop);
  if (type == bound.getType())
    return bound;
  if (std::optional<int64_t> known = getConstantIntValue(bound))
    return arith::ConstantOp::create(builder, loop.getLoc(),
                                     builder.getIntegerAttr(type, *known));
  return bound.getDefiningOp<arith::IndexCastOp>().getIn();
}

static scf::WhileOp rotate(scf::ForOp loop) {
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  CodeBuilder code(builder, loc);
  Value lower = getBound(builder, loop, loop.getLowerBound()),
        upper = getBound(builder, loop, loop.getUpperBound());
  Type type = lower.getType();
  Value step = arith::ConstantOp::create(
      builder, loc,
      builder.getIntegerAttr(type, *getConstantIntValue(loop.getStep())));
  using P = CodeBuilder::P;
  Values inits{code.compare(P::slt, lower, upper), lower};
  llvm::append_range(inits, loop.getInitArgs());
  scf::WhileOp made = createFlagged(builder, loc, inits);
  builder.setInsertionPointToEnd(made.getAfterBody());
  Block::BlockArgListType carried = made.getAfterArguments();
  Value counter = carried[1], variable = counter;
  if (variable.getType() != loop.getInductionVar().getType())
    variable = arith::IndexCastOp::create(
        builder, loc, loop.getInductionVar().getType(), counter);
  loop.getInductionVar().replaceAllUsesWith(variable);
  for (auto [from, to] :
       llvm::zip_equal(loop.getRegionIterArgs(), carried.drop_front(2)))
    from.replaceAllUsesWith(to);
  Values yielded = llvm::to_vector(loop.getYieldedValues());
  moveBody(*loop.getBody(), builder);
  Value next = code.add(counter, step);
  Values state{code.compare(P::slt, next, upper), next};
  for (Value value : yielded)
    state.push_back(value);
  scf::YieldOp::create(builder, loc, state);
  loop.replaceAllUsesWith(ValueRange(made.getResults()).drop_front(2));
  loop.erase();
  return made;
}

/// Whether a test may be made twice.
static bool isCheapTest(scf::WhileOp loop) {
  constexpr size_t most = 3;
  Block &test = *loop.getBeforeBody();
  return test.getOperations().size() <= most + 1 &&
         llvm::all_of(test.without_terminator(), [](Operation &op) {
           return op.getNumRegions() == 0 && isPure(&op);
         });
}

/// Whether a loop tests a flag that it carries.
static bool isFlagged(scf::WhileOp loop) {
  scf::ConditionOp condition = loop.getConditionOp();
  return !loop.getBeforeArguments().empty() &&
         condition.getCondition() == loop.getBeforeArguments().front() &&
         llvm::equal(condition.getArgs(), loop.getBeforeArguments());
}

/// Clones a loop's test of what it carries; what it hands on, after whether it
/// goes on.
static Values cloneTest(OpBuilder &builder, scf::WhileOp loop,
                        ValueRange carried) {
  IRMapping mapping;
  mapping.map(loop.getBeforeArguments(), carried);
  for (Operation &op : loop.getBeforeBody()->without_terminator())
    builder.clone(op, mapping);
  return llvm::map_to_vector(
      loop.getConditionOp()->getOperands(),
      [&](Value value) { return mapping.lookupOrDefault(value); });
}

/// Of a loop with a cheap test, which is made again at the end of its body.
static scf::WhileOp rotateTest(scf::WhileOp loop) {
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  Values inits{cloneTest(builder, loop, loop.getInits()).front()};
  llvm::append_range(inits, loop.getInits());
  scf::WhileOp made = createFlagged(builder, loc, inits);
  builder.setInsertionPointToEnd(made.getAfterBody());
  Values handed = cloneTest(builder, loop,
                            ValueRange(made.getAfterArguments()).drop_front());
  for (auto [from, to] :
       llvm::zip_equal(loop.getAfterArguments(), ArrayRef(handed).drop_front()))
    from.replaceAllUsesWith(to);
  Values next = llvm::to_vector(loop.getYieldOp().getOperands());
  moveBody(*loop.getAfterBody(), builder);
  Values state{cloneTest(builder, loop, next).front()};
  llvm::append_range(state, next);
  scf::YieldOp::create(builder, loc, state);
  builder.setInsertionPointAfter(made);
  Values results =
      cloneTest(builder, loop, ValueRange(made.getResults()).drop_front());
  loop.replaceAllUsesWith(ArrayRef(results).drop_front());
  loop.erase();
  return made;
}

namespace {

/// A loop whose test is its work, as `do ... while`: it carries what the test
/// hands on, and, apart, what the loop carries otherwise.
class TestRotation {
public:
  explicit TestRotation(scf::WhileOp loop)
      : loop(loop), builder(loop), loc(loop.getLoc()),
        isTrivial(loop.getAfterBody()->without_terminator().empty()) {}
  scf::WhileOp write();

private:
  void findPlaces();
  Values getNext(ValueRange handed, Value goesOn);

  scf::WhileOp loop;
  OpBuilder builder;
  Location loc;
  bool isTrivial; ///< What is handed on is carried as it is.
  Values inits;
  /// Where what is carried is in the state, or what it always is.
  SmallVector<std::pair<std::optional<size_t>, Value>> places;
  SmallVector<size_t> apart; ///< what is carried beside what is handed on
};

} // namespace

void TestRotation::findPlaces() {
  size_t handed = loop.getNumResults();
  inits.assign(1 + handed, Value());
  inits.front() = CodeBuilder(builder, loc).boolean(true);
  auto addApart = [&](size_t i, Value init) {
    places.emplace_back(inits.size(), Value());
    inits.push_back(init);
    apart.push_back(i);
  };
  for (auto [i, next, init] :
       llvm::enumerate(loop.getYieldOp().getOperands(), loop.getInits())) {
    auto argument = dyn_cast<BlockArgument>(next);
    bool isHanded =
        isTrivial && argument && argument.getOwner() == loop.getAfterBody();
    Attribute known, first;
    bool isConstant = matchPattern(next, m_Constant(&known)) &&
                      matchPattern(init, m_Constant(&first)) && known == first;
    if (isHanded && !inits[1 + argument.getArgNumber()]) {
      places.emplace_back(1 + argument.getArgNumber(), Value());
      inits[1 + argument.getArgNumber()] = init;
    } else if (isTrivial && !isHanded && (isConstant || next == init)) {
      places.emplace_back(std::nullopt, init);
    } else {
      addApart(i, init);
    }
  }
  for (auto [init, result] :
       llvm::zip(MutableArrayRef(inits).drop_front().take_front(handed),
                 loop.getResults()))
    if (!init)
      init = createPoison(builder, loc, result.getType());
}

/// What is carried beside what is handed on.
Values TestRotation::getNext(ValueRange handed, Value goesOn) {
  if (apart.empty())
    return {};
  scf::YieldOp yield = loop.getYieldOp();
  if (isTrivial) {
    IRMapping mapping;
    mapping.map(loop.getAfterArguments(), handed);
    return llvm::map_to_vector(apart, [&](size_t i) {
      return mapping.lookupOrDefault(yield.getOperand(i));
    });
  }
  for (auto [from, to] : llvm::zip_equal(loop.getAfterArguments(), handed))
    from.replaceAllUsesWith(to);
  Values next =
      llvm::map_to_vector(apart, [&](size_t i) { return yield.getOperand(i); });
  auto choice = scf::IfOp::create(builder, loc, ValueRange(next).getTypes(),
                                  goesOn, /*withElse=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToEnd(choice.thenBlock());
  moveBody(*loop.getAfterBody(), builder);
  scf::YieldOp::create(builder, loc, next);
  builder.setInsertionPointToEnd(choice.elseBlock());
  scf::YieldOp::create(builder, loc,
                       createPoison(builder, loc, ValueRange(next).getTypes()));
  return llvm::to_vector(ValueRange(choice.getResults()));
}

scf::WhileOp TestRotation::write() {
  findPlaces();
  scf::WhileOp made = createFlagged(builder, loc, inits);
  builder.setInsertionPointToEnd(made.getAfterBody());
  for (auto [argument, place] :
       llvm::zip_equal(loop.getBeforeArguments(), places))
    argument.replaceAllUsesWith(
        place.first ? Value(made.getAfterArguments()[*place.first])
                    : place.second);
  scf::ConditionOp condition = loop.getConditionOp();
  Values state{condition.getCondition()};
  Values handed = llvm::to_vector(condition.getArgs());
  moveBody(*loop.getBeforeBody(), builder);
  llvm::append_range(state, handed);
  llvm::append_range(state, getNext(handed, state.front()));
  scf::YieldOp::create(builder, loc, state);
  loop.replaceAllUsesWith(
      ValueRange(made.getResults()).slice(1, loop.getNumResults()));
  loop.erase();
  return made;
}

/// A loop as one that tests a flag.
static scf::WhileOp rotate(Operation *loop) {
  if (auto counted = dyn_cast<scf::ForOp>(loop))
    return rotate(counted);
  auto other = cast<scf::WhileOp>(loop);
  if (isFlagged(other))
    return other;
  return isCheapTest(other) ? rotateTest(other) : TestRotation(other).write();
}

//===----------------------------------------------------------------------===//
// Conditions around loops
//===----------------------------------------------------------------------===//

namespace {

/// Splits a condition at a loop that tests a flag, in one of its sides.
class ConditionSplit {
public:
  ConditionSplit(scf::IfOp choice, scf::WhileOp loop)
      : choice(choice), loop(loop), builder(choice), loc(choice.getLoc()),
        side(loop->getBlock()), isFirst(side == choice.thenBlock()),
        other(isFirst ? choice.elseBlock() : choice.thenBlock()) {}
  void write();

private:
  void findLive();
  bool isFromOther(Value value) const {
    return other && other->getParent()->isAncestor(value.getParentRegion());
  }
  scf::IfOp writeBefore();
  scf::IfOp createIf(TypeRange types);
  Block *getSide(scf::IfOp made) const {
    return isFirst ? made.thenBlock() : made.elseBlock();
  }
  Block *getOther(scf::IfOp made) const {
    return isFirst ? made.elseBlock() : made.thenBlock();
  }

  scf::IfOp choice;
  scf::WhileOp loop;
  OpBuilder builder;
  Location loc;
  Block *side;
  bool isFirst;
  Block *other; ///< or null
  /// What is computed before the loop for it and for what is after it, and what
  /// the other side yields of its own.
  llvm::SetVector<Value> live, passed;
};

} // namespace

void ConditionSplit::findLive() {
  auto add = [&](Value value) {
    Operation *from = value.getDefiningOp();
    if (from && from->getBlock() == side && from->isBeforeInBlock(loop))
      live.insert(value);
  };
  auto addAll = [&](Operation *op) {
    op->walk([&](Operation *in) {
      if (in != loop)
        llvm::for_each(in->getOperands(), add);
    });
  };
  for (Operation *op = loop; op; op = op->getNextNode())
    addAll(op);
  if (other)
    for (Value value : other->getTerminator()->getOperands())
      if (isFromOther(value))
        passed.insert(value);
}

scf::IfOp ConditionSplit::createIf(TypeRange types) {
  auto made = scf::IfOp::create(builder, loc, types, choice.getCondition(),
                                /*withElse=*/true);
  for (Region *region : {&made.getThenRegion(), &made.getElseRegion()})
    if (!region->front().empty())
      region->front().getTerminator()->erase();
  made->setDiscardableAttrs(choice->getDiscardableAttrDictionary());
  return made;
}

/// What is before the loop, or the other side, which has no loop.
scf::IfOp ConditionSplit::writeBefore() {
  Values inits = llvm::to_vector(loop.getInits());
  SmallVector<Type> types(ValueRange(inits).getTypes());
  for (const auto &values : {live, passed})
    llvm::append_range(types, ValueRange(values.getArrayRef()).getTypes());
  scf::IfOp made = createIf(types);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToEnd(getSide(made));
  getSide(made)->getOperations().splice(getSide(made)->end(),
                                        side->getOperations(), side->begin(),
                                        loop->getIterator());
  Values yielded = inits;
  llvm::append_range(yielded, live);
  llvm::append_range(
      yielded,
      createPoison(builder, loc, ValueRange(passed.getArrayRef()).getTypes()));
  scf::YieldOp::create(builder, loc, yielded);

  builder.setInsertionPointToEnd(getOther(made));
  Values nothing{CodeBuilder(builder, loc).boolean(false)};
  llvm::append_range(
      nothing,
      createPoison(builder, loc,
                   ArrayRef(types).slice(1, inits.size() - 1 + live.size())));
  if (other) {
    OpBuilder::InsertPoint end = builder.saveInsertionPoint();
    builder.setInsertionPointToStart(getOther(made));
    moveBody(*other, builder);
    builder.restoreInsertionPoint(end);
  }
  llvm::append_range(nothing, passed);
  scf::YieldOp::create(builder, loc, nothing);
  return made;
}

void ConditionSplit::write() {
  findLive();
  Values ofOther =
      other ? llvm::to_vector(other->getTerminator()->getOperands()) : Values();
  scf::IfOp before = writeBefore();
  ValueRange made = before.getResults();
  size_t count = loop.getInits().size();
  loop->moveBefore(choice);
  loop.getInitsMutable().assign(made.take_front(count));
  auto replace = [&](const llvm::SetVector<Value> &from, ValueRange to) {
    for (auto [value, result] : llvm::zip_equal(from.getArrayRef(), to))
      Value(value).replaceUsesWithIf(result, [&](OpOperand &use) {
        return !before->isAncestor(use.getOwner());
      });
  };
  replace(live, made.slice(count, live.size()));
  for (Value &value : ofOther)
    if (passed.contains(value))
      value = made[count + live.size() +
                   size_t(std::distance(passed.begin(),
                                        llvm::find(passed, value)))];

  Values ofSide = llvm::to_vector(side->getTerminator()->getOperands());
  if (side->without_terminator().empty() && ofSide.empty()) {
    choice.erase();
    return;
  }
  builder.setInsertionPoint(choice);
  scf::IfOp after = createIf(choice.getResultTypes());
  builder.setInsertionPointToEnd(getSide(after));
  moveBody(*side, builder);
  scf::YieldOp::create(builder, loc, ofSide);
  builder.setInsertionPointToEnd(getOther(after));
  scf::YieldOp::create(builder, loc, ofOther);
  choice.replaceAllUsesWith(after);
  choice.erase();
}

/// Brings a loop out of the conditions that it stands under.
static void split(scf::WhileOp loop, Block *body) {
  while (loop->getBlock() != body)
    ConditionSplit(cast<scf::IfOp>(loop->getParentOp()), loop).write();
}

//===----------------------------------------------------------------------===//
// Merging
//===----------------------------------------------------------------------===//

namespace {

/// How lanes come to a step of the outer one of two loops.
enum class StepMode {
  AtOnce, ///< in the turn in which they are done with the inner one
  Elected ///< when there are enough of them
};

/// Merges two loops that test a flag, of which the inner one stands in the
/// body of the other.
class LoopPair {
public:
  LoopPair(scf::WhileOp outer, scf::WhileOp inner, StepMode mode,
           double probability)
      : outer(outer), inner(inner), builder(outer), loc(outer.getLoc()),
        body(outer.getAfterBody()), mode(mode), probability(probability) {}
  /// Lanes wait until so many eighths of them do.
  void setEighths(int64_t count) { eighths = count; }
  /// What only steps of the outer loop change is in arrays, which are made at
  /// the beginning of a block: not all of it fits into registers.
  void setArrays(Block *block) { arrays = block; }
  scf::WhileOp write();

private:
  /// A part of the state: an argument of the loop, or an array of one element.
  struct Place {
    size_t at = 0;
    Value array = {};
  };
  Place addPlace(Type type);
  void findKept();
  void findPlaces();
  Values getInits();
  Value read(const Place &place, ValueRange state);
  /// Stores what is in an array; else puts it into the state.
  void write(const Place &place, Value value, MutableArrayRef<Value> state);
  void complete(MutableArrayRef<Value> state);
  /// Has the uses of what is kept, in the inner loop or after it, read it.
  void replaceKept(ValueRange state, bool inInner);
  scf::IfOp createIf(TypeRange types, Value condition,
                     std::optional<double> probability = {});
  void yield(Block *block, ValueRange values);
  /// The state after an iteration of the inner loop, where a condition holds.
  Values writeIteration(Value condition, ValueRange state,
                        std::optional<double> probability = {});
  /// The state after a step of the outer loop, up to the inner one.
  Values writeStep(ValueRange state);
  Values writeEnd(ValueRange state);
  Values writeStart(ValueRange next);
  Values writeElected(ValueRange state);
  Values writeAtOnce(ValueRange state);

  scf::WhileOp outer, inner;
  OpBuilder builder;
  Location loc;
  Block *body;
  StepMode mode;
  double probability;
  int64_t eighths = 4;
  Block *arrays = nullptr;
  Value zero; ///< the index of an array's element
  llvm::SetVector<Value> kept;
  /// Of the state: whether the loop goes on, whether the inner one does,
  /// whether the outer one begins, what the inner one carries, and then what is
  /// kept, and what the outer one carries.
  static constexpr size_t flags = 3;
  SmallVector<Type> types;
  SmallVector<Place> ofKept, ofCarried;
  size_t innerCount = 0;
};

} // namespace

LoopPair::Place LoopPair::addPlace(Type type) {
  if (!arrays || type.isInteger(1)) {
    types.push_back(type);
    return {types.size() - 1};
  }
  OpBuilder before(arrays, arrays->begin());
  return {0, memref::AllocaOp::create(before, loc, MemRefType::get({1}, type))};
}

void LoopPair::findKept() {
  auto add = [&](Value value) {
    Operation *from = value.getDefiningOp();
    if (value.getParentBlock() == body &&
        (!from || from->isBeforeInBlock(inner)))
      kept.insert(value);
  };
  for (Operation *op = inner; op; op = op->getNextNode())
    op->walk([&](Operation *in) {
      if (in != inner)
        llvm::for_each(in->getOperands(), add);
    });
}

void LoopPair::findPlaces() {
  types.assign(flags, builder.getI1Type());
  innerCount = inner.getNumResults() - 1;
  for (Value result : inner.getResults().drop_front())
    types.push_back(result.getType());
  for (Value value : kept)
    ofKept.push_back(addPlace(value.getType()));
  for (Value argument : body->getArguments().drop_front())
    if (auto *at = llvm::find(kept, argument); at != kept.end())
      ofCarried.push_back(ofKept[size_t(std::distance(kept.begin(), at))]);
    else
      ofCarried.push_back(addPlace(argument.getType()));
}

Value LoopPair::read(const Place &place, ValueRange state) {
  return place.array ? memref::LoadOp::create(builder, loc, place.array, zero)
                     : state[place.at];
}

void LoopPair::write(const Place &place, Value value,
                     MutableArrayRef<Value> state) {
  if (place.array)
    memref::StoreOp::create(builder, loc, value, place.array, zero);
  else
    state[place.at] = value;
}

void LoopPair::complete(MutableArrayRef<Value> state) {
  for (auto [value, type] : llvm::zip_equal(state, types))
    if (!value)
      value = createPoison(builder, loc, type);
}

Values LoopPair::getInits() {
  CodeBuilder code(builder, loc);
  Values inits{outer.getInits().front(), code.boolean(false),
               code.boolean(true)};
  inits.resize(types.size());
  for (auto [place, init] :
       llvm::zip_equal(ofCarried, outer.getInits().drop_front()))
    write(place, init, inits);
  complete(inits);
  return inits;
}

scf::IfOp LoopPair::createIf(TypeRange types, Value condition,
                             std::optional<double> probability) {
  auto made =
      scf::IfOp::create(builder, loc, types, condition, /*withElse=*/true);
  for (Region *region : {&made.getThenRegion(), &made.getElseRegion()})
    if (!region->front().empty())
      region->front().getTerminator()->erase();
  setProbability(made, probability);
  return made;
}

void LoopPair::yield(Block *block, ValueRange values) {
  builder.setInsertionPointToEnd(block);
  scf::YieldOp::create(builder, loc, values);
}

void LoopPair::replaceKept(ValueRange state, bool inInner) {
  OpBuilder::InsertionGuard guard(builder);
  for (auto [value, place] : llvm::zip_equal(kept.getArrayRef(), ofKept))
    for (OpOperand &use : llvm::make_early_inc_range(value.getUses())) {
      Operation *user = use.getOwner(),
                *at = body->findAncestorOpInBlock(*user);
      bool isInside = inner->isProperAncestor(user);
      if (!at || isInside != inInner ||
          (!isInside && !inner->isBeforeInBlock(at)))
        continue;
      // Loops that stay read it once.
      Operation *before = user;
      for (Operation *around = user->getParentOp();
           around != inner && around != outer; around = around->getParentOp())
        if (isLoop(around))
          before = around;
      builder.setInsertionPoint(before);
      use.set(read(place, state));
    }
}

Values LoopPair::writeIteration(Value condition, ValueRange state,
                                std::optional<double> probability) {
  OpBuilder::InsertionGuard guard(builder);
  replaceKept(state, /*inInner=*/true);
  SmallVector<Type> changed{builder.getI1Type()};
  llvm::append_range(changed, ArrayRef(types).slice(flags, innerCount));
  scf::IfOp made = createIf(changed, condition, probability);
  builder.setInsertionPointToEnd(made.thenBlock());
  Block &iteration = *inner.getAfterBody();
  Value goesOn = CodeBuilder(builder, loc).boolean(true);
  iteration.getArgument(0).replaceAllUsesWith(goesOn);
  for (auto [from, to] : llvm::zip_equal(iteration.getArguments().drop_front(),
                                         state.slice(flags, innerCount)))
    from.replaceAllUsesWith(to);
  Values next = llvm::to_vector(iteration.getTerminator()->getOperands());
  moveBody(iteration, builder);
  yield(made.thenBlock(), next);
  Values same{state[1]};
  llvm::append_range(same, state.slice(flags, innerCount));
  yield(made.elseBlock(), same);
  Values after = llvm::to_vector(state);
  after[1] = made.getResult(0);
  for (size_t i = 0; i < innerCount; ++i)
    after[flags + i] = made.getResult(1 + i);
  return after;
}

/// What the outer loop carries next: where it begins, what it began with.
Values LoopPair::writeEnd(ValueRange state) {
  OpBuilder::InsertionGuard guard(builder);
  replaceKept(state, /*inInner=*/false);
  Operation *end = body->getTerminator();
  scf::IfOp made = createIf(end->getOperandTypes(), state[2]);
  builder.setInsertionPointToEnd(made.thenBlock());
  Values begin{state.front()};
  for (const Place &place : ofCarried)
    begin.push_back(read(place, state));
  yield(made.thenBlock(), begin);
  builder.setInsertionPointToEnd(made.elseBlock());
  Value isDone = CodeBuilder(builder, loc).boolean(false);
  inner.getResult(0).replaceAllUsesWith(isDone);
  for (auto [from, to] : llvm::zip_equal(inner.getResults().drop_front(),
                                         state.slice(flags, innerCount)))
    from.replaceAllUsesWith(to);
  Block *after = made.elseBlock();
  after->getOperations().splice(after->end(), body->getOperations(),
                                std::next(inner->getIterator()),
                                end->getIterator());
  yield(after, end->getOperands());
  return llvm::to_vector<8>(ValueRange(made.getResults()));
}

/// Up to the inner loop, where the outer one goes on.
Values LoopPair::writeStart(ValueRange next) {
  OpBuilder::InsertionGuard guard(builder);
  scf::IfOp made = createIf(types, next.front());
  Block *start = made.thenBlock();
  for (auto [from, to] :
       llvm::zip_equal(body->getArguments().drop_front(), next.drop_front()))
    from.replaceAllUsesWith(to);
  start->getOperations().splice(start->end(), body->getOperations(),
                                body->begin(), inner->getIterator());
  builder.setInsertionPointToEnd(start);
  CodeBuilder code(builder, loc);
  Values state{next.front(), inner.getInits().front(), code.boolean(false)};
  llvm::append_range(state, inner.getInits().drop_front());
  state.resize(types.size());
  for (auto [value, place] : llvm::zip_equal(kept.getArrayRef(), ofKept)) {
    auto argument = dyn_cast<BlockArgument>(value);
    write(place, argument ? next[argument.getArgNumber()] : value, state);
  }
  complete(state);
  yield(start, state);

  builder.setInsertionPointToEnd(made.elseBlock());
  Values left{next.front(), code.boolean(false), code.boolean(false)};
  left.resize(types.size());
  for (auto [place, value] : llvm::zip_equal(ofCarried, next.drop_front()))
    write(place, value, left);
  complete(left);
  yield(made.elseBlock(), left);
  return llvm::to_vector<8>(ValueRange(made.getResults()));
}

Values LoopPair::writeStep(ValueRange state) {
  Values next = writeEnd(state);
  return writeStart(next);
}

/// A turn is a step of either loop.
Values LoopPair::writeElected(ValueRange state) {
  auto elect = ElectOp::create(builder, loc, state[1], eighths);
  scf::IfOp choice = createIf(types, elect.getSide(), probability);
  builder.setInsertionPointToEnd(choice.thenBlock());
  yield(choice.thenBlock(),
        writeIteration(elect.getTakes(), state, /*probability=*/1));
  builder.setInsertionPointToEnd(choice.elseBlock());
  scf::IfOp mine = createIf(types, elect.getTakes(), /*probability=*/1);
  builder.setInsertionPointToEnd(mine.thenBlock());
  yield(mine.thenBlock(), writeStep(state));
  yield(mine.elseBlock(), state);
  yield(choice.elseBlock(), mine.getResults());
  return llvm::to_vector<8>(ValueRange(choice.getResults()));
}

/// A turn is a step of the outer loop, where the inner one is done, and an
/// iteration of that.
Values LoopPair::writeAtOnce(ValueRange state) {
  Block *turn = builder.getBlock();
  scf::IfOp choice = createIf(types, state[1], probability);
  // The step takes what stands around the inner loop away from it.
  replaceKept(choice.getResults(), /*inInner=*/true);
  yield(choice.thenBlock(), state);
  builder.setInsertionPointToEnd(choice.elseBlock());
  yield(choice.elseBlock(), writeStep(state));
  builder.setInsertionPointToEnd(turn);
  CodeBuilder code(builder, loc);
  Value goesOn = code.select(choice.getResult(0), choice.getResult(1),
                             code.boolean(false));
  return writeIteration(goesOn, choice.getResults());
}

scf::WhileOp LoopPair::write() {
  zero = CodeBuilder(builder, loc).index(0);
  body->getArgument(0).replaceAllUsesWith(
      CodeBuilder(builder, loc).boolean(true));
  findKept();
  findPlaces();
  scf::WhileOp made = createFlagged(builder, loc, getInits());
  ValueRange state = made.getAfterArguments();
  builder.setInsertionPointToEnd(made.getAfterBody());
  Values after =
      mode == StepMode::Elected ? writeElected(state) : writeAtOnce(state);
  yield(made.getAfterBody(), after);
  builder.setInsertionPointAfter(made);
  for (auto [i, place] : llvm::enumerate(ofCarried))
    if (Value result = outer.getResult(1 + i); !result.use_empty())
      result.replaceAllUsesWith(read(place, made.getResults()));
  outer.getResult(0).replaceAllUsesWith(made.getResult(0));
  outer.erase();
  return made;
}

/// What of a nest is written in a loop by itself.
static int64_t countOwn(ArrayRef<NestedLoop> nest, size_t i) {
  return countOperations(nest[i].loop) -
         (i + 1 < nest.size() ? countOperations(nest[i + 1].loop) : 0);
}

scf::WhileOp piko::mergeLoops(ArrayRef<NestedLoop> loops, Block *arrays) {
  // Lanes that are done with an iteration of the innermost loops wait until
  // half of them are; what is longer, and rarer, for fewer.
  constexpr int64_t half = 4, fewer = 3;
  // A step of so many operations takes longer than memory does.
  constexpr int64_t mostInRegisters = 200;
  SmallVector<NestedLoop> nest(loops);
  for (size_t i = 0; i + 2 < nest.size();) {
    if (countOwn(nest, i) > countOwn(nest, i + 1)) {
      ++i;
      continue;
    }
    // What is short is done with the step inside.
    scf::WhileOp inner = rotate(nest[i + 1].loop), outer = rotate(nest[i].loop);
    split(inner, outer.getAfterBody());
    double again = 1 - 1 / (1 + nest[i + 1].iterations);
    nest[i + 1].loop = LoopPair(outer, inner, StepMode::AtOnce, again).write();
    nest[i + 1].iterations *= nest[i].iterations;
    nest.erase(nest.begin() + ptrdiff_t(i));
  }
  // Of the lanes in a turn, by counts of rays, walks and marches.
  constexpr double ofInner = 0.75, ofSteps = 0.45;
  SmallVector<double> turns;
  double around = 1;
  for (const NestedLoop &level : nest) {
    around *= level.iterations;
    turns.push_back(around / ofSteps);
  }
  turns.back() = around / ofInner;
  SmallVector<int64_t> own;
  for (size_t i = 0; i < nest.size(); ++i)
    own.push_back(countOwn(nest, i));
  scf::WhileOp merged = rotate(nest.back().loop);
  double inside = turns.back();
  for (size_t i = nest.size() - 1; i-- > 0;) {
    scf::WhileOp outer = rotate(nest[i].loop);
    split(merged, outer.getAfterBody());
    LoopPair pair(outer, merged, StepMode::Elected,
                  inside / (inside + turns[i]));
    bool isInnermost = i + 2 == nest.size();
    pair.setEighths(isInnermost && nest.size() > 2 ? half : fewer);
    if (!isInnermost || own[i] > mostInRegisters)
      pair.setArrays(arrays);
    merged = pair.write();
    inside += turns[i];
  }
  merged->setAttr(marks::iterations, Builder(merged).getF64FloatAttr(inside));
  return merged;
}
