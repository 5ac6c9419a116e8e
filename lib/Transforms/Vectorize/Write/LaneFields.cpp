// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reads of several fields of an element whose place differs between lanes, as
// of the triangle that a pixel shows. Neighbours mostly read the same one.

#include "Vectorize/Write/LaneMemory.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

using namespace mlir;
using namespace piko;

/// Primitives side by side refer to different elements; pixels and iterations
/// often do not.
static bool mayAgree(scf::ForOp loop) { return !loop->hasAttr(marks::mapping); }

/// Lanes that each go on by themselves have nothing in common.
static bool isElectedWork(Operation *op, scf::ForOp loop) {
  for (; op != loop; op = op->getParentOp())
    if (auto choice = dyn_cast<scf::IfOp>(op);
        choice && choice.getCondition().getDefiningOp<ElectOp>())
      return true;
  return false;
}

SmallVector<LoadOp> LaneMemory::findFields(Operation *first) const {
  constexpr size_t least = 3;
  auto isPart = [&](LoadOp load) {
    return load && lanes.getForm(load) == LaneForm::Access &&
           !lanes.findGroup(load) &&
           llvm::none_of(load.getElements(), [&](Value element) {
             return lanes.isVarying(element);
           });
  };
  auto load = dyn_cast<LoadOp>(first);
  if (paired || !mayAgree(loop) || !isPart(load) ||
      isRowOf(load.getIndices()) || isElectedWork(load, loop))
    return {};
  SmallVector<LoadOp> fields;
  for (Operation *op = first; op; op = op->getNextNode()) {
    auto next = dyn_cast<LoadOp>(op);
    if (!isPart(next) || next.getStateAttr() != load.getStateAttr() ||
        next.getIndices() != load.getIndices() ||
        next.getTile() != load.getTile())
      break;
    fields.push_back(next);
  }
  return fields.size() < least ? SmallVector<LoadOp>() : fields;
}

std::pair<SmallVector<Value>, Value>
LaneMemory::compareWithFirst(ValueRange places) {
  // No lane is active here only where nothing that is read matters.
  Value bits = getBits(active);
  Value last = arith::ConstantOp::create(
      builder, loc, builder.getIntegerAttr(bits.getType(), laneCount - 1));
  Value lane = math::CountTrailingZerosOp::create(builder, loc, bits);
  lane = arith::AndIOp::create(builder, loc, lane, last);
  lane =
      arith::IndexCastUIOp::create(builder, loc, builder.getIndexType(), lane);
  Value differ = zeros(active.getType());
  SmallVector<Value> firsts;
  for (Value place : places) {
    if (!isa<VectorType>(place.getType())) {
      firsts.push_back(place);
      continue;
    }
    firsts.push_back(
        vector::ExtractOp::create(builder, loc, place, OpFoldResult(lane)));
    Value other = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                        place, splat(firsts.back()));
    differ = arith::OrIOp::create(builder, loc, differ, other);
  }
  return {firsts, any(both(active, differ))};
}

/// Where all active lanes read one element, scalar loads read it; elsewhere,
/// gathers do.
void LaneMemory::writeFields(ArrayRef<LoadOp> loads) {
  auto [first, differ] =
      compareWithFirst(getPlaces(LoadOp(loads.front()).getIndices()));
  ArrayRef<Value> firsts = first; // which lambdas can capture
  SmallVector<Type> types;
  for (LoadOp load : loads)
    types.push_back(getVectorType(load.getType()));
  auto choice = scf::IfOp::create(builder, loc, types, differ,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  OpBuilder::InsertionGuard guard(builder);
  auto fill = [&](Block *block, auto read) {
    builder.setInsertionPointToEnd(block);
    SmallVector<Value> values;
    for (LoadOp load : loads)
      values.push_back(read(load));
    scf::YieldOp::create(builder, loc, values);
  };
  fill(choice.thenBlock(), [&](LoadOp load) -> Value {
    writeAccess(load);
    return vectors.lookup(load.getResult());
  });
  fill(choice.elseBlock(), [&](LoadOp load) -> Value {
    IRMapping mapping;
    for (Value element : load.getElements())
      mapping.map(element, getUniform(element));
    auto read = cast<LoadOp>(builder.clone(*load, mapping));
    read.getIndicesMutable().assign(firsts);
    return splat(read.getResult());
  });
  for (size_t i = 0; i < loads.size(); ++i)
    vectors.map(LoadOp(loads[i]).getResult(), choice.getResult(i));
}

/// An element for each lane, and of a row each line of the cache.
void LaneMemory::writePrefetch(PrefetchOp prefetch) {
  SmallVector<Value> places = getPlaces(prefetch.getIndices());
  bool isRow = isRowOf(prefetch.getIndices());
  int64_t step = laneCount;
  for (Value &place : places)
    if (isa<VectorType>(place.getType())) {
      place = choose(active, place, zeros(place.getType()));
      step = 1;
    }
  if (isRow) {
    RecordOp record =
        lookupRecord(prefetch, getStateRecord(lookupInPipeline<Operation *>(
                                   prefetch, prefetch.getStateAttr())));
    step = std::max<int64_t>(lineSize / record.getSize(), 1);
  }
  for (int64_t lane = 0; lane < laneCount; lane += step) {
    SmallVector<Value> own;
    for (Value place : places)
      own.push_back(
          isa<VectorType>(place.getType())
              ? vector::ExtractOp::create(builder, loc, place, lane).getResult()
              : place);
    if (isRow)
      own[0] = arith::AddIOp::create(
          builder, loc, own[0],
          arith::ConstantIndexOp::create(builder, loc, lane));
    PrefetchOp::create(builder, loc, prefetch.getState(), own);
  }
}
