// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What each of R ranks computes of a source is either its part, and then
// (R - 1)/R of all bytes come from others; or all, and then (R - 1)/R of all
// calls are made in addition. So it does not depend on R what costs less: it is
// the operations of a call for each byte of its result.

#include "Ranks/Partition.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Interfaces/LoopLikeInterface.h"

using namespace mlir;
using namespace piko;

/// How many operations take as long as a byte that is compared, packed, sent,
/// and put in its place. On one machine this is 40 where they run on vectors,
/// and 3 where they do not.
static constexpr double operationsPerByte = 16;

/// How often the body of a loop runs of which the text does not say it.
static constexpr double unknownTrips = 16;

static double getTrips(Operation *op) {
  if (auto loop = dyn_cast<LoopLikeOpInterface>(op))
    if (std::optional<llvm::APInt> trips = loop.getStaticTripCount())
      return double(trips->getZExtValue());
  return unknownTrips;
}

static double countInside(Region &region);

static double countOperations(Operation &op) {
  if (op.hasTrait<OpTrait::IsTerminator>() ||
      op.hasTrait<OpTrait::ConstantLike>())
    return 0;
  double inside = 0;
  for (Region &region : op.getRegions())
    inside += countInside(region);
  if (op.getNumRegions() > 0) {
    bool isLoop = !isa<scf::IfOp, UpdateOp, ProcessOp, AssignOp>(op);
    return inside * (isLoop ? getTrips(&op) : 1);
  }
  bool isSlow =
      isa<arith::DivFOp>(op) || op.getName().getDialectNamespace() == "math";
  return isSlow ? 8 : 1;
}

static double countInside(Region &region) {
  double sum = 0;
  for (Block &block : region)
    for (Operation &op : block)
      sum += countOperations(op);
  return sum;
}

/// Of a call: one record of each piece of state that it stores to, more often
/// in loops.
static double countStoredBytes(KernelOp kernel) {
  llvm::DenseMap<Attribute, double> stored;
  kernel.walk([&](StoreOp store) {
    double bytes =
        lookupRecord(store, getStateRecord(lookupInPipeline<Operation *>(
                                store, store.getStateAttr())))
            .getSize();
    for (Operation *outer = store->getParentOp(); outer != kernel;
         outer = outer->getParentOp())
      if (isa<LoopLikeOpInterface>(outer))
        bytes *= getTrips(outer);
    double &most = stored[store.getStateAttr()];
    most = std::max(most, bytes);
  });
  double sum = 0;
  for (auto [state, bytes] : stored)
    sum += bytes;
  return sum;
}

bool piko::isCheaperThanItsStores(KernelOp kernel) {
  return countInside(kernel.getBody()) <=
         operationsPerByte * countStoredBytes(kernel);
}

bool piko::isCheaperThanItsBins(KernelOp kernel) {
  constexpr double bytes = 8; // an entry for the primitive, and of most a bin
  return countInside(kernel.getBody()) <= operationsPerByte * bytes;
}
