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

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Which
//===----------------------------------------------------------------------===//

/// How many records of a lane vectors emit to a port.
static constexpr int64_t mostRecords = 3;

static RecordOp getRecord(AppendOp append) {
  return lookupRecord(append, append.getPrim().getType().getRecord());
}

/// Whether vectors can be made words of, and records of words.
static bool hasWords(AppendOp append) {
  constexpr int64_t wordSize = 4, largest = 256;
  RecordOp record = getRecord(append);
  bool areWords = !append.getValues().empty() &&
                  record.getSize() % wordSize == 0 &&
                  record.getSize() <= largest;
  for (auto [type, offset] :
       llvm::zip(record.getElementTypes(), record.getElementOffsets()))
    areWords &= offset % (type.getIntOrFloatBitWidth() / 8) == 0;
  return areWords;
}

/// Whether vectors have all that an operation of a group takes.
static bool hasVectors(Operation *op,
                       const llvm::SetVector<Operation *> &turns) {
  return op->getBlock() == turns.front()->getBlock() &&
         llvm::none_of(op->getOperands(), [&](Value operand) {
           return isLaneType(operand.getType()) && operand.getDefiningOp() &&
                  turns.contains(operand.getDefiningOp());
         });
}

bool LaneOrder::isStoredByVectors(AppendOp append) const {
  constexpr size_t least = 4;
  const OrderedGroup *group = findGroup(append);
  return group && !isEmission(append) && append.getValues().size() >= least &&
         hasVectors(append, findTurns(*group)) && hasWords(append);
}

StringRef LaneOrder::explainTurns(Operation *emission) const {
  auto isRepeated = [&](Operation *op) {
    for (Operation *at = op->getParentOp(); at != loop; at = at->getParentOp())
      if (isa<scf::ForOp, scf::WhileOp>(at))
        return true;
    return false;
  };
  auto append = dyn_cast<AppendOp>(emission);
  if (append && isRepeated(append))
    return ": a loop of each lane emits";
  if (append && !hasWords(append))
    return ": the record is no whole number of words of 4 bytes, up to 256 "
           "bytes";
  int64_t count = 0;
  bool isRepeatedly = !append && isRepeated(emission);
  loop.walk([&](Operation *op) {
    auto other = dyn_cast<AppendOp>(op);
    auto place = dyn_cast<AppendBinOp>(op);
    count += append && other && other.getWriter() == append.getWriter() &&
             other.getPort() == append.getPort();
    isRepeatedly |= append && place &&
                    place.getWriter() == append.getWriter() &&
                    place.getPort() == append.getPort() && isRepeated(place);
  });
  if (isRepeatedly)
    return ": a primitive may go to several bins";
  return count > mostRecords ? ": more than 3 of each lane go to the port" : "";
}

/// Adds a record, or the place of the last one; whether there is a way to emit
/// it.
bool LaneOrder::addEmission(Operation *op, PortEmissions &port) const {
  const OrderedGroup *group = findGroup(op);
  if (!group || !group->late || !hasVectors(op, findTurns(*group)))
    return false;
  SmallVector<LaneRecord> &records = port.records;
  if (auto append = dyn_cast<AppendOp>(op)) {
    records.push_back({append, {}, group});
    return int64_t(records.size()) <= mostRecords && append->use_empty() &&
           hasWords(append);
  }
  auto place = cast<AppendBinOp>(op);
  if (records.empty() || records.back().place || records.back().group != group)
    return false;
  records.back().place = place;
  AppendBinOp first = records.front().place;
  return first && first.getStage() == place.getStage() &&
         bool(first.getTile()) == bool(place.getTile());
}

void LaneOrder::findEmissions() {
  llvm::MapVector<std::pair<Value, int64_t>, PortEmissions> ports;
  llvm::DenseSet<std::pair<Value, int64_t>> others;
  llvm::DenseSet<Value> writers; // that more happens to than emission
  loop.walk<WalkOrder::PreOrder>([&](Operation *op) {
    auto append = dyn_cast<AppendOp>(op);
    auto place = dyn_cast<AppendBinOp>(op);
    if (append || (place && place.getPort())) {
      Value writer = append ? append.getWriter() : place.getWriter();
      int64_t number = append ? append.getPort() : *place.getPort();
      PortEmissions &port = ports[{writer, number}];
      port.writer = writer;
      port.port = number;
      if (!addEmission(op, port))
        others.insert({writer, number});
    } else if (!isa<NextOp>(op)) {
      for (Value operand : op->getOperands())
        if (isa<WriterType>(operand.getType()))
          writers.insert(operand);
    }
  });
  for (auto &[key, port] : ports) {
    auto isPlaced = [](const LaneRecord &record) { return bool(record.place); };
    bool areAlike = llvm::all_of(port.records, isPlaced) ||
                    llvm::none_of(port.records, isPlaced);
    if (!areAlike || others.contains(key) || writers.contains(port.writer))
      continue;
    for (LaneRecord record : port.records) {
      emitted.insert(record.append);
      if (record.place)
        emitted.insert(record.place);
    }
    emissions.push_back(port);
  }
}

//===----------------------------------------------------------------------===//
// How
//===----------------------------------------------------------------------===//

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
  constexpr int64_t lineSize = 64, pieceSize = 16;
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
      few +=
          laneCount * (getRecord(record.append).getSize() > pieceSize ? 3 : 1);
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
