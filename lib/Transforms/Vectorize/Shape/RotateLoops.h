// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loop rotation: loops as such that test a flag, with all of their work in the
// body.

#ifndef PIKO_LIB_TRANSFORMS_ROTATELOOPS_H
#define PIKO_LIB_TRANSFORMS_ROTATELOOPS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// A loop that carries its flag first, and goes on while that is true; its body
/// is empty.
mlir::scf::WhileOp createFlagged(mlir::OpBuilder &builder, mlir::Location loc,
                                 mlir::ValueRange inits);

/// Replaces an scf.for or an scf.while, whose numbers do not wrap around, by
/// one that tests a flag, which it carries first; it does the same in the same
/// order. Operations of its body stay the same ones.
mlir::scf::WhileOp rotate(mlir::Operation *loop);

/// The type that a loop counts in: 32 bits, where its bounds have no more.
mlir::Type getCounterType(mlir::scf::ForOp loop);

mlir::Value createPoison(mlir::OpBuilder &builder, mlir::Location loc,
                         mlir::Type type);
llvm::SmallVector<mlir::Value> createPoison(mlir::OpBuilder &builder,
                                            mlir::Location loc,
                                            mlir::TypeRange types);

/// Moves the operations of a block but its terminator to where a builder
/// stands.
void moveBody(mlir::Block &from, mlir::OpBuilder &builder);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_ROTATELOOPS_H
