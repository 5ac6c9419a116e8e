// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Parallel loops whose iterations are threads of a block:
//   1. what lies between barriers is done by the threads that have an
//      iteration, under a test; what lives across a barrier stays in their
//      registers;
//   2. a barrier is the block's;
//   3. control flow around barriers is taken by all threads of the block: what
//      decides about it is iteration 0's, which others compare theirs with
//      where it may differ;
//   4. reductions, scans and sorts are done by all, in shared memory. A
//      reduction takes log2(threads) steps, a scan twice as many. In a sort
//      each thread counts the keys that come before its own.

#include "PikoToGPU/Blocks/BlockMapping.h"

#include "Piko/Transforms/Storage/Collectives.h"
#include "Piko/Transforms/Storage/LoopSplitter.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/Support/MathExtras.h"

using namespace mlir;
using namespace piko;

namespace {

class IterationMapper : CodeBuilder {
public:
  IterationMapper(OpBuilder &builder, ParallelForOp loop, gpu::LaunchOp launch,
                  ThreadOperations &made)
      : CodeBuilder(builder, loop.getLoc()), loop(loop), launch(launch),
        made(made), uniformity(hoistInvariants(loop)) {}
  LogicalResult run();

private:
  LogicalResult map(Block &block);
  LogicalResult mapBarrier(Operation *op);
  LogicalResult mapFor(scf::ForOp op);
  void mapWhile(scf::WhileOp op, StringRef barrierName);
  /// Puts operations under a test of whether the thread runs an iteration.
  LogicalResult guard(ArrayRef<Operation *> run);
  /// Iteration 0's value, where `builder` stands. The barrier is the one that
  /// an iteration with another value would miss.
  Value agree(Value value, StringRef barrierName);
  void checkAgreement(Value value, Value first, StringRef barrier);
  void reduce(ReduceOp op);
  void scan(ScanOp op);
  void sort(SortOp op);
  /// For each distance 1, 2, 4, ..., or the other way round.
  void forEachDistance(bool falls, llvm::function_ref<void(Value)> body);
  /// For each distance s, in the iterations that are a multiple of 2s and have
  /// one so far after them, whose number `body` gets.
  void forEachPair(llvm::function_ref<void(Value)> body);
  SmallVector<Value> shareValues(ValueRange values);

  void barrier() { gpu::BarrierOp::create(builder, loc); }
  /// if (condition) body(), which the thread does alone
  void when(Value condition, llvm::function_ref<void()> body) {
    made.ofOne.insert(CodeBuilder::when(condition, body));
  }
  Value isActive() { return load(active, index(0)); }

  ParallelForOp loop;
  gpu::LaunchOp launch;
  ThreadOperations &made;
  Uniformity uniformity;
  StageOp stage;
  Value thread, count;
  Value active;  ///< Whether the thread runs an iteration; an array of one.
  Value stopped; ///< Whether iterations have not agreed; the block's.
};

} // namespace

//===----------------------------------------------------------------------===//
// What threads do alone
//===----------------------------------------------------------------------===//

/// What may be done without an iteration: it has no effect on anything, and
/// reads no primitive, of which there may be none so far on.
static bool isFree(Operation *op) {
  return op->getNumRegions() == 0 && isMemoryEffectFree(op) &&
         isSpeculatable(op) && !isa<GetOp, ItemOp>(op);
}

/// What a thread without an iteration has for a value, or null.
static Value createNothing(OpBuilder &builder, Location loc, Type type) {
  if (isa<PrimType>(type))
    return NoItemOp::create(builder, loc, type);
  if (!type.isIntOrIndexOrFloat())
    return {};
  return arith::ConstantOp::create(builder, loc,
                                   cast<TypedAttr>(builder.getZeroAttr(type)));
}

LogicalResult IterationMapper::guard(ArrayRef<Operation *> run) {
  SmallVector<Operation *> guarded;
  for (Operation *op : run) {
    if (isa<memref::AllocaOp>(op)) {
      op->moveBefore(&launch.getBody().front().front());
      made.ownArrays.insert(op);
    } else if (!guarded.empty() || !isFree(op)) {
      guarded.push_back(op);
    }
  }
  if (guarded.empty())
    return success();
  SmallVector<Value> leaving;
  for (Operation *op : guarded)
    for (Value result : op->getResults())
      if (llvm::any_of(result.getUsers(), [&](Operation *user) {
            return !llvm::is_contained(
                guarded, op->getBlock()->findAncestorOpInBlock(*user));
          }))
        leaving.push_back(result);
  builder.setInsertionPoint(guarded.front());
  auto ifOp = scf::IfOp::create(builder, loc, ValueRange(leaving).getTypes(),
                                isActive(), /*withElseRegion=*/true);
  made.ofOne.insert(ifOp);
  for (auto [value, result] : llvm::zip(leaving, ifOp.getResults())) {
    uniformity.replace(value, result);
    value.replaceUsesWithIf(result, [&](OpOperand &use) {
      return !llvm::is_contained(
          guarded, ifOp->getBlock()->findAncestorOpInBlock(*use.getOwner()));
    });
  }
  Block *then = ifOp.thenBlock();
  for (Operation *op : guarded)
    op->moveBefore(then,
                   leaving.empty() ? std::prev(then->end()) : then->end());
  builder.setInsertionPointToStart(ifOp.elseBlock());
  SmallVector<Value> nothing;
  for (Value value : leaving) {
    nothing.push_back(createNothing(builder, loc, value.getType()));
    if (!nothing.back())
      return emitError(value.getLoc(),
                       "expected a number, a primitive or a private array to "
                       "live across a barrier, but got type ")
             << value.getType();
  }
  if (!leaving.empty()) {
    scf::YieldOp::create(builder, loc, nothing);
    builder.setInsertionPointToEnd(then);
    scf::YieldOp::create(builder, loc, leaving);
  }
  return success();
}

LogicalResult IterationMapper::map(Block &block) {
  SmallVector<Operation *> run;
  for (Operation &op : llvm::make_early_inc_range(block.without_terminator())) {
    if (!findBarrier(&op)) {
      run.push_back(&op);
      continue;
    }
    if (failed(guard(run)))
      return failure();
    run.clear();
    builder.setInsertionPoint(&op);
    if (failed(mapBarrier(&op)))
      return failure();
  }
  return guard(run);
}

//===----------------------------------------------------------------------===//
// What all threads do
//===----------------------------------------------------------------------===//

LogicalResult IterationMapper::mapBarrier(Operation *op) {
  if (isa<SyncOp>(op))
    barrier();
  else if (auto reduction = dyn_cast<ReduceOp>(op))
    reduce(reduction);
  else if (auto scanning = dyn_cast<ScanOp>(op))
    scan(scanning);
  else if (auto sorting = dyn_cast<SortOp>(op))
    sort(sorting);
  if (isBarrier(op)) {
    if (!isa<SyncOp, ReduceOp, ScanOp, SortOp>(op))
      return op->emitOpError("expected piko.sync, piko.reduce, piko.scan or "
                             "piko.sort, which threads can meet at");
    op->erase();
    return success();
  }
  StringRef name = getBarrierName(op);
  if (auto choice = dyn_cast<scf::IfOp>(op)) {
    choice.getConditionMutable().assign(agree(choice.getCondition(), name));
  } else if (auto choice = dyn_cast<scf::IndexSwitchOp>(op)) {
    choice.getArgMutable().assign(agree(choice.getArg(), name));
  } else if (auto counted = dyn_cast<scf::ForOp>(op)) {
    if (failed(mapFor(counted)))
      return failure();
  } else if (!isa<scf::WhileOp>(op)) {
    InFlightDiagnostic error =
        findBarrier(op)->emitOpError("expected a barrier inside scf.if, "
                                     "scf.for, scf.while or scf.index_switch "
                                     "only, but got '")
        << op->getName() << "'";
    error.attachNote(op->getLoc()) << "the operation is here";
    return error;
  }
  for (Region &region : op->getRegions())
    for (Block &block : region)
      if (failed(map(block)))
        return failure();
  if (auto repeated = dyn_cast<scf::WhileOp>(op))
    mapWhile(repeated, name);
  return success();
}

Value IterationMapper::agree(Value value, StringRef barrierName) {
  if (!loop->isAncestor(value.getParentBlock()->getParentOp()))
    return value;
  Value cell = addSharedMemory(launch, 1, value.getType());
  Value zero = index(0);
  when(compare(P::eq, thread, zero), [&] { store(value, cell, zero); });
  barrier();
  Value first = load(cell, zero);
  if (uniformity.isVarying(value))
    checkAgreement(value, first, barrierName);
  barrier();
  return first;
}

/// What comes after such a barrier has no meaning, and is left out.
void IterationMapper::checkAgreement(Value value, Value first,
                                     StringRef barrierName) {
  Value zero = index(0);
  Value differs = both(isActive(), compare(P::ne, value, first));
  when(differs, [&] {
    store(boolean(true), stopped, zero);
    auto failure = FailBarrierOp::create(
        builder, loc, stage.getSymName(), thread,
        findBin(builder, builder.getInsertionBlock()->getParentOp()));
    failure->setAttr(cppNameAttr, builder.getStringAttr(barrierName));
  });
  barrier();
  when(load(stopped, zero), [&] { store(boolean(false), active, index(0)); });
}

/// Iterations may count from different numbers, but equally often.
LogicalResult IterationMapper::mapFor(scf::ForOp op) {
  Value lower = op.getLowerBound(), step = op.getStep();
  if (llvm::none_of(
          ValueRange{lower, op.getUpperBound(), step}, [&](Value bound) {
            return loop->isAncestor(bound.getParentBlock()->getParentOp());
          }))
    return success();
  SmallVector<Operation *> counting;
  Operation *before = op->getPrevNode();
  Value trips = createTripCount(builder, op);
  uniformity.replace(loop.getIteration(), trips);
  for (Operation *made = before ? before->getNextNode()
                                : &op->getBlock()->front();
       made != op; made = made->getNextNode())
    counting.push_back(made);
  auto none = UnrealizedConversionCastOp::create(builder, loc, trips.getType(),
                                                 trips); // keeps it alive
  if (failed(guard(counting)))
    return failure();
  builder.setInsertionPoint(op);
  Value agreed = agree(none.getOperand(0), getBarrierName(op));
  none.erase();
  op.setLowerBound(index(0));
  op.setUpperBound(agreed);
  op.setStep(index(1));
  op.setUnsignedCmp(false);
  Value trip = op.getInductionVar();
  Type type = trip.getType();
  OpBuilder::InsertionGuard insertion(builder);
  builder.setInsertionPointToStart(op.getBody());
  trip.setType(builder.getIndexType());
  Value number =
      type.isIndex()
          ? trip
          : Value(arith::IndexCastOp::create(builder, loc, type, trip));
  auto distance = arith::MulIOp::create(builder, loc, number, step);
  Value at = add(lower, distance);
  uniformity.replace(loop.getIteration(), at);
  trip.replaceUsesWithIf(at, [&](OpOperand &use) {
    Operation *user = use.getOwner();
    return user != distance && user != number.getDefiningOp();
  });
  return success();
}

void IterationMapper::mapWhile(scf::WhileOp op, StringRef barrierName) {
  scf::ConditionOp condition = op.getConditionOp();
  builder.setInsertionPoint(condition);
  Value agreed = agree(condition.getCondition(), barrierName);
  Value goesOn = arith::XOrIOp::create(builder, loc, load(stopped, index(0)),
                                       boolean(true));
  condition.getConditionMutable().assign(both(agreed, goesOn));
}

//===----------------------------------------------------------------------===//
// Collectives
//===----------------------------------------------------------------------===//

/// Arrays of the block with a value for each iteration.
SmallVector<Value> IterationMapper::shareValues(ValueRange values) {
  int64_t threads = *getConstantIntValue(launch.getBlockSizeX());
  SmallVector<Value> arrays = llvm::map_to_vector(values, [&](Value value) {
    return addSharedMemory(launch, threads, value.getType());
  });
  when(isActive(), [&] {
    for (auto [value, array] : llvm::zip(values, arrays))
      store(value, array, thread);
  });
  barrier();
  return arrays;
}

void IterationMapper::forEachDistance(bool falls,
                                      llvm::function_ref<void(Value)> body) {
  int64_t threads = *getConstantIntValue(launch.getBlockSizeX());
  int64_t levels = llvm::Log2_64(threads);
  auto counted =
      scf::ForOp::create(builder, loc, index(0), index(levels), index(1));
  OpBuilder::InsertionGuard insertion(builder);
  builder.setInsertionPointToStart(counted.getBody());
  Value level = counted.getInductionVar();
  if (falls)
    level = sub(index(levels - 1), level);
  body(arith::ShLIOp::create(builder, loc, index(1), level));
  barrier();
}

void IterationMapper::forEachPair(llvm::function_ref<void(Value)> body) {
  forEachDistance(/*falls=*/false, [&](Value s) {
    Value rest = both(thread, sub(add(s, s), index(1))), with = add(thread, s);
    Value combines =
        both(compare(P::eq, rest, index(0)), compare(P::slt, with, count));
    when(combines, [&] { body(with); });
  });
}

/// In the order of the language: at distance s, each multiple of 2s that has
/// another value so far on.
void IterationMapper::reduce(ReduceOp op) {
  SmallVector<Value> arrays = shareValues(op.getValues());
  Block &body = op.getBody().front();
  forEachPair([&](Value with) {
    store(createCombination(builder, loc, body, load(arrays, thread),
                            load(arrays, with)),
          arrays, thread);
  });
  SmallVector<Value> results = load(arrays, index(0));
  barrier(); // before the arrays are written again
  for (auto [from, to] : llvm::zip(op.getResults(), results))
    from.replaceAllUsesWith(to);
}

/// As on a CPU (Collectives.cpp): what is left of a pair waits in the slot of
/// its right, and then [0, j) is [0, j - s) and the block of j's lowest bit s.
void IterationMapper::scan(ScanOp op) {
  SmallVector<Value> arrays = shareValues(op.getValues());
  Block &body = op.getBody().front();
  Value runs = compare(P::slt, thread, count);
  forEachPair([&](Value with) {
    SmallVector<Value> left = load(arrays, thread), right = load(arrays, with);
    store(createCombination(builder, loc, body, left, right), arrays, thread);
    store(left, arrays, with);
  });
  forEachDistance(/*falls=*/true, [&](Value s) {
    Value rest = both(thread, sub(add(s, s), index(1)));
    Value isLowest = both(compare(P::eq, rest, s), compare(P::ne, thread, s));
    when(both(isLowest, runs), [&] {
      store(createCombination(builder, loc, body, load(arrays, sub(thread, s)),
                              load(arrays, thread)),
            arrays, thread);
    });
  });
  SmallVector<Value> before = load(arrays, thread);
  barrier();
  Value isFirst = compare(P::eq, thread, index(0));
  for (auto [result, empty, value] :
       llvm::zip(op.getResults(), op.getEmpty(), before)) {
    Value chosen = select(isFirst, empty, value);
    uniformity.replace(result, chosen);
    result.replaceAllUsesWith(chosen);
  }
}

/// A thread counts the keys that come before its own.
void IterationMapper::sort(SortOp op) {
  Value keys = shareValues(op.getKey()).front(), mine = op.getKey();
  int64_t threads = *getConstantIntValue(launch.getBlockSizeX());
  Value ranks = addSharedMemory(launch, threads, builder.getIndexType());
  when(isActive(), [&] {
    auto others = scf::ForOp::create(builder, loc, index(0), count, index(1),
                                     ValueRange{index(0)});
    OpBuilder::InsertionGuard insertion(builder);
    builder.setInsertionPointToStart(others.getBody());
    Value at = others.getInductionVar(), key = load(keys, at);
    bool isUnsigned = op.getIsUnsigned();
    Value less = createLess(builder, loc, key, mine, isUnsigned);
    Value more = createLess(builder, loc, mine, key, isUnsigned);
    Value ahead = either(less, select(more, less, compare(P::slt, at, thread)));
    Value counted = add(others.getRegionIterArg(0),
                        arith::IndexCastUIOp::create(
                            builder, loc, builder.getIndexType(), ahead));
    scf::YieldOp::create(builder, loc, counted);
    builder.setInsertionPointAfter(others);
    store(thread, ranks, others.getResult(0));
  });
  barrier();
  Value index = load(ranks, thread);
  barrier();
  uniformity.replace(op.getIndex(), index);
  op.getIndex().replaceAllUsesWith(index);
}

//===----------------------------------------------------------------------===//
// The loop
//===----------------------------------------------------------------------===//

LogicalResult IterationMapper::run() {
  stage = getKernelStage(loop);
  thread = launch.getThreadIds().x;
  count = loop.getCount();
  auto flag = MemRefType::get({1}, builder.getI1Type());
  {
    OpBuilder entry = OpBuilder::atBlockBegin(&launch.getBody().front());
    auto own = memref::AllocaOp::create(entry, loc, flag);
    made.ownArrays.insert(own);
    active = own;
  }
  stopped = addSharedMemory(launch, 1, builder.getI1Type());
  Value zero = index(0), runs = compare(P::slt, thread, count);
  store(runs, active, zero);
  when(compare(P::eq, thread, zero),
       [&] { store(boolean(false), stopped, index(0)); });
  barrier();
  // Iteration 0 is there to say where all go.
  auto any = scf::IfOp::create(builder, loc, compare(P::sgt, count, zero));
  loop->moveBefore(any.thenBlock()->getTerminator());
  if (failed(map(*loop.getBodyBlock())))
    return failure();
  Block *body = loop.getBodyBlock();
  loop.getIteration().replaceAllUsesWith(thread);
  body->getTerminator()->erase();
  any.thenBlock()->getOperations().splice(loop->getIterator(),
                                          body->getOperations());
  loop.erase();
  builder.setInsertionPointAfter(any);
  barrier();
  return success();
}

LogicalResult piko::mapIterations(ParallelForOp loop, gpu::LaunchOp launch,
                                  ThreadOperations &made) {
  OpBuilder builder(loop);
  return IterationMapper(builder, loop, launch, made).run();
}
