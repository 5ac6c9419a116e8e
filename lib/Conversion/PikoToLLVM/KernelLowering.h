// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What patterns for the operations of kernels share.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_KERNELLOWERING_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_KERNELLOWERING_H

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

// Members of pikoir_input.
namespace layout {
constexpr piko::RuntimeMember items = PIKO_RUNTIME_MEMBER(pikoir_input, items),
                              order = PIKO_RUNTIME_MEMBER(pikoir_input, order);
} // namespace layout

namespace piko {

template <typename OpT> struct Lowering : ContextPattern<OpT> {
  using ContextPattern<OpT>::ContextPattern;
  using ContextPattern<OpT>::context;

  static mlir::Type pointer(mlir::OpBuilder &builder) {
    return mlir::LLVM::LLVMPointerType::get(builder.getContext());
  }
  mlir::Value load(mlir::OpBuilder &builder, mlir::Location loc,
                   mlir::Value base, const RuntimeMember &member,
                   int64_t after = 0) const {
    return createLoad(builder, loc,
                      convertType(builder.getContext(), member.type),
                      createOffset(builder, loc, base, member.offset + after),
                      context.tags.input());
  }
  /// Whether positions lead to records by numbers.
  static mlir::Value isOrdered(mlir::OpBuilder &builder, mlir::Location loc,
                               mlir::Value order) {
    return mlir::LLVM::ICmpOp::create(
        builder, loc, mlir::LLVM::ICmpPredicate::ne, order,
        mlir::LLVM::ZeroOp::create(builder, loc, order.getType()));
  }
  /// The address of entry `index` of an array.
  static mlir::Value entry(mlir::OpBuilder &builder, mlir::Location loc,
                           mlir::Value array, mlir::Value index, int64_t size) {
    mlir::Value bytes =
        mlir::arith::MulIOp::create(builder, loc, toI64(builder, loc, index),
                                    createI64(builder, loc, size));
    return createOffset(builder, loc, array, bytes);
  }
};

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_KERNELLOWERING_H
