// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels and the storage of bins.

#include "Piko/Dialect/Piko/IR/Piko.h"

using namespace mlir;
using namespace piko;

ProcessOp KernelOp::getProcess() {
  for (auto process : getOps<ProcessOp>())
    return process;
  return {};
}

/// Each process phase but the first stands behind a barrier that names it.
static LogicalResult verifyBarriers(KernelOp kernel) {
  llvm::SmallDenseSet<Attribute> before;
  for (Operation &op : *kernel.getBodyBlock()) {
    if (auto process = dyn_cast<ProcessOp>(op)) {
      auto barrier = dyn_cast_or_null<LocalBarrierOp>(op.getPrevNode());
      if (!before.empty() &&
          (!barrier || barrier.getConsumerAttr() != process.getStageAttr()))
        return process.emitOpError("expected to be the first of its kernel, or "
                                   "behind a local barrier that names ")
               << process.getStageAttr();
      if (!before.insert(process.getStageAttr()).second)
        return process.emitOpError("expected one process phase of ")
               << process.getStageAttr();
    }
    auto barrier = dyn_cast<LocalBarrierOp>(op);
    if (!barrier)
      continue;
    if (!before.contains(barrier.getProducerAttr()))
      return barrier.emitOpError("expected the process phase of ")
             << barrier.getProducerAttr() << " in front of it";
    if (!isa_and_nonnull<ProcessOp>(op.getNextNode()))
      return barrier.emitOpError("expected to stand in front of a process "
                                 "phase");
  }
  return success();
}

LogicalResult KernelOp::verifyRegions() {
  bool hasPhase = false, hasOther = false;
  for (Operation &op : *getBodyBlock())
    (isa<AssignOp, ProcessOp, LocalBarrierOp>(op) ? hasPhase : hasOther) = true;
  if (hasPhase && hasOther)
    return emitOpError("expected phases (the kernels level) or loops (the "
                       "resolved level), but got both");
  if (failed(verifyBarriers(*this)))
    return failure();
  if (!hasPhase || getProcess())
    return success();
  // Without a process phase the kernel places the primitives of one source.
  auto assigns = getOps<AssignOp>();
  if (!llvm::hasSingleElement(assigns) || !(*assigns.begin()).getSource())
    return emitOpError("expected a process phase, or the assign phase of one "
                       "source alone");
  return success();
}

LogicalResult LocalBarrierOp::verifySymbolUses(SymbolTableCollection &) {
  for (auto edge : getPipeline(*this).getOps<EdgeOp>()) {
    if (edge.getProducerAttr() != getProducerAttr() ||
        edge.getPort() != getPort() ||
        edge.getConsumerAttr() != getConsumerAttr())
      continue;
    auto producer = lookupInPipeline<StageOp>(*this, getProducerAttr());
    auto consumer = lookupInPipeline<StageOp>(*this, getConsumerAttr());
    if (!producer || !consumer)
      break; // the edge has an error
    if (producer.getBins() != consumer.getBins())
      return emitOpError("expected stages with bins of one size, but got ")
             << "[" << producer.getBins() << "] and [" << consumer.getBins()
             << "]";
    if (!consumer.collects())
      return emitOpError("expected a stage that waits for its bin, but ")
             << getConsumerAttr() << " does not";
    return success();
  }
  return emitOpError("expected an edge from port ")
         << getPort() << " of " << getProducerAttr() << " to "
         << getConsumerAttr() << ", but there is none";
}

LogicalResult StripsOp::verifySymbolUses(SymbolTableCollection &) {
  PipelineOp pipeline = getPipeline(*this);
  auto sources = pipeline.getOps<SourceOp>();
  int64_t count = std::distance(sources.begin(), sources.end());
  if (int64_t(getSource()) >= count)
    return emitOpError("expected a source below ")
           << count << ", which is how many there are, but got " << getSource();
  if (getKernels().size() < 2)
    return emitOpError("expected at least two kernels, but got ")
           << getKernels().size();
  Operation *last = nullptr;
  for (auto name : getKernels().getAsRange<FlatSymbolRefAttr>()) {
    auto kernel = lookupInPipeline<KernelOp>(*this, name);
    if (!kernel)
      return emitOpError("expected a kernel, but got ")
             << name << ", which is none";
    Operation *next = last ? last->getNextNode() : kernel.getOperation();
    while (next && isa<StripsOp>(next))
      next = next->getNextNode();
    if (next != kernel)
      return emitOpError("expected kernels in a row, but ")
             << name << " does not stand behind the one before it";
    last = kernel;
  }
  for (auto other : pipeline.getOps<StripsOp>())
    if (other != *this)
      for (Attribute name : other.getKernels())
        if (llvm::is_contained(getKernels(), name)) {
          InFlightDiagnostic error = emitOpError("expected each kernel once, "
                                                 "but got ")
                                     << name << " twice";
          error.attachNote(other.getLoc()) << "it is here, too";
          return error;
        }
  return success();
}

LogicalResult OpenBinsOp::verifySymbolUses(SymbolTableCollection &) {
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  if (!stage)
    return emitOpError("expected a stage, but got ")
           << getStageAttr() << ", which is none";
  if (stage.getInputAttr() != getBins().getType().getRecord())
    return emitOpError("expected bins of record ")
           << stage.getInputAttr() << ", but got "
           << getBins().getType().getRecord();
  return success();
}

//===----------------------------------------------------------------------===//
// What kernels read and write
//===----------------------------------------------------------------------===//

static LogicalResult verifyStage(Operation *op, FlatSymbolRefAttr name) {
  if (lookupInPipeline<StageOp>(op, name))
    return success();
  return op->emitOpError("expected a stage, but got ")
         << name << ", which is none";
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

LogicalResult PlaceOp::verifySymbolUses(SymbolTableCollection &) {
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

LogicalResult BeginScheduleOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyStage(*this, getStageAttr());
}

LogicalResult ScheduleBinOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyStage(*this, getStageAttr());
}
