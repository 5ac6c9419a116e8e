// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Writes what a thread of a grid does with the log and with memory.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDCODE_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDCODE_H

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "pikort/grid.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/Math/IR/Math.h"

namespace piko {

/// Numbers have 64 bits where nothing else is said; addresses are numbers.
struct GridCode : CodeBuilder {
  using CodeBuilder::CodeBuilder;

  mlir::Type i32() { return builder.getI32Type(); }
  mlir::Type i64() { return builder.getI64Type(); }
  mlir::Value constant(int64_t value) { return createI64(builder, loc, value); }
  /// What is in a log is in global memory.
  mlir::Value at(mlir::Value address) {
    using mlir::LLVM::LLVMPointerType;
    constexpr unsigned global = 1;
    auto *context = builder.getContext();
    mlir::Value pointer = mlir::LLVM::IntToPtrOp::create(
        builder, loc, LLVMPointerType::get(context, global), address);
    return mlir::LLVM::AddrSpaceCastOp::create(
        builder, loc, LLVMPointerType::get(context), pointer);
  }
  mlir::Value load(mlir::Type type, mlir::Value address) {
    return mlir::LLVM::LoadOp::create(builder, loc, type, at(address));
  }
  /// Of what a pointer points to.
  mlir::Value load(mlir::Type type, mlir::Value pointer, int64_t offset) {
    return mlir::LLVM::LoadOp::create(
        builder, loc, type, createOffset(builder, loc, pointer, offset));
  }
  void store(mlir::Value value, mlir::Value address, int64_t offset = 0) {
    mlir::LLVM::StoreOp::create(
        builder, loc, value, createOffset(builder, loc, at(address), offset));
  }
  /// A word of an array of the thread, or of the block.
  mlir::Value get(mlir::Value words, int64_t which) {
    return mlir::memref::LoadOp::create(builder, loc, words, index(which));
  }
  void set(mlir::Value value, mlir::Value words, int64_t which) {
    mlir::memref::StoreOp::create(builder, loc, value, words, index(which));
  }
  mlir::Value extend(mlir::Value a) {
    return mlir::arith::ExtUIOp::create(builder, loc, i64(), a);
  }
  mlir::Value intrinsic(mlir::StringRef name, mlir::ValueRange arguments = {},
                        mlir::Type type = {}) {
    return mlir::LLVM::CallIntrinsicOp::create(
               builder, loc, type ? type : i32(), builder.getStringAttr(name),
               arguments)
        .getResults();
  }
  void barrier() { mlir::gpu::BarrierOp::create(builder, loc); }
  /// A barrier that says whether the condition holds for a thread of the block.
  mlir::Value meetAny(mlir::Value condition) {
    return intrinsic("llvm.nvvm.barrier.cta.red.or.aligned.all",
                     {createI32(builder, loc, 0), condition},
                     builder.getI1Type());
  }

  /// condition ? body() : otherwise()
  mlir::Value choose(mlir::Value condition,
                     llvm::function_ref<mlir::Value()> body,
                     llvm::function_ref<mlir::Value()> otherwise) {
    auto ifOp = mlir::scf::IfOp::create(builder, loc, i64(), condition,
                                        /*withElseRegion=*/true);
    mlir::OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(ifOp.thenBlock());
    mlir::scf::YieldOp::create(builder, loc, body());
    builder.setInsertionPointToStart(ifOp.elseBlock());
    mlir::scf::YieldOp::create(builder, loc, otherwise());
    return ifOp.getResult(0);
  }

  /// Takes so many bytes, a multiple of 64, of a log (a pointer): the address
  /// of a piece of this kind, or 0.
  mlir::Value take(mlir::Value log, mlir::Value bytes, int64_t kind);
  /// The same of memory, so many bytes for each of the lanes of a warp that
  /// come here together: where those of this one begin, or 0.
  mlir::Value takeForLanes(mlir::Value log, int64_t bytes);
};

/// The memory of a log that nothing is kept in.
mlir::Value getSpare(GridCode &code, mlir::Value log);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_GRIDCODE_H
