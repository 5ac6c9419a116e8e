// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-prove-bounds: marks accesses whose indices cannot be outside, so that
// nothing tests them when the pipeline runs.

#include "BinIdentity.h"
#include "IndexBounds.h"

#include "Piko/Transforms/BinArithmetic.h"
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

private:
  template <typename AccessOp> void visit(AccessOp access, StageOp stage);
  void visit(ListAtOp at);
  void visit(UpdateOp update, StageOp stage);
  bool isInState(Operation *access, StringRef state, OperandRange indices,
                 StageOp stage);
  bool isInBin(Operation *access, OperandRange indices, StageOp stage);

  std::optional<BinIdentity> identity;
};
} // namespace

/// Whether `value` is how many elements a piece of state has in a dimension; an
/// image has as many as the domain.
static bool isExtent(Value value, StringRef state, bool isImage, int64_t dim) {
  if (auto extent = value.getDefiningOp<ExtentOp>())
    return extent.getState() == state && int64_t(extent.getDim()) == dim;
  auto domain = value.getDefiningOp<DomainOp>();
  return isImage && domain && int64_t(domain.getDim()) == dim;
}

bool ProveBoundsPass::isInBin(Operation *access, OperandRange indices,
                              StageOp stage) {
  if (!access->getParentOfType<ProcessOp>())
    return false;
  for (auto [dim, index] : llvm::enumerate(indices))
    if (!identity->isInBin(stage, dim, access, index))
      return false;
  return true;
}

bool ProveBoundsPass::isInState(Operation *access, StringRef state,
                                OperandRange indices, StageOp stage) {
  bool isImage = isa<ImageOp>(SymbolTable::lookupSymbolIn(
      getOperation(), StringAttr::get(&getContext(), state)));
  if (isImage && isInBin(access, indices, stage))
    return true;
  for (auto [dim, index] : llvm::enumerate(indices)) {
    auto isBound = [&, dim = dim](Value value) {
      return isExtent(value, state, isImage, dim);
    };
    if (!IndexBounds(isBound, access).contains(index))
      return false;
  }
  return true;
}

template <typename AccessOp>
void ProveBoundsPass::visit(AccessOp access, StageOp stage) {
  if (access.getChecked() || access.getIndices().empty())
    return;
  if (isInState(access, access.getState(), access.getIndices(), stage)) {
    access.setChecked(true);
    ++proved;
    return;
  }
  ++left;
  access.emitRemark() << "the index of '" << access.getState()
                      << "' is tested when the pipeline runs";
}

void ProveBoundsPass::visit(ListAtOp at) {
  auto isBound = [&](Value value) {
    auto size = value.getDefiningOp<ListSizeOp>();
    return size && size.getList() == at.getList();
  };
  if (at.getChecked())
    return;
  if (IndexBounds(isBound, at).contains(at.getIndex())) {
    at.setChecked(true);
    ++proved;
    return;
  }
  ++left;
  at.emitRemark() << "the index into the list is tested when the pipeline runs";
}

void ProveBoundsPass::visit(UpdateOp update, StageOp stage) {
  if (isInBin(update, update.getCoordinates(), stage)) {
    update->setAttr(insideAttrName, UnitAttr::get(&getContext()));
    ++proved;
    return;
  }
  ++left;
  update.emitRemark() << "the pixel of '" << update.getImage()
                      << "' is tested to be in the bin when the pipeline runs";
}

void ProveBoundsPass::runOnOperation() {
  identity.emplace(getOperation());
  for (auto stage : getOperation().getOps<StageOp>())
    stage.walk([&](Operation *op) {
      llvm::TypeSwitch<Operation *>(op)
          .Case<LoadOp, StoreOp, AtomicOp>(
              [&](auto access) { visit(access, stage); })
          .Case([&](ListAtOp at) { visit(at); })
          .Case([&](UpdateOp update) { visit(update, stage); });
    });
}
