// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The versions of a loop over primitives as functions, where the scalar one
// holds loops in two versions itself: together in one function they would
// contend for registers, and the one that runs would spill for the others.

#include "LoweringContext.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Transforms/RegionUtils.h"

using namespace mlir;
using namespace piko;

/// Makes a function of one side of a choice, of which no other calls it.
static void outlineSide(scf::IfOp choice, Region &side, const Twine &name) {
  auto kernel = choice->getParentOfType<func::FuncOp>();
  llvm::SetVector<Value> captures;
  getUsedValuesDefinedAbove(side, captures);
  auto isInChoice = [&](Operation *user) { return choice->isAncestor(user); };
  // Private arrays of an iteration are made anew, as each side has its own.
  SmallVector<Operation *> own;
  SmallVector<Value> arguments;
  for (Value capture : captures) {
    Operation *made = capture.getDefiningOp();
    if (canBeMadeAgain(made) || (isa_and_present<memref::AllocaOp>(made) &&
                                 llvm::all_of(made->getUsers(), isInChoice)))
      own.push_back(made);
    else
      arguments.push_back(capture);
  }

  OpBuilder builder(kernel);
  Location loc = choice.getLoc();
  auto version = func::FuncOp::create(
      builder, loc, name.str(),
      builder.getFunctionType(ValueRange(arguments).getTypes(), {}));
  version.setPrivate();
  version->setAttr("passthrough", builder.getStrArrayAttr({"noinline"}));
  Block *entry = version.addEntryBlock();
  builder.setInsertionPointToEnd(entry);
  IRMapping copies;
  for (Operation *op : own)
    builder.clone(*op, copies);
  copies.map(arguments, entry->getArguments());
  Block &block = side.front();
  entry->getOperations().splice(entry->end(), block.getOperations(),
                                block.begin(), std::prev(block.end()));
  for (auto [from, to] : copies.getValueMap())
    replaceAllUsesInRegionWith(from, to, version.getBody());
  func::ReturnOp::create(builder, loc);
  builder.setInsertionPoint(block.getTerminator());
  func::CallOp::create(builder, loc, version, arguments);
}

void piko::unswitchScalarVersions(KernelOp kernel) {
  SmallVector<scf::IfOp> choices;
  kernel.walk([&](scf::IfOp choice) {
    if (choice->hasAttr(marks::versions) && choice.elseBlock())
      choices.push_back(choice);
  });
  for (scf::IfOp choice : choices) {
    llvm::SetVector<Value> captures, inner;
    getUsedValuesDefinedAbove(choice.getElseRegion(), captures);
    for (Value capture : captures)
      if (capture.getDefiningOp<TakesVectorsOp>())
        inner.insert(capture);
    if (inner.empty()) {
      choice->removeAttr(marks::versions); // Two bodies may share a function.
      continue;
    }
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
}

/// Whether there is nothing to choose on a side but between other versions.
static bool isChoiceOnly(Block &side) {
  return llvm::any_of(side, [](Operation &op) {
    return isa<scf::IfOp>(op) && op.hasAttr(marks::versions);
  });
}

void piko::outlineVersions(func::FuncOp kernel) {
  SmallVector<std::pair<scf::IfOp, Region *>> sides;
  SmallVector<scf::IfOp> choices;
  kernel.walk([&](scf::IfOp choice) {
    if (!choice->hasAttr(marks::versions))
      return;
    choices.push_back(choice);
    for (Region *side : choice.getRegions())
      if (!side->empty() && !isChoiceOnly(side->front()))
        sides.push_back({choice, side});
  });
  for (auto [number, side] : llvm::enumerate(sides))
    outlineSide(side.first, *side.second,
                kernel.getSymName() + ".version" + Twine(number));
  for (scf::IfOp choice : choices)
    choice->removeAttr(marks::versions);
}
