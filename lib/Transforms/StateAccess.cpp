// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "StateAccess.h"

#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

std::pair<FlatSymbolRefAttr, int> piko::getStateAccess(Operation *op) {
  using Access = std::pair<FlatSymbolRefAttr, int>;
  return llvm::TypeSwitch<Operation *, Access>(op)
      .Case([](LoadOp load) {
        return Access(load.getStateAttr(), StateAccess::reads);
      })
      .Case([](StoreOp store) {
        return Access(store.getStateAttr(), StateAccess::stores);
      })
      .Case([](AtomicOp atomic) {
        return Access(atomic.getStateAttr(), StateAccess::changesAtomically);
      })
      .Case([](UpdateOp update) {
        return Access(update.getImageAttr(), StateAccess::updates);
      })
      .Default([](Operation *) { return Access(); });
}

llvm::DenseSet<StringAttr> piko::getWrittenState(Operation *root) {
  llvm::DenseSet<StringAttr> written;
  root->walk([&](Operation *op) {
    if (auto [state, kind] = getStateAccess(op);
        state && kind != StateAccess::reads)
      written.insert(state.getAttr());
  });
  return written;
}
