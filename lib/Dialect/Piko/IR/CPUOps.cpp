// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops over the storage of bins, and what units of work leave.

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "FieldAccess.h"
#include "StageUses.h"

using namespace mlir;
using namespace piko;

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoCPUOps.cpp.inc"

LogicalResult OpenBinsOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  if (stage.getInputAttr() != getBins().getType().getRecord())
    return emitOpError("expected bins of record ")
           << stage.getInputAttr() << ", but got "
           << getBins().getType().getRecord();
  return verifySource(*this, getSource(), getStageAttr());
}

LogicalResult TakesVectorsOp::verifySymbolUses(SymbolTableCollection &) {
  int64_t number = getNumber();
  if (number < 0 || number >= mostMappings)
    return emitOpError("expected a number in [0, ")
           << mostMappings << "), but got " << number;
  if (std::optional<uint64_t> within = getWithin();
      within && (int64_t(*within) < 0 || int64_t(*within) >= number))
    return emitOpError("expected `within` in [0, ")
           << number << "), but got " << int64_t(*within);
  auto kernel = getOperation()->getParentOfType<KernelOp>();
  if (!kernel)
    return success();
  WalkResult other = kernel.walk([&](TakesVectorsOp op) {
    return op != *this && op.getNumber() == getNumber()
               ? WalkResult::interrupt()
               : WalkResult::advance();
  });
  return other.wasInterrupted()
             ? emitOpError("expected a number that no other loop of the kernel "
                           "has, but got ")
                   << number
             : success();
}

LogicalResult ElectOp::verify() {
  constexpr int64_t most = 7;
  int64_t eighths = getEighths();
  if (eighths >= 1 && eighths <= most)
    return success();
  return emitOpError("expected from 1 to ")
         << most << " eighths of the lanes, but got " << eighths;
}

/// A value and the storage that it is in are of one record.
static LogicalResult verifyStored(Operation *op, BinsType bins,
                                  FlatSymbolRefAttr record, StringRef what) {
  if (bins.getRecord() == record)
    return success();
  return op->emitOpError("expected a ")
         << what << " of record " << bins.getRecord()
         << ", which the bins hold, but got " << record;
}

LogicalResult ListOp::verify() {
  return verifyStored(*this, getBins().getType(),
                      getList().getType().getRecord(), "list");
}

LogicalResult ItemOp::verify() {
  return verifyStored(*this, getBins().getType(),
                      getPrim().getType().getRecord(), "primitive");
}

/// What belongs to lanes is a vector with an element for each.
static LogicalResult verifyLaneCount(Operation *op, Type mask, Type lanes,
                                     const Twine &what) {
  int64_t count = cast<VectorType>(mask).getNumElements();
  auto vector = dyn_cast<VectorType>(lanes);
  if (!vector || vector.getNumElements() == count)
    return success();
  return op->emitOpError("expected ")
         << what << " for each of " << count << " lanes, but got " << vector;
}

LogicalResult LaneItemsOp::verify() {
  Type mask = getMask().getType();
  if (failed(
          verifyLaneCount(*this, mask, getPosition().getType(), "a position")))
    return failure();
  return verifyLaneCount(*this, mask, getResult().getType(), "an address");
}

LogicalResult LaneGetOp::verifySymbolUses(SymbolTableCollection &) {
  Type mask = getMask().getType(), result = getResult().getType();
  if (failed(verifyLaneCount(*this, mask, getAddresses().getType(),
                             "an address")) ||
      failed(verifyLaneCount(*this, mask, result, "a number")))
    return failure();
  if (failed(verifyFieldAccess(*this, getRecordAttr(), getField(),
                               getElements().size(),
                               cast<VectorType>(result).getElementType())))
    return failure();
  return verifyElement(*this, getRecordAttr(), getField(), getElements());
}

LogicalResult LaneGetFieldsOp::verifySymbolUses(SymbolTableCollection &) {
  Type mask = getMask().getType();
  if (failed(
          verifyLaneCount(*this, mask, getAddresses().getType(), "an address")))
    return failure();
  if (getFields().size() != getNumResults())
    return emitOpError("expected a result for each of ")
           << getFields().size() << " fields, but got " << getNumResults();
  for (auto [field, result] : llvm::zip(getFields(), getResultTypes()))
    if (failed(verifyLaneCount(*this, mask, result, "a number")) ||
        failed(verifyFieldAccess(*this, getRecordAttr(),
                                 cast<StringAttr>(field).getValue(), 0,
                                 cast<VectorType>(result).getElementType())))
      return failure();
  return success();
}

LogicalResult LaneSetFieldsOp::verifySymbolUses(SymbolTableCollection &) {
  Type mask = getMask().getType();
  if (failed(
          verifyLaneCount(*this, mask, getAddresses().getType(), "an address")))
    return failure();
  if (getFields().size() != getValues().size())
    return emitOpError("expected a number for each of ")
           << getFields().size() << " fields, but got " << getValues().size();
  auto state = lookupInPipeline<Operation *>(*this, getStateAttr());
  FlatSymbolRefAttr record = state ? getStateRecord(state) : nullptr;
  if (!record)
    return emitOpError("expected a piece of state, but got ") << getStateAttr();
  for (auto [field, value] : llvm::zip(getFields(), getValues().getTypes()))
    if (failed(verifyLaneCount(*this, mask, value, "a number")) ||
        failed(verifyFieldAccess(*this, record,
                                 cast<StringAttr>(field).getValue(), 0,
                                 cast<VectorType>(value).getElementType())))
      return failure();
  return success();
}

FlatSymbolRefAttr LaneSetFieldsOp::getAccessedState() { return getStateAttr(); }
int LaneSetFieldsOp::getAccessKinds() { return StateAccess::stores; }

LogicalResult PermuteOp::verify() {
  Type type = getVector().getType();
  if (failed(verifyLaneCount(*this, type, getLanes().getType(), "a lane")))
    return failure();
  int64_t count = cast<VectorType>(type).getNumElements();
  if (!llvm::isPowerOf2_64(count))
    return emitOpError("expected a power of two of lanes, but got ") << count;
  return success();
}

LogicalResult CompressOp::verify() {
  return verifyLaneCount(*this, getMask().getType(), getVector().getType(),
                         "a number");
}

LogicalResult PushOp::verify() {
  if (getValues().size() != getArrays().size())
    return emitOpError("expected an array for each of ")
           << getValues().size() << " numbers, but got " << getArrays().size();
  for (auto [value, array] :
       llvm::zip(getValues().getTypes(), getArrays().getTypes()))
    if (value != cast<MemRefType>(array).getElementType())
      return emitOpError("expected an array of ")
             << value << ", but got " << array;
  Type count = cast<MemRefType>(getCount().getType()).getElementType();
  if (getLimit() && getLimit().getType() != count)
    return emitOpError("expected a limit of ")
           << count << ", but got " << getLimit().getType();
  return success();
}

LogicalResult OpenWriterOp::verifySymbolUses(SymbolTableCollection &) {
  return getStageAttr() ? verifyStage(*this, getStageAttr()) : success();
}

/// The operation that opened the bins that a writer is for, or null.
static OpenBinsOp getOpenBins(Value writer) {
  auto open = writer.getDefiningOp<OpenWriterOp>();
  return open ? open.getBins().getDefiningOp<OpenBinsOp>() : OpenBinsOp();
}

/// The stage whose emissions a writer is for, or null.
static StageOp getWriterStage(Value writer) {
  OpenBinsOp bins = getOpenBins(writer);
  if (!bins)
    return {};
  auto open = writer.getDefiningOp<OpenWriterOp>();
  return lookupInPipeline<StageOp>(
      bins, open.getStageAttr() ? open.getStageAttr() : bins.getStageAttr());
}

/// The record that a port of the stage that `writer` is for emits; null where
/// that is not known, a failure where there is no such port.
static FailureOr<FlatSymbolRefAttr> verifyPort(Operation *op, Value writer,
                                               int64_t port) {
  OpenBinsOp bins = getOpenBins(writer);
  StageOp stage = getWriterStage(writer);
  if (!stage)
    return FlatSymbolRefAttr();
  int64_t ports = bins.getSource() ? 0 : stage.getOutputs().size();
  if (port < 0 || port >= ports)
    return op->emitOpError("expected a port below ")
           << ports << ", which is how many the kernel of stage '"
           << stage.getSymName() << "' has, but got " << port;
  return cast<FlatSymbolRefAttr>(stage.getOutputs()[port]);
}

LogicalResult LocalBinOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  auto expected = BinsType::get(getContext(), stage.getInputAttr());
  if (getBodyBlock()->getNumArguments() != 1 || getBins().getType() != expected)
    return emitOpError("expected one block argument of type ") << expected;
  FailureOr<FlatSymbolRefAttr> emitted =
      verifyPort(*this, getSource(), getPort());
  if (failed(emitted))
    return failure();
  if (*emitted && *emitted != stage.getInputAttr())
    return emitOpError("expected a port of record ")
           << stage.getInputAttr() << ", which " << getStageAttr()
           << " takes, but got " << *emitted;
  if (StageOp other = getWriterStage(getWriter()); other && other != stage)
    return emitOpError("expected a writer of ")
           << getStageAttr() << ", but got one of '" << other.getSymName()
           << "'";
  return success();
}

LogicalResult PrivateCopyOp::verifySymbolUses(SymbolTableCollection &) {
  auto open = getWriter().getDefiningOp<OpenWriterOp>();
  OpenBinsOp bins = getOpenBins(getWriter());
  if ((open && open.getStageAttr()) || (bins && bins.getSource()))
    return emitOpError("expected the writer of the stage whose kernel it is, "
                       "but got that of ")
           << (open.getStageAttr() ? "another stage" : "a source");
  Operation *state = lookupInPipeline<Operation *>(*this, getStateAttr());
  if (!state || !isa<BufferOp, ImageOp>(state))
    return emitOpError("expected a buffer or an image, but got ")
           << getStateAttr() << ", which is none";
  FlatSymbolRefAttr name = getStateRecord(state);
  RecordOp record = lookupRecord(*this, name);
  FieldAttr field = record ? record.getField(getField()) : FieldAttr();
  if (!field)
    return emitOpError("expected a field of ")
           << name << ", but got '" << getField() << "'";
  if (getKind() == AtomicKind::AddF || !field.getType().isInteger())
    return emitOpError("expected an operation on integers, whose order does "
                       "not show, but got '")
           << stringifyAtomicKind(getKind()) << "' of type " << field.getType();
  return success();
}

static LogicalResult verifyImage(Operation *op, FlatSymbolRefAttr image) {
  if (!lookupInPipeline<ImageOp>(op, image))
    return op->emitOpError("expected an image, but got ")
           << image << ", which is none";
  return success();
}

LogicalResult CloseTileOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyImage(*this, getImageAttr())))
    return failure();
  auto open = getCopied().getDefiningOp<OpenTileOp>();
  if (!open || open.getImageAttr() != getImageAttr() ||
      open.getWriter() != getWriter())
    return emitOpError("expected what an open_tile of ")
           << getImageAttr() << " and this writer says";
  return success();
}

LogicalResult OpenTileOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyImage(*this, getImageAttr())))
    return failure();
  bool isClosed = llvm::any_of(getCopied().getUsers(), [&](Operation *user) {
    return isa<CloseTileOp>(user) && user->getBlock() == (*this)->getBlock();
  });
  if (!isClosed)
    return emitOpError("expected it to be closed in its block");
  return success();
}

SmallVector<StringAttr> PrivateImagesOp::getImages() {
  SmallVector<StringAttr> images{getImageAttr().getAttr()};
  for (auto image : getCarried().getAsRange<FlatSymbolRefAttr>())
    images.push_back(image.getAttr());
  return images;
}

/// Whether a comparison is of that type, and says which of two numbers is
/// before the other: never both, and neither of equal ones.
static bool isBefore(StringRef comparison, Type type) {
  if (isa<FloatType>(type))
    return comparison == "olt" || comparison == "ogt";
  return comparison == "slt" || comparison == "sgt" || comparison == "ult" ||
         comparison == "ugt";
}

LogicalResult PrivateImagesOp::verifySymbolUses(SymbolTableCollection &) {
  auto unit = lookupInPipeline<ImageOp>(*this, getUnitImageAttr());
  RecordOp record =
      unit ? lookupRecord(unit, unit.getRecordAttr()) : RecordOp();
  if (!record || !unit.getInternal() ||
      !llvm::equal(record.getElementTypes(),
                   ArrayRef<Type>{IntegerType::get(getContext(), 32)}))
    return emitOpError("expected an internal image of one i32, but got ")
           << getUnitImageAttr();
  SmallVector<StringAttr> images = getImages();
  if (getKept().size() != images.size())
    return emitOpError("expected the numbers kept of ")
           << images.size() << " images, but got those of " << getKept().size();
  SmallVector<Type> keyTypes;
  for (auto [name, kept] :
       llvm::zip(images, getKept().getAsRange<DenseI64ArrayAttr>())) {
    auto symbol = FlatSymbolRefAttr::get(name);
    auto image = lookupInPipeline<ImageOp>(*this, symbol);
    RecordOp pixel =
        image ? lookupRecord(image, image.getRecordAttr()) : RecordOp();
    if (!pixel || symbol == getUnitImageAttr())
      return emitOpError("expected an image, and not that of units, but got ")
             << symbol;
    SmallVector<Type> types = pixel.getElementTypes();
    for (int64_t number : kept.asArrayRef())
      if (number < 0 || number >= static_cast<int64_t>(types.size()))
        return emitOpError("expected numbers of ")
               << image.getRecordAttr() << ", but got " << number;
    if (keyTypes.empty())
      keyTypes = std::move(types);
  }
  if (getNumbers().size() != getComparisons().size())
    return emitOpError("expected a comparison for each number of a key");
  ArrayRef<int64_t> kept = cast<DenseI64ArrayAttr>(getKept()[0]).asArrayRef();
  for (auto [number, comparison] :
       llvm::zip(getNumbers(), getComparisons().getAsRange<StringAttr>())) {
    if (!llvm::is_contained(kept, number))
      return emitOpError("expected a key of numbers that are kept, but got ")
             << number;
    if (!isBefore(comparison, keyTypes[number]))
      return emitOpError("expected a strict comparison of ")
             << keyTypes[number] << ", but got " << comparison;
  }
  return success();
}

LogicalResult AppendOp::verifySymbolUses(SymbolTableCollection &) {
  FlatSymbolRefAttr name = getPrim().getType().getRecord();
  RecordOp record = lookupRecord(*this, name);
  if (!record)
    return emitOpError("expected a record, but got ")
           << name << ", which is none";
  SmallVector<Type> types = record.getElementTypes();
  if (types != getValues().getTypes())
    return emitOpError("expected the numbers of record ")
           << name << ", (" << types << "), but got (" << getValues().getTypes()
           << ")";
  FailureOr<FlatSymbolRefAttr> emitted =
      verifyPort(*this, getWriter(), getPort());
  if (failed(emitted))
    return failure();
  if (*emitted && *emitted != name)
    return emitOpError("expected a primitive of record ")
           << *emitted << ", which port " << getPort() << " emits, but got "
           << name;
  return success();
}

/// The numbers of records are those of its fields, for each of so many lanes.
static LogicalResult verifyLaneRecords(Operation *op, FlatSymbolRefAttr name,
                                       TypeRange values, int64_t lanes,
                                       size_t records) {
  RecordOp record = lookupRecord(op, name);
  if (!record)
    return op->emitOpError("expected a record, but got ")
           << name << ", which is none";
  SmallVector<Type> types;
  for (size_t i = 0; i < records; ++i)
    for (Type type : record.getElementTypes())
      types.push_back(VectorType::get({lanes}, type));
  if (TypeRange(types) != values)
    return op->emitOpError("expected the numbers of ")
           << records << " of record " << name << ", (" << types
           << "), but got (" << values << ")";
  return success();
}

LogicalResult LaneAppendOp::verifySymbolUses(SymbolTableCollection &) {
  size_t records = getMasks().size();
  if (records == 0)
    return emitOpError("expected a mask for each record, but got none");
  Type mask = getMasks().front().getType();
  for (ValueRange operands :
       {ValueRange(getMasks()), ValueRange(getBins()), ValueRange(getTiles())})
    for (Value operand : operands)
      if (failed(verifyLaneCount(*this, mask, operand.getType(), "an element")))
        return failure();
  if (failed(verifyLaneRecords(*this, getRecordAttr(), getValues().getTypes(),
                               cast<VectorType>(mask).getNumElements(),
                               records)))
    return failure();
  size_t bins = getStage() ? records : 0;
  if (getBins().size() != bins)
    return emitOpError("expected a bin for each of ")
           << bins << " records, but got " << getBins().size();
  if (!getTiles().empty() && getTiles().size() != bins)
    return emitOpError("expected a tile for each of ")
           << bins << " records, but got " << getTiles().size();
  if (getStageAttr() && failed(verifyStage(*this, getStageAttr())))
    return failure();
  FailureOr<FlatSymbolRefAttr> emitted =
      verifyPort(*this, getWriter(), getPort());
  if (succeeded(emitted) && *emitted && *emitted != getRecordAttr())
    return emitOpError("expected primitives of record ")
           << *emitted << ", which port " << getPort() << " emits, but got "
           << getRecordAttr();
  return success(succeeded(emitted));
}

LogicalResult StoreRecordsOp::verifySymbolUses(SymbolTableCollection &) {
  if (getValues().empty())
    return emitOpError("expected the numbers of a record, but got none");
  auto lanes = cast<VectorType>(getValues().front().getType());
  return verifyLaneRecords(*this, getRecordAttr(), getValues().getTypes(),
                           lanes.getNumElements(), 1);
}

LogicalResult AppendRecordOp::verifySymbolUses(SymbolTableCollection &) {
  FlatSymbolRefAttr name = getPrim().getType().getRecord();
  FailureOr<FlatSymbolRefAttr> emitted =
      verifyPort(*this, getWriter(), getPort());
  if (succeeded(emitted) && *emitted && *emitted != name)
    return emitOpError("expected a primitive of record ")
           << *emitted << ", which port " << getPort() << " emits, but got "
           << name;
  return success(succeeded(emitted));
}

LogicalResult AppendBinOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  if (getTile() && !lookupInPipeline<StageOp>(*this, getStageAttr()).getTile())
    return emitOpError("expected a tile only in a stage that is divided into "
                       "tiles, but ")
           << getStageAttr() << " is not";
  if (getPort())
    return failure(failed(verifyPort(*this, getWriter(), *getPort())));
  if (OpenBinsOp bins = getOpenBins(getWriter()); bins && !bins.getSource())
    return emitOpError("expected a port, because the kernel is not that of a "
                       "source");
  return success();
}
