// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-reload-inputs: members of the input are loaded where a kernel begins.
// Each would be in registers until it ends, where most are needed for a moment:
// for a unit, a cell or a primitive. So for each use,
//   1. go from it to the outermost loop in whose body no other loop waits: what
//   is
//      loaded before that is kept over none that does not need it;
//   2. load the member again there, from an address that LLVM does not know to
//   be
//      the same, or it would put the load back.

#include "LoadPlace.h"

#include "Piko/Conversion/Passes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/LLVMIR/LLVMDialect.h"
#include "mlir/IR/IRMapping.h"
#include "llvm/ADT/MapVector.h"

namespace piko {
#define GEN_PASS_DEF_RELOADINPUTS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ReloadInputsPass : piko::impl::ReloadInputsBase<ReloadInputsPass> {
  void runOnOperation() override;
  void reload(LLVM::LoadOp load);
};

} // namespace

/// The load at another place, with the address's offset.
static Value createReload(LLVM::LoadOp load, Operation *place) {
  OpBuilder builder(place);
  IRMapping mapping;
  auto step = load.getAddr().getDefiningOp<LLVM::GEPOp>();
  Value base = step ? step.getBase() : load.getAddr();
  mapping.map(base, LLVM::LaunderInvariantGroupOp::create(
                        builder, load.getLoc(), base.getType(), base));
  if (step)
    builder.clone(*step, mapping);
  return builder.clone(*load, mapping)->getResult(0);
}

/// Gives each use of a number as another type a cast of its own, so that the
/// load is for that.
static void repeatCasts(LLVM::LoadOp load) {
  for (Operation *user : llvm::make_early_inc_range(load->getUsers())) {
    auto cast = dyn_cast<arith::IndexCastOp>(user);
    if (!cast)
      continue;
    for (OpOperand &use : llvm::make_early_inc_range(cast->getUses())) {
      OpBuilder builder(use.getOwner());
      use.set(builder.clone(*cast)->getResult(0));
    }
    cast.erase();
  }
}

void ReloadInputsPass::reload(LLVM::LoadOp load) {
  load->removeAttr(marks::input);
  auto step = load.getAddr().getDefiningOp<LLVM::GEPOp>();
  if (step && !step.getDynamicIndices().empty())
    return;
  repeatCasts(load);
  llvm::MapVector<Operation *, SmallVector<OpOperand *>> places;
  for (OpOperand &use : load.getResult().getUses())
    if (Operation *place = findLoadPlace(use.getOwner(), load->getParentOp());
        place->getParentOp() != load->getParentOp())
      places[place].push_back(&use);
  for (auto &[place, uses] : places) {
    Value loaded = createReload(load, place);
    for (OpOperand *use : uses)
      use->set(loaded);
  }
  if (load.use_empty())
    load.erase();
}

void ReloadInputsPass::runOnOperation() {
  SmallVector<LLVM::LoadOp> loads;
  getOperation().walk([&](LLVM::LoadOp load) {
    if (load->hasAttr(marks::input))
      loads.push_back(load);
  });
  for (LLVM::LoadOp load : loads)
    reload(load);
}
