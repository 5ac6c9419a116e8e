// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Words of records that lie one after the other, one for each lane: vectors as
// wide as all lanes are loaded and de-interleaved, or interleaved and stored.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_RECORDROWS_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_RECORDROWS_H

#include "PikoToLLVM/LoweringContext.h"

namespace piko {

/// Whether so many lanes take less for some fields of records of this size than
/// with an access for each lane.
bool isRecordRow(int64_t laneCount, int64_t size, int64_t fields);

/// The records of lanes in a mask; of others no byte is touched.
class RecordRow {
public:
  /// From `first` on, of `size` bytes each. All lanes are mostly in the mask of
  /// elements of a buffer, hardly ever in one of a shape's pixels.
  RecordRow(mlir::OpBuilder &builder, mlir::Location loc, mlir::Value first,
            int64_t size, mlir::Value mask, bool areMostlyAll);

  /// These words of each record, as vectors of i32; those of other lanes are 0.
  llvm::SmallVector<mlir::Value> read(llvm::ArrayRef<int64_t> words);
  /// Writes words, of which those that are null stay as they are.
  void write(llvm::ArrayRef<mlir::Value> words);

private:
  mlir::Value shuffle(mlir::Value a, mlir::Value b,
                      llvm::ArrayRef<int64_t> order);
  mlir::Value cast(mlir::Value vector, mlir::VectorType type);
  /// Which words of a vector are those of lanes in the mask.
  mlir::Value createMask(int64_t vector);
  mlir::Value getAddress(int64_t vector);
  mlir::Value createAreAll();
  /// The vectors of all records, of lanes in the mask, or of all.
  llvm::SmallVector<mlir::Value> load(bool areAll);
  llvm::SmallVector<mlir::Value> load();
  /// Stores vector `number` of records, of whose words some are null, for the
  /// lanes in `mask`, or for all.
  void store(llvm::ArrayRef<mlir::Value> words, int64_t number,
             mlir::Value vector, mlir::Value mask);
  /// Unit `unit` of each record, of those that fill the vectors.
  mlir::Value deinterleave(llvm::ArrayRef<mlir::Value> vectors, int64_t unit);
  /// Vector `vector` of records, of whose units some are null.
  mlir::Value interleave(llvm::ArrayRef<mlir::Value> units, int64_t vector);
  /// The same of what is to be written.
  llvm::SmallVector<mlir::Value>
  interleaveAll(llvm::ArrayRef<mlir::Value> words);

  mlir::OpBuilder &builder;
  mlir::Location loc;
  mlir::Value first, mask;
  bool areMostlyAll;
  int64_t lanes, count; ///< of words in a record
  mlir::VectorType type, pairs;
};

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_RECORDROWS_H
