// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A builder for passes that write much arithmetic on the numbers of threads.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_EMITTER_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_EMITTER_H

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/ImplicitLocOpBuilder.h"

namespace piko {

/// Makes arithmetic on numbers of 32 bits, and access to shared memory, as
/// short as C++.
struct Emitter : mlir::ImplicitLocOpBuilder {
  using mlir::ImplicitLocOpBuilder::ImplicitLocOpBuilder;

  mlir::Value number(int64_t value) {
    return mlir::arith::ConstantIntOp::create(*this, getI32Type(), value);
  }
  mlir::Value number(mlir::Type type, int64_t value) {
    return mlir::arith::ConstantOp::create(*this, getIntegerAttr(type, value));
  }
  mlir::Value truth(bool value) {
    return mlir::arith::ConstantOp::create(*this, getBoolAttr(value));
  }
  mlir::Value index(int64_t value) {
    return mlir::arith::ConstantIndexOp::create(*this, value);
  }
  mlir::Value cast(mlir::Value value, mlir::Type type) {
    if (value.getType() == type)
      return value;
    if (type.isIndex() || value.getType().isIndex())
      return mlir::arith::IndexCastOp::create(*this, type, value);
    return mlir::arith::ExtSIOp::create(*this, type, value);
  }
  mlir::Value toIndex(mlir::Value value) { return cast(value, getIndexType()); }
  /// Between the numbers of loops and those of 32 bits.
  mlir::Value toNumber(mlir::Value value) {
    if (!value.getType().isInteger(64))
      return cast(value, getI32Type());
    return mlir::arith::TruncIOp::create(*this, getI32Type(), value);
  }
  mlir::Value fromNumber(mlir::Value value, mlir::Type type) {
    if (!type.isInteger(64))
      return cast(value, type);
    return mlir::arith::ExtUIOp::create(*this, type, value);
  }
  mlir::Value add(mlir::Value a, mlir::Value b) {
    return mlir::arith::AddIOp::create(*this, a, b);
  }
  mlir::Value sub(mlir::Value a, mlir::Value b) {
    return mlir::arith::SubIOp::create(*this, a, b);
  }
  mlir::Value mul(mlir::Value a, mlir::Value b) {
    return mlir::arith::MulIOp::create(*this, a, b);
  }
  mlir::Value both(mlir::Value a, mlir::Value b) {
    return mlir::arith::AndIOp::create(*this, a, b);
  }
  mlir::Value either(mlir::Value a, mlir::Value b) {
    return mlir::arith::OrIOp::create(*this, a, b);
  }
  mlir::Value shl(mlir::Value a, mlir::Value b) {
    return mlir::arith::ShLIOp::create(*this, a, b);
  }
  mlir::Value shr(mlir::Value a, mlir::Value b) {
    return mlir::arith::ShRUIOp::create(*this, a, b);
  }
  mlir::Value select(mlir::Value test, mlir::Value a, mlir::Value b) {
    return mlir::arith::SelectOp::create(*this, test, a, b);
  }
  mlir::Value is(mlir::Value a, mlir::arith::CmpIPredicate predicate,
                 mlir::Value b) {
    return mlir::arith::CmpIOp::create(*this, predicate, a, b);
  }
  mlir::Value load(mlir::Value memory, mlir::Value at) {
    return mlir::memref::LoadOp::create(*this, memory,
                                        mlir::ValueRange{toIndex(at)});
  }
  /// The first element of a block's shared memory, which is not to be kept in
  /// registers before a loop (GPUToNVVM.cpp).
  mlir::Value loadAgain(mlir::Value memory) {
    auto load =
        mlir::memref::LoadOp::create(*this, memory, mlir::ValueRange{index(0)});
    load.setNontemporal(true);
    return load;
  }
  void store(mlir::Value value, mlir::Value memory, mlir::Value at) {
    mlir::memref::StoreOp::create(*this, value, memory,
                                  mlir::ValueRange{toIndex(at)});
  }
  mlir::Value change(mlir::arith::AtomicRMWKind kind, mlir::Value value,
                     mlir::Value memory, mlir::Value at) {
    return mlir::memref::AtomicRMWOp::create(*this, kind, value, memory,
                                             mlir::ValueRange{toIndex(at)});
  }
  void barrier() { mlir::gpu::BarrierOp::create(*this); }
  /// A builder in the branch that is taken where the test holds.
  Emitter when(mlir::Value test) {
    auto branch =
        mlir::scf::IfOp::create(*this, test, /*withElseRegion=*/false);
    return Emitter(getLoc(), branch.thenBlock()->getTerminator());
  }
  Emitter(mlir::Location loc, mlir::Operation *before)
      : mlir::ImplicitLocOpBuilder(loc, before) {}
  Emitter(mlir::Location loc, mlir::Block *block, mlir::Block::iterator at)
      : mlir::ImplicitLocOpBuilder(loc, loc->getContext()) {
    setInsertionPoint(block, at);
  }
};

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_EMITTER_H
