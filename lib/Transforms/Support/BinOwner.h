// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Whether one thread runs a bin from first to last, so that it can keep numbers
// of the bin's pixels for itself.

#ifndef PIKO_LIB_TRANSFORMS_BINOWNER_H
#define PIKO_LIB_TRANSFORMS_BINOWNER_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Why something cannot be done, and where.
struct Reason {
  mlir::Location at;
  std::string why;
};

/// Why a stage's bins of limited size do not have one thread each; none if
/// they do.
std::optional<Reason> whyNotOneThread(StageOp stage);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_BINOWNER_H
