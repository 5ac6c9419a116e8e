// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A unit of work as a function: a kernel of a cycle may have next to nothing to
// do, and then calls it without a parallel region, which takes longer.

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

bool piko::canBeMadeAgain(Operation *op) {
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
