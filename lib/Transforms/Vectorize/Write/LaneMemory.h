// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Access of lanes to state, primitives and arrays.

#ifndef PIKO_LIB_TRANSFORMS_LANEMEMORY_H
#define PIKO_LIB_TRANSFORMS_LANEMEMORY_H

#include "Vectorize/Write/LaneValues.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/ADT/MapVector.h"

namespace piko {

class LaneMemory : protected LaneValues {
protected:
  using LaneValues::LaneValues;

  void writeAccess(mlir::Operation *op);
  /// Makes an array of an iteration: before the loop, with a column for each
  /// lane if lanes differ in it.
  void writePrivate(mlir::memref::AllocaOp array);

  /// Reads of fields of one element, of which this is the first one, that are
  /// written together; or none.
  llvm::SmallVector<LoadOp> findFields(mlir::Operation *first) const;
  void writeFields(llvm::ArrayRef<LoadOp> loads);

  // Changes of private copies.
  void writePrivateRow(AtomicOp atomic);
  bool canStage(mlir::Operation *op);
  void writeStaged(AtomicOp atomic);
  /// After the loop.
  void writeLastFlushes();

  llvm::DenseMap<mlir::Value, mlir::Value> columns; ///< of private arrays

private:
  void writeLimited(LoadOp load, mlir::Value limited);
  /// Whether lanes access one element after the other.
  bool isRowOf(mlir::ValueRange indices) const;
  /// Where lanes access state, of type index: of a row, the first place.
  llvm::SmallVector<mlir::Value> getPlaces(mlir::ValueRange indices);
  /// Places as those of the first active lane, and whether others differ.
  std::pair<llvm::SmallVector<mlir::Value>, mlir::Value>
  compareWithFirst(mlir::ValueRange places);
  void writePrefetch(PrefetchOp prefetch);
  void writeArrayAccess(mlir::Operation *op);
  void writePrivateAccess(mlir::Operation *op);
  void writeShortArrayAccess(mlir::Operation *op, mlir::Value index);
  mlir::Value readRow(mlir::Value columns, mlir::Value row);
  void writeRow(mlir::Value columns, mlir::Value row, mlir::Value mask,
                mlir::Value value);
  void writeItemAccess(mlir::Operation *op);
  void writePush(PushOp push);
  mlir::Value countPushed(PushOp push, mlir::Value count);
  mlir::Value getPaddedPlace(PushOp push, mlir::Value array, mlir::Value place);
  /// The place of an index in the lanes' columns of an array.
  mlir::Value getColumns(mlir::Value index);

  /// Changes that wait in a list.
  struct Staged {
    mlir::Value count;                                ///< an array of one
    llvm::MapVector<mlir::Value, mlir::Value> values; ///< arrays
  };
  Staged &getStaged(AtomicOp atomic);
  void writeFlush(AtomicOp atomic, const Staged &list, mlir::Value count);

  llvm::MapVector<mlir::Operation *, Staged> staged;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEMEMORY_H
