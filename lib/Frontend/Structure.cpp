//===- Structure.cpp - From branches to scf -------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "mlir/Conversion/ControlFlowToSCF/ControlFlowToSCF.h"
#include "mlir/IR/Dominance.h"

using namespace piko;

namespace {

class Lifting : public mlir::ControlFlowToSCFTransformation {
public:
  /// An iteration that never ends, as a phase that never does.
  llvm::FailureOr<mlir::Operation *>
  createUnreachableTerminator(mlir::Location location, mlir::OpBuilder &builder,
                              mlir::Region &region) override {
    if (!mlir::isa<ParallelForOp>(region.getParentOp()))
      return ControlFlowToSCFTransformation::createUnreachableTerminator(
          location, builder, region);
    return YieldOp::create(builder, location, mlir::ValueRange(),
                           mlir::ValueRange())
        .getOperation();
  }
};

} // namespace

static llvm::LogicalResult liftBranches(mlir::Region &region) {
  Lifting lifting;
  mlir::DominanceInfo dominance(region.getParentOp());
  if (llvm::succeeded(mlir::transformCFGToSCF(region, lifting, dominance)))
    return llvm::success();
  return mlir::emitError(region.getLoc(),
                         "not supported in Piko: this control flow");
}

llvm::LogicalResult piko::structurePhase(mlir::func::FuncOp function) {
  // Inner loops first.
  mlir::WalkResult lifted = function.walk([](ParallelForOp loop) {
    return mlir::WalkResult(liftBranches(loop.getBody()));
  });
  if (lifted.wasInterrupted() || llvm::failed(liftBranches(function.getBody())))
    return llvm::failure();
  return resolveBrackets(function);
}
