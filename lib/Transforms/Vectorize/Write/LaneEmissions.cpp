// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Emissions that vectors make for all lanes (piko.cpu.append): those after all
// that lanes compute, up to three records of a lane to a port. Room is made
// once, fields are transposed into records, and each lane stores its own where
// the number of those before it says.
//
// Lanes take turns instead where few emit (three eighths; one eighth of records
// up to 16 bytes), or positions are counted (piko.cpu.is_counted). They always
// do where a loop of each lane emits, a record may go to several bins, or it is
// no whole number of words of 4 bytes, or more than 256 bytes. Records whose
// fields vectors have are transposed before lanes take turns, and copied
// (piko.cpu.store_records).

#include "Vectorize/Write/LaneTurns.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

Value LaneTurns::getTurnValue(const Turn &turn, Value value) {
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  if (Value slot = turn.varying.lookup(value))
    return loadSlot(slot, start, getVectorType(value.getType()));
  if (Value slot = turn.uniform.lookup(value))
    return splat(loadSlot(slot, start, value.getType()));
  if (Operation *op = value.getDefiningOp();
      op && op->hasTrait<OpTrait::ConstantLike>())
    return splat(builder.clone(*op)->getResult(0));
  return splat(getUniform(value));
}

Value LaneTurns::loadMask(const Turn &turn) {
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  Value bits = loadSlot(turn.mask, start, getWord());
  Type lanesBits = builder.getIntegerType(laneCount);
  if (bits.getType() != lanesBits)
    bits = arith::TruncIOp::create(builder, loc, lanesBits, bits);
  return vector::BitCastOp::create(
      builder, loc, VectorType::get({laneCount}, builder.getI1Type()),
      vector::BroadcastOp::create(builder, loc, VectorType::get({1}, lanesBits),
                                  bits));
}

const LaneTurns::Turn &LaneTurns::findTurn(LaneRecord record) const {
  return *llvm::find_if(late, [&](const Turn &turn) {
    return llvm::is_contained(turn.ops, record.append.getOperation());
  });
}

void LaneTurns::writeEmissions(const PortEmissions &port) {
  SmallVector<Value> values, masks, bins, tiles;
  for (LaneRecord record : port.records) {
    const Turn &turn = findTurn(record);
    masks.push_back(loadMask(turn));
    for (Value value : record.append.getValues())
      values.push_back(getTurnValue(turn, value));
    if (!record.place)
      continue;
    bins.push_back(getTurnValue(turn, record.place.getBin()));
    if (Value tile = record.place.getTile())
      tiles.push_back(getTurnValue(turn, tile));
  }
  LaneRecord first = port.records.front();
  LaneAppendOp::create(builder, loc, getUniform(port.writer),
                       builder.getI64IntegerAttr(port.port), values,
                       first.append.getPrim().getType().getRecord(), masks,
                       first.place ? first.place.getStageAttr()
                                   : FlatSymbolRefAttr(),
                       bins, tiles);
}

Value LaneTurns::writeRecords(AppendOp append) {
  FlatSymbolRefAttr name = append.getPrim().getType().getRecord();
  constexpr int64_t pieceSize = 16;
  int64_t size =
      laneCount *
      int64_t(llvm::alignTo(lookupRecord(append, name).getSize(), pieceSize));
  OpBuilder arrays(outermost);
  Value memory = memref::AllocaOp::create(
      arrays, loc, MemRefType::get({size}, builder.getI8Type()),
      arrays.getI64IntegerAttr(lineSize));
  SmallVector<Value> values;
  for (Value value : append.getValues())
    values.push_back(get(value));
  StoreRecordsOp::create(builder, loc, memory, values, name);
  return memory;
}

/// Whether so few records are emitted that turns take no longer: vectors store
/// those of all lanes. Of records of up to 16 bytes that is a store for each
/// lane; of larger ones turns for three eighths of the lanes took as long.
Value LaneTurns::writeAreFew() {
  Value start = arith::ConstantIndexOp::create(builder, loc, 0), count;
  int64_t few = 0;
  for (const PortEmissions &port : lanes.getEmissions())
    for (LaneRecord record : port.records) {
      Value bits = loadSlot(findTurn(record).mask, start, getWord());
      Value ones =
          arith::ExtUIOp::create(builder, loc, builder.getI32Type(),
                                 math::CtPopOp::create(builder, loc, bits));
      count = count
                  ? arith::AddIOp::create(builder, loc, count, ones).getResult()
                  : ones;
      constexpr int64_t pieceSize = 16;
      few += laneCount *
             (lookupRecord(record.append,
                           record.append.getPrim().getType().getRecord())
                          .getSize() > pieceSize
                  ? 3
                  : 1);
    }
  Value most = arith::ConstantOp::create(
      builder, loc, builder.getI32IntegerAttr(int32_t(few / 8)));
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ule, count,
                               most);
}

/// What is left for turns where vectors emit, and positions are not counted.
SmallVector<LaneTurns::Turn> LaneTurns::findOtherTurns() const {
  SmallVector<Turn> others;
  for (const Turn &turn : late) {
    Turn other = turn;
    llvm::erase_if(other.ops, [&](Operation *op) {
      return isa<NextOp>(op) || lanes.isEmission(op);
    });
    if (!other.ops.empty())
      others.push_back(std::move(other));
  }
  return others;
}

void LaneTurns::writeLate() {
  if (late.empty())
    return;
  llvm::SetVector<Value> writers;
  for (const PortEmissions &port : lanes.getEmissions())
    writers.insert(getUniform(port.writer));
  if (writers.empty())
    return writeLateTurns(late);
  for (const Turn &turn : late)
    for (Operation *op : turn.ops)
      op->walk(
          [&](NextOp next) { writers.insert(getUniform(next.getWriter())); });
  Value inTurns = writeAreFew();
  for (Value writer : writers)
    inTurns = arith::OrIOp::create(builder, loc, inTurns,
                                   IsCountedOp::create(builder, loc, writer));
  auto choice =
      scf::IfOp::create(builder, loc, inTurns, /*withElseRegion=*/true);
  builder.setInsertionPointToStart(choice.thenBlock());
  writeLateTurns(late);
  builder.setInsertionPointToStart(choice.elseBlock());
  for (const PortEmissions &port : lanes.getEmissions())
    writeEmissions(port);
  writeLateTurns(findOtherTurns());
  builder.setInsertionPointAfter(choice);
}
