// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Vectorize/Analysis/LoopStreams.h"

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Utils/StaticValueUtils.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

using namespace mlir;
using namespace piko;

namespace {

/// How a value grows from one iteration to the next.
enum class StreamGrowth { None, One, Other };

} // namespace

/// From what is not too far away.
static StreamGrowth getGrowth(Value value, scf::ForOp loop,
                              unsigned depth = 8) {
  if (loop.isDefinedOutsideOfLoop(value))
    return StreamGrowth::None;
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    if (argument.getOwner() != loop.getBody())
      return StreamGrowth::Other;
    if (argument == loop.getInductionVar())
      return matchPattern(loop.getStep(), m_One()) ? StreamGrowth::One
                                                   : StreamGrowth::Other;
    auto next = loop.getTiedLoopYieldedValue(argument)
                    ->get()
                    .getDefiningOp<arith::AddIOp>();
    bool isCount = next && next.getLhs() == argument &&
                   matchPattern(next.getRhs(), m_One());
    return isCount ? StreamGrowth::One : StreamGrowth::Other;
  }
  Operation *op = value.getDefiningOp();
  if (depth == 0)
    return StreamGrowth::Other;
  if (isa<arith::IndexCastOp, arith::IndexCastUIOp, arith::ExtSIOp,
          arith::ExtUIOp, arith::TruncIOp>(op))
    return getGrowth(op->getOperand(0), loop, depth - 1);
  SmallVector<StreamGrowth> growths;
  for (Value operand : op->getOperands())
    growths.push_back(getGrowth(operand, loop, depth - 1));
  if (llvm::all_of(growths,
                   [](StreamGrowth g) { return g == StreamGrowth::None; }))
    return isMemoryEffectFree(op) ? StreamGrowth::None : StreamGrowth::Other;
  bool isSum = (isa<arith::AddIOp>(op) &&
                llvm::is_contained(growths, StreamGrowth::None)) ||
               (isa<arith::SubIOp>(op) && growths[1] == StreamGrowth::None);
  return isSum && llvm::is_contained(growths, StreamGrowth::One)
             ? StreamGrowth::One
             : StreamGrowth::Other;
}

namespace {

/// The indices of an access, the one of neighbouring elements last; and the
/// size of an element, in bytes.
struct StreamPlace {
  SmallVector<Value> indices;
  int64_t size = 0;
};

} // namespace

static int64_t getRecordSize(Operation *op, FlatSymbolRefAttr stateName) {
  Operation *state = lookupInPipeline<Operation *>(op, stateName);
  RecordOp record =
      state ? lookupRecord(state, getStateRecord(state)) : RecordOp();
  return record ? record.getSize() : 0;
}

static std::optional<StreamPlace> getPlace(Operation *op) {
  auto ofState = [&](auto access) {
    StreamPlace place;
    place.size = getRecordSize(access, access.getStateAttr());
    // The first index is the one of neighbours.
    place.indices = llvm::to_vector(llvm::reverse(access.getIndices()));
    if (!access.getElements().empty()) {
      llvm::append_range(place.indices, access.getElements());
      place.size = 1;
    }
    return place;
  };
  if (auto load = dyn_cast<LoadOp>(op))
    return ofState(load);
  if (auto store = dyn_cast<StoreOp>(op))
    return ofState(store);
  if (auto load = dyn_cast<memref::LoadOp>(op))
    return StreamPlace{llvm::to_vector(load.getIndices()), 1};
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return StreamPlace{llvm::to_vector(store.getIndices()), 1};
  if (auto get = dyn_cast<GetOp>(op); get && !get.getElements().empty())
    return StreamPlace{llvm::to_vector(get.getElements()), 1};
  return {};
}

/// How the place of an access grows: by one element, if that is as small as a
/// number or four.
static StreamGrowth getGrowth(const StreamPlace &place, scf::ForOp loop) {
  constexpr int64_t largest = 16;
  if (place.indices.empty())
    return StreamGrowth::None;
  for (Value index : ArrayRef(place.indices).drop_back())
    if (getGrowth(index, loop) != StreamGrowth::None)
      return StreamGrowth::Other;
  StreamGrowth growth = getGrowth(place.indices.back(), loop);
  return growth == StreamGrowth::One && place.size > largest
             ? StreamGrowth::Other
             : growth;
}

bool piko::isStream(Operation *access, scf::ForOp loop) {
  std::optional<StreamPlace> place = getPlace(access);
  return place && getGrowth(*place, loop) == StreamGrowth::One;
}

/// Whether a value is the same in each iteration of `loop`, or runs through the
/// same ones in loops inside of it.
static bool isRepeated(Value value, scf::ForOp loop,
                       llvm::SmallDenseSet<Value> &seen) {
  if (loop.isDefinedOutsideOfLoop(value) || !seen.insert(value).second)
    return true;
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    auto inner = dyn_cast<scf::ForOp>(argument.getOwner()->getParentOp());
    return inner && inner != loop && argument == inner.getInductionVar() &&
           isRepeated(inner.getLowerBound(), loop, seen) &&
           isRepeated(inner.getStep(), loop, seen);
  }
  Operation *op = value.getDefiningOp();
  return op->getNumRegions() == 0 && isMemoryEffectFree(op) &&
         llvm::all_of(op->getOperands(), [&](Value operand) {
           return isRepeated(operand, loop, seen);
         });
}

bool piko::isRepeated(Operation *access, scf::ForOp loop) {
  std::optional<StreamPlace> place = getPlace(access);
  llvm::SmallDenseSet<Value> seen;
  return place && llvm::all_of(place->indices, [&](Value index) {
           return ::isRepeated(index, loop, seen);
         });
}

/// Whether a loop is so short that LLVM unrolls it.
static bool isShort(scf::ForOp loop) {
  constexpr int64_t most = 16;
  std::optional<int64_t> lower = getConstantIntValue(loop.getLowerBound()),
                         upper = getConstantIntValue(loop.getUpperBound());
  return lower && upper && *upper - *lower <= most;
}

static bool isReordered(scf::ForOp loop, unsigned i) {
  Value carried = loop.getRegionIterArg(i), next = loop.getYieldedValues()[i];
  if (getGrowth(carried, loop) == StreamGrowth::One)
    return true;
  Operation *op = next.getDefiningOp();
  return carried.getType().isIntOrIndex() && op &&
         isa<arith::AddIOp, arith::AndIOp, arith::OrIOp, arith::XOrIOp,
             arith::MinSIOp, arith::MaxSIOp, arith::MinUIOp, arith::MaxUIOp>(
             op) &&
         llvm::is_contained(op->getOperands(), carried);
}

/// Whether iterations of `loop` have no control flow, where `body` is a part of
/// them.
static bool isStraight(Block &body, scf::ForOp loop) {
  return llvm::all_of(body.without_terminator(), [&](Operation &op) {
    if (auto inner = dyn_cast<scf::ForOp>(op))
      return isShort(inner) && isStraight(*inner.getBody(), loop);
    if (op.getNumRegions() != 0)
      return false;
    if (std::optional<StreamPlace> place = getPlace(&op)) {
      StreamGrowth growth = getGrowth(*place, loop);
      bool isWrite = isa<StoreOp, memref::StoreOp>(op);
      return growth == StreamGrowth::One ||
             (growth == StreamGrowth::None && !isWrite);
    }
    return isMemoryEffectFree(&op) || isa<GetOp>(op);
  });
}

bool piko::hasVectorsAlong(scf::ForOp loop) {
  auto parent = dyn_cast<scf::ForOp>(loop->getParentOp());
  if (isShort(loop) && parent && isShort(parent) && hasVectorsAlong(parent))
    return true;
  if (!isStraight(*loop.getBody(), loop))
    return false;
  for (unsigned i = 0; i < loop.getNumRegionIterArgs(); ++i)
    if (!isReordered(loop, i))
      return false;
  return true;
}
