// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Atomic operations on private copies of state, which nobody else changes. Such
// operations commute, and nothing else in the kernel uses the state.
//
//   rows    lanes whose elements stand side by side change them at once;
//   staged  what few lanes of many vectors change is compressed into a list,
//           and a scalar loop goes through it when it is full. So misses of the
//           cache overlap, and no branch depends on the lanes of one vector.

#include "Vectorize/Write/LaneMemory.h"

#include "Piko/Analysis/TargetModel.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

/// How many changes a list holds before it is gone through.
static constexpr int64_t mostStaged = 256;

void LaneMemory::writePrivateRow(AtomicOp atomic) {
  SmallVector<Value> elements;
  for (Value element : atomic.getElements())
    elements.push_back(getUniform(element));
  ReduceRowOp::create(builder, loc, atomic.getKind(), get(atomic.getValue()),
                      atomic.getState(), getPlaces(atomic.getIndices()),
                      atomic.getField(), elements, active,
                      getUniform(atomic.getCopy()));
}

bool LaneMemory::canStage(Operation *op) {
  // Fewer lanes have no instruction that compresses.
  constexpr int64_t least = 16;
  auto atomic = dyn_cast<AtomicOp>(op);
  return atomic && paired && laneCount >= least && atomic.getCopy() &&
         !atomic.getOld() && loop.isDefinedOutsideOfLoop(atomic.getCopy()) &&
         llvm::all_of(atomic->getOperands(), [&](Value operand) {
           return loop.isDefinedOutsideOfLoop(operand) ||
                  isLaneType(operand.getType());
         });
}

LaneMemory::Staged &LaneMemory::getStaged(AtomicOp atomic) {
  Staged &list = staged[atomic];
  if (list.count)
    return list;
  OpBuilder arrays(outermost);
  auto allocate = [&](int64_t size, Type type) -> Value {
    return memref::AllocaOp::create(arrays, loc, MemRefType::get({size}, type),
                                    arrays.getI64IntegerAttr(lineSize));
  };
  list.count = allocate(1, builder.getIndexType());
  for (Value operand : atomic->getOperands())
    if (!loop.isDefinedOutsideOfLoop(operand))
      list.values[operand] =
          allocate(mostStaged + laneCount, operand.getType());
  Value zero = arith::ConstantIndexOp::create(arrays, loc, 0);
  memref::StoreOp::create(arrays, loc, zero, list.count, zero);
  return list;
}

/// Makes the changes that wait, in any order.
void LaneMemory::writeFlush(AtomicOp atomic, const Staged &list, Value count) {
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto changes = scf::ForOp::create(builder, loc, zero, count, one);
  {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(changes.getBody());
    IRMapping mapping;
    for (auto [value, array] : list.values)
      mapping.map(value, memref::LoadOp::create(builder, loc, array,
                                                changes.getInductionVar())
                             .getResult());
    builder.clone(*atomic, mapping);
  }
  memref::StoreOp::create(builder, loc, zero, list.count, zero);
}

void LaneMemory::writeStaged(AtomicOp atomic) {
  Staged &list = getStaged(atomic);
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value count = memref::LoadOp::create(builder, loc, list.count, zero);
  for (auto [value, array] : list.values)
    vector::CompressStoreOp::create(builder, loc, array, count, active,
                                    get(value), IntegerAttr());
  Value more = math::CtPopOp::create(builder, loc, getBits(active));
  count = arith::AddIOp::create(
      builder, loc, count,
      arith::IndexCastUIOp::create(builder, loc, builder.getIndexType(), more));
  memref::StoreOp::create(builder, loc, count, list.count, zero);
  Value most = arith::ConstantIndexOp::create(builder, loc, mostStaged);
  Value isFull = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::uge,
                                       count, most);
  auto full = scf::IfOp::create(builder, loc, isFull, /*withElse=*/false);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(full.thenBlock());
  writeFlush(atomic, list, count);
}

void LaneMemory::writeLastFlushes() {
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointAfter(outermost);
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  for (auto &[atomic, list] : staged)
    writeFlush(cast<AtomicOp>(atomic), list,
               memref::LoadOp::create(builder, loc, list.count, zero));
}
