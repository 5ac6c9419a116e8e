// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Memory for what the iterations of a loop keep across barriers.

#ifndef PIKO_TRANSFORMS_STORAGE_SLOTS_H
#define PIKO_TRANSFORMS_STORAGE_SLOTS_H

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"

namespace piko {

/// Arrays with as many elements as a loop has iterations, one after the other
/// in the scratch memory of one call. Arrays are added while the loop is
/// written; their places follow at the end.
class Slots {
public:
  /// Writes at `builder` code that takes the memory and, where there are any
  /// iterations and there is room, runs what is then put before `inside`.
  Slots(mlir::OpBuilder &builder, mlir::Location loc, mlir::Value writer,
        mlir::Value count);

  mlir::Operation *inside() { return inner.thenBlock()->getTerminator(); }

  /// Whether a value of the type fits into a slot.
  static bool canHold(mlir::Type type);
  /// `elements` numbers or primitives for each iteration; memory of rank 1.
  mlir::Value add(mlir::Type type, int64_t elements = 1);
  /// As many arrays of the type as there are iterations.
  mlir::Value addArrays(mlir::MemRefType type);
  /// The array of one iteration.
  mlir::Value getArray(mlir::OpBuilder &builder, mlir::Value arrays,
                       mlir::MemRefType type, mlir::Value iteration);

  static mlir::Value load(mlir::OpBuilder &builder, mlir::Location loc,
                          mlir::Type type, mlir::Value slots,
                          mlir::Value index);
  static void store(mlir::OpBuilder &builder, mlir::Location loc,
                    mlir::Value value, mlir::Value slots, mlir::Value index);

  /// Gives each array its place.
  void finish();

private:
  struct Array {
    mlir::Operation *place; ///< What stands for its place until the end.
    int64_t bytes;          ///< For each iteration.
  };
  mlir::Value reserve(int64_t bytes);

  mlir::Location loc;
  mlir::Value count;
  ScratchMarkOp mark;
  ScratchOp scratch;
  ScratchReleaseOp release;
  mlir::scf::IfOp inner;
  llvm::SmallVector<Array> arrays;
};

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_SLOTS_H
