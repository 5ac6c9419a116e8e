// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The functions that approximations are in LLVM IR, until the target, which
// knows the instructions for them, replaces them: `piko.approximate_rsqrt.f32`
// of a float, `.v16f32` of a vector.

#ifndef PIKO_CONVERSION_APPROXIMATIONS_H
#define PIKO_CONVERSION_APPROXIMATIONS_H

#include "llvm/ADT/Twine.h"

namespace piko {

constexpr llvm::StringLiteral approximateReciprocal =
    "piko.approximate_reciprocal";
constexpr llvm::StringLiteral approximateRsqrt = "piko.approximate_rsqrt";
constexpr llvm::StringLiteral approximateSqrt = "piko.approximate_sqrt";

/// The name of the function of so many lanes; 0 is a float.
inline std::string getApproximationName(llvm::StringRef kind, int64_t lanes) {
  return (kind + (lanes ? ".v" + llvm::Twine(lanes) : ".") + "f32").str();
}

} // namespace piko

#endif // PIKO_CONVERSION_APPROXIMATIONS_H
