// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Instrument/Bounds.h"

#include "Piko/Dialect/Piko/IR/PikoCheck.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

/// Checks the operands that are indices into an array of these counts.
static void checkIndices(Operation *op, MutableOperandRange indices,
                         ArrayRef<int64_t> counts) {
  for (auto [index, count] : llvm::zip_equal(indices, counts)) {
    APInt known;
    if (matchPattern(index.get(), m_ConstantInt(&known)) && known.ult(count))
      continue;
    OpBuilder builder(op);
    index.set(CheckIndexOp::create(builder, op->getLoc(), index.get(), count));
  }
}

/// The counts of the array that the field is.
template <typename OpT>
static ArrayRef<int64_t> getCounts(OpT op, RecordOp record) {
  return record.getField(op.getField()).getCounts();
}
template <typename AccessOp> static RecordOp getAccessedRecord(AccessOp op) {
  auto *state = lookupInPipeline<Operation *>(op, op.getStateAttr());
  return lookupRecord(op, getStateRecord(state));
}

void piko::checkIndices(Operation *phase) {
  phase->walk([&](Operation *op) {
    llvm::TypeSwitch<Operation *>(op)
        .Case<memref::LoadOp, memref::StoreOp>([](auto access) {
          ::checkIndices(access, access.getIndicesMutable(),
                         access.getMemRefType().getShape());
        })
        .Case<GetOp>([](GetOp get) {
          RecordOp record = lookupRecord(
              get, cast<PrimType>(get.getPrim().getType()).getRecord());
          ::checkIndices(get, get.getElementsMutable(), getCounts(get, record));
        })
        .Case<LoadOp, StoreOp, AtomicOp>([](auto access) {
          ::checkIndices(access, access.getElementsMutable(),
                         getCounts(access, getAccessedRecord(access)));
        });
  });
}

void piko::checkTrips(Operation *phase) {
  phase->walk([](scf::WhileOp loop) {
    scf::ConditionOp condition = loop.getConditionOp();
    OpBuilder builder(condition);
    Value may = CheckTripOp::create(builder, loop.getLoc());
    condition.getConditionMutable().set(arith::AndIOp::create(
        builder, loop.getLoc(), condition.getCondition(), may));
  });
}
