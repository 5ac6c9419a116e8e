// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-distribute-loops: loop fission of what a phase computes of a primitive
// before its own loops, which becomes vectors of primitives.
//
// What is as quickly read or cast again is not put into arrays. What conditions
// guard counts as needed by every second primitive.

#include "Support/StateAccess.h"
#include "Vectorize/Cost/LaneCycles.h"
#include "Vectorize/LaneCandidate.h"
#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

namespace piko {
#define GEN_PASS_DEF_DISTRIBUTELOOPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct DistributeLoopsPass
    : piko::impl::DistributeLoopsBase<DistributeLoopsPass> {
  using DistributeLoopsBase::DistributeLoopsBase;
  void runOnOperation() override;
};

/// Looks at one loop over primitives.
class Distributor {
public:
  Distributor(scf::ForOp loop, int64_t laneCount,
              const llvm::DenseSet<StringAttr> &written)
      : loop(loop), laneCount(laneCount), written(written), builder(loop),
        at(builder, loop.getLoc()) {}
  void run();

private:
  void findMoved(Block &block, bool isSure);
  bool mayMove(Operation *op, bool isSure);
  bool varies(Operation *op);
  /// Whether it is as quickly made, or read, again.
  bool isCopied(Value value) const;
  void findResults();
  /// The operations of the first loop, in their order.
  SmallVector<Operation *> findSlice() const;
  void createTables();
  /// The first loop, before the original one.
  scf::ForOp writeFirst(Value lower, Value upper);
  bool isWorthwhile(const IterationLanes &lanes);
  void writeVectors(const IterationLanes &lanes, Value lower, Value upper);
  /// Lets the original loop, which is now the second one, read the tables.
  void readTables(Value lower);
  void eraseMoved();

  scf::ForOp loop;
  const int64_t laneCount;
  const llvm::DenseSet<StringAttr> &written;
  OpBuilder builder;
  CodeBuilder at;
  llvm::SetVector<Operation *> moved;
  llvm::DenseSet<Operation *> varying;     ///< From iteration to iteration.
  llvm::DenseSet<Operation *> ofPrimitive; ///< Not by its position alone.
  /// A row of one of few arrays, which a processor reads by one register.
  struct Table {
    Value array;
    int64_t begin = 0;
  };
  llvm::MapVector<Value, Table> results; ///< which the second loop takes
  SmallVector<Value> arrays;
};

} // namespace

//===----------------------------------------------------------------------===//
// What the first loop computes
//===----------------------------------------------------------------------===//

/// What a lane of a vector may be.
static bool isNumber(Value value) {
  Type type = value.getType();
  return type.isIndex() ||
         (type.isIntOrFloat() && type.getIntOrFloatBitWidth() <= 64);
}

/// Whether lanes need not compute it one by one.
static bool isForLanes(Operation *op) {
  return hasVectorForm(op) &&
         (!isIntegerDivision(op) || isDividedAsFloats(op) ||
          matchPattern(op->getOperand(1), m_Constant()));
}

/// `isSure`: the primitive's iteration comes there.
bool Distributor::mayMove(Operation *op, bool isSure) {
  bool isKnown = llvm::all_of(op->getOperands(), [&](Value operand) {
    return loop.isDefinedOutsideOfLoop(operand) ||
           operand == loop.getInductionVar() ||
           moved.contains(operand.getDefiningOp());
  });
  if (!isKnown || op->getNumRegions() > 0 || op->getNumResults() == 0)
    return false;
  // A condition may say whether another position is one.
  if (auto item = dyn_cast<ItemOp>(op))
    return isSure || item.getPosition() == loop.getInductionVar();
  if (!llvm::all_of(op->getResults(), isNumber))
    return false;
  if (auto get = dyn_cast<GetOp>(op))
    return get.getElements().empty() && !get.getType().isInteger(1);
  if (auto load = dyn_cast<LoadOp>(op))
    return isSure && load.getChecked() && !load.getTile() &&
           load.getElements().empty() && !load.getType().isInteger(1) &&
           !written.contains(load.getStateAttr().getAttr());
  return (!varies(op) || isForLanes(op)) &&
         (isSure ? isMemoryEffectFree(op) : isPure(op));
}

/// Sides that are seldom taken are left where they are.
static bool isSeldom(Operation *op, Region &region) {
  constexpr double least = 0.1;
  if (region
          .walk([](Operation *inner) {
            return inner->hasTrait<Failure>() ? WalkResult::interrupt()
                                              : WalkResult::advance();
          })
          .wasInterrupted())
    return true; // as a fallback is
  std::optional<double> probability;
  if (auto choice = dyn_cast<scf::IfOp>(op))
    probability = getProbability(choice, region);
  else if (auto choice = dyn_cast<scf::IndexSwitchOp>(op))
    probability = getProbability(choice, region);
  return probability && *probability < least;
}

bool Distributor::varies(Operation *op) {
  return llvm::any_of(op->getOperands(), [&](Value part) {
    return part == loop.getInductionVar() ||
           varying.contains(part.getDefiningOp());
  });
}

void Distributor::findMoved(Block &block, bool isSure) {
  for (Operation &op : block.without_terminator()) {
    if (mayMove(&op, isSure)) {
      moved.insert(&op);
      if (varies(&op))
        varying.insert(&op);
      if (isa<ItemOp>(op) || llvm::any_of(op.getOperands(), [&](Value part) {
            return ofPrimitive.contains(part.getDefiningOp());
          }))
        ofPrimitive.insert(&op);
    }
    if (isa<scf::IfOp, scf::IndexSwitchOp>(op))
      for (Region &region : op.getRegions())
        if (!region.empty() && !isSeldom(&op, region))
          findMoved(region.front(), /*isSure=*/false);
  }
}

bool Distributor::isCopied(Value value) const {
  Operation *op = value.getDefiningOp();
  if (isa<ItemOp, GetOp>(op) || !ofPrimitive.contains(op))
    return true;
  bool isCast =
      isa<arith::ExtSIOp, arith::ExtUIOp, arith::TruncIOp, arith::IndexCastOp,
          arith::IndexCastUIOp, arith::BitcastOp>(op);
  return isCast && moved.contains(op->getOperand(0).getDefiningOp()) &&
         isCopied(op->getOperand(0));
}

void Distributor::findResults() {
  for (Operation *op : moved)
    for (Value result : op->getResults())
      if (!isCopied(result) &&
          llvm::any_of(result.getUsers(),
                       [&](Operation *user) { return !moved.contains(user); }))
        results[result];
}

SmallVector<Operation *> Distributor::findSlice() const {
  llvm::DenseSet<Operation *> needed;
  SmallVector<Value> work = llvm::to_vector(llvm::make_first_range(results));
  while (!work.empty()) {
    Operation *op = work.pop_back_val().getDefiningOp();
    if (op && moved.contains(op) && needed.insert(op).second)
      llvm::append_range(work, op->getOperands());
  }
  return llvm::filter_to_vector(
      moved, [&](Operation *op) { return needed.contains(op); });
}

//===----------------------------------------------------------------------===//
// Two loops
//===----------------------------------------------------------------------===//

/// Lanes store no truth values, and narrow numbers one by one.
static Type getTableType(Type type) {
  bool isNarrow = type.isInteger() && type.getIntOrFloatBitWidth() < 32;
  return isNarrow ? IntegerType::get(type.getContext(), 32) : type;
}

void Distributor::createTables() {
  llvm::MapVector<Type, SmallVector<Value>> ofType;
  for (Value result : llvm::make_first_range(results))
    ofType[getTableType(result.getType())].push_back(result);
  for (auto &[type, values] : ofType) {
    auto count = static_cast<int64_t>(values.size());
    arrays.push_back(memref::AllocaOp::create(
        builder, at.loc, MemRefType::get({laneCount * count}, type),
        builder.getI64IntegerAttr(lineSize)));
    for (auto [number, value] : llvm::enumerate(values))
      results[value] = {arrays.back(), laneCount * int64_t(number)};
  }
}

scf::ForOp Distributor::writeFirst(Value lower, Value upper) {
  auto first = scf::ForOp::create(builder, at.loc, lower, upper, at.index(1));
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(first.getBody());
  Value place = at.sub(first.getInductionVar(), lower);
  IRMapping mapping;
  mapping.map(loop.getInductionVar(), first.getInductionVar());
  for (Operation *op : findSlice()) {
    Operation *copy = builder.clone(*op, mapping);
    for (auto [result, made] :
         llvm::zip(op->getResults(), copy->getResults())) {
      auto *found = results.find(result);
      if (found == results.end())
        continue;
      Type type = getTableType(made.getType());
      Value value = made;
      if (type != made.getType())
        value = arith::ExtUIOp::create(builder, at.loc, type, value);
      const Table &table = found->second;
      at.store(value, table.array, at.add(place, at.index(table.begin)));
    }
  }
  return first;
}

bool Distributor::isWorthwhile(const IterationLanes &lanes) {
  if (lanes.getRefusal().at)
    return false;
  // Estimates may be wrong, and a bin's last primitives fill no vector.
  constexpr double share = 0.6;
  IterationLanes::Cost cost = lanes.getCost();
  const Cycles &cycles = getCycles(laneCount);
  double tabled = double(results.size()) * cycles.scalarAccess;
  // Every second primitive comes to what a condition guards.
  SmallVector<Operation *> slice = findSlice();
  auto guarded = double(llvm::count_if(slice, [&](Operation *op) {
    return op->getParentOp() != loop.getOperation();
  }));
  double taken = 1 - 0.5 * guarded / double(slice.size());
  return cost.vectors + tabled < share * taken * (cost.serial - tabled);
}

/// A table has a place for each lane: those that have no primitive write, too.
static void storeAllLanes(Operation *root, ArrayRef<Value> arrays) {
  root->walk([&](vector::MaskedStoreOp store) {
    if (!llvm::is_contained(arrays, store.getBase()))
      return;
    OpBuilder builder(store);
    vector::StoreOp::create(builder, store.getLoc(), store.getValueToStore(),
                            store.getBase(), store.getIndices());
    store.erase();
  });
}

/// Few primitives take less one by one.
void Distributor::writeVectors(const IterationLanes &lanes, Value lower,
                               Value upper) {
  scf::ForOp first = lanes.getLoop();
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPoint(first);
  int64_t few = std::max<int64_t>(laneCount / 4, 2);
  Value isMany =
      at.compare(CodeBuilder::P::sge, at.sub(upper, lower), at.index(few));
  auto choice = scf::IfOp::create(builder, at.loc, isMany, /*withElse=*/true);
  builder.setInsertionPointToStart(choice.thenBlock());
  IterationWriter(lanes).write(builder.saveInsertionPoint());
  storeAllLanes(choice, arrays);
  first->moveBefore(choice.elseBlock(), choice.elseBlock()->begin());
}

/// The innermost block around all uses that is in no loop inside of `block`.
static Block *findUses(Value value, Block *block) {
  while (true) {
    Operation *around = nullptr;
    Region *region = nullptr;
    for (Operation *user : value.getUsers()) {
      Operation *here = block->findAncestorOpInBlock(*user);
      if (!here || here == user || (around && here != around) ||
          !isa<scf::IfOp, scf::IndexSwitchOp>(here))
        return block;
      Region *side = user->getParentRegion();
      while (side->getParentOp() != here)
        side = side->getParentOp()->getParentRegion();
      if (region && side != region)
        return block;
      around = here;
      region = side;
    }
    block = &region->front();
  }
}

static Operation *findFirstUse(Value value, Block *block) {
  Operation *first = nullptr;
  for (Operation *user : value.getUsers()) {
    Operation *here = block->findAncestorOpInBlock(*user);
    if (!first || here->isBeforeInBlock(first))
      first = here;
  }
  return first;
}

void Distributor::readTables(Value lower) {
  // What moved, and is not read again, has no uses from now on.
  SmallVector<std::pair<Value, Table>> values;
  for (auto [result, table] : results) {
    // All uses by one value, whose place is then found.
    auto stub = UnrealizedConversionCastOp::create(
        builder, at.loc, result.getType(), ValueRange());
    Value(result).replaceUsesWithIf(stub.getResult(0), [&](OpOperand &use) {
      return !moved.contains(use.getOwner()) &&
             loop->isAncestor(use.getOwner());
    });
    values.emplace_back(stub.getResult(0), table);
  }
  eraseMoved();
  for (auto [value, table] : values) {
    Operation *stub = value.getDefiningOp();
    if (!value.use_empty()) {
      builder.setInsertionPoint(
          findFirstUse(value, findUses(value, loop.getBody())));
      Value place = at.sub(loop.getInductionVar(), lower);
      Value read = at.load(table.array, at.add(place, at.index(table.begin)));
      if (read.getType() != value.getType())
        read = arith::TruncIOp::create(builder, at.loc, value.getType(), read);
      value.replaceAllUsesWith(read);
    }
    stub->erase();
  }
}

void Distributor::eraseMoved() {
  for (Operation *op : llvm::reverse(moved))
    if (op->use_empty())
      op->erase();
}

void Distributor::run() {
  if (!loop.getInductionVar().getType().isIndex() || loop.getUnsignedCmp())
    return;
  moveLoopInvariantCode(loop);
  findMoved(*loop.getBody(), /*isSure=*/true);
  findResults();
  if (results.empty())
    return;
  builder.setInsertionPoint(loop);
  Value begin = loop.getLowerBound(), end = loop.getUpperBound();
  createTables();
  auto blocks =
      scf::ForOp::create(builder, at.loc, begin, end, at.index(laneCount));
  builder.setInsertionPointToStart(blocks.getBody());
  Value lower = blocks.getInductionVar();
  Value after =
      arith::AddIOp::create(builder, at.loc, lower, at.index(laneCount),
                            arith::IntegerOverflowFlags::nsw);
  Value upper = at.min(after, end);
  scf::ForOp first = writeFirst(lower, upper);
  IterationLanes lanes(first, laneCount);
  if (!isWorthwhile(lanes)) {
    blocks.erase();
    for (Value array : arrays)
      array.getDefiningOp()->erase();
    return;
  }
  writeVectors(lanes, lower, upper);
  loop->moveBefore(blocks.getBody()->getTerminator());
  loop.setLowerBound(lower);
  loop.setUpperBound(upper);
  builder.setInsertionPoint(loop);
  readTables(lower);
  remarkStage(loop) << "what follows from a primitive before the loops of "
                       "its iteration is computed for "
                    << laneCount << " primitives at once";
}

void DistributeLoopsPass::runOnOperation() {
  if (!llvm::is_contained({4, 8, 16}, laneCount)) {
    getOperation().emitError("expected 4, 8 or 16 lanes, but got ")
        << int64_t(laneCount);
    return signalPassFailure();
  }
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
    SmallVector<scf::ForOp> loops;
    kernel.walk([&](scf::ForOp loop) {
      if (isOverPrimitives(loop) && !hasSpecifiedLanes(loop, LaneMapping::One))
        loops.push_back(loop);
    });
    for (scf::ForOp loop : loops)
      Distributor(loop, laneCount, written).run();
  }
}
