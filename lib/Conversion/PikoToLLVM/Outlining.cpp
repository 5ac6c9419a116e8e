// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Parts of a kernel that become functions of their own:
//   1. a unit of work: a kernel of a cycle may have next to nothing to do, and
//      then calls it without a parallel region, which takes longer;
//   2. the versions of a loop over primitives whose scalar version is one of
//      two itself (piko-unswitch-versions): together in one function they would
//      contend for registers, and the one that runs would spill for the others.

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/OpenMP/OpenMPDialect.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Transforms/RegionUtils.h"

using namespace mlir;
using namespace piko;

namespace {
/// What a part takes from around it: what its function makes again, in order,
/// and what it gets as arguments.
struct Captures {
  SmallVector<Operation *> own;
  SmallVector<Value> arguments;
};

/// Where a thread runs a unit, as convert-piko-to-openmp has written it.
struct UnitBody {
  Operation *loop; ///< In the parallel region, or what holds it there.
  Block *block;
  Value unit, count;
};
} // namespace

/// Whether a part can have an operation of its own in place of an argument: it
/// costs nothing, and gives the same.
static bool canBeMadeAgain(Operation *op) {
  return op && (op->hasTrait<OpTrait::ConstantLike>() ||
                isa<LLVM::AddressOfOp, LLVM::ZeroOp>(op));
}

/// Makes a function, before the kernel, of what a block holds before its
/// terminator.
static func::FuncOp outline(Block &block, func::FuncOp kernel,
                            const Twine &name, const Captures &captures) {
  OpBuilder builder(kernel);
  Location loc = block.getParentOp()->getLoc();
  auto part = func::FuncOp::create(
      builder, loc, name.str(),
      builder.getFunctionType(ValueRange(captures.arguments).getTypes(), {}));
  part.setPrivate();
  Block *entry = part.addEntryBlock();
  builder.setInsertionPointToEnd(entry);
  IRMapping copies;
  for (Operation *op : captures.own)
    builder.clone(*op, copies);
  copies.map(captures.arguments, entry->getArguments());
  entry->getOperations().splice(entry->end(), block.getOperations(),
                                block.begin(), std::prev(block.end()));
  for (auto [from, to] : copies.getValueMap())
    replaceAllUsesInRegionWith(from, to, part.getBody());
  func::ReturnOp::create(builder, loc);
  return part;
}

//===----------------------------------------------------------------------===//
// Units
//===----------------------------------------------------------------------===//

static UnitBody findUnitBody(omp::ParallelOp parallel) {
  Block &thread = parallel.getRegion().front();
  // If there are any units.
  auto some = thread.getOps<scf::IfOp>();
  Block &units = some.empty() ? thread : *(*some.begin()).thenBlock();
  scf::WhileOp loop = *units.getOps<scf::WhileOp>().begin();
  Block *body = loop.getAfterBody();
  auto goesOn =
      loop.getConditionOp().getCondition().getDefiningOp<arith::CmpIOp>();
  return {thread.findAncestorOpInBlock(*loop), body, body->getArgument(0),
          goesOn.getRhs()};
}

/// A unit makes the thread's private arrays, which lie before its loop, anew;
/// its last argument is its number.
static Captures findCaptures(const UnitBody &body) {
  Captures found;
  llvm::SetVector<Value> captures;
  getUsedValuesDefinedAbove(*body.block->getParent(), captures);
  Region *threads = body.loop->getParentRegion();
  for (Value capture : captures) {
    if (canBeMadeAgain(capture.getDefiningOp()))
      found.own.push_back(capture.getDefiningOp());
    else if (capture.getParentRegion() != threads)
      found.arguments.push_back(capture);
  }
  for (Operation &op : *body.loop->getBlock()) {
    if (&op == body.loop)
      break;
    if (!llvm::is_contained(found.own, &op))
      found.own.push_back(&op);
  }
  found.arguments.push_back(body.unit);
  return found;
}

void piko::outlineUnits(func::FuncOp kernel) {
  auto loops = kernel.getOps<omp::ParallelOp>();
  if (loops.empty())
    return; // a serial schedule
  omp::ParallelOp parallel = *loops.begin();
  UnitBody body = findUnitBody(parallel);
  Captures captures = findCaptures(body);
  func::FuncOp unit =
      outline(*body.block, kernel, kernel.getSymName() + ".unit", captures);

  SmallVector<Value> operands = captures.arguments;
  auto call = [&](OpBuilder &builder, Location loc, Value number) {
    operands.back() = number;
    func::CallOp::create(builder, loc, unit, operands);
  };
  OpBuilder builder(body.block->getTerminator());
  Location loc = parallel.getLoc();
  call(builder, loc, body.unit);
  for (Operation *op : llvm::reverse(captures.own))
    if (op->getParentRegion() == &parallel.getRegion() && op->use_empty())
      op->erase();

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

//===----------------------------------------------------------------------===//
// Versions
//===----------------------------------------------------------------------===//

/// Private arrays of an iteration are made anew, as each side has its own.
static Captures findCaptures(scf::IfOp choice, Region &side) {
  Captures found;
  llvm::SetVector<Value> captures;
  getUsedValuesDefinedAbove(side, captures);
  auto isInChoice = [&](Operation *user) { return choice->isAncestor(user); };
  for (Value capture : captures) {
    Operation *made = capture.getDefiningOp();
    if (canBeMadeAgain(made) || (isa_and_present<memref::AllocaOp>(made) &&
                                 llvm::all_of(made->getUsers(), isInChoice)))
      found.own.push_back(made);
    else
      found.arguments.push_back(capture);
  }
  return found;
}

/// The choice between versions that is in a version; null if it is a body.
static scf::IfOp findInnerChoice(Region &version) {
  if (version.empty())
    return nullptr;
  for (auto choice : version.getOps<scf::IfOp>())
    if (choice->hasAttr(marks::versions) && choice.elseBlock())
      return choice;
  return nullptr;
}

void piko::outlineVersions(func::FuncOp kernel) {
  SmallVector<scf::IfOp> choices;
  kernel.walk([&](scf::IfOp choice) {
    if (choice->hasAttr(marks::versions))
      choices.push_back(choice);
  });
  SmallVector<std::pair<scf::IfOp, Region *>> versions;
  for (scf::IfOp choice : choices)
    if (scf::IfOp inner = findInnerChoice(choice.getElseRegion())) {
      versions.push_back({inner, &inner.getThenRegion()});
      versions.push_back({inner, &inner.getElseRegion()});
      versions.push_back({choice, &choice.getThenRegion()});
    }
  for (auto [number, version] : llvm::enumerate(versions)) {
    auto [choice, side] = version;
    Captures captures = findCaptures(choice, *side);
    func::FuncOp part =
        outline(side->front(), kernel,
                kernel.getSymName() + ".version" + Twine(number), captures);
    part->setAttr("passthrough",
                  Builder(kernel.getContext()).getStrArrayAttr({"noinline"}));
    OpBuilder builder(side->front().getTerminator());
    func::CallOp::create(builder, choice.getLoc(), part, captures.arguments);
  }
  for (scf::IfOp choice : choices)
    choice->removeAttr(marks::versions);
}
