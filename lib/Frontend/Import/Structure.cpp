//===- Structure.cpp - From branches to scf -------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is between two placeholders is lifted by itself: then both are in one
// block, even if a path in between never ends.
//
//===----------------------------------------------------------------------===//

#include "Import/Import.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/Piko.h"
#include "mlir/Conversion/ControlFlowToSCF/ControlFlowToSCF.h"
#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/Dominance.h"

using namespace piko;
using mlir::func::CallOp;

namespace {

class Lifting : public mlir::ControlFlowToSCFTransformation {
public:
  /// An iteration or an update that never ends, as a phase that never does.
  llvm::FailureOr<mlir::Operation *>
  createUnreachableTerminator(mlir::Location location, mlir::OpBuilder &builder,
                              mlir::Region &region) override {
    if (mlir::isa<ParallelLoopOpInterface>(region.getParentOp()))
      return YieldOp::create(builder, location, mlir::ValueRange(),
                             mlir::ValueRange())
          .getOperation();
    auto wrapper =
        mlir::dyn_cast<mlir::scf::ExecuteRegionOp>(region.getParentOp());
    if (!wrapper)
      return ControlFlowToSCFTransformation::createUnreachableTerminator(
          location, builder, region);
    llvm::SmallVector<mlir::Value> values;
    for (mlir::Type type : wrapper.getResultTypes())
      values.push_back(mlir::ub::PoisonOp::create(builder, location, type));
    return mlir::scf::YieldOp::create(builder, location, values).getOperation();
  }

  /// Keeps how likely the text says that a branch is.
  llvm::FailureOr<mlir::Operation *> createStructuredBranchRegionOp(
      mlir::OpBuilder &builder, mlir::Operation *branch, mlir::TypeRange types,
      llvm::MutableArrayRef<mlir::Region> regions) override {
    auto made = ControlFlowToSCFTransformation::createStructuredBranchRegionOp(
        builder, branch, types, regions);
    if (auto all = branch->getAttr(marks::probabilities);
        all && llvm::succeeded(made))
      (*made)->setAttr(marks::probabilities, all);
    if (auto condition = mlir::dyn_cast<mlir::cf::CondBranchOp>(branch);
        condition && llvm::succeeded(made))
      setProbability(*made, getProbability(condition));
    return made;
  }

  /// Keeps how likely the text says that a loop goes on.
  llvm::FailureOr<mlir::Operation *> createStructuredDoWhileLoopOp(
      mlir::OpBuilder &builder, mlir::Operation *branch, mlir::ValueRange inits,
      mlir::Value again, mlir::ValueRange next, mlir::Region &&body) override {
    std::optional<double> known;
    if (auto flag = mlir::dyn_cast<mlir::BlockArgument>(again))
      known = computeIterationProbability(&body.front(), flag);
    auto made = ControlFlowToSCFTransformation::createStructuredDoWhileLoopOp(
        builder, branch, inits, again, next, std::move(body));
    if (llvm::succeeded(made))
      setProbability(*made, known);
    return made;
  }
};

/// The blocks between two placeholders, which are entered at the first and
/// left at the second alone.
class Between {
public:
  explicit Between(CallOp begin) : begin(begin) {}

  /// Finds them; false if they need no care or none can be taken.
  bool find();
  /// Makes one operation of them, and of the rest one block.
  mlir::scf::ExecuteRegionOp wrap();

private:
  /// Whether it goes on after a block.
  bool visit(mlir::Block *block, mlir::Block::iterator from);
  bool isInside(mlir::Operation *user) const;

  CallOp begin;
  llvm::SetVector<mlir::Block *> blocks; ///< But for that of `begin`.
  llvm::SetVector<mlir::Operation *> ends;
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

bool Between::visit(mlir::Block *block, mlir::Block::iterator from) {
  llvm::StringRef name = getBracketEnd(begin);
  for (mlir::Operation &op : llvm::make_range(from, block->end()))
    if (auto call = mlir::dyn_cast<CallOp>(op);
        call && call.getCallee() == name) {
      ends.insert(call);
      return false;
    }
  return true;
}

bool Between::find() {
  mlir::Block *first = begin->getBlock();
  if (!visit(first, std::next(begin->getIterator())))
    return false;
  blocks.insert_range(first->getSuccessors());
  for (size_t i = 0; i < blocks.size(); ++i)
    if (blocks[i] == first || blocks[i]->isEntryBlock())
      return false;
    else if (visit(blocks[i], blocks[i]->begin()))
      blocks.insert_range(blocks[i]->getSuccessors());
  // Of nested ones the inner end may come first, which is reported later.
  return ends.size() == 1 && llvm::all_of(blocks, [&](mlir::Block *block) {
           return llvm::all_of(block->getPredecessors(), [&](auto *from) {
             return from == first || blocks.contains(from);
           });
         });
}

bool Between::isInside(mlir::Operation *user) const {
  mlir::Operation *at = begin->getParentRegion()->findAncestorOpInRegion(*user);
  return blocks.contains(at->getBlock());
}

mlir::scf::ExecuteRegionOp Between::wrap() {
  mlir::Block *first = begin->getBlock();
  mlir::Block *body = first->splitBlock(std::next(begin->getIterator()));
  mlir::Operation *end = ends.front();
  mlir::Block *last = end->getBlock(), *rest = last->splitBlock(end);
  blocks.insert(body);

  llvm::SmallVector<mlir::Value> leaving;
  auto addIfLeaving = [&](mlir::Value value) {
    if (!llvm::all_of(value.getUsers(),
                      [&](auto *user) { return isInside(user); }))
      leaving.push_back(value);
  };
  for (mlir::Block *block : blocks) {
    llvm::for_each(block->getArguments(), addIfLeaving);
    for (mlir::Operation &op : *block)
      llvm::for_each(op.getResults(), addIfLeaving);
  }

  mlir::OpBuilder builder = mlir::OpBuilder::atBlockEnd(first);
  auto wrapper = mlir::scf::ExecuteRegionOp::create(
      builder, begin.getLoc(), mlir::ValueRange(leaving).getTypes());
  for (auto [value, result] : llvm::zip(leaving, wrapper.getResults()))
    mlir::Value(value).replaceUsesWithIf(result, [&](mlir::OpOperand &use) {
      return !isInside(use.getOwner());
    });
  builder.setInsertionPointToEnd(last);
  mlir::scf::YieldOp::create(builder, end->getLoc(), leaving);
  body->moveBefore(&wrapper.getRegion(), wrapper.getRegion().end());
  for (mlir::Block *block : blocks)
    if (block != body)
      block->moveBefore(&wrapper.getRegion(), wrapper.getRegion().end());
  first->getOperations().splice(first->end(), rest->getOperations());
  rest->erase();
  return wrapper;
}

/// Puts the one block of an operation in its place.
static void unwrap(mlir::scf::ExecuteRegionOp wrapper) {
  mlir::Block &body = wrapper.getRegion().front();
  mlir::Operation *yield = body.getTerminator();
  wrapper->replaceAllUsesWith(yield->getOperands());
  yield->erase();
  wrapper->getBlock()->getOperations().splice(wrapper->getIterator(),
                                              body.getOperations());
  wrapper->erase();
}

static llvm::LogicalResult structureRegion(mlir::Region &region) {
  llvm::SmallVector<CallOp> begins;
  for (CallOp call : region.getOps<CallOp>())
    if (!getBracketEnd(call).empty())
      begins.push_back(call);
  for (CallOp begin : begins) {
    Between between(begin);
    if (!between.find())
      continue;
    mlir::scf::ExecuteRegionOp wrapper = between.wrap();
    if (llvm::failed(liftBranches(wrapper.getRegion())))
      return llvm::failure();
    unwrap(wrapper);
  }
  return liftBranches(region);
}

llvm::LogicalResult piko::structurePhase(mlir::func::FuncOp function) {
  // Inner loops first.
  mlir::WalkResult structured = function.walk([](ParallelLoopOpInterface loop) {
    return mlir::WalkResult(structureRegion(loop->getRegion(0)));
  });
  if (structured.wasInterrupted() ||
      llvm::failed(structureRegion(function.getBody())))
    return llvm::failure();
  return resolveBrackets(function);
}
