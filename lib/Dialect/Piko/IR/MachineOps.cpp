// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The structured work of kernels.

#include "StageUses.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Bins, and what is in them
//===----------------------------------------------------------------------===//

static LogicalResult verifyArgument(Operation *op, Block &body, Type expected) {
  if (body.getNumArguments() == 1 && body.getArgument(0).getType() == expected)
    return success();
  return op->emitOpError("expected one block argument of type ") << expected;
}

LogicalResult BinsOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyStage(*this, getStageAttr());
}

LogicalResult BinsOp::verifyRegions() {
  if (failed(
          verifyArgument(*this, *getBodyBlock(), IndexType::get(getContext()))))
    return failure();
  llvm::SmallDenseSet<Attribute> before;
  for (auto work : getBodyBlock()->getOps<WorkOpInterface>()) {
    FlatSymbolRefAttr stage = work.getStageAttr();
    FlatSymbolRefAttr producer = work.getProducerAttr();
    if (before.empty() && (producer || stage != getStageAttr()))
      return work->emitOpError("expected to take what the bins of ")
             << getStageAttr() << " hold, because it is the first work on them";
    if (!before.empty() && !producer)
      return work->emitOpError("expected to take what work before it "
                               "emits, because it is not the first");
    if (producer && !before.contains(producer))
      return work->emitOpError("expected work of ") << producer << " before it";
    if (work->hasAttr(marks::again)) {
      auto next = dyn_cast_or_null<WorkOpInterface>(work->getNextNode());
      if (!producer || !next || next.getStageAttr() != stage ||
          next.getProducerAttr() != producer ||
          next.getPortAttr() != work.getPortAttr())
        return work->emitOpError("expected work that takes the same after it");
      continue;
    }
    if (!before.insert(stage).second)
      return work->emitOpError("expected one piece of work of ") << stage;
  }
  if (before.empty())
    return emitOpError("expected work on what the bins hold");
  return success();
}

/// What work has in common.
static LogicalResult verifyWork(WorkOpInterface op, bool isSource) {
  if (failed(verifyStage(op, op.getStageAttr())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(op, op.getStageAttr());
  bool takesList = op.takesList();
  if (stage.getTakesList() != takesList && !isSource)
    return op->emitOpError("expected ")
           << (takesList ? "a stage that takes lists"
                         : "a stage that takes primitives one by one")
           << ", but got " << op.getStageAttr();
  if (bool(op.getProducerAttr()) != bool(op.getPortAttr()))
    return op->emitOpError("expected a producer and its port, or neither");
  Type input = takesList
                   ? Type(ListType::get(op.getContext(), stage.getInputAttr()))
                   : Type(PrimType::get(op.getContext(), stage.getInputAttr()));
  if (failed(verifyArgument(op, *op.getBodyBlock(), input)))
    return failure();
  if (failed(verifyPhaseBody(op)))
    return failure();
  if (!op.getProducerAttr())
    return success();
  return verifyLocalEdge(op, op.getProducerAttr(), op.getPortAttr().getInt(),
                         op.getStageAttr());
}

LogicalResult ItemsOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyWork(*this, getSource().has_value())))
    return failure();
  return verifySource(*this, getSource(), getStageAttr());
}

LogicalResult ItemsOp::verifyRegions() {
  bool inBins = isa<BinsOp>((*this)->getParentOp());
  if (bool(getSource()) == !inBins)
    return success();
  if (inBins)
    return emitOpError("expected no source inside 'piko.bins'");
  return emitOpError("expected a source outside of 'piko.bins'");
}

LogicalResult ListsOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyWork(*this, /*isSource=*/false);
}

LogicalResult ListsOp::verifyRegions() {
  if (!isa<BinsOp>((*this)->getParentOp()))
    return emitOpError("expected to be inside 'piko.bins'");
  if (auto lanes = getLanes();
      lanes && *lanes != LaneMapping::Iterations && *lanes != LaneMapping::One)
    return emitOpError("expected lanes 'iterations' or 'one', because a list "
                       "is one item, but got '")
           << stringifyLaneMapping(*lanes) << "'";
  return success();
}

/// The work that a primitive is the argument of, or null.
static ItemsOp findItems(Value prim) {
  auto argument = dyn_cast<BlockArgument>(prim);
  return argument ? dyn_cast<ItemsOp>(argument.getOwner()->getParentOp())
                  : ItemsOp();
}

LogicalResult PositionOp::verifySymbolUses(SymbolTableCollection &) {
  ItemsOp items = findItems(getPrim());
  if (items && !items.getSource())
    return success();
  return emitOpError("expected a primitive of 'piko.items' in 'piko.bins'");
}

LogicalResult PlaceOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  if (stage.getInputAttr() != getPrim().getType().getRecord())
    return emitOpError("expected a primitive of record ")
           << stage.getInputAttr() << ", which " << getStageAttr()
           << " takes, but got " << getPrim().getType().getRecord();
  if (getTile() && !stage.getTile())
    return emitOpError("expected a tile only in a stage that is divided into "
                       "tiles, but ")
           << getStageAttr() << " is not";
  auto emission = getPrim().getDefiningOp<EmissionOpInterface>();
  if (emission && emission.getPrim() == getPrim())
    return success();
  ItemsOp items = findItems(getPrim());
  if (items && items.getSource())
    return success();
  return emitOpError("expected what 'piko.emit' gives, or a primitive of a "
                     "source");
}

//===----------------------------------------------------------------------===//
// The pixels of a bin
//===----------------------------------------------------------------------===//

LogicalResult TileOp::verifySymbolUses(SymbolTableCollection &) {
  auto image = lookupInPipeline<ImageOp>(*this, getImageAttr());
  if (!image)
    return emitOpError("expected an image, but got ")
           << getImageAttr() << ", which is none";
  if (getTile().getType().getRecord() != image.getRecordAttr())
    return emitOpError("expected a tile of record ")
           << image.getRecordAttr() << ", but got "
           << getTile().getType().getRecord();
  auto isWrite = [](Operation *user) { return isa<WriteTileOp>(user); };
  if (llvm::count_if(getTile().getUsers(), isWrite) != 1)
    return emitOpError("expected one 'piko.write_tile' of it");
  auto bins = dyn_cast<BinsOp>((*this)->getParentOp());
  if (!bins) // below the machine level
    return success();
  auto stage = lookupInPipeline<StageOp>(*this, bins.getStageAttr());
  ArrayRef<int64_t> extents = getTile().getType().getExtents();
  if (stage && (stage.getBins() != extents || llvm::is_contained(extents, 0)))
    return emitOpError("expected the extents of the bins of ")
           << bins.getStageAttr() << ", [" << stage.getBins()
           << "], of which none is 0, but got [" << extents << "]";
  if (getBin() != bins.getBin())
    return emitOpError("expected the bin that is being run");
  return success();
}

LogicalResult WriteTileOp::verifySymbolUses(SymbolTableCollection &) {
  auto tile = getTile().getDefiningOp<TileOp>();
  if (tile && tile.getImageAttr() == getImageAttr() &&
      tile.getBin() == getBin())
    return success();
  return emitOpError("expected the image and the bin that the tile is of");
}

FlatSymbolRefAttr TileOp::getAccessedState() { return getImageAttr(); }
int TileOp::getAccessKinds() { return StateAccess::reads; }

FlatSymbolRefAttr WriteTileOp::getAccessedState() { return getImageAttr(); }
int WriteTileOp::getAccessKinds() { return StateAccess::stores; }
