// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Each number that may be unwritten gets a flag that is computed along with it:
//   1. find them, forwards from each piko.undefined;
//   2. backwards from each use that shows one, make flags: `or` through
//      arithmetic, a select through selects, and through control flow a cell of
//      memory that each way to the value sets;
//   3. test the flags where the numbers are emitted or stored.

#include "Instrument/Unwritten.h"

#include "Piko/Dialect/Piko/IR/PikoCheck.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

namespace {

/// A way in which control flow brings a number to a block argument or a result.
struct Way {
  Operation *before; ///< Where it is on its way.
  Value value;
};

class FlagMaker {
public:
  void findTainted(Operation *phase);
  bool isTainted(Value value) const { return tainted.contains(value); }
  /// Whether a tainted value is unwritten, as an i1 that is there where it is.
  Value flag(Value value);

private:
  void taint(Value value);
  void taintUsers(Value value);
  Value makeCell(Value value);
  Value makeFlag(Operation *op);

  llvm::DenseSet<Value> tainted;
  SmallVector<Value> work;
  llvm::DenseMap<Value, Value> flags;
};

} // namespace

/// Whether the op computes numbers from its operands and does nothing else.
static bool isArithmetic(Operation *op) {
  return op->getNumRegions() == 0 && op->getNumResults() > 0 &&
         isMemoryEffectFree(op);
}

/// How numbers come to a result of an operation with regions.
static SmallVector<Way> getWays(OpResult result) {
  Operation *op = result.getOwner();
  unsigned i = result.getResultNumber();
  SmallVector<Way> ways;
  if (auto loop = dyn_cast<scf::WhileOp>(op)) {
    scf::ConditionOp end = loop.getConditionOp();
    ways.push_back({end, end.getArgs()[i]});
    return ways;
  }
  if (auto loop = dyn_cast<scf::ForOp>(op))
    ways.push_back({op, loop.getInitArgs()[i]});
  for (Region &region : op->getRegions()) {
    if (region.empty())
      continue;
    Operation *end = region.front().getTerminator();
    if (auto yield = dyn_cast<YieldOp>(end))
      ways.push_back({end, yield.getResults()[i]});
    else
      ways.push_back({end, end->getOperand(i)});
  }
  return ways;
}

/// How numbers come to the argument of a block.
static SmallVector<Way> getWays(BlockArgument argument) {
  Block *block = argument.getOwner();
  Operation *op = block->getParentOp();
  unsigned i = argument.getArgNumber();
  if (auto loop = dyn_cast<scf::ForOp>(op)) {
    if (i == 0)
      return {};
    return {
        {op, loop.getInitArgs()[i - 1]},
        {block->getTerminator(), block->getTerminator()->getOperand(i - 1)}};
  }
  auto loop = dyn_cast<scf::WhileOp>(op);
  if (!loop)
    return {};
  if (block == loop.getAfterBody()) {
    scf::ConditionOp end = loop.getConditionOp();
    return {{end, end.getArgs()[i]}};
  }
  Operation *end = loop.getAfterBody()->getTerminator();
  return {{op, loop.getInits()[i]}, {end, end->getOperand(i)}};
}

static SmallVector<Way> getWays(Value value) {
  if (auto result = dyn_cast<OpResult>(value))
    return getWays(result);
  return getWays(cast<BlockArgument>(value));
}

void FlagMaker::taint(Value value) {
  if (tainted.insert(value).second)
    work.push_back(value);
}

/// What control flow makes of the values that leave a block or enter a loop.
static SmallVector<Value> getTargets(Operation *op) {
  SmallVector<Value> targets(op->getResults());
  for (Region &region : op->getRegions())
    for (Block &block : region)
      llvm::append_range(targets, block.getArguments());
  return targets;
}

void FlagMaker::taintUsers(Value value) {
  for (Operation *user : value.getUsers()) {
    if (isArithmetic(user)) {
      for (Value result : user->getResults())
        taint(result);
      continue;
    }
    Operation *flow =
        user->hasTrait<OpTrait::IsTerminator>() ? user->getParentOp() : user;
    if (!isa<scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp, UpdateOp>(
            flow))
      continue;
    for (Value target : getTargets(flow))
      if (llvm::any_of(getWays(target),
                       [&](const Way &way) { return way.value == value; }))
        taint(target);
  }
}

void FlagMaker::findTainted(Operation *phase) {
  phase->walk([&](UndefinedOp op) { taint(op.getResult()); });
  while (!work.empty())
    taintUsers(work.pop_back_val());
}

Value FlagMaker::flag(Value value) {
  if (Value known = flags.lookup(value))
    return known;
  Operation *op = value.getDefiningOp();
  return op && op->getNumRegions() == 0 ? makeFlag(op) : makeCell(value);
}

/// Of what an operation without regions computes.
Value FlagMaker::makeFlag(Operation *op) {
  OpBuilder builder(op);
  builder.setInsertionPointAfter(op);
  Location loc = op->getLoc();
  Value result;
  auto flagOr = [&](Value value, bool otherwise) -> Value {
    if (isTainted(value))
      return flag(value);
    return arith::ConstantIntOp::create(builder, loc, otherwise, 1);
  };
  if (isa<UndefinedOp>(op)) {
    result = arith::ConstantIntOp::create(builder, loc, 1, 1);
  } else if (auto select = dyn_cast<arith::SelectOp>(op)) {
    result = arith::SelectOp::create(builder, loc, select.getCondition(),
                                     flagOr(select.getTrueValue(), false),
                                     flagOr(select.getFalseValue(), false));
    if (isTainted(select.getCondition()))
      result = arith::OrIOp::create(builder, loc, result,
                                    flag(select.getCondition()));
  } else {
    for (Value operand : op->getOperands())
      if (isTainted(operand))
        result = result
                     ? arith::OrIOp::create(builder, loc, result, flag(operand))
                     : flag(operand);
  }
  for (Value value : op->getResults())
    flags[value] = result;
  return result;
}

/// Of a block argument or of a result of control flow.
Value FlagMaker::makeCell(Value value) {
  Operation *op = value.getDefiningOp();
  Block *block = op ? nullptr : cast<BlockArgument>(value).getOwner();
  Operation *scope =
      (op ? op : block->getParentOp())
          ->getParentWithTrait<OpTrait::AutomaticAllocationScope>();
  Location loc = value.getLoc();
  OpBuilder builder = OpBuilder::atBlockBegin(&scope->getRegion(0).front());
  Value cell = memref::AllocaOp::create(
      builder, loc, MemRefType::get({1}, builder.getI1Type()));
  auto first = [&] { return arith::ConstantIndexOp::create(builder, loc, 0); };
  if (op)
    builder.setInsertionPointAfter(op);
  else
    builder.setInsertionPointToStart(block);
  Value zero = first();
  Value loaded = memref::LoadOp::create(builder, loc, cell, zero);
  flags[value] = loaded; // before the ways, which may lead back here
  for (const Way &way : getWays(value)) {
    Value set = isTainted(way.value) ? flag(way.value) : Value();
    builder.setInsertionPoint(way.before);
    if (!set)
      set = arith::ConstantIntOp::create(builder, loc, 0, 1);
    Value zero = first();
    memref::StoreOp::create(builder, loc, set, cell, zero);
  }
  return loaded;
}

/// The name of the field of each number of a record.
static SmallVector<StringRef> getNumberNames(RecordOp record) {
  SmallVector<StringRef> names;
  for (auto field : record.getFields().getAsRange<FieldAttr>())
    names.append(field.getElementCount(), field.getName());
  return names;
}

void piko::checkUnwritten(
    Operation *phase,
    llvm::function_ref<FlatSymbolRefAttr(FlatSymbolRefAttr)> hostOf) {
  FlagMaker flags;
  flags.findTainted(phase);
  auto check = [&](Operation *at, Value value, FlatSymbolRefAttr record,
                   StringRef field) {
    if (!flags.isTainted(value))
      return;
    Value flag = flags.flag(value);
    OpBuilder builder(at);
    CheckValueOp::create(builder, at->getLoc(), CheckedValue::Unwritten, flag,
                         field, hostOf(record).getValue());
  };
  auto checkAll = [&](Operation *at, ValueRange values,
                      FlatSymbolRefAttr record) {
    SmallVector<StringRef> names = getNumberNames(lookupRecord(at, record));
    for (auto [value, name] : llvm::zip(values, names))
      check(at, value, record, name);
  };
  auto recordOf = [](Operation *op, FlatSymbolRefAttr state) {
    return getStateRecord(lookupInPipeline<Operation *>(op, state));
  };
  SmallVector<Operation *> sinks;
  phase->walk([&](Operation *op) {
    if (isa<EmissionOpInterface, StoreOp, UpdateOp>(op))
      sinks.push_back(op);
  });
  for (Operation *op : sinks) {
    if (auto emit = dyn_cast<EmissionOpInterface>(op)) {
      Attribute record = getPhaseStage(op).getOutputs()[emit.getPort()];
      checkAll(op, emit.getNumbers(), cast<FlatSymbolRefAttr>(record));
    } else if (auto store = dyn_cast<StoreOp>(op)) {
      check(op, store.getValue(), recordOf(op, store.getStateAttr()),
            store.getField());
    } else {
      auto update = cast<UpdateOp>(op);
      auto yield = cast<YieldOp>(update.getBody().front().getTerminator());
      checkAll(yield, yield.getPixel(), recordOf(op, update.getImageAttr()));
    }
  }
  phase->walk([](UndefinedOp op) {
    OpBuilder builder(op);
    Type type = op.getResult().getType();
    Value zero = arith::ConstantOp::create(builder, op.getLoc(),
                                           builder.getZeroAttr(type));
    op.getResult().replaceAllUsesWith(zero);
    op.erase();
  });
}
