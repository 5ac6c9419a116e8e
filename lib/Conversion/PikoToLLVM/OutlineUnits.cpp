// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Parts of kernels as functions of their own. A unit of work: a kernel of a
// cycle may have next to nothing to do, and then calls it without a parallel
// region, which takes longer. The versions of a loop over primitives, of which
// the scalar one holds loops in two versions itself: together in one function
// they would contend for registers, and the one that runs would spill for the
// others.

#include "LoweringContext.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/OpenMP/OpenMPDialect.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Transforms/RegionUtils.h"

using namespace mlir;
using namespace piko;

namespace {
/// Where a thread runs a unit, as convert-piko-to-openmp has written it.
struct UnitBody {
  Operation *loop; ///< In the parallel region.
  Block *block;
  Value unit, count;
};
} // namespace

static UnitBody findUnitBody(omp::ParallelOp parallel) {
  scf::WhileOp loop =
      *parallel.getRegion().front().getOps<scf::WhileOp>().begin();
  Block *body = loop.getAfterBody();
  auto goesOn =
      loop.getConditionOp().getCondition().getDefiningOp<arith::CmpIOp>();
  return {loop, body, body->getArgument(0), goesOn.getRhs()};
}

static bool canBeMadeAgain(Operation *op) {
  return op && (op->hasTrait<OpTrait::ConstantLike>() ||
                isa<LLVM::AddressOfOp, LLVM::ZeroOp>(op));
}

/// Splits what a loop's body takes from around the threads into what can be
/// made again in it, and what cannot.
static void splitCaptures(const UnitBody &body, Region &threads,
                          SmallVector<Operation *> &constants,
                          SmallVector<Value> &arguments) {
  llvm::SetVector<Value> captures;
  getUsedValuesDefinedAbove(*body.block->getParent(), captures);
  for (Value capture : captures) {
    Operation *made = capture.getDefiningOp();
    if (capture == body.unit ||
        (made && threads.isAncestor(made->getParentRegion())))
      continue; // a private array
    if (canBeMadeAgain(made))
      constants.push_back(made);
    else
      arguments.push_back(capture);
  }
}

/// Makes a function of the body of a parallel loop; its arguments are what
/// `arguments` says, and the unit.
static func::FuncOp createUnit(func::FuncOp kernel, const UnitBody &body,
                               ArrayRef<Operation *> constants,
                               ArrayRef<Value> arguments) {
  OpBuilder builder(kernel);
  SmallVector<Type> types = llvm::map_to_vector(
      arguments, [](Value argument) { return argument.getType(); });
  types.push_back(builder.getIndexType());
  Location loc = body.loop->getLoc();
  auto unit =
      func::FuncOp::create(builder, loc, (kernel.getSymName() + ".unit").str(),
                           builder.getFunctionType(types, {}));
  unit.setPrivate();
  Block *entry = unit.addEntryBlock();
  builder.setInsertionPointToEnd(entry);
  IRMapping copies;
  for (Operation *constant : constants)
    builder.clone(*constant, copies);
  for (auto [from, to] : llvm::zip(arguments, entry->getArguments()))
    copies.map(from, to);
  // Private arrays, which lie before the loop.
  for (Operation &op : llvm::make_early_inc_range(*body.loop->getBlock())) {
    if (&op == body.loop)
      break;
    op.moveBefore(entry, entry->end());
  }
  entry->getOperations().splice(entry->end(), body.block->getOperations(),
                                body.block->begin(),
                                std::prev(body.block->end()));
  replaceAllUsesInRegionWith(body.unit, entry->getArguments().back(),
                             unit.getBody());
  for (auto [from, to] : copies.getValueMap())
    replaceAllUsesInRegionWith(from, to, unit.getBody());
  func::ReturnOp::create(builder, loc);
  return unit;
}

void piko::outlineUnits(func::FuncOp kernel) {
  auto loops = kernel.getOps<omp::ParallelOp>();
  if (loops.empty())
    return; // a serial schedule
  omp::ParallelOp parallel = *loops.begin();
  UnitBody body = findUnitBody(parallel);
  SmallVector<Operation *> constants;
  SmallVector<Value> arguments;
  splitCaptures(body, parallel.getRegion(), constants, arguments);
  func::FuncOp unit = createUnit(kernel, body, constants, arguments);

  auto call = [&](OpBuilder &builder, Location loc, Value number) {
    SmallVector<Value> operands(arguments);
    operands.push_back(number);
    func::CallOp::create(builder, loc, unit, operands);
  };
  OpBuilder builder(body.block->getTerminator());
  Location loc = parallel.getLoc();
  call(builder, loc, body.unit);

  builder.setInsertionPoint(parallel);
  Value threads = parallel.getNumThreads();
  Value several = arith::CmpIOp::create(
      builder, loc, arith::CmpIPredicate::sgt, threads,
      arith::ConstantIntOp::create(builder, loc, threads.getType(), 1));
  auto choice = scf::IfOp::create(builder, loc, several, /*withElse=*/true);
  parallel->moveBefore(choice.thenYield());
  builder.setInsertionPoint(choice.elseYield());
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto serial = scf::ForOp::create(builder, loc, zero, body.count, one);
  builder.setInsertionPoint(serial.getBody()->getTerminator());
  call(builder, loc, serial.getInductionVar());
}

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
  llvm::SmallVector<scf::IfOp> choices;
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
