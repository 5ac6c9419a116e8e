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

LogicalResult KernelOp::verifyRegions() {
  bool hasPhase = false, hasOther = false;
  int processes = 0;
  for (Operation &op : *getBodyBlock()) {
    (isa<AssignOp, ProcessOp>(op) ? hasPhase : hasOther) = true;
    processes += isa<ProcessOp>(op);
  }
  if (hasPhase && hasOther)
    return emitOpError("expected phases (the kernels level) or loops (the "
                       "resolved level), but got both");
  if (processes > 1)
    return emitOpError("expected at most one process phase, but got ")
           << processes;
  if (!hasPhase || processes)
    return success();
  // Without a process phase the kernel places the primitives of one source.
  auto assigns = getOps<AssignOp>();
  if (!llvm::hasSingleElement(assigns) || !(*assigns.begin()).getSource())
    return emitOpError("expected a process phase, or the assign phase of one "
                       "source alone");
  return success();
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

/// The operation that opened the bins that a writer is for, or null.
static OpenBinsOp getOpenBins(Value writer) {
  auto open = writer.getDefiningOp<OpenWriterOp>();
  return open ? open.getBins().getDefiningOp<OpenBinsOp>() : OpenBinsOp();
}

/// The record that a port of the stage whose kernel opened `writer` emits; null
/// where that is not known, a failure where there is no such port.
static FailureOr<FlatSymbolRefAttr> verifyPort(Operation *op, Value writer,
                                               int64_t port) {
  OpenBinsOp bins = getOpenBins(writer);
  auto stage =
      bins ? lookupInPipeline<StageOp>(bins, bins.getStageAttr()) : StageOp();
  if (!stage)
    return FlatSymbolRefAttr();
  int64_t ports = bins.getSource() ? 0 : stage.getOutputs().size();
  if (port < 0 || port >= ports)
    return op->emitOpError("expected a port below ")
           << ports << ", which is how many the kernel of stage '"
           << stage.getSymName() << "' has, but got " << port;
  return cast<FlatSymbolRefAttr>(stage.getOutputs()[port]);
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
