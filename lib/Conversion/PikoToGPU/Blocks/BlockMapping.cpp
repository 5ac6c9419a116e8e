// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a block do. All of them go the same way through a block's
// work, but for the bodies of loops that they share:
//   1. what lies between shared loops and has effects is the first thread's,
//      between two barriers; numbers from there that others need go through
//      shared memory;
//   2. a shared loop steps by the number of threads, between two barriers; one
//      over primitives that the first thread does in order is cut into rounds;
//   3. iterations that meet at barriers are threads (BarrierLoops.cpp);
//   4. arrays that more than one thread sees are in shared memory.
// What threads emit is in their append buffers; the block takes it (a flush)
// after each round of a loop, so that it is in the order of iterations, and no
// join has to follow more than a round's by one thread. What iterations of a
// cut loop emit is in append buffers of their own until its end.
//
// One class, and so one file: all four share the variables in shared memory and
// the barriers.

#include "PikoToGPU/Blocks/BlockMapping.h"
#include "PikoToGPU/Blocks/WorkQueue.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

namespace {

class BlockMapper {
public:
  explicit BlockMapper(GridMemory &memory)
      : launch(memory.launch), log(memory.log), memory(memory),
        loc(memory.launch.getLoc()) {
    threads.ownArrays.insert(memory.buffers.getDefiningOp());
  }
  LogicalResult run();

private:
  LogicalResult mapBlock(Block &block);
  LogicalResult mapOperation(Operation *op);
  LogicalResult mapRun(ArrayRef<Operation *> run);
  void share(scf::ForOp loop);
  LogicalResult mapIterations(ParallelForOp loop);
  void beginQueues();
  void shareInRounds(scf::ForOp loop, DrainOp drain);
  bool isCut(Operation *op) const;
  void doInRounds(scf::ForOp loop);
  LogicalResult mapLocalBin(LocalBinOp local);
  void clearStates(OpBuilder &builder, Value words);
  void reorderIterations(ReorderBeginOp begin);
  void reorder(ReorderIterationOp iteration, Value states, Value has);
  void endReordering(ReorderEndOp end);
  /// Copies the append buffers of a thread, or of an iteration, whose words
  /// begin at `at`.
  void copyAppendBuffers(OpBuilder &builder, Value from, Value fromAt, Value to,
                         Value toAt);
  Value createOwn(MemRefType type);
  void mapScratch(ScratchOp scratch);
  FailureOr<Value> broadcast(Value value, OpBuilder &inside, OpBuilder &after);
  LogicalResult placeArrays();
  /// An array of the block, where the body begins.
  Value createBlockArray(memref::AllocaOp array);

  Value constant(OpBuilder &builder, int64_t value) {
    return arith::ConstantIndexOp::create(builder, loc, value);
  }
  scf::IfOp createFirst(OpBuilder &builder) {
    Value isFirst =
        arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                              launch.getThreadIds().x, constant(builder, 0));
    auto first = scf::IfOp::create(builder, loc, isFirst);
    firsts.insert(first);
    return first;
  }
  Value addVariable(Type type) { return addSharedMemory(launch, 1, type); }

  gpu::LaunchOp launch;
  Value log;
  GridMemory &memory;
  Location loc;
  llvm::DenseSet<Operation *> firsts;
  ThreadOperations threads; ///< What threads have of their own.
  int64_t blockBytes = 0;
  SmallVector<DrainOp> drains; ///< Whose work is in its loop's rounds.
  /// Of the loop whose emissions are reordered: append buffers of its
  /// iterations, how many, whether there is memory for them, and where a
  /// thread's own wait.
  Value states, iterations, hasStates, own;
};

} // namespace

/// What adds to an append buffer.
static bool isEmission(Operation *op) {
  return isa<AppendOp, AppendBinOp, NextOp>(op) || op->hasTrait<Failure>();
}

/// What is to be seen after each round of a shared loop.
static bool isOfRound(Operation *op) {
  return isEmission(op) || isa<LeaveRoundOp>(op);
}

/// What all threads take part in.
static bool isShared(Operation *op) {
  return isa<ScratchOp, ReorderBeginOp, ReorderEndOp, LocalBinOp, ParallelForOp,
             DrainOp>(op) ||
         op->hasAttr(marks::shared);
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

/// What a thread has of its own.
static bool isLocalArray(Operation *op) {
  return isa<memref::AllocaOp, AppendBuffersOp>(op);
}

//===----------------------------------------------------------------------===//
// What the first thread does
//===----------------------------------------------------------------------===//

static int64_t getByteSize(Type type) {
  if (type.isIndex())
    return 8;
  return llvm::PowerOf2Ceil((type.getIntOrFloatBitWidth() + 7) / 8);
}

FailureOr<Value> BlockMapper::broadcast(Value value, OpBuilder &inside,
                                        OpBuilder &after) {
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
  Value variable = addVariable(sent.getType());
  blockBytes += getByteSize(sent.getType());
  memref::StoreOp::create(inside, loc, sent, variable, constant(inside, 0));
  Value received =
      memref::LoadOp::create(after, loc, variable, constant(after, 0));
  if (isPrim)
    received = FromAddressOp::create(after, value.getLoc(), type, received);
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
    bool isForAll = contains(
        &op, [&](Operation *inner) { return isShared(inner) || isCut(inner); });
    if (!isEnd && !isForAll) {
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
  if (op->hasAttr(marks::shared)) {
    share(cast<scf::ForOp>(op));
    return success();
  }
  if (isCut(op)) {
    doInRounds(cast<scf::ForOp>(op));
    return success();
  }
  if (isa<DrainOp>(op))
    return success(); // the loop's before it, which is shared
  if (auto loop = dyn_cast<ParallelForOp>(op))
    return mapIterations(loop);
  if (auto scratch = dyn_cast<ScratchOp>(op)) {
    mapScratch(scratch);
    return success();
  }
  if (auto begin = dyn_cast<ReorderBeginOp>(op)) {
    reorderIterations(begin);
    return success();
  }
  if (auto end = dyn_cast<ReorderEndOp>(op)) {
    endReordering(end);
    return success();
  }
  if (auto local = dyn_cast<LocalBinOp>(op))
    return mapLocalBin(local);
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

/// All threads come to the end of a round, whether they have an iteration or
/// not.
void BlockMapper::shareInRounds(scf::ForOp loop, DrainOp drain) {
  OpBuilder builder(loop);
  Value begin = loop.getLowerBound(), end = loop.getUpperBound();
  Type type = begin.getType();
  auto rounds = scf::ForOp::create(
      builder, loc, begin, end, castTo(builder, launch.getBlockSizeX(), type));
  builder.setInsertionPointToStart(rounds.getBody());
  Value at =
      arith::AddIOp::create(builder, loc, rounds.getInductionVar(),
                            castTo(builder, launch.getThreadIds().x, type));
  Value has =
      arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt, at, end);
  auto ifOp = scf::IfOp::create(builder, loc, has);
  threads.ofOne.insert(ifOp);
  loop.getInductionVar().replaceAllUsesWith(at);
  loop.getBody()->getTerminator()->erase();
  ifOp.thenBlock()->getOperations().splice(
      ifOp.thenBlock()->getTerminator()->getIterator(),
      loop.getBody()->getOperations());
  memory.flush(builder);
  if (Attribute rest = loop->getAttr(marks::rest))
    rounds->setAttr(marks::rest, rest);
  if (drain) {
    Value next = arith::AddIOp::create(builder, loc, rounds.getInductionVar(),
                                       rounds.getStep());
    Value isLast = arith::CmpIOp::create(builder, loc,
                                         arith::CmpIPredicate::sge, next, end);
    threads.ofOne.insert(drainQueue(drain, builder, isLast));
    drains.push_back(drain);
  }
  loop.erase();
}

/// Nothing is in the queues where a block begins.
void BlockMapper::beginQueues() {
  OpBuilder builder(launch.getContext());
  builder.setInsertionPointAfter(memory.buffers.getDefiningOp());
  for (DrainOp drain : drains) {
    clearQueue(builder, drain);
    drain.erase();
  }
}

/// Whether the first thread does a loop in rounds: what it uses of those before
/// can go through shared memory.
bool BlockMapper::isCut(Operation *op) const {
  if (!op->hasAttr(marks::ordered) || op->getNumResults() > 0 ||
      !contains(op, isEmission) || contains(op, isShared))
    return false;
  llvm::SetVector<Value> used;
  getUsedValuesDefinedAbove(op->getRegions(), used);
  return llvm::all_of(used, [&](Value value) {
    Operation *made = value.getDefiningOp();
    return value.getType().isIntOrIndexOrFloat() ||
           isa<PrimType>(value.getType()) || !made ||
           !launch->isAncestor(made) || isLocalArray(made) ||
           isMemoryEffectFree(made);
  });
}

void BlockMapper::doInRounds(scf::ForOp loop) {
  constexpr int64_t iterations = 32;
  OpBuilder builder(loop);
  Type type = loop.getInductionVar().getType();
  Value size = arith::MulIOp::create(
      builder, loc, loop.getStep(),
      castTo(builder, constant(builder, iterations), type));
  auto rounds = scf::ForOp::create(builder, loc, loop.getLowerBound(),
                                   loop.getUpperBound(), size);
  builder.setInsertionPointToStart(rounds.getBody());
  Value begin = rounds.getInductionVar();
  Value end = arith::AddIOp::create(builder, loc, begin, size);
  end = arith::MinSIOp::create(builder, loc, end, loop.getUpperBound());
  loop->removeAttr(marks::ordered);
  loop->moveBefore(createFirst(builder).thenBlock()->getTerminator());
  loop.setLowerBound(begin);
  loop.setUpperBound(end);
  memory.flush(builder);
}

void BlockMapper::share(scf::ForOp loop) {
  loop->removeAttr(marks::shared);
  auto drain = dyn_cast_or_null<DrainOp>(loop->getNextNode());
  OpBuilder builder(loop);
  gpu::BarrierOp::create(builder, loc);
  builder.setInsertionPointAfter(loop);
  gpu::BarrierOp::create(builder, loc);
  if (drain ||
      (!loop->removeAttr(marks::reordered) && contains(loop, isOfRound)))
    return shareInRounds(loop, drain);
  threads.ofOne.insert(loop);
  builder.setInsertionPoint(loop);
  Type type = loop.getInductionVar().getType();
  Value begin =
      arith::AddIOp::create(builder, loc, loop.getLowerBound(),
                            castTo(builder, launch.getThreadIds().x, type));
  loop.setLowerBound(begin);
  loop.setStep(castTo(builder, launch.getBlockSizeX(), type));
}

LogicalResult BlockMapper::mapIterations(ParallelForOp loop) {
  OpBuilder builder(loop);
  gpu::BarrierOp::create(builder, loc);
  bool emits = contains(loop, isEmission);
  Operation *next = loop->getNextNode();
  if (failed(piko::mapIterations(loop, launch, threads)))
    return failure();
  builder.setInsertionPoint(next);
  if (emits)
    memory.flush(builder);
  return success();
}

/// The block takes what is read there, and forgets it after its last reader.
LogicalResult BlockMapper::mapLocalBin(LocalBinOp local) {
  OpBuilder builder(local);
  memory.flush(builder);
  if (failed(mapBlock(*local.getBodyBlock())))
    return failure();
  builder.setInsertionPointAfter(local);
  gpu::BarrierOp::create(builder, loc);
  if (local->removeAttr(marks::again))
    return success();
  scf::IfOp first = createFirst(builder);
  OpBuilder inside = first.getThenBodyBuilder();
  memory.setLocalCount(inside, local,
                       arith::ConstantIntOp::create(inside, loc, 0, 64));
  gpu::BarrierOp::create(builder, loc);
  return success();
}

//===----------------------------------------------------------------------===//
// Iterations whose emissions wait
//===----------------------------------------------------------------------===//

Value BlockMapper::createOwn(MemRefType type) {
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  auto array = memref::AllocaOp::create(builder, loc, type);
  threads.ownArrays.insert(array);
  return array;
}

void BlockMapper::copyAppendBuffers(OpBuilder &builder, Value from,
                                    Value fromAt, Value to, Value toAt) {
  for (int64_t i = 0, e = memory.getWords(); i < e; ++i) {
    auto place = [&](Value at) -> Value {
      Value which = constant(builder, i);
      return at ? arith::AddIOp::create(builder, loc, at, which).getResult()
                : which;
    };
    Value word = memref::LoadOp::create(builder, loc, from, place(fromAt));
    memref::StoreOp::create(builder, loc, word, to, place(toAt));
  }
}

/// All threads of the block make the append buffers of iterations empty, as
/// what the log gives holds what was there.
void BlockMapper::clearStates(OpBuilder &builder, Value words) {
  OpBuilder then =
      scf::IfOp::create(builder, loc, hasStates).getThenBodyBuilder();
  auto loop = scf::ForOp::create(then, loc, launch.getThreadIds().x, words,
                                 launch.getBlockSizeX());
  OpBuilder inside = OpBuilder::atBlockBegin(loop.getBody());
  Value empty = arith::ConstantIntOp::create(inside, loc, 0, 64);
  memref::StoreOp::create(inside, loc, empty, states, loop.getInductionVar());
  gpu::BarrierOp::create(builder, loc);
}

void BlockMapper::reorderIterations(ReorderBeginOp begin) {
  OpBuilder builder(begin);
  iterations = begin.getIterations();
  memory.flush(builder);
  Value bytes = arith::MulIOp::create(builder, loc, iterations,
                                      constant(builder, 8 * memory.getWords()));
  Value variable = addVariable(builder.getIndexType());
  scf::IfOp first = createFirst(builder);
  OpBuilder inside = first.getThenBodyBuilder();
  Value taken =
      AllocateOp::create(inside, loc, inside.getIndexType(), log, bytes);
  memref::StoreOp::create(inside, loc, taken, variable, constant(inside, 0));
  gpu::BarrierOp::create(builder, loc);
  Value zero = constant(builder, 0);
  Value address = memref::LoadOp::create(builder, loc, variable, zero);
  hasStates = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                    address, zero);
  auto plain = MemRefType::get({ShapedType::kDynamic}, builder.getI8Type());
  Value all = BytesAtOp::create(builder, loc, plain, address, bytes);
  auto type = MemRefType::get({ShapedType::kDynamic}, builder.getI64Type());
  Value words = arith::MulIOp::create(builder, loc, iterations,
                                      constant(builder, memory.getWords()));
  states = memref::ViewOp::create(builder, loc, type, all, zero, words);
  clearStates(builder, words);
  own = createOwn(MemRefType::get({memory.getWords()}, builder.getI64Type()));
  SmallVector<ReorderIterationOp> reordered;
  for (Operation *op = begin; op && !isa<ReorderEndOp>(op);
       op = op->getNextNode())
    op->walk(
        [&](ReorderIterationOp iteration) { reordered.push_back(iteration); });
  for (ReorderIterationOp iteration : reordered)
    reorder(iteration, states, hasStates);
  begin.erase();
}

/// From here to the end of its body a loop's iteration has its own append
/// buffers.
void BlockMapper::reorder(ReorderIterationOp iteration, Value states,
                          Value has) {
  iteration->getParentOp()->setAttr(marks::reordered,
                                    UnitAttr::get(launch.getContext()));
  OpBuilder builder(iteration);
  Value at = arith::MulIOp::create(builder, loc, iteration.getIteration(),
                                   constant(builder, memory.getWords()));
  OpBuilder inside = scf::IfOp::create(builder, loc, has).getThenBodyBuilder();
  copyAppendBuffers(inside, memory.buffers, {}, own, {});
  copyAppendBuffers(inside, states, at, memory.buffers, {});
  builder.setInsertionPoint(iteration->getBlock()->getTerminator());
  inside = scf::IfOp::create(builder, loc, has).getThenBodyBuilder();
  copyAppendBuffers(inside, memory.buffers, {}, states, at);
  copyAppendBuffers(inside, own, {}, memory.buffers, {});
  iteration.erase();
}

void BlockMapper::endReordering(ReorderEndOp end) {
  OpBuilder builder(end);
  copyAppendBuffers(builder, memory.buffers, {}, own, {});
  auto rounds = scf::ForOp::create(builder, loc, constant(builder, 0),
                                   iterations, launch.getBlockSizeX());
  OpBuilder inside = OpBuilder::atBlockBegin(rounds.getBody());
  Value at = arith::AddIOp::create(inside, loc, rounds.getInductionVar(),
                                   launch.getThreadIds().x);
  Value runs = arith::CmpIOp::create(inside, loc, arith::CmpIPredicate::slt, at,
                                     iterations);
  runs = arith::AndIOp::create(inside, loc, runs, hasStates);
  auto ifOp = scf::IfOp::create(inside, loc, runs, /*withElseRegion=*/true);
  OpBuilder then = ifOp.getThenBodyBuilder(), none = ifOp.getElseBodyBuilder();
  Value words =
      arith::MulIOp::create(then, loc, at, constant(then, memory.getWords()));
  copyAppendBuffers(then, states, words, memory.buffers, {});
  memory.clearAppendBuffers(none);
  memory.flush(inside);
  copyAppendBuffers(builder, own, {}, memory.buffers, {});
  end.erase();
}

//===----------------------------------------------------------------------===//
// Memory
//===----------------------------------------------------------------------===//

/// The block keeps what it once has, for all that it does: it takes more where
/// that is not enough.
void BlockMapper::mapScratch(ScratchOp scratch) {
  Value address = addVariable(IndexType::get(launch.getContext())),
        room = addVariable(IndexType::get(launch.getContext()));
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
      blockBytes + bytes <= maxSharedBytes / 2) {
    blockBytes += bytes;
    return addSharedMemory(launch, type.getShape(), type.getElementType());
  }
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  Value address = addVariable(builder.getIndexType());
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
    if (threads.ownArrays.contains(array))
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
    if (isa<ScratchMarkOp, ScratchReleaseOp>(op))
      dropped.push_back(op);
  });
  for (Operation *op : llvm::reverse(dropped))
    op->erase();
  if (failed(mapBlock(launch.getBody().front())) || failed(placeArrays()))
    return failure();
  beginQueues();
  launch.walk([](scf::ForOp loop) { loop->removeAttr(marks::ordered); });
  return success();
}

LogicalResult piko::mapBlock(GridMemory &memory) {
  return BlockMapper(memory).run();
}
