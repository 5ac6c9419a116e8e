// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_ANALYSIS_BRANCHPROBABILITY_H
#define PIKO_ANALYSIS_BRANCHPROBABILITY_H

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

#include <optional>

namespace piko {

/// How probable it is that a branch goes into one of its regions, from 0 to 1,
/// where the text says so.
inline std::optional<double> getProbability(mlir::scf::IfOp branch,
                                            mlir::Region &region) {
  auto first = branch->getAttrOfType<mlir::FloatAttr>(marks::probability);
  if (!first)
    return std::nullopt;
  double taken = first.getValueAsDouble();
  return &region == &branch.getThenRegion() ? taken : 1 - taken;
}

inline std::optional<double> getProbability(mlir::scf::IndexSwitchOp choice,
                                            mlir::Region &region) {
  auto all =
      choice->getAttrOfType<mlir::DenseF64ArrayAttr>(marks::probabilities);
  if (!all || all.size() != choice->getNumRegions())
    return std::nullopt;
  return all[region.getRegionNumber()];
}

} // namespace piko

#endif // PIKO_ANALYSIS_BRANCHPROBABILITY_H
