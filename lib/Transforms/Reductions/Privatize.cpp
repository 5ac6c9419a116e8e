// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-privatize: what a kernel only reduces to, each thread reduces to a copy
// of its own (privatization of reductions).
//
// Copies are combined for runs of elements that have been written to, by a
// function that convert-piko-to-llvm makes for the field and the kind, and hold
// what changes nothing after that, as the next launch needs them
// (runtime/cpu/state/PrivateCopies.h).

#include "Reductions/UnitWork.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/TypeSwitch.h"

namespace piko {
#define GEN_PASS_DEF_PRIVATIZE
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// A field of a piece of state, by name.
using Target = std::pair<StringAttr, StringAttr>;

/// What is in the way of private copies.
struct Obstacle {
  Operation *op = nullptr;
  const char *why = "";
};

struct PrivatizePass : piko::impl::PrivatizeBase<PrivatizePass> {
  void runOnOperation() override;
  void runOnUnits(KernelOp kernel, OpenWriterOp writer);
};

} // namespace

/// The field that an access reads or changes; null if it may be any.
static StringAttr getField(Operation *op) {
  return llvm::TypeSwitch<Operation *, StringAttr>(op)
      .Case<LoadOp, StoreOp, AtomicOp, GatherOp, ScatterOp>(
          [](auto access) { return access.getFieldAttr(); })
      .Default(StringAttr());
}

/// Whether the change of one number shows in nothing but that number, and not
/// the order of changes in it.
static Obstacle findObstacle(ArrayRef<AtomicOp> atomics, OpenWriterOp writer) {
  AtomicOp first = atomics.front();
  for (AtomicOp atomic : atomics) {
    Operation *around = writer->getBlock()->findAncestorOpInBlock(*atomic);
    if (!around || around->isBeforeInBlock(writer))
      return {atomic, "this is not a part of a unit of work"};
    if (atomic.getOld())
      return {atomic, "the result of this is used"};
    if (atomic.getKind() == AtomicKind::AddF)
      return {atomic, "sums of floats depend on the order in which they are "
                      "added"};
    if (atomic.getKind() != first.getKind())
      return {atomic, "this is an operation of another kind"};
  }
  return {};
}

/// What else in the kernel may use the field.
static Obstacle findOtherUse(KernelOp kernel, const Target &target) {
  auto uses = SymbolTable::getSymbolUses(target.first, kernel);
  if (!uses)
    return {kernel, "it is not known what this does"};
  for (SymbolTable::SymbolUse use : *uses) {
    Operation *user = use.getUser();
    StringAttr field = getField(user);
    bool isApart = isa<ExtentOp, PrefetchOp, PrivateCopyOp>(user) ||
                   user->hasTrait<Failure>() ||
                   (field && field != target.second);
    if (!isApart && !isa<AtomicOp>(user))
      return {user, "this uses it, too"};
  }
  return {};
}

void PrivatizePass::runOnUnits(KernelOp kernel, OpenWriterOp writer) {
  llvm::MapVector<Target, SmallVector<AtomicOp>> targets;
  kernel.walk([&](AtomicOp atomic) {
    targets[{atomic.getStateAttr().getAttr(), atomic.getFieldAttr()}].push_back(
        atomic);
  });
  for (auto &[target, atomics] : targets) {
    AtomicOp first = atomics.front();
    if (first.getCopy())
      continue;
    Obstacle obstacle = findObstacle(atomics, writer);
    if (!obstacle.op)
      obstacle = findOtherUse(kernel, target);
    StringRef stage =
        first.getOf().value_or(getCppName(getKernelStage(writer)));
    if (obstacle.op) {
      InFlightDiagnostic remark = first.emitRemark("stage '")
                                  << stage << "' changes '"
                                  << target.first.getValue()
                                  << "' by locked instructions";
      remark.attachNote(obstacle.op->getLoc()) << obstacle.why;
      continue;
    }
    OpBuilder builder(writer->getContext());
    builder.setInsertionPointAfter(writer);
    auto copy = PrivateCopyOp::create(builder, first.getLoc(), first.getKind(),
                                      first.getState(), target.second, writer,
                                      llvm::any_of(atomics, isRepeatedInWork));
    for (AtomicOp atomic : atomics)
      atomic.getCopyMutable().assign(copy);
    first.emitRemark("stage '")
        << stage << "' changes private copies of '" << target.first.getValue()
        << "', which are combined when its kernel ends";
  }
}

void PrivatizePass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>())
    if (OpenWriterOp writer = findUnitWriter(kernel))
      runOnUnits(kernel, writer);
}
