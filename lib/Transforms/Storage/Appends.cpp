// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A list's length is a variable of the loop, to which an iteration adds one, or
// not; its elements are arrays that the loop stores to at that index, where it
// adds one. A test of the length against a limit becomes a part of the push:
// which iterations reach it does not depend on others then.

#include "Piko/Transforms/Storage/Appends.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Transforms/Storage/CountedWhiles.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

namespace {

/// One list of a loop.
class Append {
public:
  Append(scf::ForOp loop, unsigned number)
      : loop(loop), number(number), count(loop.getRegionIterArg(number)) {}
  /// Whether the loop does so with this variable.
  bool find();
  /// What keeps it from being one, though it is an index.
  Operation *getRefusal() const { return isIndex ? refusal : nullptr; }
  /// Pushes, to a count in memory.
  void rewrite(Value memory);

private:
  bool refuse(Operation *at) {
    refusal = refusal ? refusal : at;
    return false;
  }
  bool follow(OpOperand &handedOn);
  bool setNext(Operation *sum, OpOperand &handedOn, Value when);
  bool addIndex(Operation *cast);
  bool addStore(memref::StoreOp store);
  bool setLimit(arith::CmpIOp compare);
  bool isInvariant(Value value) const;
  bool onlyAppends(scf::IfOp choice) const;
  bool isInVain(scf::IfOp choice) const;
  bool isConjunct(Value test) const;
  bool findPlace();

  mutable scf::ForOp loop; // whose accessors are not const
  unsigned number;
  BlockArgument count;
  Operation *refusal = nullptr;
  bool isIndex = false; ///< Of something that is stored.

  Operation *next = nullptr; ///< Adds one, in an iteration that appends,
  Block *home = nullptr;     ///< from which that is handed on.
  Value condition;           ///< Of appending, where the sum says it; or null.
  SmallVector<memref::StoreOp> stores;
  arith::CmpIOp limit; ///< Whether there is room for one more; or null.
  Value most;
  bool isInclusive = false, isUnsigned = false;
  llvm::DenseSet<OpOperand *> known; ///< How the count goes on.
  SmallVector<Value> chosen;         ///< It, or one more.
};

} // namespace

//===----------------------------------------------------------------------===//
// The count
//===----------------------------------------------------------------------===//

/// The only sum. `when` says where it adds one; if null, wherever it is handed
/// on.
bool Append::setNext(Operation *sum, OpOperand &handedOn, Value when) {
  if (next)
    return refuse(sum);
  next = sum;
  home = handedOn.getOwner()->getBlock();
  condition = when;
  return true;
}

/// The condition that a number is, as 0 or 1.
static Value getFlag(Value number) {
  Operation *cast = number.getDefiningOp();
  bool isFlag = isa_and_nonnull<arith::ExtUIOp, arith::IndexCastUIOp>(cast) &&
                cast->getOperand(0).getType().isInteger(1);
  return isFlag ? cast->getOperand(0) : Value();
}

/// Where a value that is handed on comes from: it is the count, or one more.
bool Append::follow(OpOperand &handedOn) {
  known.insert(&handedOn);
  Value value = handedOn.get();
  if (value == count)
    return true;
  Operation *op = value.getDefiningOp();
  if (!op || !loop->isProperAncestor(op))
    return false;
  if (auto sum = dyn_cast<arith::AddIOp>(op)) {
    OpOperand &left = sum.getLhsMutable(), &right = sum.getRhsMutable();
    bool isLeft = left.get() == count;
    if (!isLeft && right.get() != count)
      return false;
    known.insert(isLeft ? &left : &right);
    Value more = (isLeft ? right : left).get();
    Value flag = getFlag(more);
    return (flag || matchPattern(more, m_One())) &&
           setNext(sum, handedOn, flag);
  }
  if (auto choice = dyn_cast<scf::IfOp>(op)) {
    unsigned at = cast<OpResult>(value).getResultNumber();
    chosen.push_back(value);
    return follow(choice.thenYield()->getOpOperand(at)) &&
           follow(choice.elseYield()->getOpOperand(at));
  }
  // Only a sum that is one or the other: a store cannot stand there.
  auto choice = dyn_cast<arith::SelectOp>(op);
  if (!choice || choice.getFalseValue() != count)
    return false;
  auto sum = choice.getTrueValue().getDefiningOp<arith::AddIOp>();
  if (!sum || sum.getLhs() != count || !matchPattern(sum.getRhs(), m_One()))
    return false;
  known.insert_range(ArrayRef<OpOperand *>{&choice.getTrueValueMutable(),
                                           &choice.getFalseValueMutable(),
                                           &sum.getLhsMutable()});
  chosen.push_back(value);
  return setNext(sum, handedOn, choice.getCondition());
}

//===----------------------------------------------------------------------===//
// Its uses
//===----------------------------------------------------------------------===//

static bool isList(Value array) {
  auto made = array.getDefiningOp<memref::AllocaOp>();
  if (!made)
    return false;
  MemRefType type = made.getType();
  Type element = type.getElementType();
  bool isNumber = element.isIndex() || element.isF32() || element.isF64() ||
                  element.isInteger(8) || element.isInteger(16) ||
                  element.isInteger(32) || element.isInteger(64);
  return type.hasStaticShape() && type.getRank() == 1 &&
         type.getLayout().isIdentity() && isNumber;
}

static bool isWidening(Operation *op) {
  return isa_and_nonnull<arith::IndexCastOp, arith::IndexCastUIOp,
                         arith::ExtSIOp, arith::ExtUIOp>(op);
}

/// Nothing else in the loop knows the array.
bool Append::addStore(memref::StoreOp store) {
  Value array = store.getMemRef();
  isIndex = true;
  if (!isList(array) || !loop.isDefinedOutsideOfLoop(array))
    return refuse(store);
  for (Operation *user : array.getUsers())
    if (user != store && loop->isAncestor(user))
      return refuse(user);
  stores.push_back(store);
  return true;
}

bool Append::addIndex(Operation *cast) {
  return llvm::all_of(cast->getUses(), [&](OpOperand &use) {
    auto store = dyn_cast<memref::StoreOp>(use.getOwner());
    if (store && use.get() != store.getValue())
      return addStore(store);
    return isWidening(use.getOwner()) ? addIndex(use.getOwner())
                                      : refuse(use.getOwner());
  });
}

/// Whether a condition does nothing but to append, and to find out whether:
/// where the list is full, it may do so in vain.
bool Append::onlyAppends(scf::IfOp choice) const {
  auto isHandedOn = [&](OpResult result) {
    return result.use_empty() || llvm::is_contained(chosen, result);
  };
  bool appends = choice.getThenRegion().isAncestor(home->getParent()) ||
                 (condition && choice.getCondition() == condition);
  return appends && llvm::all_of(choice.getResults(), isHandedOn) &&
         isInVain(choice);
}

/// Whether an operation reads what is known to be there in all iterations: of
/// an array, by a constant or by the number of the iteration.
static bool isChecked(Operation *op, scf::ForOp loop) {
  if (auto load = dyn_cast<LoadOp>(op))
    return load.getChecked() || load.getIndices().empty();
  auto load = dyn_cast<memref::LoadOp>(op);
  if (!load || load.getMemRefType().getRank() != 1 ||
      !load.getMemRefType().hasStaticShape())
    return false;
  int64_t size = load.getMemRefType().getNumElements();
  Value index = load.getIndices()[0];
  if (std::optional<int64_t> constant = getConstantIntValue(index))
    return *constant >= 0 && *constant < size;
  while (isWidening(index.getDefiningOp()))
    index = index.getDefiningOp()->getOperand(0);
  std::optional<int64_t> first = getConstantIntValue(loop.getLowerBound()),
                         end = getConstantIntValue(loop.getUpperBound());
  return index == loop.getInductionVar() && first && *first >= 0 && end &&
         *end <= size;
}

bool Append::isInVain(scf::IfOp choice) const {
  return !choice
              ->walk([&](Operation *op) {
                bool isFree =
                    (op->getNumRegions() == 0 && isPure(op)) ||
                    isa<scf::IfOp, scf::YieldOp>(op) || isChecked(op, loop) ||
                    llvm::is_contained(stores, dyn_cast<memref::StoreOp>(op));
                return isFree ? WalkResult::advance() : WalkResult::interrupt();
              })
              .wasInterrupted();
}

/// Whether all that follows from a test is whether to append, by conjunctions.
bool Append::isConjunct(Value test) const {
  return llvm::all_of(test.getUses(), [&](OpOperand &use) {
    Operation *user = use.getOwner();
    if (isa<arith::AndIOp>(user))
      return isConjunct(user->getResult(0));
    if (auto choice = dyn_cast<arith::SelectOp>(user)) {
      bool isCondition = use.get() == choice.getCondition();
      return isCondition ? llvm::is_contained(chosen, choice.getResult())
                         : choice.getTrueValue() == use.get() &&
                               matchPattern(choice.getFalseValue(), m_Zero()) &&
                               isConjunct(choice.getResult());
    }
    if (auto choice = dyn_cast<scf::IfOp>(user))
      return onlyAppends(choice);
    if (auto choice = dyn_cast<scf::IfOp>(user->getParentOp());
        choice && isa<scf::YieldOp>(user)) {
      unsigned at = use.getOperandNumber();
      return user == choice.thenYield() && isInVain(choice) &&
             matchPattern(choice.elseYield().getOperand(at), m_Zero()) &&
             isConjunct(choice.getResult(at));
    }
    return test == condition && user->hasOneUse() &&
           *user->getUsers().begin() == next;
  });
}

/// Whether a value may be computed before the loop.
bool Append::isInvariant(Value value) const {
  if (loop.isDefinedOutsideOfLoop(value))
    return true;
  Operation *op = value.getDefiningOp();
  auto load = dyn_cast_if_present<LoadOp>(op);
  bool isConstant = load && load.getIndices().empty() &&
                    load.getElements().empty() &&
                    lookupInPipeline<ConstantOp>(load, load.getStateAttr());
  return isConstant || (op && op->getNumOperands() > 0 && isPure(op) &&
                        op->getNumRegions() == 0 &&
                        llvm::all_of(op->getOperands(), [&](Value operand) {
                          return isInvariant(operand);
                        }));
}

/// The same before the loop.
static Value hoist(OpBuilder &builder, scf::ForOp loop, Value value) {
  if (loop.isDefinedOutsideOfLoop(value))
    return value;
  IRMapping mapping;
  for (Value operand : value.getDefiningOp()->getOperands())
    mapping.map(operand, hoist(builder, loop, operand));
  return builder.clone(*value.getDefiningOp(), mapping)
      ->getResult(cast<OpResult>(value).getResultNumber());
}

/// A comparison that says that the count is less than a number.
bool Append::setLimit(arith::CmpIOp compare) {
  using P = arith::CmpIPredicate;
  bool isLeft = compare.getLhs() == count;
  Value other = isLeft ? compare.getRhs() : compare.getLhs();
  P predicate = compare.getPredicate();
  P below = isLeft ? P::slt : P::sgt, belowUnsigned = isLeft ? P::ult : P::ugt,
    upTo = isLeft ? P::sle : P::sge, upToUnsigned = isLeft ? P::ule : P::uge;
  // Constants alone surely have a next number.
  std::optional<int64_t> last = getConstantIntValue(other);
  bool isUpTo = (predicate == upTo || predicate == upToUnsigned) && last &&
                *last >= 0 && *last < std::numeric_limits<int32_t>::max();
  if (limit || !(predicate == below || predicate == belowUnsigned || isUpTo) ||
      !isInvariant(other))
    return refuse(compare);
  limit = compare;
  most = other;
  isInclusive = isUpTo;
  isUnsigned = predicate == belowUnsigned || predicate == upToUnsigned;
  return true;
}

/// Where the push stands: the stores' block, where the sum is, or where its
/// condition holds.
bool Append::findPlace() {
  if (stores.empty())
    return true;
  Block *block = stores.front()->getBlock();
  for (memref::StoreOp store : stores)
    if (store->getBlock() != block)
      return refuse(store);
  if (!condition)
    return block == home || refuse(stores.front());
  auto choice = dyn_cast<scf::IfOp>(block->getParentOp());
  bool isThere = choice && choice->getBlock() == home &&
                 block == choice.thenBlock() &&
                 choice.getCondition() == condition;
  return isThere || refuse(stores.front());
}

bool Append::find() {
  if (!isa<IntegerType, IndexType>(count.getType()) ||
      (!count.getType().isIndex() &&
       count.getType().getIntOrFloatBitWidth() < 32) ||
      !follow((*loop.getYieldedValuesMutable())[number]) || !next)
    return false;
  for (OpOperand &use : count.getUses()) {
    Operation *user = use.getOwner();
    if (known.contains(&use) || isOpTriviallyDead(user))
      continue;
    auto store = dyn_cast<memref::StoreOp>(user);
    auto compare = dyn_cast<arith::CmpIOp>(user);
    if (store && use.get() != store.getValue() ? !addStore(store)
        : isWidening(user)                     ? !addIndex(user)
                                               : !compare || !setLimit(compare))
      return refuse(user);
  }
  // The sum, and what is chosen of both, goes on alone.
  chosen.push_back(next->getResult(0));
  for (Value value : chosen)
    for (OpOperand &use : value.getUses())
      if (!known.contains(&use) && !isOpTriviallyDead(use.getOwner()))
        return refuse(use.getOwner());
  if (!findPlace())
    return false;
  return !limit || isConjunct(limit.getResult()) || refuse(limit);
}

//===----------------------------------------------------------------------===//
// Rewriting
//===----------------------------------------------------------------------===//

void Append::rewrite(Value memory) {
  OpBuilder builder(home->getTerminator());
  Location loc = next->getLoc();
  if (!stores.empty()) {
    loc = stores.front()->getLoc();
    builder.setInsertionPoint(stores.front()->getBlock()->getTerminator());
  } else if (condition) {
    auto choice =
        scf::IfOp::create(builder, loc, condition, /*withElse=*/false);
    builder.setInsertionPointToStart(choice.thenBlock());
  }
  SmallVector<Value> values, arrays;
  for (memref::StoreOp store : stores) {
    values.push_back(store.getValue());
    arrays.push_back(store.getMemRef());
  }
  if (limit) {
    OpBuilder at(limit), before(loop);
    limit.replaceAllUsesWith(CodeBuilder(at, loc).boolean(true));
    limit.erase();
    most = isInclusive
               ? arith::ConstantOp::create(
                     before, loc,
                     before.getIntegerAttr(most.getType(),
                                           *getConstantIntValue(most) + 1))
               : hoist(before, loop, most);
  }
  PushOp::create(builder, loc, values, arrays, memory, most, isUnsigned,
                 /*padded=*/false);
  for (memref::StoreOp store : stores) {
    Operation *index = store.getIndices()[0].getDefiningOp();
    store.erase();
    if (index && isOpTriviallyDead(index))
      index->erase();
  }
  for (Value value : chosen)
    value.replaceAllUsesWith(count);
}

static void eraseDead(scf::ForOp loop) {
  SmallVector<Operation *> ops;
  loop.walk<WalkOrder::PreOrder>([&](Operation *op) { ops.push_back(op); });
  for (Operation *op : llvm::reverse(ops))
    if (isOpTriviallyDead(op))
      op->erase();
}

/// The same without results that nobody needs.
static void dropUnused(scf::IfOp choice) {
  SmallVector<unsigned> kept;
  SmallVector<Type> types;
  for (OpResult result : choice.getResults())
    if (!result.use_empty()) {
      kept.push_back(result.getResultNumber());
      types.push_back(result.getType());
    }
  // An else that hands on nothing is none.
  Region &rest = choice.getElseRegion();
  bool isEmpty =
      kept.empty() && !rest.empty() && llvm::hasSingleElement(rest.front());
  if (kept.size() == choice.getNumResults() && !isEmpty)
    return;
  OpBuilder builder(choice);
  auto made = scf::IfOp::create(builder, choice.getLoc(), types,
                                choice.getCondition(), /*addThenBlock=*/false,
                                /*addElseBlock=*/false);
  made->setAttrs(choice->getAttrs());
  made.getThenRegion().takeBody(choice.getThenRegion());
  if (!isEmpty)
    made.getElseRegion().takeBody(choice.getElseRegion());
  for (Region &region : made->getRegions()) {
    if (region.empty())
      continue;
    Operation *yield = region.front().getTerminator();
    SmallVector<Value> values;
    for (unsigned i : kept)
      values.push_back(yield->getOperand(i));
    yield->setOperands(values);
  }
  for (auto [i, result] : llvm::zip(kept, made.getResults()))
    choice.getResult(i).replaceAllUsesWith(result);
  choice.erase();
}

/// A loop that hands on nothing, with the body of one that does not need what
/// it hands on.
static scf::ForOp dropCarried(scf::ForOp loop) {
  OpBuilder builder(loop);
  auto made = scf::ForOp::create(builder, loop.getLoc(), loop.getLowerBound(),
                                 loop.getUpperBound(), loop.getStep());
  made->setDiscardableAttrs(loop->getDiscardableAttrDictionary());
  made.setUnsignedCmp(loop.getUnsignedCmp());
  Operation *yield = loop.getBody()->getTerminator();
  yield->setOperands({});
  for (auto [argument, init] :
       llvm::zip(loop.getRegionIterArgs(), loop.getInitArgs()))
    argument.replaceAllUsesWith(init);
  loop.getInductionVar().replaceAllUsesWith(made.getInductionVar());
  made.getBody()->getTerminator()->erase();
  made.getBody()->getOperations().splice(made.getBody()->end(),
                                         loop.getBody()->getOperations());
  loop.erase();
  // Outer conditions first: their yields may be all that needs the inner ones'.
  SmallVector<scf::IfOp> choices;
  made.walk<WalkOrder::PreOrder>(
      [&](scf::IfOp choice) { choices.push_back(choice); });
  for (scf::IfOp choice : choices)
    dropUnused(choice);
  return made;
}

/// Has a loop push, if it hands on nothing but how long lists are; else it is
/// as it was.
static std::optional<PushLoop> formPushes(scf::ForOp loop,
                                          std::optional<Location> &refusal) {
  SmallVector<Append> appends;
  for (unsigned i = 0; i < loop.getNumRegionIterArgs(); ++i) {
    appends.emplace_back(loop, i);
    if (appends.back().find())
      continue;
    if (Operation *at = appends.back().getRefusal())
      refusal = at->getLoc();
    return std::nullopt;
  }
  PushLoop made;
  OpBuilder before(loop), after(loop->getContext());
  after.setInsertionPointAfter(loop);
  CodeBuilder first(before, loop.getLoc()), last(after, loop.getLoc());
  auto note = [&](Value value) {
    made.helpers.push_back(value.getDefiningOp());
    return value;
  };
  for (auto [append, init] : llvm::zip(appends, loop.getInitArgs())) {
    Value memory = note(memref::AllocaOp::create(
        before, loop.getLoc(), MemRefType::get({1}, init.getType())));
    Value zero = note(first.index(0));
    made.helpers.push_back(
        memref::StoreOp::create(before, loop.getLoc(), init, memory, zero));
    append.rewrite(memory);
    made.results.push_back(note(last.load(memory, zero)));
  }
  made.loop = dropCarried(loop);
  eraseDead(made.loop);
  return made;
}

std::optional<PushLoop> piko::copyAsPushes(Operation *op,
                                           std::optional<Location> &refusal) {
  auto isLength = [](Type type) { return isa<IntegerType, IndexType>(type); };
  if (!llvm::all_of(op->getResultTypes(), isLength))
    return std::nullopt;
  OpBuilder builder(op);
  PushLoop made;
  made.original = op;
  made.before = op->getPrevNode();
  if (auto loop = dyn_cast<scf::ForOp>(op)) {
    made.loop = cast<scf::ForOp>(builder.clone(*loop));
    made.results.assign(made.loop.result_begin(), made.loop.result_end());
  } else if (auto loop = dyn_cast<scf::WhileOp>(op);
             loop && findUpliftableWhile(loop)) {
    auto copy = cast<scf::WhileOp>(builder.clone(*loop));
    made.loop = upliftWhile(copy, *findUpliftableWhile(copy), &made.results);
  }
  if (!made.loop)
    return std::nullopt;
  if (made.loop.getNumResults() == 0)
    return made;
  SmallVector<Value> handedOn(made.loop.getResults());
  std::optional<PushLoop> pushes = formPushes(made.loop, refusal);
  if (!pushes) {
    made.erase();
    return std::nullopt;
  }
  made.loop = pushes->loop;
  made.helpers = pushes->helpers;
  for (auto [from, to] : llvm::zip(handedOn, pushes->results))
    llvm::replace(made.results, from, to);
  return made;
}

void PushLoop::erase() {
  loop.erase();
  for (Operation *helper : llvm::reverse(helpers))
    helper->erase();
  // What counts, and how often, stands there too.
  Operation *op = original->getPrevNode();
  while (op && op != before && isOpTriviallyDead(op)) {
    op->erase();
    op = original->getPrevNode();
  }
}
