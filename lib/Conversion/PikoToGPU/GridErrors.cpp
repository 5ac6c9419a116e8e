// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Errors of a grid. A kernel on a GPU cannot call the runtime, so that
//   1. each thread notes its first error, and where in the bin it was;
//   2. at the end, the first thread of the block that has the earliest one
//      writes it to a list with an entry for each block;
//   3. behind the launch, the host reports the first entry there is.
// An error is the number of the place in the code, the bin, and the indices.

#include "PikoToGPU.h"

#include "mlir/Dialect/Utils/StaticValueUtils.h"

using namespace mlir;
using namespace piko;

namespace {

class GridErrors {
public:
  GridErrors(gpu::LaunchOp launch, scf::ForOp items);
  void run();

private:
  /// What a thread notes: the place, 0 for none; the position; the bin, -1 for
  /// none; the indices. All but the position go to the block's entry.
  enum { place = 0, at = 1, bin = 2, indices = 3 };

  Value number(OpBuilder &builder, int64_t value) {
    return arith::ConstantIndexOp::create(builder, loc, value);
  }
  Value integer(OpBuilder &builder, int64_t value) {
    return arith::ConstantIntOp::create(builder, loc, value, 64);
  }
  Value compare(OpBuilder &builder, arith::CmpIPredicate predicate, Value a,
                Value b) {
    return arith::CmpIOp::create(builder, loc, predicate, a, b);
  }
  Value load(OpBuilder &builder, Value memory, Value index) {
    return memref::LoadOp::create(builder, loc, memory, index);
  }
  void store(OpBuilder &builder, Value value, Value memory, Value index) {
    if (value.getType().isIndex())
      value =
          arith::IndexCastOp::create(builder, loc, builder.getI64Type(), value);
    memref::StoreOp::create(builder, loc, value, memory, index);
  }
  /// Number `i` of a block's entry in the list.
  Value entry(OpBuilder &builder, Value block, int64_t i) {
    Value begin =
        arith::MulIOp::create(builder, loc, block, number(builder, width));
    return arith::AddIOp::create(builder, loc, begin, number(builder, i));
  }

  int64_t placeOf(Operation *fail);
  Value positionOf(Operation *fail, OpBuilder &builder);
  void note(Operation *fail);
  void publish();
  void clear();
  void report();

  gpu::LaunchOp launch;
  scf::ForOp items;
  Location loc;
  SmallVector<Operation *> fails; ///< FailOp or FailDivideOp.
  /// One of each kind.
  SmallVector<Operation *> places;
  int64_t width = 2; ///< Of an entry.
  Value noted, list;
};

} // namespace

static ValueRange getIndices(Operation *fail) {
  auto access = dyn_cast<FailOp>(fail);
  return access ? ValueRange(access.getIndices()) : ValueRange();
}

static Value getBin(Operation *fail) {
  auto access = dyn_cast<FailOp>(fail);
  return access ? access.getBin() : cast<FailDivideOp>(fail).getBin();
}

GridErrors::GridErrors(gpu::LaunchOp launch, scf::ForOp items)
    : launch(launch), items(items), loc(launch.getLoc()) {
  launch.walk([&](Operation *op) {
    if (isa<FailOp, FailDivideOp>(op))
      fails.push_back(op);
  });
  for (Operation *fail : fails)
    width = std::max<int64_t>(width, getIndices(fail).size() + 2);
}

int64_t GridErrors::placeOf(Operation *fail) {
  auto *known = llvm::find_if(places, [&](Operation *other) {
    return other->getName() == fail->getName() &&
           other->getAttrDictionary() == fail->getAttrDictionary() &&
           getIndices(other).size() == getIndices(fail).size();
  });
  if (known == places.end()) {
    places.push_back(fail);
    return places.size();
  }
  return known - places.begin() + 1;
}

/// What is in front of the loops over primitives comes first.
Value GridErrors::positionOf(Operation *fail, OpBuilder &builder) {
  if (!items->isProperAncestor(fail))
    return integer(builder, -1);
  return arith::AddIOp::create(
      builder, loc, items->getParentOfType<scf::ForOp>().getInductionVar(),
      items.getInductionVar());
}

void GridErrors::note(Operation *fail) {
  OpBuilder builder(fail);
  Value none = compare(builder, arith::CmpIPredicate::eq,
                       load(builder, noted, number(builder, place)),
                       integer(builder, 0));
  auto first = scf::IfOp::create(builder, loc, none);
  builder.setInsertionPointToStart(first.thenBlock());
  store(builder, integer(builder, placeOf(fail)), noted,
        number(builder, place));
  store(builder, positionOf(fail, builder), noted, number(builder, at));
  store(builder, getBin(fail) ? getBin(fail) : integer(builder, -1), noted,
        number(builder, bin));
  for (auto [i, index] : llvm::enumerate(getIndices(fail)))
    store(builder, index, noted, number(builder, indices + i));
}

void GridErrors::publish() {
  OpBuilder builder(launch.getBody().front().getTerminator());
  Value thread = launch.getThreadIds().x;
  int64_t threads = *getConstantIntValue(launch.getBlockSizeX());
  Value positions = addBlockMemory(launch, threads, builder.getI64Type());
  store(builder, load(builder, noted, number(builder, at)), positions, thread);
  gpu::BarrierOp::create(builder, loc);
  Value found = load(builder, noted, number(builder, place));
  auto failed = scf::IfOp::create(
      builder, loc,
      compare(builder, arith::CmpIPredicate::ne, found, integer(builder, 0)));
  builder.setInsertionPointToStart(failed.thenBlock());
  Value mine = load(builder, noted, number(builder, at));
  Value yes = arith::ConstantIntOp::create(builder, loc, 1, 1);
  auto loop = scf::ForOp::create(
      builder, loc, number(builder, 0), number(builder, threads),
      number(builder, 1), yes,
      [&](OpBuilder &body, Location, Value other, ValueRange isFirst) {
        Value theirs = load(body, positions, other);
        Value later = compare(body, arith::CmpIPredicate::sgt, theirs, mine);
        Value same = compare(body, arith::CmpIPredicate::eq, theirs, mine);
        Value behind = compare(body, arith::CmpIPredicate::uge, other, thread);
        same = arith::AndIOp::create(body, loc, same, behind);
        later = arith::OrIOp::create(body, loc, later, same);
        Value still = arith::AndIOp::create(body, loc, isFirst[0], later);
        scf::YieldOp::create(body, loc, still);
      });
  auto first = scf::IfOp::create(builder, loc, loop.getResult(0));
  builder.setInsertionPointToStart(first.thenBlock());
  Value block = launch.getBlockIds().x;
  store(builder, found, list, entry(builder, block, 0));
  for (int64_t i = 1; i < width; ++i)
    store(builder, load(builder, noted, number(builder, at + i)), list,
          entry(builder, block, i));
}

/// Makes the list, in front of the launch.
void GridErrors::clear() {
  OpBuilder builder(launch);
  Value blocks = launch.getGridSizeX();
  Value size =
      arith::MulIOp::create(builder, loc, blocks, number(builder, width));
  auto type = MemRefType::get({ShapedType::kDynamic}, builder.getI64Type());
  list = memref::AllocOp::create(builder, loc, type, ValueRange{size});
  auto loop = scf::ForOp::create(builder, loc, number(builder, 0), blocks,
                                 number(builder, 1));
  builder.setInsertionPointToStart(loop.getBody());
  store(builder, integer(builder, 0), list,
        entry(builder, loop.getInductionVar(), 0));
}

void GridErrors::report() {
  OpBuilder builder(launch->getContext());
  builder.setInsertionPointAfter(launch);
  Value no = arith::ConstantIntOp::create(builder, loc, 0, 1);
  auto loop = scf::ForOp::create(builder, loc, number(builder, 0),
                                 launch.getGridSizeX(), number(builder, 1), no);
  memref::DeallocOp::create(builder, loc, list);
  builder.setInsertionPointToStart(loop.getBody());
  Value block = loop.getInductionVar(), done = loop.getRegionIterArg(0);
  Value found = load(builder, list, entry(builder, block, 0));
  Value failed =
      compare(builder, arith::CmpIPredicate::ne, found, integer(builder, 0));
  scf::YieldOp::create(builder, loc,
                       Value(arith::OrIOp::create(builder, loc, done, failed)));
  builder.setInsertionPoint(loop.getBody()->getTerminator());
  Value isFirst = compare(builder, arith::CmpIPredicate::ugt, failed, done);
  auto ifOp = scf::IfOp::create(builder, loc, isFirst);
  builder.setInsertionPointToStart(ifOp.thenBlock());
  for (auto [i, error] : llvm::enumerate(places)) {
    Value same = compare(builder, arith::CmpIPredicate::eq, found,
                         integer(builder, i + 1));
    auto here = scf::IfOp::create(builder, error->getLoc(), same);
    OpBuilder body = here.getThenBodyBuilder();
    auto numberAt = [&](int64_t n) {
      return arith::IndexCastOp::create(body, loc, body.getIndexType(),
                                        load(body, list, entry(body, block, n)))
          .getResult();
    };
    Value inBin = getBin(error) ? numberAt(1) : Value();
    if (auto divide = dyn_cast<FailDivideOp>(error)) {
      FailDivideOp::create(body, divide.getLoc(), divide.getStageAttr(), inBin,
                           divide.getOfAttr());
      continue;
    }
    auto fail = cast<FailOp>(error);
    SmallVector<Value> indices;
    for (int64_t n = 0, e = fail.getIndices().size(); n < e; ++n)
      indices.push_back(numberAt(n + 2));
    FailOp::create(body, fail.getLoc(), fail.getStageAttr(),
                   fail.getStateAttr(), indices, fail.getOutsideBinAttr(),
                   inBin, fail.getOfAttr());
  }
}

void GridErrors::run() {
  if (fails.empty())
    return;
  OpBuilder builder(launch->getContext());
  builder.setInsertionPointToStart(&launch.getBody().front());
  noted = memref::AllocaOp::create(
      builder, loc, MemRefType::get({width + 1}, builder.getI64Type()));
  store(builder, integer(builder, 0), noted, number(builder, place));
  store(builder, integer(builder, INT64_MAX), noted, number(builder, at));
  clear();
  for (Operation *fail : fails)
    note(fail);
  publish();
  report();
  for (Operation *fail : fails)
    fail->erase();
}

void piko::gatherGridErrors(gpu::LaunchOp launch, scf::ForOp items) {
  GridErrors(launch, items).run();
}
