//===- Structure.cpp - Branches to scf, updates to regions ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "mlir/Conversion/ControlFlowToSCF/ControlFlowToSCF.h"
#include "mlir/IR/Dominance.h"

using namespace piko;
using mlir::func::CallOp;

static bool isBegin(mlir::Operation &op) {
  auto call = mlir::dyn_cast<CallOp>(op);
  return call && call.getCallee().starts_with(updateBeginName);
}
static bool isEnd(mlir::Operation &op) {
  auto call = mlir::dyn_cast<CallOp>(op);
  return call && call.getCallee() == updateEndName;
}

/// Moves what an update does not need to be inside of it to before it.
static void hoistPureOps(CallOp begin, mlir::Operation *end) {
  mlir::Block *block = begin->getBlock();
  for (auto &op : llvm::make_early_inc_range(llvm::make_range(
           std::next(begin->getIterator()), end->getIterator()))) {
    if (op.getNumRegions() != 0 || !mlir::isPure(&op))
      continue;
    bool isOutside = llvm::all_of(op.getOperands(), [&](mlir::Value operand) {
      mlir::Operation *definition = operand.getDefiningOp();
      return !definition || definition->getBlock() != block ||
             definition->isBeforeInBlock(begin);
    });
    if (isOutside)
      op.moveBefore(begin);
  }
}

/// Moves what lies between a begin and its end into an update.
static llvm::LogicalResult makeUpdate(CallOp begin) {
  mlir::Block *block = begin->getBlock();
  mlir::Operation *end = nullptr;
  for (auto &op :
       llvm::make_range(std::next(begin->getIterator()), block->end())) {
    if (isBegin(op))
      return mlir::emitError(
          op.getLoc(), "not supported in Piko: an update inside an update");
    if (isEnd(op)) {
      end = &op;
      break;
    }
  }
  if (!end)
    return mlir::emitError(
        begin.getLoc(),
        "not supported in Piko: leaving an update other than at its end");

  hoistPureOps(begin, end);
  llvm::SmallVector<mlir::Operation *> body;
  for (auto &op :
       llvm::make_range(std::next(begin->getIterator()), end->getIterator()))
    body.push_back(&op);
  llvm::SmallVector<mlir::Value> leaving;
  for (mlir::Operation *op : body)
    for (mlir::Value result : op->getResults())
      if (llvm::any_of(result.getUsers(), [&](mlir::Operation *user) {
            mlir::Operation *at = block->findAncestorOpInBlock(*user);
            return !at || (at != end && end->isBeforeInBlock(at));
          }))
        leaving.push_back(result);
  // What the update began with may be read after it.
  llvm::SmallVector<mlir::Value> pixel(begin.getResults());
  for (mlir::Value value : pixel)
    if (llvm::any_of(value.getUsers(), [&](mlir::Operation *user) {
          mlir::Operation *at = block->findAncestorOpInBlock(*user);
          return !at || (at != end && end->isBeforeInBlock(at));
        }))
      leaving.push_back(value);

  mlir::OpBuilder builder(begin);
  llvm::SmallVector<mlir::Type> types;
  for (mlir::Value value : leaving)
    types.push_back(value.getType());
  auto update = UpdateOp::create(
      builder, begin.getLoc(), types,
      mlir::FlatSymbolRefAttr::get(
          builder.getContext(),
          begin.getCallee().drop_front(updateBeginName.size())),
      begin.getOperands(), mlir::Value());
  mlir::Block *inner = builder.createBlock(&update.getBody());
  for (mlir::Value value : pixel)
    inner->addArgument(value.getType(), begin.getLoc());
  for (mlir::Operation *op : body)
    op->moveBefore(inner, inner->end());
  builder.setInsertionPointToEnd(inner);
  auto yield =
      YieldOp::create(builder, end->getLoc(), end->getOperands(), leaving);
  for (auto [value, result] : llvm::zip(leaving, update.getResults()))
    value.replaceUsesWithIf(result, [&](mlir::OpOperand &use) {
      return !update->isAncestor(use.getOwner()) && use.getOwner() != end;
    });
  end->erase();
  for (auto [value, argument] : llvm::zip(pixel, inner->getArguments()))
    value.replaceAllUsesWith(argument);
  (void)yield;
  begin.erase();
  return llvm::success();
}

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
  llvm::SmallVector<CallOp> begins;
  function.walk([&](CallOp call) {
    if (isBegin(*call))
      begins.push_back(call);
  });
  for (CallOp begin : begins)
    if (llvm::failed(makeUpdate(begin)))
      return llvm::failure();
  return llvm::success();
}
