// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What runs for one lane after the other: in its place, or after all that
// vectors do. Values of lanes go through memory, a slot for each.

#include "Vectorize/Write/LaneTurns.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// A turn
//===----------------------------------------------------------------------===//

namespace {

/// What operations that run lane by lane take from outside of them.
class SerialInputs {
public:
  /// Those of `records` are stored by vectors.
  SerialInputs(const IterationLanes &lanes, ArrayRef<Operation *> ops,
               const llvm::MapVector<Operation *, Value> &records, bool isLate)
      : lanes(lanes), ops(ops.begin(), ops.end()), isLate(isLate) {
    for (Operation *op : ops)
      if (!records.contains(op))
        op->walk([&](Operation *inner) {
          for (Value operand : inner->getOperands())
            add(operand);
        });
  }
  /// What differs between lanes.
  llvm::SetVector<Value> varying;
  /// What is the same for all, and computed in the loop.
  llvm::SetVector<Value> uniform;
  /// What is made again for each lane, in order.
  llvm::SetVector<Operation *> made;

private:
  bool isInside(Value value) const {
    Operation *at = value.getParentBlock()->getParentOp();
    if (Operation *op = value.getDefiningOp())
      at = op;
    for (; at && at != lanes.getLoop(); at = at->getParentOp())
      if (ops.contains(at))
        return true;
    return false;
  }
  void add(Value value) {
    if (lanes.isPrivate(value) || isInside(value) ||
        !lanes.getLoop()->isAncestor(value.getParentBlock()->getParentOp()))
      return;
    Operation *op = value.getDefiningOp();
    bool isConstant = op && op->hasTrait<OpTrait::ConstantLike>();
    // Each lane widens its own index: vectors of 64 bits are two.
    bool isWidened = !isLate && isa_and_nonnull<arith::IndexCastOp>(op) &&
                     value.getType().isIndex();
    if (isLaneType(value.getType()) && !isConstant && !isWidened) {
      (lanes.isVarying(value) ? varying : uniform).insert(value);
      return;
    }
    for (Value operand : op->getOperands())
      add(operand);
    made.insert(op);
  }

  const IterationLanes &lanes;
  llvm::DenseSet<Operation *> ops;
  bool isLate;
};

} // namespace

/// Arrays of an iteration have a column for each lane.
void LaneTurns::useColumns(Operation *copy, Value lane) {
  copy->walk([&](Operation *op) {
    auto load = dyn_cast<memref::LoadOp>(op);
    auto write = dyn_cast<memref::StoreOp>(op);
    Value array = load ? load.getMemRef() : write ? write.getMemRef() : Value();
    Value wide = array ? columns.lookup(array) : Value();
    if (!wide)
      return;
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPoint(op);
    Value index = load ? load.getIndices()[0] : write.getIndices()[0];
    Value stride = arith::ConstantIndexOp::create(builder, loc, laneCount);
    Value at = arith::AddIOp::create(
        builder, loc, arith::MulIOp::create(builder, loc, index, stride), lane);
    (load ? load.getMemrefMutable() : write.getMemrefMutable()).assign(wide);
    (load ? load.getIndicesMutable() : write.getIndicesMutable()).assign(at);
  });
}

SmallVector<Operation *> LaneTurns::findRest(Operation *first,
                                             Operation *last) const {
  SmallVector<Operation *> rest;
  for (Operation *op : OrderedGroup{first, last}.getOperations()) {
    bool isDone = llvm::any_of(op->getResults(), [&](Value result) {
      return vectors.contains(result) || scalars.contains(result);
    });
    if (!isDone && !isa<memref::AllocaOp>(op))
      rest.push_back(op);
  }
  return rest;
}

/// The results of some operations of a block that others use.
static SmallVector<Value> findOutputs(ArrayRef<Operation *> ops) {
  llvm::DenseSet<Operation *> inside(ops.begin(), ops.end());
  SmallVector<Value> outputs;
  for (Operation *op : ops)
    for (Value result : op->getResults())
      if (llvm::any_of(result.getUsers(), [&](Operation *user) {
            return !inside.contains(
                op->getBlock()->findAncestorOpInBlock(*user));
          }))
        outputs.push_back(result);
  return outputs;
}

LaneTurns::Turn LaneTurns::prepareTurn(Operation *first, Operation *last,
                                       bool isLate) {
  Turn turn;
  turn.ops = findRest(first, last);
  for (Operation *op : turn.ops)
    if (auto append = dyn_cast<AppendOp>(op);
        append && lanes.isStoredByVectors(append))
      turn.records[append] = writeRecords(append);
  SerialInputs inputs(lanes, turn.ops, turn.records, isLate);
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  for (Value value : inputs.varying) {
    Value slot = turn.varying[value] = createSlot(value.getType());
    storeSlot(get(value), slot, start);
  }
  // After all, what stands here is not known.
  for (Value value : inputs.uniform) {
    if (!isLate)
      break;
    Value slot = turn.uniform[value] = createSlot(value.getType());
    storeSlot(getUniform(value), slot, start);
  }
  turn.made.assign(inputs.made.begin(), inputs.made.end());
  return turn;
}

IRMapping LaneTurns::writeTurn(const Turn &turn, Value lane) {
  IRMapping mapping(scalars);
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  for (auto [value, slot] : turn.varying)
    mapping.map(value, loadSlot(slot, lane, value.getType()));
  for (auto [value, slot] : turn.uniform)
    mapping.map(value, loadSlot(slot, start, value.getType()));
  for (ArrayRef<Operation *> ops :
       {ArrayRef<Operation *>(turn.made), ArrayRef<Operation *>(turn.ops)})
    for (Operation *op : ops)
      if (Value records = turn.records.lookup(op)) {
        auto append = cast<AppendOp>(op);
        mapping.map(
            append.getPrim(),
            AppendRecordOp::create(builder, loc, append.getPrim().getType(),
                                   mapping.lookupOrDefault(append.getWriter()),
                                   append.getPortAttr(), records, lane,
                                   builder.getI64IntegerAttr(laneCount))
                .getPrim());
      } else {
        useColumns(builder.clone(*op, mapping), lane);
      }
  return mapping;
}

void LaneTurns::writeTurns(Value bits,
                           llvm::function_ref<void(Value lane)> write) {
  // One bit for each lane; the lowest one is the next.
  Type word = bits.getType();
  Value none = zeros(word), one = arith::ConstantOp::create(
                                builder, loc, builder.getIntegerAttr(word, 1));
  auto turns =
      scf::WhileOp::create(builder, loc, TypeRange{word}, ValueRange{bits});
  turnLoops.push_back(turns);
  Block *before = builder.createBlock(&turns.getBefore(), {}, word, loc);
  Value isLeft = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                       before->getArgument(0), none);
  scf::ConditionOp::create(builder, loc, isLeft, before->getArguments());
  Block *after = builder.createBlock(&turns.getAfter(), {}, word, loc);
  Value left = after->getArgument(0);
  write(arith::IndexCastUIOp::create(
      builder, loc, builder.getIndexType(),
      math::CountTrailingZerosOp::create(builder, loc, left)));
  Value rest = arith::AndIOp::create(
      builder, loc, left, arith::SubIOp::create(builder, loc, left, one));
  scf::YieldOp::create(builder, loc, rest);
  builder.setInsertionPointAfter(turns);
}

//===----------------------------------------------------------------------===//
// In its place
//===----------------------------------------------------------------------===//

void LaneTurns::writeSerial(Operation *first, Operation *last) {
  Turn turn = prepareTurn(first, last, /*isLate=*/false);
  SmallVector<Value> outputs = findOutputs(turn.ops);
  llvm::DenseMap<Value, Value> slots;
  for (Value output : outputs)
    slots[output] = createSlot(output.getType());
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  writeTurns(getBits(active), [&](Value lane) {
    IRMapping mapping = writeTurn(turn, lane);
    for (Value output : outputs)
      storeSlot(mapping.lookup(output), slots[output],
                lanes.isVarying(output) ? lane : start);
  });
  for (Value output : outputs) {
    Type type = output.getType();
    if (lanes.isVarying(output))
      type = getVectorType(type);
    setCarried(output, loadSlot(slots[output], start, type));
  }
}

//===----------------------------------------------------------------------===//
// After all
//===----------------------------------------------------------------------===//

std::optional<Value> LaneTurns::writeIsCounted(const Turn &turn) {
  Value counted;
  for (Operation *op : turn.ops) {
    auto next = dyn_cast<NextOp>(op);
    if (!next)
      return std::nullopt;
    Value one = IsCountedOp::create(builder, loc, getUniform(next.getWriter()));
    counted = counted ? arith::OrIOp::create(builder, loc, counted, one) : one;
  }
  return counted;
}

void LaneTurns::delay(const OrderedGroup &group) {
  Turn turn = prepareTurn(group.first, group.last, /*isLate=*/true);
  turn.mask = masks.lookup(group.first);
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  Value bits = getBits(active);
  if (std::optional<Value> counted = writeIsCounted(turn))
    bits = arith::SelectOp::create(builder, loc, *counted, bits,
                                   zeros(bits.getType()));
  storeSlot(bits, turn.mask, start);
  late.push_back(std::move(turn));
}

void LaneTurns::createMasks() {
  Type word = getWord();
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  for (const OrderedGroup &group : lanes.getGroups()) {
    if (!group.late)
      continue;
    Value mask = masks[group.first] = createSlot(word);
    storeSlot(zeros(word), mask, start);
  }
}

void LaneTurns::writeLateTurns(ArrayRef<Turn> late) {
  if (late.empty())
    return;
  Type word = getWord();
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  SmallVector<Value> bits;
  Value all;
  for (const Turn &turn : late) {
    bits.push_back(loadSlot(turn.mask, start, word));
    all = all ? arith::OrIOp::create(builder, loc, all, bits.back())
              : bits.back();
  }
  if (late.size() == 1)
    return writeTurns(all, [&](Value lane) { writeTurn(late.front(), lane); });
  writeTurns(all, [&](Value lane) {
    Value shift = arith::IndexCastUIOp::create(builder, loc, word, lane);
    for (auto [turn, mask] : llvm::zip(late, bits)) {
      Value bit = arith::TruncIOp::create(
          builder, loc, builder.getI1Type(),
          arith::ShRUIOp::create(builder, loc, mask, shift));
      auto mine = scf::IfOp::create(builder, loc, bit, /*withElse=*/false);
      OpBuilder::InsertionGuard guard(builder);
      builder.setInsertionPointToStart(mine.thenBlock());
      writeTurn(turn, lane);
    }
  });
}
