// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What operations that name an element of state, but do not access it, have in
// common.

#ifndef PIKO_LIB_DIALECT_PIKO_IR_ELEMENTACCESS_H
#define PIKO_LIB_DIALECT_PIKO_IR_ELEMENTACCESS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// An error unless the state is a buffer or an image of as many dimensions as
/// there are indices.
inline mlir::LogicalResult verifyElement(mlir::Operation *op,
                                         mlir::FlatSymbolRefAttr name,
                                         size_t indices) {
  auto *state = lookupInPipeline<mlir::Operation *>(op, name);
  if (!mlir::isa_and_nonnull<BufferOp, ImageOp>(state))
    return op->emitOpError("expected a buffer or an image, but got ")
           << name << ", which is none";
  if (int64_t(indices) != getStateRank(state))
    return op->emitOpError("expected ")
           << getStateRank(state) << " indices into " << name << ", but got "
           << indices;
  return mlir::success();
}

} // namespace piko

#endif // PIKO_LIB_DIALECT_PIKO_IR_ELEMENTACCESS_H
