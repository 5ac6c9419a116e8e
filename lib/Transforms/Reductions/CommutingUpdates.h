// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Updates whose order does not show, as sums of integers: atomic operations.

#ifndef PIKO_LIB_TRANSFORMS_COMMUTINGUPDATES_H
#define PIKO_LIB_TRANSFORMS_COMMUTINGUPDATES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "llvm/ADT/DenseMap.h"
#include "llvm/ADT/SetVector.h"

namespace piko {

/// An update that changes each number by an operation that commutes and
/// associates, with something that has nothing to do with the pixel.
struct CommutingUpdate {
  struct Change {
    unsigned number; ///< Of the record, fields in order.
    AtomicKind kind;
    mlir::Operation *op; ///< In the update; of a sum also a subtraction.
    mlir::Value value;   ///< What the number is changed by.
    mlir::Value
        condition;       ///< On which, if `op` stands in front; null = always.
    bool outcome = true; ///< Of the condition.
  };
  UpdateOp update;
  llvm::SmallVector<Change> changes;
};

/// Of all images of a kernel that it changes by nothing but such updates, each
/// number by one kind of operation, the updates.
llvm::SmallVector<CommutingUpdate> findCommutingUpdates(KernelOp kernel);

/// The images of updates.
llvm::SetVector<mlir::StringAttr>
getImages(llvm::ArrayRef<CommutingUpdate> updates);

/// Makes updates of a stage atomic operations, under tests of their pixels,
/// and says so.
void makeAtomic(StageOp stage, llvm::MutableArrayRef<CommutingUpdate> updates);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_COMMUTINGUPDATES_H
