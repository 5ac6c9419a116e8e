// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations and where they meet.

#include "Piko/Dialect/Piko/IR/Piko.h"

using namespace mlir;
using namespace piko;

LogicalResult ParallelForOp::verifyRegions() {
  Block &body = getBody().front();
  if (body.getNumArguments() != 1 || !body.getArgument(0).getType().isIndex())
    return emitOpError("expected one block argument of type 'index'");
  if (!isa<YieldOp>(body.getTerminator()) ||
      body.getTerminator()->getNumOperands() != 0)
    return emitOpError("expected its body to end with a piko.yield of nothing");
  if ((*this)->getParentOfType<UpdateOp>())
    return emitOpError("expected to be outside an update");
  Operation *phase = (*this)->getParentOfType<ProcessOp>();
  if (!phase && !(*this)->getParentOfType<KernelOp>())
    return emitOpError("expected to be inside a process phase");
  return success();
}

bool ParallelForOp::hasBarriers() {
  return walk<WalkOrder::PreOrder>([&](Operation *op) {
           if (op != *this && isa<ParallelForOp>(op))
             return WalkResult::skip();
           return isa<SyncOp, ReduceOp, ScanOp, SortOp>(op)
                      ? WalkResult::interrupt()
                      : WalkResult::advance();
         })
      .wasInterrupted();
}

/// All iterations of one loop that is not nested meet at the operation.
static LogicalResult verifyBarrier(Operation *op) {
  if (op->getParentOfType<UpdateOp>())
    return op->emitOpError("expected to be outside an update");
  auto loop = op->getParentOfType<ParallelForOp>();
  if (!loop)
    return op->emitOpError("expected to be inside a parallel_for");
  if (auto outer = loop->getParentOfType<ParallelForOp>()) {
    InFlightDiagnostic error = op->emitOpError(
        "expected to be inside a parallel_for that is not nested");
    error.attachNote(outer.getLoc()) << "the outer one is here";
    return error;
  }
  if (Operation *combine = op->getParentOfType<ReduceOp>();
      combine && combine != op)
    return op->emitOpError("expected to be outside the body of a reduce");
  if (Operation *combine = op->getParentOfType<ScanOp>();
      combine && combine != op)
    return op->emitOpError("expected to be outside the body of a scan");
  return success();
}

LogicalResult SyncOp::verify() { return verifyBarrier(*this); }
LogicalResult ReduceOp::verify() { return verifyBarrier(*this); }
LogicalResult ScanOp::verify() { return verifyBarrier(*this); }
LogicalResult SortOp::verify() { return verifyBarrier(*this); }

/// The body of a reduction or a scan takes two values and yields one.
static LogicalResult verifyCombine(Operation *op, TypeRange types) {
  Block &body = op->getRegion(0).front();
  SmallVector<Type> pair(types);
  llvm::append_range(pair, types);
  if (types.empty())
    return op->emitOpError("expected at least one number to combine");
  if (body.getArgumentTypes() != TypeRange(pair))
    return op->emitOpError("expected block arguments of types (")
           << pair << "), but got (" << body.getArgumentTypes() << ")";
  auto yield = dyn_cast<YieldOp>(body.getTerminator());
  if (!yield || !yield.getPixel().empty() ||
      yield.getResults().getTypes() != types)
    return op->emitOpError("expected its body to yield results of types (")
           << types << ")";
  WalkResult effects = op->walk([&](Operation *inner) {
    if (inner == op ||
        !isa<EmitOp, StoreOp, AtomicOp, UpdateOp, ParallelForOp>(inner))
      return WalkResult::advance();
    inner->emitOpError("expected to be outside the function of a ")
        << op->getName().stripDialect();
    return WalkResult::interrupt();
  });
  return failure(effects.wasInterrupted());
}

LogicalResult ReduceOp::verifyRegions() {
  return verifyCombine(*this, getValues().getTypes());
}
LogicalResult ScanOp::verifyRegions() {
  return verifyCombine(*this, getValues().getTypes());
}
