// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-prove-bounds: marks accesses whose indices cannot be outside, so that
// nothing tests them when the pipeline runs.

#include "Support/StateAccess.h"

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/PikoFixed.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/TypeSwitch.h"

namespace piko {
#define GEN_PASS_DEF_PROVEBOUNDS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ProveBoundsPass : piko::impl::ProveBoundsBase<ProveBoundsPass> {
  void runOnOperation() override;
};

/// Whether indices are inside, from what is known in the block of an operation.
class Prover {
public:
  bool isInBin(Operation *access, OperandRange pixel);
  bool isInState(Operation *access, StringRef state, OperandRange indices);
  bool isInList(ListAtOp at);

private:
  LinearFacts &getFacts(Operation *op);

  BinIdentity identity;
  llvm::DenseMap<Block *, std::unique_ptr<LinearFacts>> facts;
};

} // namespace

LinearFacts &Prover::getFacts(Operation *op) {
  std::unique_ptr<LinearFacts> &known = facts[op->getBlock()];
  if (!known)
    known = std::make_unique<LinearFacts>(op, identity);
  return *known;
}

bool Prover::isInBin(Operation *access, OperandRange pixel) {
  LinearFacts &known = getFacts(access);
  for (auto [dim, coordinate] : llvm::enumerate(pixel))
    if (!known.isAboveBin(coordinate, dim) ||
        !known.isBelowBin(coordinate, dim))
      return false;
  return true;
}

bool Prover::isInState(Operation *access, StringRef state,
                       OperandRange indices) {
  LinearFacts &known = getFacts(access);
  for (auto [dim, value] : llvm::enumerate(indices)) {
    Linear index = known.get(value);
    if (!known.isAtLeastZero(index) ||
        !known.isAtLeastZero(known.getRoom(state, dim) - index - Linear(1)))
      return false;
  }
  return true;
}

bool Prover::isInList(ListAtOp at) {
  LinearFacts &known = getFacts(at);
  Linear index = known.get(at.getIndex());
  return known.isAtLeastZero(index) &&
         known.isAtLeastZero(known.getListSize(at.getList()) - index -
                             Linear(1));
}

void ProveBoundsPass::runOnOperation() {
  Prover prover;
  int64_t accesses = 0, tested = 0;
  auto note = [&](Operation *op, bool isInside, const Twine &what) {
    if (!isInside)
      op->emitRemark() << what << " when the pipeline runs";
    return isInside;
  };
  UnitAttr unit = UnitAttr::get(&getContext());
  llvm::DenseSet<StringAttr> written = getWrittenState(getOperation());
  // What piko-form-tiles asks, of images that may have tiles.
  auto visitPixel = [&](auto access) {
    FlatSymbolRefAttr state = access.getStateAttr();
    auto process = access->template getParentOfType<ProcessOp>();
    if (process && written.contains(state.getAttr()) &&
        !llvm::is_contained(getPhaseStage(process).getBins(), 0) &&
        lookupInPipeline<ImageOp>(access, state) &&
        prover.isInBin(access, access.getIndices()))
      access->setAttr(marks::inside, unit);
  };
  auto visit = [&](auto access) {
    if (!isa<AtomicOp>(access.getOperation()))
      visitPixel(access);
    if (!access.getChecked() && !access.getIndices().empty())
      access.setChecked(
          note(access,
               prover.isInState(access, access.getState(), access.getIndices()),
               "the index of '" + access.getState() + "' is tested"));
    accesses += !access.getIndices().empty();
    tested += !access.getIndices().empty() && !access.getChecked();
  };
  auto visitList = [&](ListAtOp at) {
    if (!at.getChecked())
      at.setChecked(
          note(at, prover.isInList(at), "the index into the list is tested"));
  };
  auto visitUpdate = [&](UpdateOp update) {
    if (note(update, prover.isInBin(update, update.getCoordinates()),
             "the pixel of '" + update.getImage() +
                 "' is tested to be in the bin"))
      update->setAttr(marks::inside, unit);
  };
  for (auto stage : getOperation().getOps<StageOp>())
    stage.walk([&](Operation *op) {
      llvm::TypeSwitch<Operation *>(op)
          .Case<LoadOp, StoreOp, AtomicOp>(visit)
          .Case(visitList)
          .Case(visitUpdate);
    });
  if (!getOperation().getOps<ContractOp>().empty())
    getOperation().emitRemark()
        << "with what the host's contracts say, the indices of " << tested
        << " of " << accesses
        << " accesses to state are tested when the pipeline runs";
}
