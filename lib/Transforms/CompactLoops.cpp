// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-compact-loops: what a test guards is done for the primitives of a block
// that passed it, together.

#include "LaneReport.h"
#include "StateAccess.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/TypeSwitch.h"

namespace piko {
#define GEN_PASS_DEF_COMPACTLOOPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

/// How many primitives take the test before those that passed go on.
static constexpr int64_t blockSize = 64;

namespace {

struct CompactLoopsPass : piko::impl::CompactLoopsBase<CompactLoopsPass> {
  void runOnOperation() override;
};

/// The state that operations touch.
struct Touched {
  llvm::DenseSet<StringAttr> read, written;

  void add(Operation *op);
  /// Whether one may go before the other or behind it.
  bool commutesWith(const Touched &other) const {
    auto meet = [](auto &a, auto &b) {
      return llvm::any_of(a, [&](StringAttr name) { return b.contains(name); });
    };
    return !meet(written, other.read) && !meet(written, other.written) &&
           !meet(read, other.written);
  }
};

/// A loop over primitives that ends with a test, and work that it guards.
class GuardedLoop {
public:
  explicit GuardedLoop(scf::ForOp loop) : loop(loop), loc(loop.getLoc()) {}

  /// Whether the work can be put off until others have taken the test.
  bool find();
  /// Makes a loop of the work, unless that would not be worth it: then nothing
  /// has changed. The result says what vectors would have to do.
  LaneCost split();
  Location getTest() { return test.getLoc(); }

private:
  bool isWorkAlone() const;
  bool isRecomputable(Value value);
  void createWork();
  void createTest();

  scf::ForOp loop, workLoop;
  Location loc;
  scf::IfOp test;
  Region *work = nullptr;
  Touched head;
  llvm::DenseMap<Value, bool> recomputable;
  Value list, count; // arrays: the numbers of those that passed, and of them
  SmallVector<std::pair<Value, Value>> saved; // with the array of each
};

} // namespace

//===----------------------------------------------------------------------===//
// Whether work can wait
//===----------------------------------------------------------------------===//

void Touched::add(Operation *op) {
  auto [state, kind] = getStateAccess(op);
  if (state)
    (kind == StateAccess::reads ? read : written).insert(state.getAttr());
}

bool GuardedLoop::isWorkAlone() const {
  auto isOwn = [&](Value array) {
    Operation *owner = array.getDefiningOp();
    return owner && work->isAncestor(owner->getParentRegion());
  };
  Touched touched;
  WalkResult result = work->walk([&](Operation *op) {
    touched.add(op);
    bool isKnown =
        llvm::TypeSwitch<Operation *, bool>(op)
            .Case<LoadOp, StoreOp, AtomicOp, UpdateOp, YieldOp, scf::IfOp,
                  scf::ForOp, scf::WhileOp, scf::IndexSwitchOp, scf::YieldOp,
                  scf::ConditionOp, memref::AllocaOp>([](auto) { return true; })
            .Case<memref::LoadOp, memref::StoreOp>(
                [&](auto access) { return isOwn(access.getMemRef()); })
            .Default([](Operation *other) {
              return !other->getNumRegions() && isMemoryEffectFree(other);
            });
    return isKnown ? WalkResult::advance() : WalkResult::interrupt();
  });
  return !result.wasInterrupted() && touched.commutesWith(head);
}

bool GuardedLoop::find() {
  for (Operation &op : llvm::reverse(loop.getBody()->without_terminator())) {
    if ((test = dyn_cast<scf::IfOp>(op)))
      break;
    if (!isa<NextOp>(op) && (!isMemoryEffectFree(&op) || op.getNumRegions()))
      return false;
  }
  if (!test || test.getNumResults() || loop.getNumResults())
    return false;
  auto isEmpty = [](Region &region) {
    return region.empty() || region.front().without_terminator().empty();
  };
  if (isEmpty(test.getElseRegion()))
    work = &test.getThenRegion();
  else if (isEmpty(test.getThenRegion()))
    work = &test.getElseRegion();
  else
    return false;
  loop.walk([&](Operation *op) {
    if (!work->isAncestor(op->getParentRegion()))
      head.add(op);
  });
  // Without effects, nothing has to wait for the test.
  return !head.written.empty() && isWorkAlone();
}

//===----------------------------------------------------------------------===//
// The loop over what passed
//===----------------------------------------------------------------------===//

bool GuardedLoop::isRecomputable(Value value) {
  Operation *op = value.getDefiningOp();
  if (value == loop.getInductionVar() ||
      !loop->isAncestor(value.getParentRegion()->getParentOp()))
    return true;
  if (!op)
    return false;
  auto [known, isNew] = recomputable.try_emplace(value, false);
  if (!isNew)
    return known->second;
  bool result = isa<PikoDialect, arith::ArithDialect>(op->getDialect()) &&
                !op->getNumRegions() && isMemoryEffectFree(op) &&
                llvm::all_of(op->getOperands(),
                             [&](Value v) { return isRecomputable(v); });
  return recomputable[value] = result;
}

void GuardedLoop::createWork() {
  OpBuilder builder(loop);
  auto createArray = [&](int64_t size, Type type) -> Value {
    return memref::AllocaOp::create(builder, loc, MemRefType::get(size, type));
  };
  list = createArray(blockSize, builder.getIndexType());
  count = createArray(1, builder.getIndexType());
  llvm::SetVector<Value> used;
  getUsedValuesDefinedAbove(*work, used);
  for (Value value : used)
    if (!isRecomputable(value))
      saved.push_back({value, createArray(blockSize, value.getType())});
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value size = memref::LoadOp::create(builder, loc, count, zero);
  workLoop = scf::ForOp::create(builder, test.getLoc(), zero, size, one);
  workLoop->setAttr(marks::lanes, builder.getUnitAttr());
  workLoop->setAttr(marks::passed, builder.getUnitAttr());
  if (Attribute mapping = loop->getAttr(marks::mapping))
    workLoop->setAttr(marks::mapping, mapping);
  builder.setInsertionPointToStart(workLoop.getBody());
  Value place = workLoop.getInductionVar();
  IRMapping mapping;
  mapping.map(loop.getInductionVar(),
              memref::LoadOp::create(builder, loc, list, place));
  for (auto [value, array] : saved)
    mapping.map(value, memref::LoadOp::create(builder, loc, array, place));
  auto recompute = [&](auto &self, Value value) -> void {
    Operation *op = value.getDefiningOp();
    if (!op || !loop->isAncestor(op) || mapping.contains(value))
      return;
    for (Value operand : op->getOperands())
      self(self, operand);
    builder.clone(*op, mapping);
  };
  for (Value value : used)
    recompute(recompute, value);
  for (Operation &op : work->front().without_terminator())
    builder.clone(op, mapping);
}

void GuardedLoop::createTest() {
  OpBuilder builder(loop);
  Value size = arith::ConstantIndexOp::create(builder, loc, blockSize);
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto blocks = scf::ForOp::create(builder, loc, loop.getLowerBound(),
                                   loop.getUpperBound(), size);
  Operation *end = blocks.getBody()->getTerminator();
  loop->moveBefore(end);
  workLoop.getUpperBound().getDefiningOp()->moveBefore(end);
  workLoop->moveBefore(end);
  builder.setInsertionPoint(loop);
  Value begin = blocks.getInductionVar();
  loop.getLowerBoundMutable().assign(begin);
  loop.getUpperBoundMutable().assign(arith::MinSIOp::create(
      builder, loc, arith::AddIOp::create(builder, loc, begin, size),
      blocks.getUpperBound()));
  memref::StoreOp::create(builder, loc, zero, count, zero);
  Block &body = work->front();
  while (&body.front() != body.getTerminator())
    body.getTerminator()->getPrevNode()->erase();
  builder.setInsertionPointToStart(&body);
  Value place = memref::LoadOp::create(builder, loc, count, zero);
  memref::StoreOp::create(builder, loc, loop.getInductionVar(), list, place);
  for (auto [value, array] : saved)
    memref::StoreOp::create(builder, loc, value, array, place);
  memref::StoreOp::create(builder, loc,
                          arith::AddIOp::create(builder, loc, place, one),
                          count, zero);
}

LaneCost GuardedLoop::split() {
  createWork();
  LanePlanner planner(workLoop);
  LaneCost cost = planner.getCost(planner.run());
  if (!cost.isWorthwhile()) {
    Operation *size = workLoop.getUpperBound().getDefiningOp();
    workLoop->erase();
    size->erase();
    for (auto [value, array] : saved)
      array.getDefiningOp()->erase();
    list.getDefiningOp()->erase();
    count.getDefiningOp()->erase();
    return cost;
  }
  createTest();
  return cost;
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

void CompactLoopsPass::runOnOperation() {
  for (scf::ForOp loop : findLoopsOverPrimitives(getOperation())) {
    if (getLaneMapping(loop) == LaneMapping::One)
      continue;
    GuardedLoop guarded(loop);
    if (!guarded.find())
      continue;
    StageOp stage = getKernelStage(loop);
    StringRef phase = getLoopPhase(loop);
    LaneCost cost = guarded.split();
    InFlightDiagnostic remark = emitRemark(guarded.getTest())
                                << "stage '" << getCppName(stage)
                                << "': " << phase;
    if (cost.isWorthwhile()) {
      remark << " puts off what passes this test, to do it together";
      ++compacted;
      continue;
    }
    remark << " does what passes this test without delay";
    remark.attachNote(guarded.getTest())
        << "too little is computed behind it: expected at least "
        << cost.getLeast() << " operations, but got " << cost.operations;
  }
}
