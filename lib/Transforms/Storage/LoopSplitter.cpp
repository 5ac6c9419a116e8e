// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Transforms/Storage/LoopSplitter.h"

#include "Piko/Transforms/Storage/Collectives.h"
#include "Piko/Transforms/Storage/Groups.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/IRMapping.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

class LoopSplitter::Piece {
public:
  explicit Piece(LoopSplitter &splitter) : splitter(splitter) {}

  /// Where its next operation goes.
  OpBuilder atEnd() {
    if (!loop)
      loop = splitter.createPiece();
    return OpBuilder(loop.getBody()->getTerminator());
  }
  void append(Operation *op) {
    op->moveBefore(atEnd().getBlock()->getTerminator());
  }
  Value getIteration() { return loop.getInductionVar(); }
  /// What is appended next comes after what `splitter` has built since.
  void close() { loop = {}; }

private:
  LoopSplitter &splitter;
  scf::ForOp loop;
};

static Value findWriter(Operation *op) {
  if (auto local = op->getParentOfType<LocalBinOp>())
    return local.getWriter();
  if (auto forall = op->getParentOfType<scf::ForallOp>())
    for (auto open : forall.getOps<OpenWriterOp>())
      return open.getWriter();
  return {};
}

LoopSplitter::LoopSplitter(ParallelForOp parallel, Value writer, bool isShared)
    : parallel(parallel), isShared(isShared), loc(parallel.getLoc()),
      builder(parallel), count(parallel.getCount()), writer(writer),
      uniformity(hoistInvariants(parallel)) {}

LogicalResult LoopSplitter::run() {
  if (!writer)
    writer = findWriter(parallel);
  stage = getKernelStage(parallel);
  if (!writer || !stage)
    return parallel.emitOpError(
        "expected to be in the loop over a kernel's units");
  if (failed(checkControlFlow()))
    return failure();

  builder.setInsertionPoint(parallel);
  zero = arith::ConstantIndexOp::create(builder, loc, 0);
  one = arith::ConstantIndexOp::create(builder, loc, 1);
  slots.emplace(builder, loc, writer, count);
  builder.setInsertionPoint(slots->inside());
  Piece piece(*this);
  split(*parallel.getBodyBlock(), piece, [](Piece &, Operation *) {});
  if (failed(connect()))
    return failure();
  orderEmissions();
  stopAtDisagreement();
  slots->finish();
  parallel.erase();
  return success();
}

//===----------------------------------------------------------------------===//
// What can be cut
//===----------------------------------------------------------------------===//

LogicalResult LoopSplitter::checkControlFlow() {
  WalkResult result = parallel.walk([&](Operation *op) {
    if (!isBarrier(op))
      return WalkResult::advance();
    if (!isa<SyncOp, ReduceOp, ScanOp, SortOp, GroupedOp>(op)) {
      op->emitError("expected piko.sync, piko.reduce, piko.scan, piko.sort or "
                    "piko.grouped, which loops can be cut at, but got '")
          << op->getName() << "'";
      return WalkResult::interrupt();
    }
    for (Operation *at = op->getParentOp(); at != parallel;
         at = at->getParentOp()) {
      if (isa<scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp>(at))
        continue;
      InFlightDiagnostic error =
          op->emitError(
              "expected a barrier inside scf.if, scf.for, scf.while or "
              "scf.index_switch only, but got '")
          << at->getName() << "'";
      error.attachNote(at->getLoc()) << "the operation is here";
      return WalkResult::interrupt();
    }
    return WalkResult::advance();
  });
  return failure(result.wasInterrupted());
}

//===----------------------------------------------------------------------===//
// Cutting
//===----------------------------------------------------------------------===//

scf::ForOp LoopSplitter::createPiece() {
  auto piece = scf::ForOp::create(builder, loc, zero, count, one);
  piece->setAttr(marks::lanes, builder.getUnitAttr());
  pieces.push_back(piece);
  isPiece.insert(piece);
  return piece;
}

void LoopSplitter::split(Block &block, Piece &piece, Terminate terminate) {
  for (Operation &op : llvm::make_early_inc_range(block.without_terminator())) {
    if (!findBarrier(&op)) {
      piece.append(&op);
      continue;
    }
    split(&op, piece);
    op.erase();
    piece.close();
  }
  terminate(piece, block.getTerminator());
  block.getTerminator()->erase();
}

void LoopSplitter::split(Operation *op, Piece &piece) {
  if (auto reduce = dyn_cast<ReduceOp>(op))
    return splitReduce(reduce, piece);
  if (auto scan = dyn_cast<ScanOp>(op))
    return splitScan(scan, piece);
  if (auto sort = dyn_cast<SortOp>(op))
    return splitSort(sort, piece);
  if (auto grouped = dyn_cast<GroupedOp>(op))
    return splitGrouped(grouped, piece);
  if (auto ifOp = dyn_cast<scf::IfOp>(op))
    return splitIf(ifOp, piece);
  if (auto switchOp = dyn_cast<scf::IndexSwitchOp>(op))
    return splitSwitch(switchOp, piece);
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return splitFor(loop, piece);
  if (auto loop = dyn_cast<scf::WhileOp>(op))
    return splitWhile(loop, piece);
}

void LoopSplitter::splitReduce(ReduceOp op, Piece &piece) {
  SmallVector<Value> arrays = addSlots(op.getValues().getTypes());
  store(piece, op.getValues(), arrays);
  auto create = isShared ? createSharedReduction : createReduction;
  create(builder, op.getLoc(), count, arrays, op.getBody().front());
  for (auto [result, array] : llvm::zip(op.getResults(), arrays))
    result.replaceAllUsesWith(
        Slots::load(builder, op.getLoc(), result.getType(), array, zero));
}

void LoopSplitter::splitScan(ScanOp op, Piece &piece) {
  SmallVector<Value> arrays = addSlots(op.getValues().getTypes());
  store(piece, op.getValues(), arrays);
  auto create = isShared ? createSharedScan : createScan;
  create(builder, op.getLoc(), count, arrays, op.getBody().front());
  for (auto [empty, array] : llvm::zip(op.getEmpty(), arrays))
    Slots::store(builder, op.getLoc(), empty, array, zero);
  readFrom(op.getResults(), arrays);
}

void LoopSplitter::splitSort(SortOp op, Piece &piece) {
  Type index = builder.getIndexType();
  SmallVector<Value> keys = addSlots(op.getKey().getType());
  store(piece, op.getKey(), keys);
  Value room = slots->add(index, /*elements=*/2), ranks = slots->add(index);
  auto create = isShared ? createSharedSort : createSort;
  create(builder, op.getLoc(), count, keys.front(), op.getIsUnsigned(), room,
         ranks);
  readFrom(op.getIndex(), ranks);
}

/// Sorts iterations by group, and runs each group where its first one stands.
void LoopSplitter::splitGrouped(GroupedOp op, Piece &piece) {
  Location loc = op.getLoc();
  Type index = builder.getIndexType();
  OpBuilder inPiece = piece.atEnd();
  BinArithmetic bins(inPiece, loc, stage);
  Value group = createGroup(
      inPiece, op, llvm::map_to_vector(op.getKey(), [&](Value coordinate) {
        return bins.toIndex(coordinate);
      }));
  SmallVector<Value> groups = addSlots(group.getType()),
                     values = addSlots(op.getBody().getArgumentTypes()),
                     results = addSlots(op.getResultTypes());
  store(piece, group, groups);
  store(piece, op->getOperands().drop_front(), values);
  for (auto [result, array] : llvm::zip(op.getResults(), results)) {
    inPiece = piece.atEnd();
    Value zero = arith::ConstantOp::create(
        inPiece, loc, inPiece.getZeroAttr(result.getType()));
    store(piece, zero, array);
  }
  Value room = slots->add(index, /*elements=*/2), ranks = slots->add(index);
  auto create = isShared ? createSharedSort : createSort;
  create(builder, loc, count, groups.front(), /*isUnsigned=*/true, room, ranks);
  // It does not run on what was never left.
  loops.push_back(createGroupLoop(builder, op, count, groups.front(), ranks,
                                  values, results));
  readFrom(op.getResults(), results);
}

void LoopSplitter::splitIf(scf::IfOp op, Piece &piece) {
  compare(op.getCondition(), getBarrierName(op));
  SmallVector<Value> arrays = addSlots(op.getResultTypes());
  bool hasElse = !op.getElseRegion().empty();
  auto ifOp = scf::IfOp::create(builder, op.getLoc(), TypeRange(),
                                op.getCondition(), hasElse);
  OpBuilder::InsertionGuard guard(builder);
  for (auto [from, to] : llvm::zip(op->getRegions(), ifOp->getRegions())) {
    if (from.empty())
      continue;
    builder.setInsertionPoint(to.front().getTerminator());
    Piece inner(*this);
    split(from.front(), inner, [&](Piece &piece, Operation *yield) {
      store(piece, yield->getOperands(), arrays);
    });
  }
  readFrom(op.getResults(), arrays);
}

void LoopSplitter::splitSwitch(scf::IndexSwitchOp op, Piece &piece) {
  compare(op.getArg(), getBarrierName(op));
  SmallVector<Value> arrays = addSlots(op.getResultTypes());
  auto switchOp =
      scf::IndexSwitchOp::create(builder, op.getLoc(), TypeRange(), op.getArg(),
                                 op.getCases(), op.getCases().size());
  OpBuilder::InsertionGuard guard(builder);
  for (auto [from, to] : llvm::zip(op->getRegions(), switchOp->getRegions())) {
    builder.createBlock(&to);
    builder.setInsertionPoint(scf::YieldOp::create(builder, op.getLoc()));
    Piece inner(*this);
    split(from.front(), inner, [&](Piece &piece, Operation *yield) {
      store(piece, yield->getOperands(), arrays);
    });
  }
  readFrom(op.getResults(), arrays);
}

void LoopSplitter::splitFor(scf::ForOp op, Piece &piece) {
  SmallVector<Value> arrays = addSlots(op.getResultTypes());
  store(piece, op.getInits(), arrays);
  bool isUniform = llvm::none_of(
      ValueRange{op.getLowerBound(), op.getUpperBound(), op.getStep()},
      [&](Value bound) { return uniformity.isVarying(bound); });
  OpBuilder::InsertionGuard guard(builder);
  scf::ForOp loop;
  Value iterationVar;
  if (isUniform) {
    loop = scf::ForOp::create(builder, op.getLoc(), op.getLowerBound(),
                              op.getUpperBound(), op.getStep());
    loop.setUnsignedCmp(op.getUnsignedCmp());
    iterationVar = loop.getInductionVar();
  } else {
    // Iterations may count from different numbers, but equally often.
    OpBuilder inPiece = piece.atEnd();
    Value trips = createTripCount(inPiece, op);
    uniformity.replace(parallel.getIteration(), trips);
    compare(trips, getBarrierName(op));
    loop = scf::ForOp::create(builder, op.getLoc(), zero, trips, one);
  }
  loops.push_back(loop);
  builder.setInsertionPoint(loop.getBody()->getTerminator());
  splitForBody(op, loop, iterationVar, arrays);
  readFrom(op.getResults(), arrays);
}

void LoopSplitter::splitForBody(scf::ForOp op, scf::ForOp loop,
                                Value iterationVar, ValueRange arrays) {
  Piece inner(*this);
  if (!iterationVar) {
    OpBuilder inPiece = inner.atEnd();
    Location loc = op.getLoc();
    Value trip = loop.getInductionVar();
    Type type = op.getInductionVar().getType();
    if (!type.isIndex())
      trip = arith::IndexCastOp::create(inPiece, loc, type, trip);
    Value distance = arith::MulIOp::create(inPiece, loc, trip, op.getStep());
    iterationVar =
        arith::AddIOp::create(inPiece, loc, op.getLowerBound(), distance);
    uniformity.replace(parallel.getIteration(), iterationVar);
  }
  op.getInductionVar().replaceAllUsesWith(iterationVar);
  readFrom(op.getRegionIterArgs(), arrays);
  split(*op.getBody(), inner, [&](Piece &piece, Operation *yield) {
    store(piece, yield->getOperands(), arrays);
  });
}

void LoopSplitter::splitWhile(scf::WhileOp op, Piece &piece) {
  Location loc = op.getLoc();
  StringRef barrier = getBarrierName(op);
  SmallVector<Value> before =
      addSlots(ValueRange(op.getBeforeArguments()).getTypes());
  SmallVector<Value> after = addSlots(op.getResultTypes());
  store(piece, op.getInits(), before);
  auto loop = scf::WhileOp::create(builder, loc, TypeRange(), ValueRange());
  loops.push_back(loop);
  OpBuilder::InsertionGuard guard(builder);
  builder.createBlock(&loop.getBefore());
  readFrom(op.getBeforeArguments(), before);
  Piece test(*this);
  split(*op.getBeforeBody(), test, [&](Piece &piece, Operation *terminator) {
    auto condition = cast<scf::ConditionOp>(terminator);
    store(piece, condition.getArgs(), after);
    Value goesOn = condition.getCondition();
    compare(goesOn, barrier);
    scf::ConditionOp::create(builder, loc, goesOn, ValueRange());
  });
  builder.createBlock(&loop.getAfter());
  builder.setInsertionPoint(scf::YieldOp::create(builder, loc));
  readFrom(op.getAfterArguments(), after);
  Piece body(*this);
  split(*op.getAfterBody(), body, [&](Piece &piece, Operation *yield) {
    store(piece, yield->getOperands(), before);
  });
  readFrom(op.getResults(), after);
}

void LoopSplitter::compare(Value value, StringRef barrier) {
  if (!uniformity.isVarying(value))
    return;
  Location loc = value.getLoc();
  auto first =
      UnrealizedConversionCastOp::create(builder, loc, value.getType(), value);
  copies.push_back(first);
  Value yes =
      arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
  auto piece =
      scf::ForOp::create(builder, loc, one, count, one, ValueRange{yes});
  pieces.push_back(piece);
  isPiece.insert(piece);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(piece.getBody());
  Value agreed = piece.getRegionIterArg(0);
  Value same = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                     value, first.getResult(0));
  Value agree = arith::AndIOp::create(builder, loc, agreed, same);
  Value parts = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                      agreed, agree);
  auto ifOp = scf::IfOp::create(builder, loc, TypeRange(), parts,
                                /*withElseRegion=*/false);
  scf::YieldOp::create(builder, loc, agree);
  builder.setInsertionPoint(ifOp.thenBlock()->getTerminator());
  auto failure =
      FailBarrierOp::create(builder, loc, stage.getSymName(),
                            piece.getInductionVar(), findBin(builder, piece));
  failure->setAttr(cppNameAttr, builder.getStringAttr(barrier));
  failures.push_back(failure);
}

//===----------------------------------------------------------------------===//
// Values across cuts
//===----------------------------------------------------------------------===//

SmallVector<Value> LoopSplitter::addSlots(TypeRange types) {
  return llvm::map_to_vector(types, [&](Type type) -> Value {
    // What cannot be held is reported when all uses are known.
    return Slots::canHold(type) ? slots->add(type) : Value();
  });
}

void LoopSplitter::store(Piece &piece, ValueRange values, ValueRange arrays) {
  for (auto [value, array] : llvm::zip(values, arrays)) {
    if (!array)
      continue;
    OpBuilder inPiece = piece.atEnd();
    Slots::store(inPiece, value.getLoc(), value, array, piece.getIteration());
  }
}

void LoopSplitter::readFrom(ValueRange values, ValueRange arrays) {
  OpBuilder atStart = OpBuilder::atBlockBegin(slots->inside()->getBlock());
  for (auto [value, array] : llvm::zip(values, arrays)) {
    auto placeholder = UnrealizedConversionCastOp::create(
        atStart, value.getLoc(), value.getType(), ValueRange());
    uniformity.replace(value, placeholder.getResult(0));
    value.replaceAllUsesWith(placeholder.getResult(0));
    placeholders.push_back({placeholder, array});
  }
}

scf::ForOp LoopSplitter::pieceOf(Operation *op) const {
  for (; op; op = op->getParentOp())
    if (isPiece.contains(op))
      return cast<scf::ForOp>(op);
  return {};
}

void LoopSplitter::replaceUses(
    Value value, scf::ForOp home,
    llvm::function_ref<Value(OpBuilder &, Value)> read) {
  llvm::SmallDenseMap<Operation *, Value> known;
  for (OpOperand &use : llvm::make_early_inc_range(value.getUses())) {
    scf::ForOp piece = pieceOf(use.getOwner());
    if (home && piece == home)
      continue;
    Operation *reader = piece ? piece.getOperation() : use.getOwner();
    Value &found = known[reader];
    if (!found) {
      OpBuilder atReader(use.getOwner());
      if (piece)
        atReader.setInsertionPointToStart(piece.getBody());
      found = read(atReader, piece ? piece.getInductionVar() : zero);
    }
    use.set(found);
  }
}

/// Whether a value of a piece follows from its iteration and from what all
/// pieces see, by so few cheap operations that a slot costs more. Adds these to
/// `slice`, operands first.
static bool isCheap(Value value, scf::ForOp piece,
                    llvm::SetVector<Operation *> &slice) {
  constexpr size_t most = 4;
  if (value == piece.getInductionVar() ||
      !piece->isAncestor(value.getParentRegion()->getParentOp()))
    return true;
  Operation *op = value.getDefiningOp();
  if (!isa_and_nonnull<arith::AddIOp, arith::SubIOp, arith::MulIOp,
                       arith::AndIOp, arith::ShLIOp, arith::IndexCastOp,
                       arith::IndexCastUIOp, arith::TruncIOp, arith::ExtSIOp,
                       arith::ExtUIOp, arith::CmpIOp, arith::SIToFPOp>(op))
    return false;
  for (Value operand : op->getOperands())
    if (!isCheap(operand, piece, slice))
      return false;
  slice.insert(op);
  return slice.size() <= most;
}

LogicalResult LoopSplitter::connectResult(Value value, scf::ForOp piece) {
  auto isOutside = [&](OpOperand &use) {
    return pieceOf(use.getOwner()) != piece;
  };
  if (llvm::none_of(value.getUses(), isOutside))
    return success();
  if (auto array = value.getDefiningOp<memref::AllocaOp>();
      array && array.getDynamicSizes().empty() &&
      array.getType().getLayout().isIdentity() &&
      array.getType().getElementType().isIntOrIndexOrFloat()) {
    connectArray(array, piece);
    return success();
  }
  llvm::SetVector<Operation *> slice;
  if (isCheap(value, piece, slice)) {
    replaceUses(value, piece, [&](OpBuilder &at, Value iteration) {
      IRMapping mapping;
      mapping.map(piece.getInductionVar(), iteration);
      for (Operation *op : slice)
        at.clone(*op, mapping);
      return mapping.lookup(value);
    });
    return success();
  }
  if (!Slots::canHold(value.getType()))
    return emitError(value.getLoc(),
                     "expected a number, a primitive or a private array to "
                     "live across a barrier, but got type ")
           << value.getType();
  Value array = slots->add(value.getType());
  OpBuilder after(value.getContext());
  after.setInsertionPointAfterValue(value);
  Slots::store(after, value.getLoc(), value, array, piece.getInductionVar());
  replaceUses(value, piece, [&](OpBuilder &at, Value iteration) {
    return Slots::load(at, value.getLoc(), value.getType(), array, iteration);
  });
  return success();
}

void LoopSplitter::connectArray(memref::AllocaOp array, scf::ForOp piece) {
  MemRefType type = array.getType();
  Value arrays = slots->addArrays(type);
  replaceUses(array, /*home=*/{}, [&](OpBuilder &at, Value iteration) {
    return slots->getArray(at, arrays, type, iteration);
  });
  array.erase();
}

LogicalResult LoopSplitter::connect() {
  replaceUses(parallel.getIteration(), /*home=*/{},
              [](OpBuilder &, Value iteration) { return iteration; });
  for (auto [placeholder, array] : placeholders) {
    Value value = placeholder->getResult(0);
    if (!array && !value.use_empty())
      return emitError(placeholder->getLoc(),
                       "expected a number or a primitive to live across a "
                       "barrier, but got type ")
             << value.getType();
    replaceUses(value, /*home=*/{},
                [&, array = array](OpBuilder &at, Value iteration) {
                  return Slots::load(at, value.getLoc(), value.getType(), array,
                                     iteration);
                });
    placeholder->erase();
  }
  for (scf::ForOp piece : pieces)
    for (Operation &op :
         llvm::make_early_inc_range(piece.getBody()->without_terminator()))
      for (Value result : llvm::to_vector(op.getResults()))
        if (failed(connectResult(result, piece)))
          return failure();
  for (Operation *copy : copies) {
    copy->getResult(0).replaceAllUsesWith(copy->getOperand(0));
    copy->erase();
  }
  return success();
}

//===----------------------------------------------------------------------===//
// Emissions
//===----------------------------------------------------------------------===//

/// They are in the order of iterations if all come from one piece that runs
/// once.
void LoopSplitter::orderEmissions() {
  SmallVector<scf::ForOp> emitting;
  bool inOrder = true;
  Operation *inside = slots->inside()->getBlock()->getParentOp();
  for (scf::ForOp piece : pieces) {
    if (!piece.walk([](AppendOp) { return WalkResult::interrupt(); })
             .wasInterrupted())
      continue;
    emitting.push_back(piece);
    for (Operation *at = piece->getParentOp(); at != inside;
         at = at->getParentOp())
      inOrder &= !isa<scf::ForOp, scf::WhileOp>(at);
  }
  if (emitting.size() < 2 && inOrder)
    return;
  OpBuilder at = OpBuilder::atBlockBegin(slots->inside()->getBlock());
  ReorderBeginOp::create(at, loc, writer, count);
  at.setInsertionPoint(slots->inside());
  ReorderEndOp::create(at, loc, writer);
  for (scf::ForOp piece : emitting) {
    at.setInsertionPointToStart(piece.getBody());
    ReorderIterationOp::create(at, loc, writer, piece.getInductionVar());
  }
}

//===----------------------------------------------------------------------===//
// Failures
//===----------------------------------------------------------------------===//

/// What comes after such a barrier has no meaning: the way there was
/// iteration 0's, and slots may never have been written.
void LoopSplitter::stopAtDisagreement() {
  if (failures.empty())
    return;
  Value left = slots->add(builder.getIndexType()); // iterations to run
  auto load = [&](OpBuilder &at) {
    return Slots::load(at, loc, at.getIndexType(), left, zero);
  };
  auto isRunning = [&](OpBuilder &at) {
    return arith::CmpIOp::create(at, loc, arith::CmpIPredicate::ne, load(at),
                                 zero);
  };
  OpBuilder at(parallel);
  at.setInsertionPointAfterValue(left);
  Slots::store(at, loc, count, left, zero);
  for (FailBarrierOp failure : failures) {
    at.setInsertionPoint(failure);
    Slots::store(at, loc, zero, left, zero);
  }
  for (scf::ForOp piece : pieces) {
    at.setInsertionPoint(piece);
    piece.setUpperBound(load(at));
  }
  for (Operation *op : loops) {
    if (auto loop = dyn_cast<scf::ForOp>(op)) {
      at.setInsertionPoint(loop);
      loop.setUpperBound(arith::SelectOp::create(
          at, loc, isRunning(at), loop.getUpperBound(), loop.getLowerBound()));
      continue;
    }
    scf::ConditionOp condition = cast<scf::WhileOp>(op).getConditionOp();
    at.setInsertionPoint(condition);
    condition.getConditionMutable().assign(arith::AndIOp::create(
        at, loc, condition.getCondition(), isRunning(at)));
  }
}
