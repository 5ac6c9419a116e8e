// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records as pieces of four words, which vectors of lanes are transposed into
// and from.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_RECORDPIECES_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_RECORDPIECES_H

#include "PikoToLLVM/LoweringContext.h"

namespace piko {

constexpr int64_t wordSize = 4, pieceWords = 4;
constexpr int64_t pieceSize = wordSize * pieceWords;

/// Transposes the blocks of 4x4 words that four vectors of words are made of.
std::array<mlir::Value, pieceWords>
transposeBlocks(mlir::OpBuilder &builder, mlir::Location loc,
                const std::array<mlir::Value, pieceWords> &rows);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_RECORDPIECES_H
