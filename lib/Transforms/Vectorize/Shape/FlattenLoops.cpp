// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   while (A) {            start: if (A) B, initialize C; else leave
//     B                    while (not left) {
//     while (C) D    =>      if (C) D
//     E                      if (not C) { E; start again }
//   }                      }
//
// Where C stands for all the work of the inner loop, as in `do ... while`, it
// is done once in an iteration, and D or E follows. The state of the loop that
// is made is that of the inner loop, and what B computes for it and for E; its
// results take the same places, once it is left.

#include "Vectorize/Shape/FlattenLoops.h"

#include "Vectorize/Shape/RotateLoops.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/ADT/SmallBitVector.h"

using namespace mlir;
using namespace piko;

static bool isLoop(Operation *op) { return isa<scf::ForOp, scf::WhileOp>(op); }

/// The blocks of a loop, in the order that they run.
static SmallVector<Block *> getBlocks(Operation *loop) {
  if (auto counted = dyn_cast<scf::ForOp>(loop))
    return {counted.getBody()};
  auto other = cast<scf::WhileOp>(loop);
  return {other.getBeforeBody(), other.getAfterBody()};
}

/// Whether a loop counts with a sign, by a step that is known.
static bool isSimple(Operation *loop) {
  auto counted = dyn_cast<scf::ForOp>(loop);
  return !counted ||
         (!counted.getUnsignedCmp() && getConstantIntValue(counted.getStep()));
}

/// What a bound is cast from, where a loop counts in fewer bits.
static Value getSource(scf::ForOp loop, Value bound) {
  auto cast = bound.getDefiningOp<arith::IndexCastOp>();
  return cast && getCounterType(loop) != bound.getType() ? cast.getIn() : bound;
}

/// Whether a test may be made twice.
static bool isCheapTest(Operation *loop) {
  constexpr size_t most = 3;
  auto other = dyn_cast<scf::WhileOp>(loop);
  if (!other)
    return true;
  Block &test = *other.getBeforeBody();
  return test.getOperations().size() <= most + 1 &&
         llvm::all_of(test.without_terminator(), [](Operation &op) {
           return op.getNumRegions() == 0 && isPure(&op);
         });
}

/// What is computed in the outer loop before the inner one, and used in it
/// or after it; its own counter goes without saying.
static llvm::SetVector<Value> findKept(FlatNest nest) {
  llvm::SetVector<Value> kept;
  Block *block = nest.inner->getBlock();
  auto counted = dyn_cast<scf::ForOp>(nest.outer);
  Value counter = counted ? counted.getInductionVar() : Value();
  auto add = [&](Value value) {
    Operation *from = value.getDefiningOp();
    if (value != counter && value.getParentBlock() == block &&
        (!from || from->isBeforeInBlock(nest.inner)))
      kept.insert(value);
  };
  if (auto inner = dyn_cast<scf::ForOp>(nest.inner))
    add(getSource(inner, inner.getUpperBound()));
  nest.inner->walk([&](Operation *op) {
    if (op != nest.inner)
      llvm::for_each(op->getOperands(), add);
  });
  for (Operation *op = nest.inner->getNextNode(); op; op = op->getNextNode())
    op->walk(
        [&](Operation *inside) { llvm::for_each(inside->getOperands(), add); });
  return kept;
}

FlatNest piko::findFlatNest(Operation *outer) {
  FlatNest nest;
  if (!isLoop(outer) || !isSimple(outer))
    return {};
  for (Block *block : getBlocks(outer))
    for (Operation &op : *block)
      if (isLoop(&op)) {
        if (nest || !isSimple(&op))
          return {};
        nest.outer = outer;
        nest.inner = &op;
      }
  if (!nest)
    return {};
  auto isNumber = [](Value value) {
    return value.getType().isIntOrIndexOrFloat();
  };
  bool isKnown = llvm::all_of(findKept(nest), isNumber);
  for (Operation *loop : {nest.outer, nest.inner})
    isKnown &= llvm::all_of(loop->getOperands(), isNumber) &&
               llvm::all_of(loop->getResults(), isNumber);
  return isKnown ? nest : FlatNest();
}

namespace {

class Flattener {
public:
  explicit Flattener(FlatNest nest)
      : nest(nest), builder(nest.outer), loc(nest.outer->getLoc()),
        kept(findKept(nest)) {}
  scf::WhileOp write();

private:
  using Values = SmallVector<Value>;
  /// Whether a loop goes on, and what its test hands to its body.
  struct Test {
    Value goesOn;
    Values handed;
  };

  void findPlaces();
  Value get(Value value) const { return mapping.lookupOrDefault(value); }
  Values get(ValueRange values) const {
    return llvm::map_to_vector(values, [&](Value value) { return get(value); });
  }
  /// Clones the operations from `first` up to `end`.
  void clone(Operation *first, Operation *end);
  Value getBound(scf::ForOp loop, Value bound);
  /// A counting loop carries its number first.
  Values getInits(Operation *loop);
  Test writeTest(Operation *loop, ValueRange carried);
  Test writeTest(scf::WhileOp loop);
  /// What the next iteration of a loop carries, at the end of its body.
  Values getNext(Operation *loop);
  Values writeBody(Operation *loop, ValueRange handed);
  void setArguments(Operation *loop, ValueRange handed);
  void setCounter(scf::ForOp loop, Value counter);
  Values writeChoice(Value condition, TypeRange types,
                     llvm::function_ref<Values()> yes,
                     llvm::function_ref<Values()> no);

  // States: whether the loop goes on, and the places.
  Values enter();
  Values stay(ValueRange carried);
  Values leave(ValueRange handed);
  Values writeStart(ValueRange carried);
  Values writeAdvance(ValueRange handed);
  Values writeIteration(ValueRange state);
  /// Chooses what state is next: a lane that does not go on may wait.
  Values writeWait(Value goesOn, llvm::function_ref<Values()> stay,
                   llvm::function_ref<Values()> advance);

  /// Whether the inner loop stands where the outer one tests.
  bool isInTest() const {
    auto outer = dyn_cast<scf::WhileOp>(nest.outer);
    return outer && nest.inner->getBlock() == outer.getBeforeBody();
  }

  FlatNest nest;
  OpBuilder builder;
  Location loc;
  IRMapping mapping;
  llvm::SetVector<Value> kept;
  llvm::DenseMap<Operation *, Value> counters; ///< of counting loops, now
  SmallVector<Type> types;                     ///< of the state
  SmallVector<std::optional<size_t>> at;       ///< Where results are in it.
};

} // namespace

/// Each time with arguments of its own for the blocks inside.
void Flattener::clone(Operation *first, Operation *end) {
  for (Operation *op = first; op != end; op = op->getNextNode()) {
    op->walk([&](Block *block) {
      for (Value argument : block->getArguments())
        mapping.erase(argument);
    });
    builder.clone(*op, mapping);
  }
}

Value Flattener::getBound(scf::ForOp loop, Value bound) {
  Type type = getCounterType(loop);
  std::optional<int64_t> known = getConstantIntValue(bound);
  if (known && bound.getType() != type)
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(type, *known));
  return get(getSource(loop, bound));
}

Flattener::Values Flattener::getInits(Operation *loop) {
  Values inits = get(cast<LoopLikeOpInterface>(loop).getInits());
  if (auto counted = dyn_cast<scf::ForOp>(loop))
    inits.insert(inits.begin(), getBound(counted, counted.getLowerBound()));
  return inits;
}

Flattener::Test Flattener::writeTest(scf::WhileOp loop) {
  scf::ConditionOp condition = loop.getConditionOp();
  return {get(condition.getCondition()), get(condition.getArgs())};
}

Flattener::Test Flattener::writeTest(Operation *loop, ValueRange carried) {
  if (auto counted = dyn_cast<scf::ForOp>(loop))
    return {CodeBuilder(builder, loc)
                .compare(CodeBuilder::P::slt, carried.front(),
                         getBound(counted, counted.getUpperBound())),
            llvm::to_vector(carried)};
  auto other = cast<scf::WhileOp>(loop);
  mapping.map(other.getBeforeArguments(), carried);
  clone(&other.getBeforeBody()->front(), other.getConditionOp());
  return writeTest(other);
}

void Flattener::setArguments(Operation *loop, ValueRange handed) {
  auto arguments = getBlocks(loop).back()->getArguments();
  mapping.map(arguments, handed);
  if (isa<scf::ForOp>(loop))
    setCounter(cast<scf::ForOp>(loop), handed.front());
}

void Flattener::setCounter(scf::ForOp loop, Value counter) {
  Value variable = loop.getInductionVar();
  counters[loop] = counter;
  mapping.map(variable, counter.getType() == variable.getType()
                            ? counter
                            : arith::IndexCastOp::create(
                                  builder, loc, variable.getType(), counter));
}

Flattener::Values Flattener::getNext(Operation *loop) {
  Values next = get(getBlocks(loop).back()->getTerminator()->getOperands());
  if (!isa<scf::ForOp>(loop))
    return next;
  Value counter = counters.lookup(loop);
  Value step = arith::ConstantOp::create(
      builder, loc,
      builder.getIntegerAttr(
          counter.getType(),
          *getConstantIntValue(cast<scf::ForOp>(loop).getStep())));
  next.insert(next.begin(), CodeBuilder(builder, loc).add(counter, step));
  return next;
}

Flattener::Values Flattener::writeBody(Operation *loop, ValueRange handed) {
  setArguments(loop, handed);
  Block &body = *getBlocks(loop).back();
  clone(&body.front(), body.getTerminator());
  return getNext(loop);
}

Flattener::Values Flattener::writeChoice(Value condition, TypeRange types,
                                         llvm::function_ref<Values()> yes,
                                         llvm::function_ref<Values()> no) {
  auto choice =
      scf::IfOp::create(builder, loc, types, condition, /*withElse=*/true);
  OpBuilder::InsertionGuard guard(builder);
  for (auto [block, write] : {std::pair(choice.thenBlock(), yes),
                              std::pair(choice.elseBlock(), no)}) {
    if (!block->empty())
      block->getTerminator()->erase();
    builder.setInsertionPointToEnd(block);
    scf::YieldOp::create(builder, loc, write());
  }
  return llvm::to_vector<6>(ValueRange(choice.getResults()));
}

/// The state is that of the inner loop, and what is kept; results that are used
/// share places with these where they can.
void Flattener::findPlaces() {
  types.push_back(builder.getI1Type());
  llvm::append_range(types, ValueRange(getInits(nest.inner)).getTypes());
  llvm::append_range(types, ValueRange(kept.getArrayRef()).getTypes());
  if (auto counted = dyn_cast<scf::ForOp>(nest.outer))
    types.push_back(getCounterType(counted));
  llvm::SmallBitVector taken(types.size());
  taken.set(0);
  for (Value result : nest.outer->getResults()) {
    at.emplace_back();
    if (result.use_empty())
      continue;
    size_t place = 0;
    while (place < types.size() &&
           (taken[place] || types[place] != result.getType()))
      ++place;
    if (place == types.size()) {
      types.push_back(result.getType());
      taken.resize(types.size());
    }
    taken.set(place);
    at.back() = place;
  }
}

Flattener::Values Flattener::stay(ValueRange carried) {
  Values state{CodeBuilder(builder, loc).boolean(true)};
  llvm::append_range(state, carried);
  llvm::append_range(state, get(ValueRange(kept.getArrayRef())));
  if (isa<scf::ForOp>(nest.outer))
    state.push_back(counters.lookup(nest.outer));
  for (Type type : ArrayRef(types).drop_front(state.size()))
    state.push_back(ub::PoisonOp::create(builder, loc, type));
  return state;
}

Flattener::Values Flattener::enter() { return stay(getInits(nest.inner)); }

Flattener::Values Flattener::leave(ValueRange handed) {
  if (isa<scf::ForOp>(nest.outer))
    handed = handed.drop_front();
  Values state(types.size());
  state.front() = CodeBuilder(builder, loc).boolean(false);
  for (auto [place, value] : llvm::zip_equal(at, handed))
    if (place)
      state[*place] = value;
  for (auto [value, type] : llvm::zip_equal(state, types))
    if (!value)
      value = ub::PoisonOp::create(builder, loc, type);
  return state;
}

/// An iteration of the outer loop, up to the inner one.
Flattener::Values Flattener::writeStart(ValueRange carried) {
  Operation *first = &nest.inner->getBlock()->front();
  if (isInTest()) {
    mapping.map(getBlocks(nest.outer).front()->getArguments(), carried);
    clone(first, nest.inner);
    return enter();
  }
  Test test = writeTest(nest.outer, carried);
  return writeChoice(
      test.goesOn, types,
      [&] {
        setArguments(nest.outer, test.handed);
        clone(first, nest.inner);
        return enter();
      },
      [&] { return leave(test.handed); });
}

/// From the end of the inner loop to the next one.
Flattener::Values Flattener::writeAdvance(ValueRange handed) {
  if (isa<scf::ForOp>(nest.inner))
    handed = handed.drop_front();
  mapping.map(nest.inner->getResults(), handed);
  clone(nest.inner->getNextNode(), nest.inner->getBlock()->getTerminator());
  if (!isInTest())
    return writeStart(getNext(nest.outer));
  Test test = writeTest(cast<scf::WhileOp>(nest.outer));
  return writeChoice(
      test.goesOn, types,
      [&] { return writeStart(writeBody(nest.outer, test.handed)); },
      [&] { return leave(test.handed); });
}

/// A lane that waits finds its test to fail again in the next iteration.
Flattener::Values Flattener::writeIteration(ValueRange state) {
  size_t count = getInits(nest.inner).size();
  ValueRange carried = state.drop_front().take_front(count);
  mapping.map(kept.getArrayRef(),
              state.drop_front(1 + count).take_front(kept.size()));
  if (auto counted = dyn_cast<scf::ForOp>(nest.outer))
    setCounter(counted, state[1 + count + kept.size()]);
  Test test = writeTest(nest.inner, carried);
  auto advance = [&] { return writeAdvance(test.handed); };
  auto iteration = [&] {
    return writeChoice(
        test.goesOn, carried.getTypes(),
        [&] { return writeBody(nest.inner, test.handed); },
        [&] { return llvm::to_vector(carried); });
  };
  if (isCheapTest(nest.inner)) {
    Values next = iteration();
    test = writeTest(nest.inner, next);
    return writeWait(test.goesOn, [&] { return stay(next); }, advance);
  }
  if (nest.advances)
    return writeWait(test.goesOn, [&] { return stay(iteration()); }, advance);
  return writeChoice(
      test.goesOn, types,
      [&] { return stay(writeBody(nest.inner, test.handed)); }, advance);
}

Flattener::Values Flattener::writeWait(Value goesOn,
                                       llvm::function_ref<Values()> stay,
                                       llvm::function_ref<Values()> advance) {
  Values state = writeChoice(goesOn, types, stay, advance);
  if (nest.advances)
    state.front().getDefiningOp()->setAttr(
        marks::advances, builder.getF64FloatAttr(*nest.advances));
  return state;
}

scf::WhileOp Flattener::write() {
  findPlaces();
  Values start = writeStart(getInits(nest.outer));
  auto made = scf::WhileOp::create(builder, loc, types, start);
  SmallVector<Location> places(types.size(), loc);
  Block *test = builder.createBlock(&made.getBefore(), {}, types, places);
  scf::ConditionOp::create(builder, loc, test->getArgument(0),
                           test->getArguments());
  Block *iteration = builder.createBlock(&made.getAfter(), {}, types, places);
  scf::YieldOp::create(builder, loc, writeIteration(iteration->getArguments()));
  for (auto [result, place] : llvm::zip_equal(nest.outer->getResults(), at))
    if (place)
      result.replaceAllUsesWith(made.getResult(*place));
  nest.outer->erase();
  return made;
}

scf::WhileOp piko::flatten(FlatNest nest) { return Flattener(nest).write(); }
