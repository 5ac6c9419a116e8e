// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Analysis/OrderFacts.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"

using namespace mlir;
using namespace piko;

/// Whether an operation is one of integers whose operands may change places and
/// partners.
static bool isAssociative(Operation *op) {
  return isa_and_nonnull<arith::AddIOp, arith::MulIOp, arith::AndIOp,
                         arith::OrIOp, arith::XOrIOp, arith::MaxSIOp,
                         arith::MaxUIOp, arith::MinSIOp, arith::MinUIOp>(op);
}

/// How an update changes each of a pixel's numbers, if it commutes with itself:
/// what stays is empty.
static std::optional<std::string> findChange(UpdateOp update) {
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  if (!update.getResults().empty())
    return std::nullopt;
  std::string change;
  for (auto [old, value] : llvm::zip(body.getArguments(), yield.getPixel())) {
    if (value != old) {
      // The old number goes nowhere else.
      Operation *op = value.getDefiningOp();
      if (!isAssociative(op) || !old.hasOneUse() || *old.user_begin() != op ||
          !value.hasOneUse())
        return std::nullopt;
      change += op->getName().getStringRef();
    } else if (!old.hasOneUse()) {
      return std::nullopt;
    }
    change += ",";
  }
  return change;
}

namespace {

/// Looks for what tells of the order of a process phase's calls.
class OrderFinder {
public:
  bool isSeen() const {
    // A read shows what calls before it have made of a pixel.
    return seen || llvm::any_of(changes, [&](const auto &change) {
             return others.contains(change.first);
           });
  }

  void visit(Operation *op) {
    if (auto update = dyn_cast<UpdateOp>(op))
      visitChange(update.getImageAttr(), findChange(update));
    else if (auto atomic = dyn_cast<AtomicOp>(op))
      visitChange(atomic.getStateAttr(), findChange(atomic));
    else if (auto access = dyn_cast<StateAccessOpInterface>(op))
      visitAccess(access);
    else
      seen |= !isIndifferent(op);
  }

private:
  static std::optional<std::string> findChange(UpdateOp update) {
    return ::findChange(update);
  }
  static std::optional<std::string> findChange(AtomicOp atomic) {
    if (atomic.getOld() || atomic.getKind() == AtomicKind::AddF)
      return std::nullopt;
    return "atomic " + stringifyAtomicKind(atomic.getKind()).str();
  }

  /// Changes of one kind commute; a sum and a maximum do not.
  void visitChange(Attribute state, std::optional<std::string> change) {
    auto [known, isNew] = changes.try_emplace(state, change.value_or(""));
    seen |= !change || known->second != *change;
  }

  void visitAccess(StateAccessOpInterface access) {
    int kinds = access.getAccessKinds();
    bool isImage =
        bool(lookupInPipeline<ImageOp>(access, access.getAccessedState()));
    seen |= kinds != StateAccess::reads &&
            (kinds != StateAccess::stores || isImage);
    others.insert(access.getAccessedState());
  }

  /// Whether an operation, by itself, does the same in whatever order.
  static bool isIndifferent(Operation *op) {
    if (isa<EmissionOpInterface>(op))
      return false;
    return op->getNumRegions() > 0 || isMemoryEffectFree(op) ||
           isa<memref::AllocaOp, memref::LoadOp, memref::StoreOp>(op);
  }

  bool seen = false;
  llvm::DenseMap<Attribute, std::string> changes;
  llvm::DenseSet<Attribute> others; ///< State that is read or stored to.
};

} // namespace

bool piko::isOrderIrrelevant(PipelineOp pipeline, StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  if (schedule && schedule.getUnordered())
    return true;
  if (stage.getTakesList())
    return false;
  OrderFinder finder;
  bool isKnown = false; // Or it is no phase any more.
  pipeline.walk([&](ProcessOp process) {
    FlatSymbolRefAttr name = process.getStageAttr();
    if (name ? name != FlatSymbolRefAttr::get(stage.getSymNameAttr())
             : process->getParentOp() != stage)
      return;
    isKnown = true;
    process.walk([&](Operation *op) {
      if (op != process)
        finder.visit(op);
    });
  });
  return isKnown && !finder.isSeen();
}
