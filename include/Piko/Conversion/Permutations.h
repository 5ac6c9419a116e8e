// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The functions that permutations of lanes are in LLVM IR, until the target,
// which knows the instructions for them, replaces them: `piko.permute.v16i32`
// takes 16 integers of 32 bits, and for each lane the number of another;
// `piko.compress.v16i32` a mask, whose lanes it brings to the front.

#ifndef PIKO_CONVERSION_PERMUTATIONS_H
#define PIKO_CONVERSION_PERMUTATIONS_H

#include "llvm/ADT/Twine.h"

namespace piko {

constexpr llvm::StringLiteral permutationPrefix = "piko.permute.",
                              compressionPrefix = "piko.compress.";

/// The name of the function for so many lanes of so many bits.
inline std::string getMoveName(llvm::StringRef prefix, int64_t lanes,
                               unsigned width) {
  return (prefix + "v" + llvm::Twine(lanes) + "i" + llvm::Twine(width)).str();
}

} // namespace piko

#endif // PIKO_CONVERSION_PERMUTATIONS_H
