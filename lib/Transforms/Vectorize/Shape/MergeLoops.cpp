// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From the innermost loop outwards, in three steps for each nest of two.
//
//   1. Each loop becomes one that tests a flag which it carries (RotateLoops).
//   2. Conditions around the inner loop are split at it (SplitConditions).
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
// (iteration delaying). Where there are three loops or more, A and C that are
// shorter than what the loop inside has beside its own inner loop are done at
// once, when a lane comes to them (loop flattening).

#include "Vectorize/Shape/MergeLoops.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Vectorize/Analysis/LaneForms.h"
#include "Vectorize/Shape/RotateLoops.h"
#include "Vectorize/Shape/SplitConditions.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

using Values = SmallVector<Value>;

static bool isLoop(Operation *op) { return isa<scf::ForOp, scf::WhileOp>(op); }

//===----------------------------------------------------------------------===//
// What is merged
//===----------------------------------------------------------------------===//

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
  if (!arrays || type.isInteger(1) || !type.isIntOrIndexOrFloat()) {
    types.push_back(type);
    return {types.size() - 1};
  }
  OpBuilder before(arrays, arrays->begin());
  return {0, memref::AllocaOp::create(before, loc, MemRefType::get({1}, type))};
}

void LoopPair::findKept() {
  auto add = [&](Value value) {
    Operation *from = value.getDefiningOp();
    if (value.getParentBlock() != body ||
        (from && !from->isBeforeInBlock(inner)))
      return;
    if (from && from->hasTrait<OpTrait::ConstantLike>())
      from->moveBefore(outer);
    else
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
  if (arrays) {
    OpBuilder before(arrays, arrays->begin());
    zero = CodeBuilder(before, loc).index(0);
  }
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

/// Flattens each loop into the one inside that has more to do by itself, unless
/// that is the innermost one.
static SmallVector<NestedLoop> flattenShort(ArrayRef<NestedLoop> loops) {
  SmallVector<NestedLoop> nest(loops);
  for (size_t i = 0; i + 2 < nest.size();) {
    if (countOwn(nest, i) > countOwn(nest, i + 1)) {
      ++i;
      continue;
    }
    NestedLoop &next = nest[i + 1];
    scf::WhileOp inner = rotate(next.loop), outer = rotate(nest[i].loop);
    split(inner, outer.getAfterBody());
    double again = 1 - 1 / (1 + next.iterations);
    next.loop = LoopPair(outer, inner, StepMode::AtOnce, again).write();
    next.iterations *= nest[i].iterations;
    nest.erase(nest.begin() + ptrdiff_t(i));
  }
  return nest;
}

/// In how many turns lanes are in each loop of a nest, but in the one inside.
static SmallVector<double> estimateTurns(ArrayRef<NestedLoop> nest) {
  // Of the lanes in a turn: three eighths, or a few more, in a step that waits
  // for these, and from five eighths to all in the others.
  constexpr double ofInner = 0.75, ofSteps = 0.45;
  SmallVector<double> turns;
  double around = 1;
  for (const NestedLoop &level : nest) {
    around *= level.iterations;
    turns.push_back(around / ofSteps);
  }
  turns.back() = around / ofInner;
  return turns;
}

scf::WhileOp piko::mergeLoops(ArrayRef<NestedLoop> loops, Block *arrays) {
  // Lanes that are done with an iteration of the innermost loops wait until
  // half of them are; what is longer, and rarer, for fewer.
  constexpr int64_t half = 4, fewer = 3;
  // A step of so many operations takes longer than memory does.
  constexpr int64_t mostInRegisters = 200;
  SmallVector<NestedLoop> nest = flattenShort(loops);
  SmallVector<double> turns = estimateTurns(nest);
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
