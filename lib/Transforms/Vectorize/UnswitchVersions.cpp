// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-unswitch-versions: a body for units that run all inner loops as scalar
// ones.

#include "Piko/Transforms/Passes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Transforms/RegionUtils.h"

namespace piko {
#define GEN_PASS_DEF_UNSWITCHVERSIONS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct UnswitchVersionsPass
    : piko::impl::UnswitchVersionsBase<UnswitchVersionsPass> {
  void runOnOperation() override;
};
} // namespace

/// The decisions, made before a choice, that its scalar version depends
/// on: each is whether a loop in it runs by vectors.
static llvm::SetVector<Value> findInnerDecisions(scf::IfOp choice) {
  llvm::SetVector<Value> captures, inner;
  getUsedValuesDefinedAbove(choice.getElseRegion(), captures);
  for (Value capture : captures)
    if (capture.getDefiningOp<TakesVectorsOp>())
      inner.insert(capture);
  return inner;
}

/// Makes two of the scalar version: the first for units in which one of its
/// inner loops runs by vectors, the second for those in which none does.
static void unswitch(scf::IfOp choice, const llvm::SetVector<Value> &inner) {
  Location loc = choice.getLoc();
  Block *scalar = choice.elseBlock();
  OpBuilder builder(scalar, scalar->begin());
  Value any = inner.front();
  for (Value takes : llvm::drop_begin(inner))
    any = arith::OrIOp::create(builder, loc, any, takes);
  auto split = scf::IfOp::create(builder, loc, any, /*withElse=*/true);
  split->setAttr(marks::versions, builder.getUnitAttr());
  Block *mixed = split.thenBlock();
  mixed->getOperations().splice(mixed->begin(), scalar->getOperations(),
                                std::next(split->getIterator()),
                                std::prev(scalar->end()));
  builder.setInsertionPointToStart(split.elseBlock());
  Value none = arith::ConstantIntOp::create(builder, loc, 0, 1);
  IRMapping copies;
  for (Value takes : inner)
    copies.map(takes, none);
  for (Operation &op : mixed->without_terminator())
    builder.clone(op, copies);
}

void UnswitchVersionsPass::runOnOperation() {
  SmallVector<scf::IfOp> choices;
  getOperation().walk([&](scf::IfOp choice) {
    if (choice->hasAttr(marks::versions) && choice.elseBlock())
      choices.push_back(choice);
  });
  for (scf::IfOp choice : choices)
    if (auto inner = findInnerDecisions(choice); !inner.empty())
      unswitch(choice, inner);
}
