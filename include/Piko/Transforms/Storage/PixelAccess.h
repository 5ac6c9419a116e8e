// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Updates as loads and stores of pixels.

#ifndef PIKO_TRANSFORMS_STORAGE_PIXELACCESS_H
#define PIKO_TRANSFORMS_STORAGE_PIXELACCESS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Calls `body` with each number of a record: its field, and its indices into
/// an array.
void forEachElement(mlir::OpBuilder &builder, mlir::Location loc,
                    RecordOp record,
                    llvm::function_ref<void(FieldAttr, mlir::ValueRange)> body);

/// A region, where `builder` stands, for what is done to the pixel of an update
/// if the indices `at` of it are in the bin; elsewhere the run fails, and
/// results are zeros.
mlir::scf::IfOp createInsideTest(mlir::OpBuilder &builder, UpdateOp update,
                                 mlir::ValueRange at, mlir::TypeRange results);

/// The pixel of an update, which is known to be in the image.
class PixelAccess {
public:
  explicit PixelAccess(UpdateOp update);

  llvm::SmallVector<mlir::Value> load(mlir::OpBuilder &builder);
  void store(mlir::OpBuilder &builder, unsigned number, mlir::Value value);
  /// Changes a number by an atomic operation.
  void change(mlir::OpBuilder &builder, unsigned number, AtomicKind kind,
              mlir::Value value);
  /// What an image of one number has there.
  mlir::Value loadFrom(mlir::OpBuilder &builder, ImageOp image);
  void changeIn(mlir::OpBuilder &builder, ImageOp image, AtomicKind kind,
                mlir::Value value);

  /// `createInsideTest` before the update.
  mlir::scf::IfOp createTest(mlir::OpBuilder &builder, mlir::TypeRange results);

private:
  void change(mlir::OpBuilder &builder, ImageOp image, unsigned number,
              AtomicKind kind, mlir::Value value);
  mlir::Value load(mlir::OpBuilder &builder, ImageOp image, FieldAttr field,
                   mlir::ValueRange elements);

  UpdateOp update;
  ImageOp image;
  mlir::Location loc;
  llvm::SmallVector<mlir::Value> at; ///< Its coordinates, each an index.
};

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_PIXELACCESS_H
