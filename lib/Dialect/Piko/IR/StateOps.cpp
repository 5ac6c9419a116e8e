// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Access to a pipeline's state.

#include "FieldAccess.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

using namespace mlir;
using namespace piko;

/// The piece of state that an access names, after its indices are checked.
static FailureOr<Operation *> verifyState(Operation *op, FlatSymbolRefAttr name,
                                          std::optional<size_t> indices) {
  Operation *state = lookupInPipeline<Operation *>(op, name);
  if (!state || !getStateRecord(state))
    return op->emitOpError("expected a constant, buffer or image, but got ")
           << name << ", which is none";
  if (indices && int64_t(*indices) != getStateRank(state)) {
    InFlightDiagnostic error = op->emitOpError("expected ")
                               << getStateRank(state) << " indices into "
                               << name << ", but got " << *indices;
    error.attachNote(state->getLoc()) << "the state is declared here";
    return error;
  }
  return state;
}

/// Whether a tile, if there is one, is of the image that an access names.
static LogicalResult verifyTile(Operation *op, Value tile,
                                FlatSymbolRefAttr image) {
  if (!tile)
    return success();
  auto made = tile.getDefiningOp<TileOp>();
  if (made && made.getImageAttr() == image)
    return success();
  InFlightDiagnostic error = op->emitOpError("expected the tile of ") << image;
  if (made)
    error << ", but got that of " << made.getImageAttr();
  return error;
}

template <typename AccessOp>
static LogicalResult verifyAccess(AccessOp op, Type type) {
  auto state = verifyState(op, op.getStateAttr(), op.getIndices().size());
  if (failed(state))
    return failure();
  FlatSymbolRefAttr record = getStateRecord(*state);
  if (failed(verifyFieldAccess(op, record, op.getField(),
                               op.getElements().size(), type)))
    return failure();
  return verifyElement(op, record, op.getField(), op.getElements());
}

template <typename AccessOp>
static LogicalResult verifyWrite(AccessOp op, Type type) {
  if (lookupInPipeline<ConstantOp>(op, op.getStateAttr()))
    return op.emitOpError(
               "expected a buffer or an image, but got the constant ")
           << op.getStateAttr();
  return verifyAccess(op, type);
}

LogicalResult LoadOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyTile(*this, getTile(), getStateAttr())))
    return failure();
  return verifyAccess(*this, getResult().getType());
}

LogicalResult StoreOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyTile(*this, getTile(), getStateAttr())))
    return failure();
  return verifyWrite(*this, getValue().getType());
}

/// Whether an operation is what its private copy is for.
template <typename AccessOp> static LogicalResult verifyCopy(AccessOp op) {
  auto made = op.getCopy().template getDefiningOp<PrivateCopyOp>();
  if (made && made.getStateAttr() == op.getStateAttr() &&
      made.getField() == op.getField() && made.getKind() == op.getKind())
    return success();
  InFlightDiagnostic error = op.emitOpError("expected a private copy for '")
                             << stringifyAtomicKind(op.getKind()) << "' of "
                             << op.getStateAttr() << " \"" << op.getField()
                             << "\"";
  if (made)
    error << ", but got one for '" << stringifyAtomicKind(made.getKind())
          << "' of " << made.getStateAttr() << " \"" << made.getField() << "\"";
  return error;
}

LogicalResult AtomicOp::verifySymbolUses(SymbolTableCollection &) {
  bool isFloat = isa<FloatType>(getValue().getType());
  if (isFloat != (getKind() == AtomicKind::AddF))
    return emitOpError("expected a ")
           << (isFloat ? "float only for 'add_float'" : "float for 'add_float'")
           << ", but got '" << stringifyAtomicKind(getKind()) << "' of type "
           << getValue().getType();
  if (getOld() && getOld().getType() != getValue().getType())
    return emitOpError("expected a result of type ")
           << getValue().getType() << ", but got " << getOld().getType();
  // The stage is known until its phases have become kernels.
  if (StageOp stage = getPhaseStage(*this); stage && (getOld() || isFloat)) {
    ScheduleOp schedule = stage.getSchedule();
    if (!schedule || !schedule.getUnordered())
      return emitOpError("expected stage '")
             << getCppName(stage) << "' to be unordered, because "
             << (getOld() ? "the result of an atomic" : "a float atomic")
             << " shows the order of its primitives";
  }
  if (failed(verifyWrite(*this, getValue().getType())))
    return failure();
  if (!getCopy())
    return success();
  if (getOld())
    return emitOpError("expected no result, because a private copy does not "
                       "hold what others have changed");
  return verifyCopy(*this);
}

LogicalResult PrefetchOp::verifySymbolUses(SymbolTableCollection &) {
  return failure(
      failed(verifyState(*this, getStateAttr(), getIndices().size())));
}

LogicalResult ExtentOp::verifySymbolUses(SymbolTableCollection &) {
  auto state = verifyState(*this, getStateAttr(), std::nullopt);
  if (failed(state))
    return failure();
  if (getDim() >= getStateRank(*state))
    return emitOpError("expected a dimension below ")
           << getStateRank(*state) << ", but got " << getDim();
  return success();
}

LogicalResult UpdateOp::verifySymbolUses(SymbolTableCollection &) {
  if (!lookupInPipeline<ImageOp>(*this, getImageAttr()))
    return emitOpError("expected an image, but got ")
           << getImageAttr() << ", which is none";
  if (failed(verifyTile(*this, getTile(), getImageAttr())))
    return failure();
  return failure(
      failed(verifyState(*this, getImageAttr(), getCoordinates().size())));
}

LogicalResult UpdateOp::verifyRegions() {
  auto image = lookupInPipeline<ImageOp>(*this, getImageAttr());
  RecordOp record =
      image ? lookupRecord(image, image.getRecordAttr()) : RecordOp();
  if (!record)
    return success(); // verifySymbolUses reports it
  if (!(*this)->getParentOfType<StageOp>() &&
      !(*this)->getParentOfType<KernelOp>())
    return emitOpError("expected to be inside a process phase");
  SmallVector<Type> types = record.getElementTypes();
  Block &body = getBody().front();
  if (types != body.getArgumentTypes())
    return emitOpError("expected a block argument for each number of record ")
           << image.getRecordAttr() << ", (" << types << "), but got ("
           << body.getArgumentTypes() << ")";
  // The body works on a copy of the pixel, which other access would bypass.
  WalkResult bypass = walk([&](Operation *op) {
    auto access = dyn_cast<StateAccessOpInterface>(op);
    if (op == getOperation() || !access ||
        access.getAccessedState() != getImageAttr())
      return WalkResult::advance();
    op->emitError("expected an update to see ")
        << getImageAttr() << " only through the pixel that it is given";
    return WalkResult::interrupt();
  });
  if (bypass.wasInterrupted())
    return failure();
  auto yield = dyn_cast<YieldOp>(body.getTerminator());
  if (!yield)
    return emitOpError("expected its body to end with piko.yield");
  if (types != yield.getPixel().getTypes())
    return yield.emitOpError("expected the numbers of record ")
           << image.getRecordAttr() << ", (" << types << "), but got ("
           << yield.getPixel().getTypes() << ")";
  if (yield.getResults().getTypes() != getResultTypes())
    return yield.emitOpError("expected results of types (")
           << getResultTypes() << "), but got ("
           << yield.getResults().getTypes() << ")";
  return success();
}

//===----------------------------------------------------------------------===//
// How state is used
//===----------------------------------------------------------------------===//

/// Indices have as many lanes, and consecutive ones begin with scalars.
template <typename AccessOp>
static LogicalResult verifyLaneIndices(AccessOp op, int64_t count) {
  for (Value index : op.getIndices())
    if (auto vector = dyn_cast<VectorType>(index.getType())) {
      if (op.getConsecutive())
        return op.emitOpError("expected the indices of the first of "
                              "consecutive lanes, but got ")
               << vector;
      if (vector.getNumElements() != count)
        return op.emitOpError("expected an index for each of ")
               << count << " lanes, but got " << vector;
    }
  return success();
}

/// The field is of the lanes' type, and masks and indices have as many lanes.
template <typename AccessOp>
static LogicalResult verifyLanes(AccessOp op, VectorType lanes) {
  int64_t count = lanes.getNumElements();
  auto mask = cast<VectorType>(op.getMask().getType());
  if (mask.getNumElements() != count)
    return op.emitOpError("expected a mask of ")
           << count << " lanes, but got " << mask;
  if (failed(verifyLaneIndices(op, count)))
    return failure();
  return verifyAccess(op, lanes.getElementType());
}

LogicalResult GatherOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyLanes(*this, cast<VectorType>(getResult().getType()));
}

LogicalResult GatherRunOp::verifySymbolUses(SymbolTableCollection &) {
  auto state = verifyState(*this, getStateAttr(), /*indices=*/1);
  if (failed(state))
    return failure();
  FlatSymbolRefAttr record = getStateRecord(*state);
  int64_t size = lookupRecord(*this, record).getSize(),
          together = size * getNumResults();
  if (!llvm::is_contained({1, 2, 4, 8}, together))
    return emitOpError("expected 1, 2, 4 or 8 bytes together, but got ")
           << getNumResults() << " elements of " << size;
  auto index = getIndex().getType(), mask = getMask().getType();
  for (Type type : getResultTypes()) {
    auto lanes = cast<VectorType>(type);
    if (index.getShape() != lanes.getShape() ||
        mask.getShape() != lanes.getShape())
      return emitOpError("expected an index and a mask of ")
             << lanes.getNumElements() << " lanes, but got " << index << " and "
             << mask;
    if (failed(verifyFieldAccess(*this, record, getField(), /*elements=*/0,
                                 lanes.getElementType())))
      return failure();
    constexpr int64_t byteBits = 8;
    if (size * byteBits != lanes.getElementTypeBitWidth())
      return emitOpError("expected elements of no more than the field, but got "
                         "records of ")
             << size << " bytes";
  }
  return success();
}

LogicalResult ScatterOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyLanes(*this, cast<VectorType>(getValue().getType()));
}

LogicalResult ReduceRowOp::verifySymbolUses(SymbolTableCollection &) {
  return success(
      succeeded(verifyLanes(*this, cast<VectorType>(getValue().getType()))) &&
      succeeded(verifyCopy(*this)));
}

LogicalResult LaneElementsOp::verifySymbolUses(SymbolTableCollection &) {
  auto lanes = cast<VectorType>(getAddresses().getType());
  if (failed(verifyLaneIndices(*this, lanes.getNumElements())))
    return failure();
  return failure(
      failed(verifyState(*this, getStateAttr(), getIndices().size())));
}

FlatSymbolRefAttr LaneElementsOp::getAccessedState() { return getStateAttr(); }
int LaneElementsOp::getAccessKinds() { return StateAccess::reads; }

FlatSymbolRefAttr GatherOp::getAccessedState() { return getStateAttr(); }
int GatherOp::getAccessKinds() { return StateAccess::reads; }

FlatSymbolRefAttr GatherRunOp::getAccessedState() { return getStateAttr(); }
int GatherRunOp::getAccessKinds() { return StateAccess::reads; }

FlatSymbolRefAttr ScatterOp::getAccessedState() { return getStateAttr(); }
int ScatterOp::getAccessKinds() { return StateAccess::stores; }

FlatSymbolRefAttr ReduceRowOp::getAccessedState() { return getStateAttr(); }
int ReduceRowOp::getAccessKinds() { return StateAccess::changesAtomically; }

FlatSymbolRefAttr LoadOp::getAccessedState() { return getStateAttr(); }
int LoadOp::getAccessKinds() { return StateAccess::reads; }

FlatSymbolRefAttr StoreOp::getAccessedState() { return getStateAttr(); }
int StoreOp::getAccessKinds() { return StateAccess::stores; }

FlatSymbolRefAttr AtomicOp::getAccessedState() { return getStateAttr(); }
int AtomicOp::getAccessKinds() { return StateAccess::changesAtomically; }

FlatSymbolRefAttr UpdateOp::getAccessedState() { return getImageAttr(); }
int UpdateOp::getAccessKinds() { return StateAccess::updates; }
