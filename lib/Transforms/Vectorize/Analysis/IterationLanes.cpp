// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The analysis of a loop as a whole: forms of its operations and what keeps an
// order depend on one another through arrays, which lanes may need one of each.

#include "Vectorize/Analysis/IterationLanes.h"

#include "Vectorize/Analysis/Lanes.h"

using namespace mlir;
using namespace piko;

IterationLanes::IterationLanes(scf::ForOp loop, int64_t laneCount)
    : LaneOrder(loop, laneCount) {
  analyze();
  // What is computed of an array is another way then, and may have other
  // iterations.
  while (splitArraysOfIterations())
    analyze();
  checkBarriers();
}

void IterationLanes::analyze() {
  findForms();
  findOrder();
}

/// Where lanes take turns to change an array, each has a column, though it does
/// the same as the others.
bool IterationLanes::splitArraysOfIterations() {
  llvm::SetVector<Value> found;
  for (const OrderedGroup &group : getGroups())
    for (Operation *op : findTurns(group))
      op->walk([&](memref::StoreOp store) {
        Value array = store.getMemRef();
        if (isPrivate(array) && !isVarying(array))
          found.insert(array);
      });
  if (!found.empty())
    split(found.getArrayRef());
  return !found.empty();
}

/// About how many instructions an operation is as vectors: those of 64 bits
/// take two, and conversions bring two halves together.
static int64_t countInstructions(Operation *op) {
  auto isWide = [](Type type) { return type.isInteger(64) || type.isF64(); };
  bool fromWide = llvm::any_of(op->getOperandTypes(), isWide),
       toWide = llvm::any_of(op->getResultTypes(), isWide);
  return fromWide != toWide && !isa<arith::CmpIOp, arith::CmpFOp>(op) ? 3
         : fromWide || toWide                                         ? 2
                                                                      : 1;
}

/// Adds up the instructions of a side that has no effect where no lane is
/// active; false if it may have one, or takes long.
bool IterationLanes::addInstructions(Region &region, bool isOfStrip,
                                     bool isNested, int64_t &count) const {
  for (Operation &op : region.front().without_terminator()) {
    LaneForm form = getForm(&op);
    if (isa<scf::IfOp>(op) && isNested && isVarying(op.getOperand(0))) {
      for (Region &side : op.getRegions())
        if (!side.empty() && !addInstructions(side, isOfStrip, isNested, count))
          return false;
      count += isOfStrip ? 0 : op.getNumResults(); // chosen
      continue;
    }
    bool isFree =
        form == LaneForm::Vector || (form == LaneForm::Uniform && isPure(&op));
    bool isMasked = isOfStrip && isa<LoadOp, StoreOp>(op) &&
                    form == LaneForm::Access && isRow(&op) && !findLimited(&op);
    if ((!isFree && !isMasked) || isDivision(&op) || findGroup(&op))
      return false;
    count += countInstructions(&op);
  }
  return true;
}

// Hardly any vector of a strip is empty, and where one is, a branch is seldom
// foreseen: without it, the next row's pixels are asked for in the meantime.
bool IterationLanes::isCheap(Region &region, bool isNested) const {
  constexpr int64_t most = 12, mostOfStrip = 64;
  bool isOfStrip = isOneVector(loop, getLaneCount());
  int64_t count = 0;
  return addInstructions(region, isOfStrip, isNested || isOfStrip, count) &&
         count <= (isOfStrip ? mostOfStrip : most);
}
