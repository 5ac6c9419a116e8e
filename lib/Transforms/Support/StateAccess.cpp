// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Support/StateAccess.h"

using namespace mlir;
using namespace piko;

std::pair<FlatSymbolRefAttr, int> piko::getStateAccess(Operation *op) {
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    return {access.getAccessedState(), access.getAccessKinds()};
  return {};
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
