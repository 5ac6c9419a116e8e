//===- Canonicalization.h - What keeps numbers ------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_DIALECT_PIKO_IR_CANONICALIZATION_H
#define PIKO_DIALECT_PIKO_IR_CANONICALIZATION_H

#include "llvm/ADT/SmallVector.h"

#include <string>

namespace piko {

/// The names of upstream's canonicalizations that change numbers, which are to
/// be disabled. These convert an integer of 64 bits to a float at once rather
/// than by way of a double: it is rounded once, not twice.
inline llvm::SmallVector<std::string> getInexactPatterns() {
  return {"(anonymous namespace)::TruncFSIToFPToSIToFP",
          "(anonymous namespace)::TruncFUIToFPToUIToFP"};
}

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_CANONICALIZATION_H
