// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-vectorize: what only computes goes ahead of what has effects, for a
// block of primitives at a time and in vectors.
//
// A lane that comes to an index outside of its buffer, or to the rare side of a
// condition, gives up: its primitive goes through the original body, with all
// that it says about errors.

#include "LanePlan.h"

#include "Piko/Transforms/BinArithmetic.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/IR/TypeUtilities.h"
#include "llvm/ADT/MapVector.h"

namespace piko {
#define GEN_PASS_DEF_VECTORIZE
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

/// How many primitives run ahead: enough for many vectors, so few that what is
/// kept stays in the nearest cache.
static constexpr int64_t blockSize = 64;
/// Numbers of 32 bits in the widest vectors there are; where they are narrower,
/// LLVM takes several.
static constexpr int64_t lanes = 16;

namespace {

struct VectorizePass : piko::impl::VectorizeBase<VectorizePass> {
  void runOnOperation() override;
};

/// Arrays that keep a value for each primitive of a block.
class LaneSlots {
public:
  /// Puts the arrays in front of a loop.
  explicit LaneSlots(scf::ForOp loop) : loc(loop.getLoc()), arrays(loop) {}

  bool contains(Value value) const { return slots.contains(value); }
  /// Adds an array for a value of the original loop.
  void add(Value value) { slots[value] = create(value.getType()); }
  /// An array that is of no value of the original loop.
  Value create(Type type);
  Value get(Value value) const { return slots.lookup(value); }
  const llvm::MapVector<Value, Value> &getAll() const { return slots; }

  void store(OpBuilder &builder, Value value, Value slot, Value place) const;
  Value load(OpBuilder &builder, Value slot, Value place, Type type) const;

private:
  Location loc;
  OpBuilder arrays;
  llvm::MapVector<Value, Value> slots;
};

/// Writes the loop that reads.
class FetchWriter {
public:
  FetchWriter(OpBuilder &builder, StageOp stage, const LanePlanner &planner,
              Value iteration)
      : builder(builder), loc(planner.getLoop().getLoc()), stage(stage),
        planner(planner) {
    mapping.map(planner.getLoop().getInductionVar(), iteration);
  }

  /// The value of this primitive.
  Value get(Value value);
  /// Repeats an operation without results.
  void repeat(Operation *op);
  /// All of `loads` read the same element: one test holds for all.
  void getElement(ArrayRef<LoadOp> loads);
  /// Whether all reads were inside of their buffers; null if none was tested.
  Value getInside() const { return inside; }

private:
  OpBuilder &builder;
  Location loc;
  StageOp stage;
  const LanePlanner &planner;
  IRMapping mapping;
  Value inside;
};

/// Writes the loop that computes in vectors.
class VectorWriter {
public:
  /// Takes what was read from `slots`, and adds arrays of what else is read.
  VectorWriter(OpBuilder &builder, StageOp stage, const LanePlanner &planner,
               LaneSlots &slots, Value begin, Value count, Value place,
               Value outside)
      : builder(builder), top(place.getParentBlock()),
        loc(planner.getLoop().getLoc()), stage(stage), planner(planner),
        slots(slots), begin(begin), count(count), place(place),
        outside(outside) {}

  /// Computes what a plan computes, whatever the conditions around it say.
  void write(const LanePlan &plan);
  /// The values of these primitives.
  Value get(Value value);
  /// The lanes that came to a rare side of a condition; null if none could.
  Value getRare() const { return rare; }

private:
  void writeOperations(Block &block);
  void writeOperation(Operation *op);
  void writeCondition(scf::IfOp choice);
  void writeLoop(scf::WhileOp loop);
  /// The loop where a lane needs it, and zeros where none does.
  void writeLoopIfNeeded(scf::WhileOp loop);
  void writeUniform(Operation *op);
  /// A read of the same element for all.
  void writeUniform(LoadOp load);
  void giveUp(Value lanes);
  /// The lanes that have a primitive, and have read it.
  Value getPresent();
  /// What `write` does is for these lanes alone.
  void writeFor(Value lanes, llvm::function_ref<void()> write);
  Value getUniform(Value value);
  /// A value as a variable or result of a loop carries it: one for all lanes or
  /// for each. Behind the last comes what `rare` is.
  SmallVector<Value> getFor(ValueRange variables, ValueRange values);
  SmallVector<Type> getTypesFor(ValueRange variables);
  void set(ValueRange variables, ValueRange carried);
  Value splat(Value scalar);
  Value zeros(Type type);
  Value invert(Value mask);
  /// Both masks, where the other one may be poison unless the first is true.
  Value both(Value mask, Value other);

  OpBuilder &builder;
  Block *top;
  Location loc;
  StageOp stage;
  const LanePlanner &planner;
  LaneSlots &slots;
  Value begin, count, place;
  Value outside; // an array: whether a primitive read outside of a buffer
  IRMapping vectors, scalars;
  Value present; // null if nothing asked yet
  Value active;  // null: all
  Value rare;
};

/// One loop over primitives becomes a loop over blocks of them with three loops
/// inside.
class LoopVectorizer {
public:
  LoopVectorizer(scf::ForOp loop, StageOp stage, LanePlan plan,
                 const LanePlanner &planner)
      : loop(loop), stage(stage), plan(std::move(plan)), planner(planner),
        loc(loop.getLoc()), builder(loop), blocks(createBlocks()),
        slots(blocks) {}
  void run();

private:
  scf::ForOp createBlocks();
  void createVectors(Value begin, Value end);
  void createFetches(Value begin, Value end);
  void createRest(Value begin, Value end);
  /// Replaces what has run ahead.
  void reduce(LanePlan &plan, Value place);

  scf::ForOp loop;
  StageOp stage;
  LanePlan plan;
  const LanePlanner &planner;
  Location loc;
  OpBuilder builder;
  scf::ForOp blocks;
  LaneSlots slots;
  Value outside; // an array: whether a primitive read outside of a buffer
  Value gaveUp;  // an array: whether its lane gave up
};

} // namespace

//===----------------------------------------------------------------------===//
// Slots
//===----------------------------------------------------------------------===//

/// What memory holds for a value: vectors of single bits take long to pack.
static Type getSlotType(Type type) {
  return type.isInteger(1) ? IntegerType::get(type.getContext(), 8) : type;
}

Value LaneSlots::create(Type type) {
  constexpr int64_t lineSize = 64;
  return memref::AllocaOp::create(
      arrays, loc, MemRefType::get({blockSize}, getSlotType(type)),
      arrays.getI64IntegerAttr(lineSize));
}

/// The type of a vector of these numbers.
static VectorType getVectorType(Type type) {
  return VectorType::get({lanes}, type);
}

void LaneSlots::store(OpBuilder &builder, Value value, Value slot,
                      Value place) const {
  Type type = value.getType(), element = getElementTypeOrSelf(type);
  auto array = cast<MemRefType>(slot.getType());
  bool isVector = isa<VectorType>(type);
  if (element != array.getElementType())
    value =
        arith::ExtUIOp::create(builder, loc,
                               isVector ? getVectorType(array.getElementType())
                                        : array.getElementType(),
                               value);
  if (isVector)
    vector::StoreOp::create(builder, loc, value, slot, place);
  else
    memref::StoreOp::create(builder, loc, value, slot, place);
}

Value LaneSlots::load(OpBuilder &builder, Value slot, Value place,
                      Type type) const {
  Type kept = getSlotType(getElementTypeOrSelf(type));
  Value value =
      isa<VectorType>(type)
          ? vector::LoadOp::create(builder, loc, getVectorType(kept), slot,
                                   place)
                .getResult()
          : memref::LoadOp::create(builder, loc, slot, place).getResult();
  if (kept == getElementTypeOrSelf(type))
    return value;
  Value zero = arith::ConstantOp::create(builder, loc,
                                         builder.getZeroAttr(value.getType()));
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne, value,
                               zero);
}

//===----------------------------------------------------------------------===//
// The loop that reads
//===----------------------------------------------------------------------===//

Value FetchWriter::get(Value value) {
  value = planner.getFirst(value);
  if (Value known = mapping.lookupOrNull(value))
    return known;
  Operation *op = value.getDefiningOp();
  if (!op || !planner.getLoop()->isAncestor(op))
    return value;
  if (auto load = dyn_cast<LoadOp>(op); load && !load.getIndices().empty())
    getElement(load);
  else
    repeat(op);
  return mapping.lookup(value);
}

void FetchWriter::repeat(Operation *op) {
  for (Value operand : op->getOperands())
    mapping.map(operand, get(operand));
  builder.clone(*op, mapping);
}

void FetchWriter::getElement(ArrayRef<LoadOp> loads) {
  LoadOp first = loads.front();
  SmallVector<Value> indices;
  for (Value index : first.getIndices())
    indices.push_back(get(index));
  BinArithmetic bins(builder, loc, stage);
  Value isInside = bins.isInState(first.getState(), indices);
  SmallVector<Type> types;
  for (LoadOp load : loads) {
    types.push_back(load.getType());
    for (Value element : load.getElements())
      get(element);
  }
  auto choice = scf::IfOp::create(builder, loc, types, isInside,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  auto fill = [&](Block *block, auto create) {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(block);
    SmallVector<Value> values;
    for (LoadOp load : loads)
      values.push_back(create(load));
    scf::YieldOp::create(builder, loc, values);
  };
  fill(choice.thenBlock(), [&](LoadOp load) {
    repeat(load);
    auto copy = mapping.lookup(load.getResult()).getDefiningOp<LoadOp>();
    copy.setChecked(true);
    copy.removeOfAttr(); // so that equal reads are the same
    return copy.getResult();
  });
  fill(choice.elseBlock(), [&](LoadOp load) -> Value {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getZeroAttr(load.getType()));
  });
  for (auto [load, result] : llvm::zip(loads, choice.getResults()))
    mapping.map(LoadOp(load).getResult(), result);
  inside =
      inside ? arith::AndIOp::create(builder, loc, inside, isInside) : isInside;
}

//===----------------------------------------------------------------------===//
// The loop in vectors
//===----------------------------------------------------------------------===//

Value VectorWriter::splat(Value scalar) {
  return vector::BroadcastOp::create(builder, loc,
                                     getVectorType(scalar.getType()), scalar);
}

Value VectorWriter::invert(Value mask) {
  Value yes = arith::ConstantOp::create(
      builder, loc,
      DenseElementsAttr::get(cast<ShapedType>(mask.getType()), true));
  return arith::XOrIOp::create(builder, loc, mask, yes);
}

Value VectorWriter::zeros(Type type) {
  return arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
}

Value VectorWriter::getUniform(Value value) {
  return scalars.lookupOrDefault(value);
}

Value VectorWriter::get(Value value) {
  value = planner.getFirst(value);
  if (planner.isInvariant(value))
    return splat(getUniform(value));
  if (Value known = vectors.lookupOrNull(value))
    return known;
  // In front of all, because inner loops may need it first.
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(top);
  Value result;
  if (value == planner.getLoop().getInductionVar()) {
    Value first = arith::AddIOp::create(builder, loc, begin, place);
    Value steps = vector::StepOp::create(builder, loc,
                                         getVectorType(builder.getIndexType()));
    result = arith::AddIOp::create(builder, loc, splat(first), steps);
  } else {
    slots.add(value);
    result = slots.load(builder, slots.get(value), place,
                        getVectorType(value.getType()));
  }
  vectors.map(value, result);
  return result;
}

SmallVector<Value> VectorWriter::getFor(ValueRange variables,
                                        ValueRange values) {
  SmallVector<Value> carried;
  for (auto [variable, value] : llvm::zip_equal(variables, values))
    carried.push_back(planner.isInvariant(variable) ? getUniform(value)
                                                    : get(value));
  carried.push_back(rare ? rare : zeros(getVectorType(builder.getI1Type())));
  return carried;
}

SmallVector<Type> VectorWriter::getTypesFor(ValueRange variables) {
  SmallVector<Type> types;
  for (Value variable : variables)
    types.push_back(planner.isInvariant(variable)
                        ? variable.getType()
                        : getVectorType(variable.getType()));
  types.push_back(getVectorType(builder.getI1Type()));
  return types;
}

void VectorWriter::set(ValueRange variables, ValueRange carried) {
  for (auto [variable, value] : llvm::zip(variables, carried))
    (planner.isInvariant(variable) ? scalars : vectors).map(variable, value);
  rare = carried.back();
}

Value VectorWriter::both(Value mask, Value other) {
  return arith::SelectOp::create(builder, loc, mask, other,
                                 zeros(other.getType()));
}

void VectorWriter::giveUp(Value lanes) {
  if (active)
    lanes = both(active, lanes);
  rare = rare ? arith::OrIOp::create(builder, loc, rare, lanes) : lanes;
}

Value VectorWriter::getPresent() {
  if (present)
    return present;
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(top);
  Value steps = vector::StepOp::create(builder, loc,
                                       getVectorType(builder.getIndexType()));
  Value left = arith::SubIOp::create(builder, loc, count, place);
  Value isThere = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                        steps, splat(left));
  Value isRead = invert(
      slots.load(builder, outside, place, getVectorType(builder.getI1Type())));
  return present = arith::AndIOp::create(builder, loc, isThere, isRead);
}

void VectorWriter::write(const LanePlan &plan) {
  for (Operation *op : plan.ahead)
    writeOperation(op);
  for (const LaneBranch &branch : plan.branches) {
    scf::IfOp choice = branch.choice;
    Value condition = get(choice.getCondition());
    writeFor(branch.region == 0 ? condition : invert(condition),
             [&] { write(branch.plan); });
  }
}

void VectorWriter::writeFor(Value lanes, llvm::function_ref<void()> write) {
  Value outer = active;
  active = outer ? both(outer, lanes) : lanes;
  write();
  active = outer;
}

void VectorWriter::writeOperations(Block &block) {
  for (Operation &op : block.without_terminator())
    writeOperation(&op);
}

void VectorWriter::writeUniform(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op); load && !load.getIndices().empty())
    return writeUniform(load);
  for (Value operand : op->getOperands())
    scalars.map(operand, getUniform(operand));
  builder.clone(*op, scalars);
}

void VectorWriter::writeUniform(LoadOp load) {
  SmallVector<Value> indices;
  for (Value index : load.getIndices())
    indices.push_back(getUniform(index));
  BinArithmetic bins(builder, loc, stage);
  Value isInside = bins.isInState(load.getState(), indices);
  auto choice = scf::IfOp::create(builder, loc, load.getType(), isInside,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(choice.thenBlock());
    auto copy = cast<LoadOp>(builder.clone(*load, scalars));
    copy.setChecked(true);
    copy.removeOfAttr(); // so that equal reads are the same
    scf::YieldOp::create(builder, loc, copy.getResult());
    builder.setInsertionPointToStart(choice.elseBlock());
    scf::YieldOp::create(builder, loc, zeros(load.getType()));
  }
  scalars.map(load.getResult(), choice.getResult(0));
  giveUp(invert(splat(isInside)));
}

void VectorWriter::writeOperation(Operation *op) {
  if (auto choice = dyn_cast<scf::IfOp>(op))
    return writeCondition(choice);
  if (auto loop = dyn_cast<scf::WhileOp>(op))
    return writeLoopIfNeeded(loop);
  Value first = op->getResult(0);
  if (planner.isInvariant(first))
    return writeUniform(op);
  if (planner.isFetched(first))
    return; // was read
  IRMapping operands;
  for (Value operand : op->getOperands())
    operands.map(operand, get(operand));
  Operation *copy = builder.clone(*op, operands);
  for (auto [from, to] : llvm::zip(op->getResults(), copy->getResults())) {
    to.setType(getVectorType(from.getType()));
    vectors.map(from, to);
  }
}

void VectorWriter::writeCondition(scf::IfOp choice) {
  Value condition = get(choice.getCondition());
  SmallVector<Value> values[2]; // of either side
  for (Region &region : choice->getRegions()) {
    unsigned side = region.getRegionNumber();
    Value lanes = side == 0 ? condition : invert(condition);
    writeFor(lanes, [&] {
      if (planner.isRare(region))
        return giveUp(active);
      writeOperations(region.front());
      for (Value value : region.front().getTerminator()->getOperands())
        values[side].push_back(get(value));
    });
  }
  for (auto [i, result] : llvm::enumerate(choice.getResults())) {
    // What a lane gets that gives up does not matter.
    Value value = values[0].empty() ? values[1][i]
                  : values[1].empty()
                      ? values[0][i]
                      : arith::SelectOp::create(builder, loc, condition,
                                                values[0][i], values[1][i])
                            .getResult();
    vectors.map(result, value);
  }
}

void VectorWriter::writeLoop(scf::WhileOp loop) {
  OpBuilder::InsertionGuard guard(builder);
  auto copy = scf::WhileOp::create(
      builder, loc, getTypesFor(loop.getResults()),
      getFor(loop.getBeforeArguments(), loop.getInits()),
      [&](OpBuilder &body, Location, ValueRange carried) {
        builder.setInsertionPointToStart(body.getInsertionBlock());
        set(loop.getBeforeArguments(), carried);
        writeOperations(*loop.getBeforeBody());
        scf::ConditionOp condition = loop.getConditionOp();
        scf::ConditionOp::create(
            builder, loc, getUniform(condition.getCondition()),
            getFor(loop.getResults(), condition.getArgs()));
      },
      [&](OpBuilder &body, Location, ValueRange carried) {
        builder.setInsertionPointToStart(body.getInsertionBlock());
        set(loop.getAfterArguments(), carried);
        writeOperations(*loop.getAfterBody());
        scf::YieldOp::create(
            builder, loc,
            getFor(loop.getBeforeArguments(), loop.getYieldOp().getResults()));
      });
  set(loop.getResults(), copy.getResults());
}

void VectorWriter::writeLoopIfNeeded(scf::WhileOp loop) {
  if (!active)
    return writeLoop(loop);
  // A lane without numbers of its own must not enter it: it may not end.
  Value entering = rare ? both(invert(rare), active) : active;
  entering = both(getPresent(), entering);
  Value isNeeded = vector::ReductionOp::create(
      builder, loc, vector::CombiningKind::OR, entering);
  SmallVector<Type> types = getTypesFor(loop.getResults());
  auto choice = scf::IfOp::create(builder, loc, types, isNeeded,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(choice.elseBlock());
  SmallVector<Value> values;
  for (Type type : ArrayRef(types).drop_back())
    values.push_back(zeros(type));
  values.push_back(rare ? rare : zeros(types.back()));
  scf::YieldOp::create(builder, loc, values);
  builder.setInsertionPointToStart(choice.thenBlock());
  writeLoop(loop);
  scf::YieldOp::create(builder, loc,
                       getFor(loop.getResults(), loop.getResults()));
  set(loop.getResults(), choice.getResults());
}

//===----------------------------------------------------------------------===//
// The three loops
//===----------------------------------------------------------------------===//

scf::ForOp LoopVectorizer::createBlocks() {
  Value size = arith::ConstantIndexOp::create(builder, loc, blockSize);
  return scf::ForOp::create(builder, loc, loop.getLowerBound(),
                            loop.getUpperBound(), size);
}

void LoopVectorizer::createVectors(Value begin, Value end) {
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value step = arith::ConstantIndexOp::create(builder, loc, lanes);
  Value count = arith::SubIOp::create(builder, loc, end, begin);
  auto groups = scf::ForOp::create(builder, loc, zero, count, step);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(groups.getBody());
  Value place = groups.getInductionVar();
  Type bit = builder.getI1Type();
  outside = slots.create(bit);
  VectorWriter writer(builder, stage, planner, slots, begin, count, place,
                      outside);
  writer.write(plan);
  SmallVector<Value> kept;
  auto collect = [&](auto &self, const LanePlan &plan) -> void {
    llvm::append_range(kept, plan.kept);
    for (const LaneBranch &branch : plan.branches)
      self(self, branch.plan);
  };
  collect(collect, plan);
  for (Value value : kept) {
    value = planner.getFirst(value);
    Value computed = writer.get(value);
    if (slots.contains(value))
      continue; // was read
    slots.add(value);
    slots.store(builder, computed, slots.get(value), place);
  }
  bool reads = planner.readsState();
  if (reads)
    gaveUp = outside;
  if (Value rare = writer.getRare()) {
    if (reads)
      rare = arith::OrIOp::create(
          builder, loc, rare,
          slots.load(builder, outside, place, getVectorType(bit)));
    gaveUp = slots.create(bit);
    slots.store(builder, rare, gaveUp, place);
  }
}

void LoopVectorizer::createFetches(Value begin, Value end) {
  auto fetches = scf::ForOp::create(builder, loc, begin, end, loop.getStep());
  fetches->setAttr("piko.reads", builder.getUnitAttr());
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(fetches.getBody());
  Value iteration = fetches.getInductionVar();
  Value place = arith::SubIOp::create(builder, loc, iteration, begin);
  FetchWriter writer(builder, stage, planner, iteration);
  for (Operation *op : planner.getPrefetches())
    writer.repeat(op);
  // Elements in the order in which they are read first.
  SmallVector<SmallVector<LoadOp>> elements;
  for (auto [value, slot] : slots.getAll())
    if (auto load = value.getDefiningOp<LoadOp>();
        load && planner.isFetched(value)) {
      auto known = llvm::find_if(elements, [&](ArrayRef<LoadOp> loads) {
        LoadOp other = loads.front();
        return other.getStateAttr() == load.getStateAttr() &&
               llvm::equal(other.getIndices(), load.getIndices());
      });
      if (known == elements.end())
        elements.push_back({load});
      else
        known->push_back(load);
    }
  for (ArrayRef<LoadOp> loads : elements)
    writer.getElement(loads);
  for (auto [value, slot] : slots.getAll())
    if (planner.isFetched(value))
      slots.store(builder, writer.get(value), slot, place);
  Value inside = writer.getInside();
  if (outside.use_empty() && gaveUp != outside)
    return;
  Value yes =
      arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
  slots.store(builder,
              arith::XOrIOp::create(builder, loc, inside ? inside : yes, yes),
              outside, place);
}

void LoopVectorizer::reduce(LanePlan &plan, Value place) {
  // What the kept values are computed from comes first.
  Operation *head =
      place.getParentBlock() == plan.block ? place.getDefiningOp() : nullptr;
  auto lift = [&](Operation *op) {
    if (head)
      op->moveAfter(head);
    else
      op->moveBefore(plan.block, plan.block->begin());
    head = op;
  };
  for (Operation *op : plan.repeated)
    lift(op);
  if (head)
    builder.setInsertionPointAfter(head);
  else
    builder.setInsertionPointToStart(plan.block);
  llvm::DenseMap<Value, Value> loaded;
  for (Value kept : plan.kept) {
    Value first = planner.getFirst(kept);
    Value &value = loaded[first];
    if (!value)
      value = slots.load(builder, slots.get(first), place, kept.getType());
    kept.replaceAllUsesWith(value);
  }
  for (LaneBranch &branch : plan.branches)
    reduce(branch.plan, place);
  for (Operation *op : llvm::reverse(plan.ahead))
    if (!plan.repeated.contains(op))
      op->erase();
}

void LoopVectorizer::createRest(Value begin, Value end) {
  loop.getLowerBoundMutable().assign(begin);
  loop.getUpperBoundMutable().assign(end);
  loop->removeAttr("piko.lanes");
  for (Operation *op : planner.getPrefetches())
    op->erase();
  Block *body = loop.getBody();
  auto original = llvm::make_range(body->begin(), std::prev(body->end()));
  builder.setInsertionPointToStart(body);
  Value place =
      arith::SubIOp::create(builder, loc, loop.getInductionVar(), begin);
  if (gaveUp) {
    Value again = slots.load(builder, gaveUp, place, builder.getI1Type());
    auto choice = scf::IfOp::create(builder, loc, again, /*withElse=*/true);
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(choice.thenBlock());
    IRMapping mapping;
    for (Operation &op : original)
      builder.clone(op, mapping);
    Block *other = choice.elseBlock();
    other->getOperations().splice(other->begin(), body->getOperations(),
                                  original.begin(), original.end());
    plan.block = other;
  }
  reduce(plan, place);
}

void LoopVectorizer::run() {
  builder.setInsertionPointToStart(blocks.getBody());
  Value begin = blocks.getInductionVar();
  Value end = arith::MinSIOp::create(
      builder, loc,
      arith::AddIOp::create(builder, loc, begin, blocks.getStep()),
      blocks.getUpperBound());
  loop->moveBefore(blocks.getBody()->getTerminator());
  builder.setInsertionPoint(loop);
  // What is read is known when all is written that is computed from it.
  createVectors(begin, end);
  builder.setInsertionPoint(loop->getPrevNode());
  createFetches(begin, end);
  createRest(begin, end);
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// Turns choices between two sides into conditions.
static void simplifySwitches(scf::ForOp loop) {
  IRRewriter rewriter(loop.getContext());
  loop.walk([&](scf::IndexSwitchOp choice) {
    if (choice.getNumCases() != 1)
      return;
    Location loc = choice.getLoc();
    rewriter.setInsertionPoint(choice);
    Value expected = arith::ConstantIndexOp::create(rewriter, loc,
                                                    choice.getCases().front());
    Value isCase = arith::CmpIOp::create(
        rewriter, loc, arith::CmpIPredicate::eq, choice.getArg(), expected);
    auto condition =
        scf::IfOp::create(rewriter, loc, choice.getResultTypes(), isCase,
                          /*addThenBlock=*/false, /*addElseBlock=*/false);
    rewriter.inlineRegionBefore(choice.getCaseRegions().front(),
                                condition.getThenRegion(),
                                condition.getThenRegion().begin());
    rewriter.inlineRegionBefore(choice.getDefaultRegion(),
                                condition.getElseRegion(),
                                condition.getElseRegion().begin());
    rewriter.replaceOp(choice, condition);
  });
}

static void explain(StageOp stage, const LaneCost &cost) {
  InFlightDiagnostic remark = stage.emitRemark()
                              << "stage '" << stage.getSymName() << "' ";
  if (cost.isWorthwhile())
    remark << "computes for " << lanes << " primitives at once";
  else
    remark << "computes for one primitive after the other";
  remark.attachNote() << "ahead of what has effects, " << cost.operations
                      << " operations could run, with " << cost.values
                      << " values to keep";
}

void VectorizePass::runOnOperation() {
  SmallVector<scf::ForOp> loops;
  getOperation().walk([&](scf::ForOp loop) {
    if (isOverPrimitives(loop))
      loops.push_back(loop);
  });
  for (scf::ForOp loop : loops) {
    StageOp stage = getKernelStage(loop);
    simplifySwitches(loop);
    LanePlanner planner(loop);
    LanePlan plan = planner.run();
    LaneCost cost = planner.getCost(plan);
    explain(stage, cost);
    if (!cost.isWorthwhile()) {
      ++left;
      continue;
    }
    kept += plan.countKept();
    LoopVectorizer(loop, stage, std::move(plan), planner).run();
    ++vectorized;
  }
}
