// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a grid emit: the entries of pikort/grid.h.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDLOG_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDLOG_H

#include "PikoToLLVM/LoweringContext.h"

#include "pikort/grid.h"

namespace piko {

enum class EntryKind : int64_t {
  Record = PIKOIR_ENTRY_RECORD,
  Bucket = PIKOIR_ENTRY_BUCKET,
  Next = PIKOIR_ENTRY_NEXT,
  Error = PIKOIR_ENTRY_ERROR,
  Kept = PIKOIR_ENTRY_KEPT
};

/// Adds an entry to an append buffer of the thread, where `op` stands in a
/// grid; the address of its `bytes`. Without a stage it is of the kernel's.
mlir::Value createEntry(mlir::OpBuilder &builder, mlir::Operation *op,
                        const GridContext &grid, EntryKind kind, int64_t number,
                        int64_t bytes, int64_t stage = -1, int64_t buffer = 0);

/// The number of the stage that leaves something in a log; -1 is the kernel's.
int64_t getLogStage(mlir::Operation *op, mlir::Value log,
                    LoweringContext &context);
/// The append buffer of a port: one of a local edge, or that of the log.
int64_t findAppendBuffer(const GridContext &grid, int64_t stage, int64_t port);

/// Adds an error at a place of the grid; false outside one. `function` is that
/// of the runtime that a CPU's kernel would call, `code` the number after the
/// bin, `numbers` the last two, or one.
bool createErrorEntry(mlir::OpBuilder &builder, mlir::Operation *op,
                      LoweringContext &context, mlir::StringRef function,
                      int32_t stage, std::optional<mlir::StringRef> name,
                      mlir::Value bin, int32_t code,
                      llvm::ArrayRef<mlir::Value> numbers);

/// Keeps the last record of a local edge for the bin.
void createKeep(mlir::OpBuilder &builder, mlir::Location loc,
                const GridContext &grid, int64_t buffer);
/// What the block has of a local edge, as bins: the address of a pikoir_input.
mlir::Value createLocalBins(mlir::OpBuilder &builder, mlir::Operation *op,
                            const GridContext &grid, int64_t buffer);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDLOG_H
