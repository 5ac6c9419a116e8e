// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-if-convert: from the inside out, for each scf.if and scf.index_switch
// with results whose arms compute next to nothing,
//   1. move what the arms hold before it;
//   2. choose each result by arith.select, with one test for cases of the same
//      values.

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

namespace piko {
#define GEN_PASS_DEF_IFCONVERT
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct IfConvertPass : public piko::impl::IfConvertBase<IfConvertPass> {
  using IfConvertBase::IfConvertBase;
  void runOnOperation() override;

private:
  bool isCheap(Operation *choice);
};
} // namespace

/// Whether an operation reads a field, compares, converts or chooses integers,
/// which costs less than a branch that is not predicted.
static bool isChoosing(Operation &op) {
  return isMemoryEffectFree(&op) && isSpeculatable(&op) &&
         isa<GetOp, arith::ConstantOp, arith::CmpIOp, arith::SelectOp,
             arith::AndIOp, arith::OrIOp, arith::XOrIOp, arith::IndexCastOp,
             arith::IndexCastUIOp, arith::ExtUIOp, arith::ExtSIOp,
             arith::TruncIOp>(op);
}

static bool isScalar(Type type) { return type.isIntOrIndexOrFloat(); }

/// Whether what a choice executes is so little that all arms may.
bool IfConvertPass::isCheap(Operation *choice) {
  if (choice->getNumResults() == 0 ||
      !llvm::all_of(choice->getResultTypes(), isScalar))
    return false;
  int64_t operations = 0;
  for (Region &arm : choice->getRegions())
    for (Operation &op : arm.front().without_terminator()) {
      if (!isChoosing(op))
        return false;
      operations += !isa<arith::ConstantOp>(op);
    }
  int64_t cases = choice->getNumRegions() - 1;
  return operations <= maxOperations && cases <= maxCases;
}

/// Moves an arm's operations before the choice; its values.
static OperandRange hoist(Region &arm, Operation *choice) {
  Block &block = arm.front();
  Operation *yield = block.getTerminator();
  while (&block.front() != yield)
    block.front().moveBefore(choice);
  return yield->getOperands();
}

static void convert(scf::IfOp choice) {
  OperandRange ifTrue = hoist(choice.getThenRegion(), choice);
  OperandRange ifFalse = hoist(choice.getElseRegion(), choice);
  OpBuilder builder(choice);
  for (auto [result, left, right] :
       llvm::zip(choice.getResults(), ifTrue, ifFalse))
    result.replaceAllUsesWith(
        left == right
            ? left
            : arith::SelectOp::create(builder, choice.getLoc(),
                                      choice.getCondition(), left, right)
                  .getResult());
  choice.erase();
}

static void convert(scf::IndexSwitchOp choice) {
  OperandRange otherwise = hoist(choice.getDefaultRegion(), choice);
  SmallVector<std::pair<Value, OperandRange>> cases; // by their tests
  Location loc = choice.getLoc();
  for (auto [number, arm] :
       llvm::zip(choice.getCases(), choice.getCaseRegions())) {
    OperandRange values = hoist(arm, choice);
    OpBuilder builder(choice);
    Value constant = arith::ConstantIndexOp::create(builder, loc, number);
    Value test = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                       choice.getArg(), constant);
    auto same = llvm::find_if(cases, [&](const auto &earlier) {
      return llvm::equal(earlier.second, values);
    });
    if (same == cases.end())
      cases.emplace_back(test, values);
    else
      same->first = arith::OrIOp::create(builder, loc, same->first, test);
  }
  OpBuilder builder(choice);
  for (OpResult result : choice.getResults()) {
    unsigned i = result.getResultNumber();
    Value chosen = otherwise[i];
    for (auto &[test, values] : cases)
      if (values[i] != chosen)
        chosen = arith::SelectOp::create(builder, loc, test, values[i], chosen);
    result.replaceAllUsesWith(chosen);
  }
  choice.erase();
}

void IfConvertPass::runOnOperation() {
  getOperation().walk([&](Operation *op) { // inner ones first
    if (!isa<scf::IfOp, scf::IndexSwitchOp>(op) || !isCheap(op))
      return;
    if (auto choice = dyn_cast<scf::IfOp>(op))
      convert(choice);
    else
      convert(cast<scf::IndexSwitchOp>(op));
  });
}
