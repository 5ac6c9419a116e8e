// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records, pipelines, state and edges.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "llvm/ADT/StringSet.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// RecordOp
//===----------------------------------------------------------------------===//

FieldAttr RecordOp::getField(StringRef name) {
  for (auto field : getFields().getAsRange<FieldAttr>())
    if (field.getName() == name)
      return field;
  return {};
}

SmallVector<Type> RecordOp::getElementTypes() {
  SmallVector<Type> types;
  for (auto field : getFields().getAsRange<FieldAttr>())
    types.append(field.getElementCount(), field.getType());
  return types;
}

SmallVector<int64_t> RecordOp::getElementOffsets() {
  SmallVector<int64_t> offsets;
  for (auto field : getFields().getAsRange<FieldAttr>())
    for (int64_t i = 0, e = field.getElementCount(); i < e; ++i)
      offsets.push_back(field.getElementOffset(i));
  return offsets;
}

LogicalResult RecordOp::verify() {
  int64_t size = getSize(), align = getAlign();
  if (size < 1)
    return emitOpError("expected a positive size, but got ") << size;
  if (align < 1 || (align & (align - 1)) || size % align)
    return emitOpError("expected the alignment to be a power of two that "
                       "divides the size ")
           << size << ", but got " << align;
  llvm::StringSet<> names;
  for (auto field : getFields().getAsRange<FieldAttr>()) {
    if (!names.insert(field.getName()).second)
      return emitOpError("expected each field once, but got '")
             << field.getName() << "' twice";
    int64_t last = field.getElementOffset(field.getElementCount() - 1);
    int64_t end = last + (field.getType().getIntOrFloatBitWidth() + 7) / 8;
    if (end > size)
      return emitOpError("expected field '")
             << field.getName() << "' to end within the record's " << size
             << " bytes, but got " << end;
  }
  return verifyCppTypes(*this);
}

//===----------------------------------------------------------------------===//
// PipelineOp
//===----------------------------------------------------------------------===//

/// Each port of each stage has one edge. (That the edges name real stages, and
/// records that match, is checked at the edges.)
static LogicalResult verifyPorts(PipelineOp pipeline) {
  llvm::DenseMap<std::pair<Attribute, int64_t>, EdgeOp> edges;
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    auto [it, fresh] = edges.try_emplace(
        std::pair(Attribute(edge.getProducerAttr()), edge.getPort()), edge);
    if (!fresh) {
      InFlightDiagnostic error = edge.emitError("expected one edge from port ")
                                 << edge.getPort() << " of stage '"
                                 << edge.getProducer() << "', but got two";
      error.attachNote(it->second.getLoc()) << "the other edge is here";
      return error;
    }
  }
  for (auto stage : pipeline.getOps<StageOp>())
    for (int64_t port = 0, e = stage.getOutputs().size(); port < e; ++port)
      if (!edges.count({FlatSymbolRefAttr::get(stage.getSymNameAttr()), port}))
        return stage.emitError("port ")
               << port << " of stage '" << stage.getSymName()
               << "' is not connected";
  return success();
}

/// A stage that no primitive can reach is a mistake in the graph.
static LogicalResult verifyReached(PipelineOp pipeline) {
  llvm::DenseSet<StringAttr> fed;
  for (Operation &op : *pipeline.getBodyBlock()) {
    if (auto source = dyn_cast<SourceOp>(op))
      fed.insert(source.getStageAttr().getAttr());
    if (auto edge = dyn_cast<EdgeOp>(op))
      fed.insert(edge.getConsumerAttr().getAttr());
  }
  for (auto stage : pipeline.getOps<StageOp>())
    if (!fed.contains(stage.getSymNameAttr()))
      return stage.emitError("stage '")
             << stage.getSymName()
             << "' has no input: expected an edge or a source that feeds it";
  return success();
}

LogicalResult PipelineOp::verifyRegions() {
  for (Operation &op : *getBodyBlock())
    if (!isa<ConstantOp, BufferOp, ImageOp, SourceOp, EdgeOp, StageOp, KernelOp,
             StripsOp, CheckRecordOp>(op))
      return op.emitOpError(
          "expected only state, sources, edges, stages and kernels in a "
          "pipeline");
  if (failed(verifyPorts(*this)) || failed(verifyReached(*this)))
    return failure();
  return success();
}

//===----------------------------------------------------------------------===//
// State
//===----------------------------------------------------------------------===//

static LogicalResult verifyRecordExists(Operation *op, FlatSymbolRefAttr name) {
  if (lookupRecord(op, name))
    return success();
  return op->emitOpError("expected a record, but got ")
         << name << ", which is none";
}

/// One number for each number of a record, or nothing.
static LogicalResult verifyNumbers(Operation *op, FlatSymbolRefAttr record,
                                   ArrayAttr numbers, StringRef name) {
  if (failed(verifyRecordExists(op, record)))
    return failure();
  if (!numbers)
    return success();
  SmallVector<Type> types = lookupRecord(op, record).getElementTypes();
  if (numbers.size() != types.size())
    return op->emitOpError("expected ")
           << types.size() << " " << name << "s, one for each number of record "
           << record << ", but got " << numbers.size();
  for (auto [i, value, type] : llvm::enumerate(numbers, types)) {
    auto typed = dyn_cast<TypedAttr>(value);
    if (!isa<IntegerAttr, FloatAttr>(value) || typed.getType() != type)
      return op->emitOpError("expected ")
             << name << " " << i << " to be of type " << type << ", but got "
             << value;
  }
  return success();
}

LogicalResult ConstantOp::verifySymbolUses(SymbolTableCollection &) {
  // What the constant is until the host sets it.
  return verifyNumbers(*this, getRecordAttr(), getValueAttr(), "value");
}

LogicalResult BufferOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyRecordExists(*this, getRecordAttr())))
    return failure();
  if (std::optional<int64_t> source = getPerSource()) {
    auto sources = getPipeline(*this).getOps<SourceOp>();
    int64_t count = std::distance(sources.begin(), sources.end());
    if (*source < 0 || *source >= count)
      return emitOpError("expected per_source to name one of the ")
             << count << " sources, but got " << *source;
  }
  return success();
}

LogicalResult ImageOp::verifySymbolUses(SymbolTableCollection &) {
  if (failed(verifyRecordExists(*this, getRecordAttr())))
    return failure();
  if (getRank() != getPipeline(*this).getRank())
    return emitOpError("expected the rank of the pipeline, ")
           << getPipeline(*this).getRank() << ", but got " << getRank();
  return verifyNumbers(*this, getRecordAttr(), getClearAttr(), "clear value");
}

//===----------------------------------------------------------------------===//
// Sources and edges
//===----------------------------------------------------------------------===//

LogicalResult SourceOp::verifySymbolUses(SymbolTableCollection &) {
  if (!lookupInPipeline<StageOp>(*this, getStageAttr()))
    return emitOpError("expected a stage, but got ")
           << getStageAttr() << ", which is none";
  return success();
}

LogicalResult EdgeOp::verifySymbolUses(SymbolTableCollection &) {
  auto producer = lookupInPipeline<StageOp>(*this, getProducerAttr());
  auto consumer = lookupInPipeline<StageOp>(*this, getConsumerAttr());
  if (!producer || !consumer)
    return emitOpError("expected a stage, but got ")
           << (producer ? getConsumerAttr() : getProducerAttr())
           << ", which is none";
  if (getPort() >= int64_t(producer.getOutputs().size()))
    return emitOpError("expected a port below ")
           << producer.getOutputs().size() << ", which is how many stage '"
           << getProducer() << "' has, but got " << getPort();
  auto sent = cast<FlatSymbolRefAttr>(producer.getOutputs()[getPort()]);
  if (sent != consumer.getInputAttr()) {
    InFlightDiagnostic error = emitOpError("expected primitives of record ")
                               << consumer.getInputAttr() << ", which stage '"
                               << getConsumer() << "' takes, but port "
                               << getPort() << " of stage '" << getProducer()
                               << "' emits " << sent;
    error.attachNote(consumer.getLoc()) << "the consumer is declared here";
    return error;
  }
  return success();
}
