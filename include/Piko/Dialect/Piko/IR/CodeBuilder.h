// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Short names for the arithmetic, the memory and the control flow that
// lowerings are made of.

#ifndef PIKO_DIALECT_PIKO_IR_CODEBUILDER_H
#define PIKO_DIALECT_PIKO_IR_CODEBUILDER_H

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Creates operations where its builder stands.
struct CodeBuilder {
  using P = mlir::arith::CmpIPredicate;

  CodeBuilder(mlir::OpBuilder &builder, mlir::Location loc)
      : builder(builder), loc(loc) {}

  mlir::Value index(int64_t value) {
    return mlir::arith::ConstantIndexOp::create(builder, loc, value);
  }
  mlir::Value boolean(bool value) {
    return mlir::arith::ConstantOp::create(builder, loc,
                                           builder.getBoolAttr(value));
  }
  mlir::Value add(mlir::Value a, mlir::Value b) {
    return mlir::arith::AddIOp::create(builder, loc, a, b);
  }
  mlir::Value sub(mlir::Value a, mlir::Value b) {
    return mlir::arith::SubIOp::create(builder, loc, a, b);
  }
  mlir::Value mul(mlir::Value a, mlir::Value b) {
    return mlir::arith::MulIOp::create(builder, loc, a, b);
  }
  mlir::Value min(mlir::Value a, mlir::Value b) {
    return mlir::arith::MinSIOp::create(builder, loc, a, b);
  }
  mlir::Value both(mlir::Value a, mlir::Value b) {
    return mlir::arith::AndIOp::create(builder, loc, a, b);
  }
  mlir::Value either(mlir::Value a, mlir::Value b) {
    return mlir::arith::OrIOp::create(builder, loc, a, b);
  }
  mlir::Value select(mlir::Value condition, mlir::Value a, mlir::Value b) {
    return mlir::arith::SelectOp::create(builder, loc, condition, a, b);
  }
  mlir::Value compare(P predicate, mlir::Value a, mlir::Value b) {
    return mlir::arith::CmpIOp::create(builder, loc, predicate, a, b);
  }
  mlir::Value compare(mlir::arith::CmpFPredicate predicate, mlir::Value a,
                      mlir::Value b) {
    return mlir::arith::CmpFOp::create(builder, loc, predicate, a, b);
  }

  mlir::Value load(mlir::Value array, mlir::Value at) {
    return mlir::memref::LoadOp::create(builder, loc, array, at);
  }
  llvm::SmallVector<mlir::Value> load(mlir::ValueRange arrays, mlir::Value at) {
    return llvm::map_to_vector(
        arrays, [&](mlir::Value array) { return load(array, at); });
  }
  void store(mlir::ValueRange values, mlir::ValueRange arrays, mlir::Value at) {
    for (auto [value, array] : llvm::zip(values, arrays))
      mlir::memref::StoreOp::create(builder, loc, value, array, at);
  }

  /// if (condition) body()
  mlir::scf::IfOp when(mlir::Value condition, llvm::function_ref<void()> body) {
    auto ifOp = mlir::scf::IfOp::create(builder, loc, condition);
    mlir::OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(ifOp.thenBlock());
    body();
    return ifOp;
  }
  /// for (i = from; i < to; i += step) body(i), for indices
  mlir::scf::ForOp forEach(mlir::Value from, mlir::Value to, mlir::Value step,
                           llvm::function_ref<void(mlir::Value)> body) {
    auto loop = mlir::scf::ForOp::create(builder, loc, from, to, step);
    mlir::OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(loop.getBody());
    body(loop.getInductionVar());
    return loop;
  }

  mlir::OpBuilder &builder;
  mlir::Location loc;
};

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_CODEBUILDER_H
