// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-forward-stores: store-to-load forwarding, and elimination of redundant
// loads, for state.

#include "Piko/Transforms/Passes.h"

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Utils/StaticValueUtils.h"

namespace piko {
#define GEN_PASS_DEF_FORWARDSTORES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// A field of an element.
struct StatePlace {
  explicit StatePlace(LoadOp load) : StatePlace(load, 0) {}
  explicit StatePlace(StoreOp store) : StatePlace(store, 0) {}

  bool isSame(const StatePlace &other) const {
    return state == other.state && field == other.field && tile == other.tile &&
           indices == other.indices && elements == other.elements;
  }
  bool mayOverlap(const StatePlace &other) const;

  FlatSymbolRefAttr state;
  StringAttr field;
  Value tile;
  SmallVector<Value> indices, elements;

private:
  template <typename OpT>
  StatePlace(OpT access, int)
      : state(access.getStateAttr()), field(access.getFieldAttr()),
        tile(access.getTile()), indices(access.getIndices()),
        elements(access.getElements()) {}
};

/// What state is known to hold.
struct Known {
  StatePlace place;
  Value value;
};

/// Goes through code in the order in which it runs.
class Forwarder {
public:
  void forward(Block &block);

private:
  void forget(FlatSymbolRefAttr state) {
    llvm::erase_if(known,
                   [&](const Known &one) { return one.place.state == state; });
  }
  /// What operations inside of one change.
  void forgetChanged(Operation *op);
  void visit(Operation *op);
  void visit(LoadOp load);
  void visit(StoreOp store);
  void visitStructure(Operation *op);

  SmallVector<Known> known;
};

struct ForwardStoresPass : piko::impl::ForwardStoresBase<ForwardStoresPass> {
  void runOnOperation() override;
};

} // namespace

/// Fields of a record lie side by side.
bool StatePlace::mayOverlap(const StatePlace &other) const {
  if (state != other.state || field != other.field)
    return false;
  auto differ = [](Value a, Value b) {
    std::optional<int64_t> one = getConstantIntValue(a),
                           two = getConstantIntValue(b);
    return one && two && *one != *two;
  };
  return elements.size() != other.elements.size() ||
         llvm::none_of(llvm::zip(elements, other.elements), [&](auto pair) {
           return differ(std::get<0>(pair), std::get<1>(pair));
         });
}

void Forwarder::forgetChanged(Operation *op) {
  op->walk([&](Operation *inner) {
    if (auto store = dyn_cast<StoreOp>(inner)) {
      StatePlace place(store);
      llvm::erase_if(
          known, [&](const Known &one) { return one.place.mayOverlap(place); });
    } else if (auto access = dyn_cast<StateAccessOpInterface>(inner)) {
      if (access.getAccessKinds() != StateAccess::reads)
        forget(access.getAccessedState());
    }
  });
}

void Forwarder::visit(LoadOp load) {
  StatePlace place(load);
  for (const Known &one : known)
    if (one.place.isSame(place) && one.value.getType() == load.getType()) {
      load.getResult().replaceAllUsesWith(one.value);
      load.erase();
      return;
    }
  known.push_back({place, load.getResult()});
}

void Forwarder::visit(StoreOp store) {
  StatePlace place(store);
  llvm::erase_if(known,
                 [&](const Known &one) { return one.place.mayOverlap(place); });
  known.push_back({place, store.getValue()});
}

void Forwarder::visitStructure(Operation *op) {
  bool repeats = isa<LoopLikeOpInterface>(op);
  if (repeats)
    forgetChanged(op);
  SmallVector<Known> before = known;
  for (Region &region : op->getRegions())
    if (!region.empty()) {
      known = before;
      forward(region.front());
    }
  known = before;
  forgetChanged(op);
}

/// Whether an operation leaves all state as it is, or says what it changes.
static bool isKnown(Operation *op) {
  if (isMemoryEffectFree(op) || op->hasTrait<Failure>() ||
      isa<EmissionOpInterface, PlaceOp, PrefetchOp, memref::LoadOp,
          memref::StoreOp, memref::AllocaOp>(op))
    return true;
  return isa<StateAccessOpInterface>(op) && op->getNumRegions() == 0;
}

void Forwarder::visit(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op))
    return visit(load);
  if (auto store = dyn_cast<StoreOp>(op))
    return visit(store);
  if (isa<scf::IfOp, scf::IndexSwitchOp, scf::ForOp, scf::WhileOp>(op)) {
    // Iterations that meet inside show one another what they change.
    bool meets = op->walk([](BarrierOpInterface) {
                     return WalkResult::interrupt();
                   }).wasInterrupted();
    if (meets)
      known.clear();
    visitStructure(op);
    if (meets)
      known.clear();
    return;
  }
  if (op->getNumRegions() == 0 && isKnown(op))
    return forgetChanged(op);
  known.clear();
  for (Region &region : op->getRegions())
    for (Block &block : region) {
      forward(block);
      known.clear();
    }
}

void Forwarder::forward(Block &block) {
  for (Operation &op : llvm::make_early_inc_range(block))
    visit(&op);
}

void ForwardStoresPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>())
    for (Region &region : kernel->getRegions())
      for (Block &block : region)
        Forwarder().forward(block);
}
