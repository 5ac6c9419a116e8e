// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a block do. All of them go the same way through a block's
// work, but for the bodies of loops that they share:
//   1. what lies between shared loops and has effects is the first thread's,
//      between two barriers; numbers from there that others need go through the
//      block's memory;
//   2. a shared loop steps by the number of threads, between two barriers;
//   3. iterations that meet at barriers are threads (BarrierLoops.cpp);
//   4. arrays that more than one thread sees are in the block's memory.
// The order of what is emitted: the step (of what the first thread does, and of
// each shared loop), the iteration, the piece of a loop that was cut at
// barriers, and the number of the entry.

#include "PikoToGPU.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

namespace {

class BlockMapper {
public:
  BlockMapper(gpu::LaunchOp launch, Value log, Value order,
              MappingCounts &counts)
      : launch(launch), log(log), order(order), loc(launch.getLoc()),
        counts(counts) {}
  LogicalResult run();

private:
  enum { step = 0, iteration = 1, piece = 2, ordinal = 3 };

  LogicalResult mapBlock(Block &block);
  LogicalResult mapOperation(Operation *op);
  LogicalResult mapRun(ArrayRef<Operation *> run);
  void share(scf::ForOp loop);
  LogicalResult mapIterations(ParallelForOp loop);
  /// In front of what threads do together and may emit in.
  void beginOrder(OpBuilder &builder, Operation *loop, bool isDeferred);
  void mapScratch(ScratchOp scratch);
  FailureOr<Value> broadcast(Value value, OpBuilder &inside, OpBuilder &behind);
  LogicalResult placeArrays();
  /// An array of the block, where the body begins.
  Value createBlockArray(memref::AllocaOp array);

  Value constant(OpBuilder &builder, int64_t value) {
    return arith::ConstantIndexOp::create(builder, loc, value);
  }
  void setOrder(OpBuilder &builder, int64_t which, Value value) {
    if (value.getType().isIndex())
      value =
          arith::IndexCastOp::create(builder, loc, builder.getI64Type(), value);
    memref::StoreOp::create(builder, loc, value, order,
                            constant(builder, which));
  }
  void advanceOrder(OpBuilder &builder, int64_t which) {
    Value at = constant(builder, which);
    Value now = memref::LoadOp::create(builder, loc, order, at);
    Value one = arith::ConstantIntOp::create(builder, loc, 1, 64);
    setOrder(builder, which, arith::AddIOp::create(builder, loc, now, one));
  }
  scf::IfOp createFirst(OpBuilder &builder) {
    Value isFirst =
        arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                              launch.getThreadIds().x, constant(builder, 0));
    auto first = scf::IfOp::create(builder, loc, isFirst);
    first->setAttr(firstAttrName, builder.getUnitAttr());
    firsts.insert(first);
    return first;
  }
  Value addCell(Type type) { return addBlockMemory(launch, 1, type); }

  gpu::LaunchOp launch;
  Value log, order;
  Location loc;
  llvm::DenseSet<Operation *> firsts;
  ThreadOperations threads; ///< What threads have of their own.
  MappingCounts &counts;
  int64_t blockBytes = 0;
};

} // namespace

/// What adds to the log.
static bool isEmission(Operation *op) {
  return isa<AppendOp, AppendBinOp, NextOp>(op);
}

template <typename Predicate>
static bool contains(Operation *op, Predicate predicate) {
  return op
      ->walk([&](Operation *inner) {
        return predicate(inner) ? WalkResult::interrupt()
                                : WalkResult::advance();
      })
      .wasInterrupted();
}

/// What all threads take part in.
static bool isShared(Operation *op) {
  return isa<ScratchOp, DeferBeginOp, ParallelForOp>(op) ||
         op->hasAttr(sharedAttrName);
}

/// Whether an operation only reads, apart from arrays that it makes.
static bool onlyReads(Operation *op) {
  return !contains(op, [](Operation *inner) {
    if (inner->getNumRegions() &&
        inner->hasTrait<OpTrait::HasRecursiveMemoryEffects>())
      return false;
    return !isMemoryEffectFree(inner) &&
           !hasSingleEffect<MemoryEffects::Read>(inner);
  });
}

static bool isLocalArray(Operation *op) { return isa<memref::AllocaOp>(op); }

//===----------------------------------------------------------------------===//
// What the first thread does
//===----------------------------------------------------------------------===//

static int64_t getByteSize(Type type) {
  if (type.isIndex())
    return 8;
  return llvm::PowerOf2Ceil((type.getIntOrFloatBitWidth() + 7) / 8);
}

FailureOr<Value> BlockMapper::broadcast(Value value, OpBuilder &inside,
                                        OpBuilder &behind) {
  Type type = value.getType();
  bool isPrim = isa<PrimType>(type);
  if (!isPrim && !type.isIntOrIndexOrFloat())
    return emitError(value.getLoc())
           << "expected a number or a primitive to be passed from one thread "
              "to the others, but got type "
           << type;
  Value sent = value;
  if (isPrim)
    sent = ToAddressOp::create(inside, value.getLoc(), value);
  Value cell = addCell(sent.getType());
  blockBytes += getByteSize(sent.getType());
  memref::StoreOp::create(inside, loc, sent, cell, constant(inside, 0));
  Value received =
      memref::LoadOp::create(behind, loc, cell, constant(behind, 0));
  if (isPrim)
    received = FromAddressOp::create(behind, value.getLoc(), type, received);
  return received;
}

/// The operations of a run that the first thread does: from the first effect to
/// the last, but for what depends on none of them and reads nothing.
static llvm::SetVector<Operation *> takeEffects(ArrayRef<Operation *> run) {
  llvm::SetVector<Operation *> taken;
  auto isEffect = [](Operation *op) {
    return !isLocalArray(op) && !onlyReads(op);
  };
  auto *first = llvm::find_if(run, isEffect);
  auto last = llvm::find_if(llvm::reverse(run), isEffect).base();
  if (first == run.end())
    return taken;
  auto depends = [&](Operation *op) {
    return contains(op, [&](Operation *inner) {
      return llvm::any_of(inner->getOperands(), [&](Value operand) {
        return operand.getDefiningOp() &&
               taken.contains(operand.getDefiningOp());
      });
    });
  };
  for (Operation *op : llvm::make_range(first, last))
    if (!isLocalArray(op) && (!isMemoryEffectFree(op) || depends(op)))
      taken.insert(op);
  return taken;
}

LogicalResult BlockMapper::mapRun(ArrayRef<Operation *> run) {
  llvm::SetVector<Operation *> taken = takeEffects(run);
  if (taken.empty())
    return success();
  OpBuilder builder(taken.front());
  Operation *front = taken.front();
  for (Operation *op : run)
    if (front->isBeforeInBlock(op) && op->isBeforeInBlock(taken.back()) &&
        !taken.contains(op))
      op->moveBefore(front);
  if (llvm::any_of(taken,
                   [](Operation *op) { return contains(op, isEmission); }))
    advanceOrder(builder, step);
  gpu::BarrierOp::create(builder, loc);
  scf::IfOp first = createFirst(builder);
  for (Operation *op : taken)
    op->moveBefore(first.thenBlock()->getTerminator());
  builder.setInsertionPointAfter(first);
  gpu::BarrierOp::create(builder, loc);
  OpBuilder inside(first.thenBlock()->getTerminator());
  for (Operation *op : taken)
    for (Value result : op->getResults()) {
      auto isOutside = [&](OpOperand &use) {
        return !first->isProperAncestor(use.getOwner());
      };
      if (llvm::none_of(result.getUses(), isOutside))
        continue;
      FailureOr<Value> received = broadcast(result, inside, builder);
      if (failed(received))
        return failure();
      result.replaceUsesWithIf(*received, isOutside);
    }
  return success();
}

//===----------------------------------------------------------------------===//
// What threads share
//===----------------------------------------------------------------------===//

LogicalResult BlockMapper::mapBlock(Block &block) {
  SmallVector<Operation *> run;
  for (Operation &op : llvm::make_early_inc_range(block)) {
    bool isEnd = &op == &block.back() && block.mightHaveTerminator();
    if (!isEnd && !contains(&op, isShared)) {
      run.push_back(&op);
      continue;
    }
    if (failed(mapRun(run)))
      return failure();
    run.clear();
    if (!isEnd && failed(mapOperation(&op)))
      return failure();
  }
  return mapRun(run);
}

LogicalResult BlockMapper::mapOperation(Operation *op) {
  OpBuilder builder(op);
  if (op->hasAttr(sharedAttrName)) {
    share(cast<scf::ForOp>(op));
    return success();
  }
  if (auto loop = dyn_cast<ParallelForOp>(op))
    return mapIterations(loop);
  if (auto scratch = dyn_cast<ScratchOp>(op)) {
    mapScratch(scratch);
    return success();
  }
  if (isa<DeferBeginOp>(op)) {
    advanceOrder(builder, step);
    op->erase();
    return success();
  }
  if (!isa<scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp>(op))
    return op->emitOpError("expected loops that threads share inside scf.if, "
                           "scf.for, scf.while or scf.index_switch only");
  for (Region &region : op->getRegions())
    for (Block &block : region)
      if (failed(mapBlock(block)))
        return failure();
  return success();
}

/// A number as another integer type: loops over pixels count in 32 bits.
static Value castTo(OpBuilder &builder, Value value, Type type) {
  if (value.getType() == type)
    return value;
  return arith::IndexCastOp::create(builder, value.getLoc(), type, value);
}

void BlockMapper::beginOrder(OpBuilder &builder, Operation *loop,
                             bool isDeferred) {
  if (!contains(loop, isEmission))
    return;
  if (!isDeferred)
    advanceOrder(builder, step);
  advanceOrder(builder, piece);
}

void BlockMapper::share(scf::ForOp loop) {
  loop->removeAttr(sharedAttrName);
  threads.ofOne.insert(loop);
  ++counts.shared;
  OpBuilder builder(loop);
  auto deferred = llvm::to_vector(loop.getBody()->getOps<DeferIterationOp>());
  beginOrder(builder, loop, !deferred.empty());
  if (contains(loop, isEmission)) {
    OpBuilder inside = OpBuilder::atBlockBegin(loop.getBody());
    setOrder(inside, iteration,
             castTo(inside, loop.getInductionVar(), inside.getIndexType()));
    setOrder(inside, ordinal, constant(inside, 0));
  }
  for (DeferIterationOp defer : deferred)
    defer.erase(); // it is the loop's
  gpu::BarrierOp::create(builder, loc);
  Type type = loop.getInductionVar().getType();
  Value begin =
      arith::AddIOp::create(builder, loc, loop.getLowerBound(),
                            castTo(builder, launch.getThreadIds().x, type));
  loop.setLowerBound(begin);
  loop.setStep(castTo(builder, launch.getBlockSizeX(), type));
  builder.setInsertionPointAfter(loop);
  gpu::BarrierOp::create(builder, loc);
}

LogicalResult BlockMapper::mapIterations(ParallelForOp loop) {
  OpBuilder builder(loop);
  beginOrder(builder, loop, /*isDeferred=*/false);
  if (contains(loop, isEmission)) {
    setOrder(builder, iteration, launch.getThreadIds().x);
    setOrder(builder, ordinal, constant(builder, 0));
  }
  gpu::BarrierOp::create(builder, loc);
  return piko::mapIterations(loop, launch, threads);
}

/// The block keeps what it once has, for all that it does: it takes more where
/// that is not enough.
void BlockMapper::mapScratch(ScratchOp scratch) {
  Value address = addCell(IndexType::get(launch.getContext())),
        room = addCell(IndexType::get(launch.getContext()));
  blockBytes += 16;
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  scf::IfOp init = createFirst(builder);
  OpBuilder inside = init.getThenBodyBuilder();
  memref::StoreOp::create(inside, loc, constant(inside, 0), room,
                          constant(inside, 0));
  builder.setInsertionPoint(scratch);
  gpu::BarrierOp::create(builder, loc);
  scf::IfOp first = createFirst(builder);
  inside = first.getThenBodyBuilder();
  Value zero = constant(inside, 0), size = scratch.getSize();
  Value now = memref::LoadOp::create(inside, loc, room, zero);
  Value isSmall =
      arith::CmpIOp::create(inside, loc, arith::CmpIPredicate::ugt, size, now);
  auto grow = scf::IfOp::create(inside, loc, isSmall);
  inside = grow.getThenBodyBuilder();
  Value taken =
      AllocateOp::create(inside, loc, inside.getIndexType(), log, size);
  Value none =
      arith::CmpIOp::create(inside, loc, arith::CmpIPredicate::eq, taken, zero);
  memref::StoreOp::create(inside, loc, taken, address, zero);
  Value has = arith::SelectOp::create(inside, loc, none, zero, size);
  memref::StoreOp::create(inside, loc, has, room, zero);
  gpu::BarrierOp::create(builder, loc);
  zero = constant(builder, 0);
  Value at = memref::LoadOp::create(builder, loc, address, zero);
  now = memref::LoadOp::create(builder, loc, room, zero);
  Value granted =
      arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ule, size, now);
  Value bytes =
      BytesAtOp::create(builder, loc, scratch.getBytes().getType(), at, size);
  scratch.getBytes().replaceAllUsesWith(bytes);
  scratch.getGranted().replaceAllUsesWith(granted);
  scratch.erase();
}

//===----------------------------------------------------------------------===//
// Arrays
//===----------------------------------------------------------------------===//

Value BlockMapper::createBlockArray(memref::AllocaOp array) {
  MemRefType type = array.getType();
  int64_t bytes = type.getNumElements() * getByteSize(type.getElementType());
  bool isPlain = llvm::all_of(array->getUsers(), [](Operation *user) {
    return isa<memref::LoadOp, memref::StoreOp, memref::AtomicRMWOp>(user);
  });
  if (isPlain && type.getLayout().isIdentity() &&
      blockBytes + bytes <= maxBlockBytes / 2) {
    blockBytes += bytes;
    return addBlockMemory(launch, type.getShape(), type.getElementType());
  }
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  Value address = addCell(builder.getIndexType());
  blockBytes += 8;
  scf::IfOp first = createFirst(builder);
  OpBuilder inside = first.getThenBodyBuilder();
  Value taken = AllocateOp::create(inside, loc, inside.getIndexType(), log,
                                   constant(inside, bytes));
  memref::StoreOp::create(inside, loc, taken, address, constant(inside, 0));
  gpu::BarrierOp::create(builder, loc);
  Value zero = constant(builder, 0);
  Value at = memref::LoadOp::create(builder, loc, address, zero);
  auto plain = MemRefType::get({ShapedType::kDynamic}, builder.getI8Type());
  Value all =
      BytesAtOp::create(builder, loc, plain, at, constant(builder, bytes));
  Value whole = memref::ViewOp::create(
      builder, loc, MemRefType::get(type.getShape(), type.getElementType()),
      all, zero, ValueRange());
  // Without memory the block does nothing; the run ends with an error.
  Value granted =
      arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne, at, zero);
  auto rest = scf::IfOp::create(builder, loc, granted);
  Block &body = launch.getBody().front();
  rest.thenBlock()->getOperations().splice(
      std::prev(rest.thenBlock()->end()), body.getOperations(),
      std::next(rest->getIterator()), std::prev(body.end()));
  return whole;
}

LogicalResult BlockMapper::placeArrays() {
  SmallVector<memref::AllocaOp> arrays;
  launch.walk([&](memref::AllocaOp array) { arrays.push_back(array); });
  auto isOfOne = [&](Operation *op) {
    for (; op != launch; op = op->getParentOp())
      if (firsts.contains(op) || threads.ofOne.contains(op))
        return true;
    return false;
  };
  auto isFirstOnly = [&](Operation *op) {
    for (; op != launch; op = op->getParentOp())
      if (firsts.contains(op))
        return true;
    return false;
  };
  for (memref::AllocaOp array : arrays) {
    if (array.getResult() == order || threads.ownArrays.contains(array))
      continue;
    if (!array.getType().hasStaticShape())
      return array.emitOpError("expected an array of constant size");
    if (isOfOne(array) || llvm::all_of(array->getUsers(), isFirstOnly)) {
      // An alloca in a loop would take more memory each time around.
      Block &body = launch.getBody().front();
      array->moveBefore(&body, body.begin());
      continue;
    }
    Value shared = createBlockArray(array);
    array.getResult().replaceAllUsesWith(shared);
    array.erase();
  }
  return success();
}

LogicalResult BlockMapper::run() {
  // What is kept is given back at the end of the grid.
  SmallVector<Operation *> dropped;
  launch.walk([&](Operation *op) {
    if (isa<ScratchMarkOp, ScratchReleaseOp, DeferEndOp>(op))
      dropped.push_back(op);
  });
  for (Operation *op : llvm::reverse(dropped))
    op->erase();
  Block &body = launch.getBody().front();
  if (failed(mapBlock(body)))
    return failure();
  OpBuilder builder(launch);
  builder.setInsertionPointAfter(order.getDefiningOp());
  Value zero = arith::ConstantIntOp::create(builder, loc, 0, 64);
  for (int64_t which : {step, iteration, piece, ordinal})
    setOrder(builder, which, zero);
  // An iteration that runs alone.
  SmallVector<DeferIterationOp> alone;
  launch.walk([&](DeferIterationOp defer) { alone.push_back(defer); });
  for (DeferIterationOp defer : alone) {
    OpBuilder here(defer);
    setOrder(here, iteration, defer.getIteration());
    defer.erase();
  }
  return placeArrays();
}

LogicalResult piko::mapBlock(gpu::LaunchOp launch, Value log, Value order,
                             MappingCounts &counts) {
  return BlockMapper(launch, log, order, counts).run();
}
