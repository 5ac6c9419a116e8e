// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where a test is more than a few operations, it is work, and is done in the
// body.

#include "Vectorize/Shape/RotateLoops.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

using namespace mlir;
using namespace piko;

using Values = SmallVector<Value>;

Value piko::createPoison(OpBuilder &builder, Location loc, Type type) {
  return ub::PoisonOp::create(builder, loc, type);
}

Values piko::createPoison(OpBuilder &builder, Location loc, TypeRange types) {
  return llvm::map_to_vector(
      types, [&](Type type) { return createPoison(builder, loc, type); });
}

void piko::moveBody(Block &from, OpBuilder &builder) {
  builder.getBlock()->getOperations().splice(builder.getInsertionPoint(),
                                             from.getOperations(), from.begin(),
                                             std::prev(from.end()));
}

Type piko::getCounterType(scf::ForOp loop) {
  auto isWord = [](Value bound) {
    std::optional<int64_t> known = getConstantIntValue(bound);
    auto cast = bound.getDefiningOp<arith::IndexCastOp>();
    return known ? llvm::isInt<32>(*known)
                 : cast && cast.getIn().getType().isInteger(32);
  };
  Type type = loop.getInductionVar().getType();
  return type.isIndex() && isWord(loop.getLowerBound()) &&
                 isWord(loop.getUpperBound())
             ? IntegerType::get(loop.getContext(), 32)
             : type;
}

scf::WhileOp piko::createFlagged(OpBuilder &builder, Location loc,
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

/// A bound in the type that a rotated loop counts in, whose number after the
/// last must not wrap around.
static Value getBound(OpBuilder &builder, scf::ForOp loop, Value bound) {
  Type type = isOneInteger(loop.getStep()) ? getCounterType(loop)
                                           : loop.getInductionVar().getType();
  if (type == bound.getType())
    return bound;
  if (std::optional<int64_t> known = getConstantIntValue(bound))
    return arith::ConstantOp::create(builder, loop.getLoc(),
                                     builder.getIntegerAttr(type, *known));
  return bound.getDefiningOp<arith::IndexCastOp>().getIn();
}

static scf::WhileOp rotateCount(scf::ForOp loop) {
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

scf::WhileOp piko::rotate(Operation *loop) {
  if (auto counted = dyn_cast<scf::ForOp>(loop))
    return rotateCount(counted);
  auto other = cast<scf::WhileOp>(loop);
  if (isFlagged(other))
    return other;
  return isCheapTest(other) ? rotateTest(other) : TestRotation(other).write();
}
