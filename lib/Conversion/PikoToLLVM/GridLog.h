// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a grid add to its log: the entries of pikort/grid.h.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDLOG_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDLOG_H

#include "LoweringContext.h"

namespace piko {

/// Kinds of entries (PIKOIR_ENTRY_RECORD, ...).
enum class EntryKind : int64_t { Record, Cell, Next, Error, Memory };

/// Adds an entry, where `op` stands in a grid; the address of its `bytes`.
mlir::Value createEntry(mlir::OpBuilder &builder, mlir::Operation *op,
                        const Grid &grid, EntryKind kind, int64_t number,
                        int64_t bytes);

/// Adds an error at a place of the grid; null outside one. `function` is that
/// of the runtime that a CPU's kernel would call, `code` the number behind the
/// bin, `numbers` the last two, or one.
bool createErrorEntry(mlir::OpBuilder &builder, mlir::Operation *op,
                      LoweringContext &context, mlir::StringRef function,
                      int32_t stage, std::optional<mlir::StringRef> name,
                      mlir::Value bin, int32_t code,
                      llvm::ArrayRef<mlir::Value> numbers);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDLOG_H
