// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which emissions vectors make for all lanes, and why lanes take turns to make
// others.

#include "Vectorize/Analysis/LaneOrder.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "llvm/ADT/MapVector.h"

using namespace mlir;
using namespace piko;

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
