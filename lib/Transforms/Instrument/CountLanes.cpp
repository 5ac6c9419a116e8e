// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-count-lanes, for each kernel: the kernel and each unit of its work gets
// room for the four sums, each block adds to them what it does, and the end of
// the unit tells the runtime.
//
// The lanes of a block that do something are those of the mask that guards it:
// the condition of the scf.if or scf.while around it asks for any of them; or
// else the mask of its own first access by a mask, such as that of a last part
// of a row.

#include "Piko/Transforms/Passes.h"

#include "Instrument/Counters.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "llvm/Support/SaveAndRestore.h"

namespace piko {
#define GEN_PASS_DEF_COUNTLANES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct CountLanesPass : piko::impl::CountLanesBase<CountLanesPass> {
  void runOnOperation() override;
};

constexpr CounterKind kinds[] = {CounterKind::Scalars, CounterKind::Vectors,
                                 CounterKind::Lanes, CounterKind::ActiveLanes};
constexpr int64_t kindCount = 4;

/// What a block does each time that it runs.
struct BlockWork {
  int64_t scalars = 0, vectors = 0, lanes = 0;
};

/// Counts in one kernel. What stands in a loop whose line is known is counted
/// for that line, other things for what is around them.
class LaneCounter {
public:
  LaneCounter(KernelOp kernel, Counters &counters, StringAttr stage)
      : kernel(kernel), counters(counters), stage(stage),
        builder(kernel.getContext()) {}
  void run();

private:
  void addCounters(Location loc, std::optional<int32_t> around);
  void findLoops();
  /// `sums` are those of the unit, `mask` of the lanes that do something, or
  /// null where all do.
  void countBlock(Block &block, Value sums, Value mask);
  void countRegions(Operation &op, Value sums, Value mask);
  void countUnit(Block &block);
  void addWork(Block &block, const BlockWork &work, Value sums, Value mask);
  void add(Value sums, CounterKind kind, Value amount);
  int64_t getCounterCount() const {
    return kindCount * static_cast<int64_t>(firstCounters.size());
  }
  Value constant(int64_t value) {
    return arith::ConstantIndexOp::create(builder, kernel.getLoc(), value);
  }

  KernelOp kernel;
  Counters &counters;
  StringAttr stage;
  OpBuilder builder;
  SmallVector<int32_t> firstCounters;         ///< The kernel's, those of lines.
  llvm::DenseMap<Operation *, int64_t> lines; ///< Of loops.
  int64_t line = 0;                           ///< Where blocks are counted.
};

} // namespace

static BlockWork measure(Block &block) {
  BlockWork work;
  for (Operation &op : block) {
    auto vector = dyn_cast_if_present<VectorType>(getComputedType(&op));
    if (!vector) {
      work.scalars += getComputedType(&op) != Type();
      continue;
    }
    ++work.vectors;
    work.lanes += vector.getNumElements();
  }
  return work;
}

static bool isMask(Type type) {
  auto vector = dyn_cast<VectorType>(type);
  return vector && vector.getRank() == 1 &&
         vector.getElementType().isInteger(1);
}

/// The mask that a condition asks for any lane of, or null.
static Value getMask(Value condition) {
  auto any = condition.getDefiningOp<vector::ReductionOp>();
  return any && any.getKind() == vector::CombiningKind::OR &&
                 isMask(any.getVector().getType())
             ? any.getVector()
             : Value();
}

/// The mask of a loop's body: what its condition asks for, as it is passed on.
static Value getBodyMask(scf::WhileOp loop, Value otherwise) {
  Value mask = getMask(loop.getConditionOp().getCondition());
  for (auto [passed, argument] : llvm::zip(loop.getConditionOp().getArgs(),
                                           loop.getAfterBody()->getArguments()))
    if (mask && passed == mask)
      return argument;
  return otherwise;
}

/// The mask before the condition: the one that goes around the loop.
static Value getHeadMask(scf::WhileOp loop, Value otherwise) {
  Value found;
  for (BlockArgument argument : loop.getBeforeBody()->getArguments())
    if (isMask(argument.getType())) {
      if (found)
        return otherwise;
      found = argument;
    }
  return found ? found : otherwise;
}

/// The mask of the block's first access to memory that has one.
static Value getAccessMask(Block &block) {
  for (Operation &op : block) {
    if (!isa<vector::MaskedLoadOp, vector::MaskedStoreOp, vector::GatherOp,
             vector::ScatterOp>(op) &&
        !isa_and_nonnull<PikoDialect>(op.getDialect()))
      continue;
    for (Value operand : op.getOperands())
      if (isMask(operand.getType()) && operand.getParentBlock() == &block)
        return operand;
  }
  return {};
}

void LaneCounter::add(Value sums, CounterKind kind, Value amount) {
  Location loc = kernel.getLoc();
  Value at = constant(line * kindCount + (llvm::find(kinds, kind) - kinds));
  Value before = memref::LoadOp::create(builder, loc, sums, at);
  Value after = arith::AddIOp::create(builder, loc, before, amount);
  memref::StoreOp::create(builder, loc, after, sums, at);
}

/// How many lanes of a mask are set.
static Value countLanes(OpBuilder &builder, Location loc, Value mask) {
  int64_t width = cast<VectorType>(mask.getType()).getNumElements();
  Type bits = builder.getIntegerType(static_cast<unsigned>(width));
  Value packed =
      vector::BitCastOp::create(builder, loc, VectorType::get({1}, bits), mask);
  Value number = vector::ExtractOp::create(builder, loc, packed, 0);
  number = math::CtPopOp::create(builder, loc, number);
  return arith::IndexCastUIOp::create(builder, loc, builder.getIndexType(),
                                      number);
}

void LaneCounter::addWork(Block &block, const BlockWork &work, Value sums,
                          Value mask) {
  // At the end: there the block's own mask is known.
  builder.setInsertionPoint(block.getTerminator());
  if (work.scalars)
    add(sums, CounterKind::Scalars, constant(work.scalars));
  if (!work.vectors)
    return;
  add(sums, CounterKind::Vectors, constant(work.vectors));
  add(sums, CounterKind::Lanes, constant(work.lanes));
  if (!mask) {
    add(sums, CounterKind::ActiveLanes, constant(work.lanes));
    return;
  }
  Location loc = kernel.getLoc();
  int64_t width = cast<VectorType>(mask.getType()).getNumElements();
  Value active = arith::MulIOp::create(
      builder, loc, countLanes(builder, loc, mask), constant(work.lanes));
  add(sums, CounterKind::ActiveLanes,
      arith::DivUIOp::create(builder, loc, active, constant(width)));
}

void LaneCounter::countRegions(Operation &op, Value sums, Value mask) {
  auto known = lines.find(&op);
  llvm::SaveAndRestore inner(line, known == lines.end() ? line : known->second);
  if (isa<scf::ForallOp>(op)) {
    countUnit(op.getRegion(0).front());
    return;
  }
  if (auto loop = dyn_cast<scf::WhileOp>(op)) {
    countBlock(*loop.getBeforeBody(), sums, getHeadMask(loop, mask));
    countBlock(*loop.getAfterBody(), sums, getBodyMask(loop, mask));
    return;
  }
  Value own = mask;
  if (auto branch = dyn_cast<scf::IfOp>(op))
    if (Value asked = getMask(branch.getCondition()))
      own = asked;
  for (Region &region : op.getRegions())
    for (Block &block : region) {
      countBlock(block, sums, own);
      own = mask; // of the other branch
    }
}

void LaneCounter::countBlock(Block &block, Value sums, Value mask) {
  BlockWork work = measure(block);
  Value own = getAccessMask(block);
  for (Operation &op : llvm::make_early_inc_range(block)) {
    // Of what stands after the access, its mask is the guard as well.
    bool isAfter = own && (!own.getDefiningOp() ||
                           own.getDefiningOp()->isBeforeInBlock(&op));
    if (op.getNumRegions())
      countRegions(op, sums, !mask && isAfter ? own : mask);
  }
  addWork(block, work, sums, mask ? mask : own);
}

void LaneCounter::countUnit(Block &block) {
  Location loc = kernel.getLoc();
  builder.setInsertionPointToStart(&block);
  Value sums = memref::AllocaOp::create(
      builder, loc,
      MemRefType::get({getCounterCount()}, builder.getIndexType()));
  for (int64_t which = 0; which < getCounterCount(); ++which)
    memref::StoreOp::create(builder, loc, constant(0), sums, constant(which));
  countBlock(block, sums, Value());
  builder.setInsertionPoint(block.getTerminator());
  for (int64_t which = 0; which < getCounterCount(); ++which) {
    Value sum = memref::LoadOp::create(builder, loc, sums, constant(which));
    CountOp::create(builder, loc,
                    firstCounters[which / kindCount] +
                        static_cast<int32_t>(which % kindCount),
                    sum);
  }
}

void LaneCounter::addCounters(Location loc, std::optional<int32_t> around) {
  firstCounters.push_back(counters.size());
  for (CounterKind kind : kinds)
    counters.add(loc, kind, stage, around);
}

/// Copies of a loop have one line.
void LaneCounter::findLoops() {
  llvm::DenseMap<std::pair<Attribute, unsigned>, int64_t> known;
  kernel.walk<WalkOrder::PreOrder>([&](Operation *op) {
    auto at = op->getLoc()->findInstanceOf<FileLineColLoc>();
    if (!isa<scf::ForOp, scf::WhileOp>(op) || !at)
      return;
    auto [place, isNew] = known.try_emplace({at.getFilename(), at.getLine()},
                                            firstCounters.size());
    if (isNew)
      addCounters(at, firstCounters.front());
    lines[op] = place->second;
  });
}

void LaneCounter::run() {
  addCounters(kernel.getLoc(), std::nullopt);
  findLoops();
  countUnit(*kernel.getBodyBlock());
}

/// The name of the stage whose work a kernel does, or null.
static StringAttr getStage(KernelOp kernel) {
  StringAttr name;
  kernel.walk([&](OpenBinsOp bins) {
    auto stage = lookupInPipeline<StageOp>(kernel, bins.getStageAttr());
    name = StringAttr::get(kernel.getContext(), getCppName(stage));
    return WalkResult::interrupt();
  });
  return name;
}

void CountLanesPass::runOnOperation() {
  Counters counters(getOperation());
  SmallVector<KernelOp> kernels(getOperation().getOps<KernelOp>());
  for (KernelOp kernel : kernels) {
    StringAttr stage = getStage(kernel);
    if (!stage)
      continue;
    LaneCounter(kernel, counters, stage).run();
  }
}
