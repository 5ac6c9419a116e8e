// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-unroll-and-jam: of a loop around another one,
//   1. test that iterations of the outer loop that change the same element do
//      so in the same iteration of the inner one, which keeps their order when
//      several of them share the inner loop;
//   2. before it, repeat it for as many iterations as a multiple of the factor,
//      with that many of them in each run of the inner loop;
//   3. hand on, in such an iteration, what one copy stored to the next that
//      loads it.

#include "CPU/IndexRanges.h"

#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/MapVector.h"

namespace piko {
#define GEN_PASS_DEF_UNROLLANDJAM
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

/// Iterations of the outer loop that share one of the inner loop, and how much
/// may stand in the inner loop: what they need at once must fit into registers.
static constexpr int64_t factor = 4, mostOperations = 24;
/// Iterations of an inner loop that LLVM unrolls, so that its elements may stay
/// in registers through the outer loop: channels of a color.
static constexpr int64_t fewIterations = 5;

namespace {

struct UnrollAndJamPass : piko::impl::UnrollAndJamBase<UnrollAndJamPass> {
  void runOnOperation() override;
};

/// A loop that does nothing but to count, and what its body has.
struct Counting {
  LoopLikeOpInterface loop;
  LoopCount count;
  Block *body;
  Operation *next; ///< What makes the next count, in an scf.while.
};

/// An access to state, or to an array of the phase, inside of the inner loop.
struct Access {
  Operation *op;
  const void *memory; ///< Accesses to different ones do not meet.
  OperandRange indices;
  Value stored; ///< null for a load
};

/// One loop that has another one as the last thing that it does.
class Nest {
public:
  static std::optional<Nest> find(LoopLikeOpInterface outer);
  /// What keeps the iterations in order; null if nothing does.
  Operation *findConflict();
  /// Whether iterations of the outer loop use the same element.
  bool hasReuse();
  void jam();

private:
  Nest(Counting outer, Counting inner) : outer(outer), inner(inner) {}
  bool collect();
  /// Whether it is the same in all iterations of both loops.
  bool isFixed(Value value);
  bool countsBelow(Value count, Value other);
  bool isOneToOne(Value index);
  void findVarying();
  bool varies(Operation *op) const;
  Value createEnd(OpBuilder &builder);
  void cloneInner(OpBuilder &builder, ArrayRef<IRMapping> mappings);
  void setFirst(Value first);

  Counting outer, inner;
  SmallVector<Operation *> front; ///< of the outer loop, before the inner
  SmallVector<Access> accesses;
  llvm::DenseSet<const void *> written;
  llvm::DenseSet<Value>
      varying; ///< from iteration to iteration of the outer loop
};

/// What the copies of an inner loop's iteration have stored and not yet loaded
/// from elsewhere.
class Forwarding {
public:
  /// The number that a load would find, if a store has just written it.
  Value find(const Access &load, const IRMapping &mapping);
  void store(const Access &store, Operation *clone, const IRMapping &mapping);

private:
  using Place = SmallVector<const void *>;
  static Place getPlace(const Access &access, const IRMapping &mapping);
  struct Last {
    Place place;
    Value value;
    Operation *store;
  };
  llvm::MapVector<const void *, Last> last; // by memory
};

} // namespace

//===----------------------------------------------------------------------===//
// Recognition
//===----------------------------------------------------------------------===//

/// A loop that hands on nothing but its count.
static std::optional<Counting> findCounting(Operation *op) {
  std::optional<CountedLoop> counted = findCountedLoop(op);
  if (!counted || !counted->onlyCompares() ||
      op->getNumResults() != (isa<scf::WhileOp>(op) ? 1 : 0))
    return {};
  std::optional<LoopCount> count = findLoopCount(counted->loop);
  if (!count)
    return {};
  return Counting{counted->loop, *count, counted->body, counted->getNext()};
}

static bool computesNumber(Operation &op) {
  return op.getNumRegions() == 0 && isMemoryEffectFree(&op);
}

static std::optional<Access> findAccess(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op); load && load.getChecked())
    return Access{op,
                  load.getStateAttr().getAttr().getAsOpaquePointer(),
                  load.getIndices(),
                  {}};
  if (auto store = dyn_cast<StoreOp>(op); store && store.getChecked())
    return Access{op, store.getStateAttr().getAttr().getAsOpaquePointer(),
                  store.getIndices(), store.getValue()};
  auto isOwn = [](Value array) {
    return array.getDefiningOp<memref::AllocaOp>() != nullptr;
  };
  if (auto load = dyn_cast<memref::LoadOp>(op); load && isOwn(load.getMemRef()))
    return Access{
        op, load.getMemRef().getAsOpaquePointer(), load.getIndices(), {}};
  if (auto store = dyn_cast<memref::StoreOp>(op);
      store && isOwn(store.getMemRef()))
    return Access{op, store.getMemRef().getAsOpaquePointer(),
                  store.getIndices(), store.getValue()};
  return {};
}

static bool isShort(const LoopCount &count) {
  APInt first, end;
  return matchPattern(count.first, m_ConstantInt(&first)) &&
         matchPattern(count.end, m_ConstantInt(&end)) &&
         end.sle(first.getSExtValue() + fewIterations);
}

std::optional<Nest> Nest::find(LoopLikeOpInterface loop) {
  std::optional<Counting> outer = findCounting(loop);
  if (!outer)
    return {};
  std::optional<Counting> inner;
  SmallVector<Operation *> front;
  for (Operation &op : outer->body->without_terminator()) {
    if (&op == outer->next)
      continue;
    if (inner)
      return {};
    if (op.getNumRegions() != 0) {
      inner = findCounting(&op);
      if (!inner || !op.use_empty())
        return {};
      continue;
    }
    if (!computesNumber(op) && !(findAccess(&op) && op.getNumResults() != 0))
      return {};
    front.push_back(&op);
  }
  if (!inner)
    return {};
  Nest nest(*outer, *inner);
  nest.front = std::move(front);
  if (!nest.collect())
    return {};
  nest.findVarying();
  if (!nest.isFixed(inner->count.first) || !nest.isFixed(inner->count.end) ||
      isShort(inner->count))
    return {};
  return nest;
}

bool Nest::collect() {
  int64_t operations = 0;
  for (Operation &op : inner.body->without_terminator()) {
    if (&op == inner.next)
      continue;
    ++operations;
    if (std::optional<Access> access = findAccess(&op)) {
      accesses.push_back(*access);
      if (access->stored)
        written.insert(access->memory);
    } else if (!computesNumber(op)) {
      return false;
    }
  }
  return operations <= mostOperations && !written.empty();
}

bool Nest::varies(Operation *op) const {
  if (llvm::any_of(op->getOperands(),
                   [&](Value value) { return varying.contains(value); }))
    return true;
  std::optional<Access> access = findAccess(op);
  return access && written.contains(access->memory);
}

void Nest::findVarying() {
  varying.insert(outer.count.value);
  auto visit = [&](Operation *op) {
    if (varies(op))
      varying.insert(op->result_begin(), op->result_end());
  };
  for (Operation *op : front)
    visit(op);
  for (Operation &op : inner.body->without_terminator())
    visit(&op);
}

//===----------------------------------------------------------------------===//
// Dependences
//===----------------------------------------------------------------------===//

bool Nest::isFixed(Value value) {
  Operation *around = value.getParentBlock()->getParentOp();
  return !outer.loop->isAncestor(around) ||
         (around == outer.loop && value != outer.count.value &&
          !varying.contains(value));
}

/// The bits at the lower end that are known to be zero.
static unsigned getZeroBits(Value value) {
  APInt by;
  Operation *op = value.getDefiningOp();
  if (!isa_and_nonnull<arith::ShLIOp, arith::MulIOp>(op) ||
      !matchPattern(op->getOperand(1), m_ConstantInt(&by)))
    return 0;
  return isa<arith::ShLIOp>(op) ? unsigned(by.getLimitedValue(by.getBitWidth()))
                                : by.countTrailingZeros();
}

/// Whether the inner loop's count has no bits but those that another number
/// does not have.
bool Nest::countsBelow(Value count, Value other) {
  APInt first, end;
  unsigned bits = getZeroBits(other);
  return count == inner.count.value && isFixed(other) && bits < 31 &&
         matchPattern(inner.count.first, m_ConstantInt(&first)) &&
         matchPattern(inner.count.end, m_ConstantInt(&end)) &&
         first.isNonNegative() && end.sle(int64_t(1) << bits);
}

/// Whether an index differs from one iteration of the inner loop to any other,
/// and is the same in all iterations of the outer one: a sum of the count and
/// of what neither loop changes, which is one to one even where it wraps
/// around.
bool Nest::isOneToOne(Value index) {
  if (index == inner.count.value)
    return true;
  Operation *op = index.getDefiningOp();
  if (!op)
    return false;
  if (isa<arith::ExtSIOp, arith::ExtUIOp>(op) ||
      (isa<arith::IndexCastOp>(op) && !index.getType().isInteger(32)))
    return isOneToOne(op->getOperand(0));
  if (isa<arith::OrIOp>(op))
    return countsBelow(op->getOperand(0), op->getOperand(1)) ||
           countsBelow(op->getOperand(1), op->getOperand(0));
  if (!isa<arith::AddIOp, arith::SubIOp>(op))
    return false;
  Value a = op->getOperand(0), b = op->getOperand(1);
  return (isFixed(a) && isOneToOne(b)) || (isFixed(b) && isOneToOne(a));
}

Operation *Nest::findConflict() {
  for (Operation *op : front)
    if (std::optional<Access> access = findAccess(op);
        access && written.contains(access->memory))
      return op;
  llvm::DenseMap<const void *, SmallVector<Value>> places;
  for (const Access &access : accesses) {
    if (!written.contains(access.memory))
      continue;
    auto [found, isNew] = places.try_emplace(access.memory);
    SmallVector<Value> &place = found->second;
    // Null: a dimension in which iterations may meet.
    if (isNew)
      for (Value index : access.indices)
        place.push_back(isOneToOne(index) ? index : Value());
    for (auto [own, first] : llvm::zip_equal(access.indices, place))
      if (own != first)
        first = Value();
    if (llvm::none_of(place, [](Value index) { return bool(index); }))
      return access.op;
  }
  return nullptr;
}

bool Nest::hasReuse() {
  return llvm::any_of(accesses, [&](const Access &access) {
    return written.contains(access.memory) &&
           llvm::none_of(access.indices,
                         [&](Value index) { return varying.contains(index); });
  });
}

//===----------------------------------------------------------------------===//
// Forwarding
//===----------------------------------------------------------------------===//

/// Indices, elements and the field.
Forwarding::Place Forwarding::getPlace(const Access &access,
                                       const IRMapping &mapping) {
  Place place;
  // What is stored is the first operand.
  for (Value operand : access.op->getOperands().drop_front(!!access.stored))
    place.push_back(mapping.lookupOrDefault(operand).getAsOpaquePointer());
  if (auto load = dyn_cast<LoadOp>(access.op))
    place.push_back(load.getFieldAttr().getAsOpaquePointer());
  if (auto store = dyn_cast<StoreOp>(access.op))
    place.push_back(store.getFieldAttr().getAsOpaquePointer());
  return place;
}

Value Forwarding::find(const Access &load, const IRMapping &mapping) {
  auto found = last.find(load.memory);
  if (found == last.end())
    return {};
  if (found->second.place == getPlace(load, mapping))
    return found->second.value;
  last.erase(found);
  return {};
}

void Forwarding::store(const Access &store, Operation *clone,
                       const IRMapping &mapping) {
  Place place = getPlace(store, mapping);
  Value value = mapping.lookupOrDefault(store.stored);
  if (auto found = last.find(store.memory);
      found != last.end() && found->second.place == place)
    found->second.store->erase();
  last[store.memory] = {place, value, clone};
}

//===----------------------------------------------------------------------===//
// Rewriting
//===----------------------------------------------------------------------===//

/// Where the iterations end that are a multiple of the factor.
Value Nest::createEnd(OpBuilder &builder) {
  Location loc = outer.loop.getLoc();
  Value first = outer.count.first, end = outer.count.end;
  Value any = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                    first, end);
  Value iterations = arith::SubIOp::create(builder, loc, end, first);
  Value by = arith::ConstantOp::create(
      builder, loc, builder.getIntegerAttr(first.getType(), factor));
  Value rest = arith::RemUIOp::create(builder, loc, iterations, by);
  Value last = arith::SubIOp::create(builder, loc, end, rest);
  return arith::SelectOp::create(builder, loc, any, last, first);
}

void Nest::cloneInner(OpBuilder &builder, ArrayRef<IRMapping> mappings) {
  SmallVector<IRMapping> copies(mappings);
  Forwarding forwarding;
  for (auto [i, mapping] : llvm::enumerate(copies))
    for (Operation &op : inner.body->without_terminator()) {
      if (&op == inner.next)
        continue;
      std::optional<Access> access = findAccess(&op);
      bool isStore = access && access->stored;
      if (i != 0 && !isStore && !varies(&op)) {
        mapping.map(op.getResults(),
                    llvm::map_to_vector(op.getResults(), [&](Value result) {
                      return copies[0].lookup(result);
                    }));
        continue;
      }
      if (access && !isStore)
        if (Value value = forwarding.find(*access, mapping)) {
          mapping.map(op.getResult(0), value);
          continue;
        }
      Operation *clone = builder.clone(op, mapping);
      if (isStore)
        forwarding.store(*access, clone, mapping);
    }
}

void Nest::setFirst(Value first) {
  if (auto range = dyn_cast<scf::ForOp>(outer.loop.getOperation()))
    range.setLowerBound(first);
  else
    cast<scf::WhileOp>(outer.loop.getOperation())
        .getInitsMutable()[0]
        .assign(first);
}

void Nest::jam() {
  OpBuilder builder(outer.loop);
  Location loc = outer.loop.getLoc(), innerLoc = inner.loop.getLoc();
  Type type = outer.count.first.getType();
  auto constant = [&](Type type, int64_t value) {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(type, value));
  };
  Value end = createEnd(builder);
  auto strips = scf::ForOp::create(builder, loc, outer.count.first, end,
                                   constant(type, factor));
  builder.setInsertionPointToStart(strips.getBody());
  SmallVector<IRMapping> mappings(factor);
  for (auto [i, mapping] : llvm::enumerate(mappings)) {
    Value count = strips.getInductionVar();
    if (i != 0)
      count = arith::AddIOp::create(builder, loc, count, constant(type, i),
                                    arith::IntegerOverflowFlags::nsw);
    mapping.map(outer.count.value, count);
    for (Operation *op : front)
      builder.clone(*op, mapping);
  }
  // What is computed before it in each iteration alike is any iteration's.
  auto iterations = scf::ForOp::create(
      builder, innerLoc, mappings[0].lookupOrDefault(inner.count.first),
      mappings[0].lookupOrDefault(inner.count.end),
      constant(inner.count.first.getType(), 1));
  for (IRMapping &mapping : mappings)
    mapping.map(inner.count.value, iterations.getInductionVar());
  builder.setInsertionPointToStart(iterations.getBody());
  cloneInner(builder, mappings);
  setFirst(end);
}

void UnrollAndJamPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    SmallVector<LoopLikeOpInterface> loops;
    kernel.walk([&](LoopLikeOpInterface loop) { loops.push_back(loop); });
    for (LoopLikeOpInterface loop : loops) {
      std::optional<Nest> nest = Nest::find(loop);
      if (!nest || !nest->hasReuse())
        continue;
      if (Operation *conflict = nest->findConflict()) {
        InFlightDiagnostic remark = loop->emitRemark(
            "iterations of this loop do not share those of the "
            "loop inside of it (unroll-and-jam)");
        remark.attachNote(conflict->getLoc())
            << "it may use an element here that another iteration of the inner "
               "loop "
               "changes";
        continue;
      }
      loop->emitRemark() << factor
                         << " iterations of this loop share those of the loop "
                            "inside of it (unroll-and-jam)";
      nest->jam();
    }
  }
}
