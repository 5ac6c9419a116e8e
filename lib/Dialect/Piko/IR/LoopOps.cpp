// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations and where they meet.

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

using namespace mlir;
using namespace piko;

#include "Piko/Dialect/Piko/IR/PikoInterfaces.cpp.inc"

//===----------------------------------------------------------------------===//
// Loops
//===----------------------------------------------------------------------===//

/// What holds of every parallel loop, whatever its iterations are called.
static LogicalResult verifyParallelLoop(ParallelLoopOpInterface loop) {
  Operation *end = loop.getBodyBlock()->getTerminator();
  if (!isa<YieldOp>(end) || end->getNumOperands() != 0)
    return loop->emitOpError(
        "expected its body to end with a piko.yield of nothing");
  if (loop->getParentOfType<UpdateOp>())
    return loop->emitOpError("expected to be outside an update");
  if (!loop->getParentOfType<ProcessOp>() && !loop->getParentOfType<KernelOp>())
    return loop->emitOpError("expected to be inside a process phase");
  return success();
}

LogicalResult ParallelForOp::verifyRegions() {
  Block &body = getBody().front();
  if (body.getNumArguments() != 1 || !body.getArgument(0).getType().isIndex())
    return emitOpError("expected one block argument of type 'index'");
  return verifyParallelLoop(*this);
}

Value ParallelForOp::buildIteration(OpBuilder &) { return getIteration(); }

LogicalResult ParallelPixelsOp::verifyRegions() {
  PipelineOp pipeline = getPipeline(*this);
  if (!pipeline)
    return emitOpError("expected to be inside a pipeline");
  int64_t rank = pipeline.getRank();
  if (int64_t(getLo().size()) != rank)
    return emitOpError("expected a box of ")
           << rank << " dimensions, as its pipeline has, but got "
           << getLo().size();
  Block &body = getBody().front();
  bool areCoordinates = llvm::all_of(
      body.getArgumentTypes(), [](Type type) { return type.isInteger(32); });
  if (body.getNumArguments() != rank || !areCoordinates)
    return emitOpError("expected ")
           << rank << " block arguments of type 'i32', but got ("
           << body.getArgumentTypes() << ")";
  return verifyParallelLoop(*this);
}

/// (z - z0) * (y1 - y0) + (y - y0), and so on down to x.
Value ParallelPixelsOp::buildIteration(OpBuilder &builder) {
  Location loc = getLoc();
  auto cast = [&](Value value) {
    return arith::IndexCastOp::create(builder, loc, builder.getIndexType(),
                                      value);
  };
  Value number;
  for (auto [lo, hi, at] :
       llvm::reverse(llvm::zip(getLo(), getHi(), getCell()))) {
    Value low = cast(lo);
    Value offset = arith::SubIOp::create(builder, loc, cast(at), low);
    if (number) {
      Value extent = arith::SubIOp::create(builder, loc, cast(hi), low);
      number = arith::MulIOp::create(builder, loc, number, extent);
      offset = arith::AddIOp::create(builder, loc, number, offset);
    }
    number = offset;
  }
  return number;
}

bool piko::detail::hasBarriers(Operation *loop) {
  return loop
      ->walk<WalkOrder::PreOrder>([&](Operation *op) {
        if (op != loop && isa<ParallelLoopOpInterface>(op))
          return WalkResult::skip();
        return isa<BarrierOpInterface>(op) ? WalkResult::interrupt()
                                           : WalkResult::advance();
      })
      .wasInterrupted();
}

//===----------------------------------------------------------------------===//
// Barriers
//===----------------------------------------------------------------------===//

/// All iterations of one loop that is not nested meet at the operation.
static LogicalResult verifyBarrier(Operation *op) {
  if (op->getParentOfType<UpdateOp>())
    return op->emitOpError("expected to be outside an update");
  auto loop = op->getParentOfType<ParallelLoopOpInterface>();
  if (!loop)
    return op->emitOpError(
        "expected to be inside a parallel_for or a parallel_pixels");
  if (auto outer = loop->getParentOfType<ParallelLoopOpInterface>()) {
    InFlightDiagnostic error = op->emitOpError("expected to be inside a ")
                               << loop->getName().stripDialect()
                               << " that is not nested";
    error.attachNote(outer.getLoc()) << "the outer one is here";
    return error;
  }
  if (Operation *combine = op->getParentOfType<ReduceOp>();
      combine && combine != op)
    return op->emitOpError("expected to be outside the body of a reduce");
  if (Operation *combine = op->getParentOfType<ScanOp>();
      combine && combine != op)
    return op->emitOpError("expected to be outside the body of a scan");
  if (Operation *group = op->getParentOfType<GroupedOp>(); group && group != op)
    return op->emitOpError("expected to be outside the body of a grouped");
  return success();
}

LogicalResult SyncOp::verify() { return verifyBarrier(*this); }
LogicalResult ReduceOp::verify() { return verifyBarrier(*this); }
LogicalResult ScanOp::verify() { return verifyBarrier(*this); }
LogicalResult SortOp::verify() { return verifyBarrier(*this); }
LogicalResult GroupedOp::verify() {
  for (Type type : getValues().getTypes())
    if (!isa<PrimType>(type) && !type.isIntOrIndexOrFloat())
      return emitOpError("expected numbers and primitives for values, but got ")
             << type;
  return verifyBarrier(*this);
}

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
    auto access = dyn_cast<StateAccessOpInterface>(inner);
    bool isEffect = isa<EmissionOpInterface, ParallelLoopOpInterface>(inner) ||
                    (access && access.getAccessKinds() != StateAccess::reads);
    if (inner == op || !isEffect)
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

LogicalResult GroupedOp::verifyRegions() {
  Block &body = getBody().front();
  SmallVector<Type> types(getKey().getTypes());
  llvm::append_range(types, getValues().getTypes());
  if (body.getArgumentTypes() != TypeRange(types))
    return emitOpError("expected block arguments of types (")
           << types << "), but got (" << body.getArgumentTypes() << ")";
  auto yield = dyn_cast<YieldOp>(body.getTerminator());
  if (!yield || !yield.getPixel().empty() ||
      yield.getResults().getTypes() != getResultTypes())
    return emitOpError("expected its body to yield results of types (")
           << getResultTypes() << ")";
  ValueRange key = ValueRange(body.getArguments()).take_front(getKey().size());
  WalkResult updates = walk([&](UpdateOp update) {
    if (!llvm::equal(key, update.getCoordinates()))
      update.emitOpError("expected to be of the pixel that is the key");
    else if (!update.getBin())
      update.emitOpError("expected to name the bin that its pixel must be in");
    else
      return WalkResult::advance();
    return WalkResult::interrupt();
  });
  return failure(updates.wasInterrupted());
}
