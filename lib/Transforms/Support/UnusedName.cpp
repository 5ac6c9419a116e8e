// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Support/UnusedName.h"

using namespace mlir;
using namespace piko;

std::string piko::getUnusedName(PipelineOp pipeline, const Twine &stem) {
  std::string base = stem.str(), name = base;
  for (int i = 1; SymbolTable::lookupSymbolIn(pipeline, name); ++i)
    name = base + std::to_string(i);
  return name;
}
