// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a grid has for what its threads emit.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_GRIDMEMORY_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_GRIDMEMORY_H

#include "PikoToGPU/PikoToGPU.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

namespace piko {

/// As the piko.gpu.append_buffers of a launch says.
struct GridMemory {
  /// Where it has none, `opened` is null.
  explicit GridMemory(mlir::gpu::LaunchOp launch);

  mlir::gpu::LaunchOp launch;
  AppendBuffersOp opened;
  mlir::Value log;
  mlir::Value buffers;          ///< A thread's.
  mlir::Value kept, flushWords; ///< The block's.
  /// Producer and port of each local edge.
  llvm::SmallVector<std::pair<mlir::FlatSymbolRefAttr, int64_t>> locals;

  int64_t getWords();
  /// Whether it is a local edge of the kernel's own stage.
  bool isLocal(int64_t port);
  void flush(mlir::OpBuilder &builder);
  /// Makes what a thread has, and what the block keeps of local edges, empty.
  void clearAppendBuffers(mlir::OpBuilder &builder);
  void clearKept(mlir::OpBuilder &builder);
  /// Puts the append buffers of threads, which are many numbers, into shared
  /// memory.
  void keepAppendBuffersInBlock();
  /// Which primitive errors are about from here on.
  void setPosition(mlir::OpBuilder &builder, mlir::Value position);
  void setLocalCount(mlir::OpBuilder &builder, LocalBinOp local,
                     mlir::Value count);
  mlir::Value getLocalCount(mlir::OpBuilder &builder, LocalBinOp local);

private:
  mlir::Attribute getStage();
  /// Where the words of a local edge begin.
  int64_t getLocalBase(LocalBinOp local);
};

/// Of the launches of a pipeline that are not mapped to their threads yet; an
/// error where one has none.
mlir::FailureOr<llvm::SmallVector<GridMemory>> findGrids(PipelineOp pipeline);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_GRIDMEMORY_H
