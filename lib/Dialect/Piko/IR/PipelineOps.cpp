// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records, pipelines, state and edges.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Dialect/Piko/IR/PikoCount.h"
#include "Piko/Dialect/Piko/IR/PikoFixed.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
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

static int64_t getNumberSize(FieldAttr field) {
  return field.getType().getIntOrFloatBitWidth() / 8;
}

/// The bytes of a field's numbers, from the first to the last.
static std::pair<int64_t, int64_t> getExtent(FieldAttr field) {
  return {field.getOffset(),
          field.getElementOffset(field.getElementCount() - 1) +
              getNumberSize(field)};
}

/// Compiled code reads and writes numbers where the machine does it best.
static LogicalResult verifyAligned(RecordOp record, FieldAttr field) {
  int64_t size = getNumberSize(field);
  if (int64_t(record.getAlign()) % size)
    return record.emitOpError("expected an alignment of at least ")
           << size << ", because of field '" << field.getName() << "', but got "
           << record.getAlign();
  if (field.getOffset() % size)
    return record.emitOpError("expected field '")
           << field.getName() << "' of type " << field.getType()
           << " to be at a multiple of " << size << ", but got "
           << field.getOffset();
  for (int64_t stride : field.getStrides())
    if (stride % size)
      return record.emitOpError("expected the strides of field '")
             << field.getName() << "' to be multiples of " << size
             << ", but got " << stride;
  return success();
}

/// Whether the numbers of a field come in the order of their indices and leave
/// each other alone.
static bool isRowMajor(FieldAttr field) {
  int64_t inner = getNumberSize(field);
  for (auto [count, stride] :
       llvm::reverse(llvm::zip(field.getCounts(), field.getStrides()))) {
    if (stride < inner)
      return false;
    inner = (count - 1) * stride + inner;
  }
  return true;
}

/// No byte is of two numbers. `fields` are those between whose first and last
/// byte others lie, as in an array of structs.
static LogicalResult verifyDisjoint(RecordOp record,
                                    ArrayRef<FieldAttr> fields) {
  struct Number {
    int64_t begin, end;
    FieldAttr field;
  };
  SmallVector<Number> numbers;
  for (FieldAttr field : fields)
    for (int64_t i = 0, e = field.getElementCount(); i < e; ++i) {
      int64_t begin = field.getElementOffset(i);
      numbers.push_back({begin, begin + getNumberSize(field), field});
    }
  llvm::sort(numbers, [](const Number &a, const Number &b) {
    return std::pair(a.begin, a.field.getName()) <
           std::pair(b.begin, b.field.getName());
  });
  for (size_t i = 1; i < numbers.size(); ++i) {
    const Number &before = numbers[i - 1], &number = numbers[i];
    if (number.begin >= before.end)
      continue;
    if (before.field == number.field)
      return record.emitOpError("expected the numbers of field '")
             << number.field.getName()
             << "' to lie side by side, but got two at " << number.begin;
    return record.emitOpError("expected field '")
           << number.field.getName() << "' to lie beside field '"
           << before.field.getName() << "', but both have byte "
           << number.begin;
  }
  return success();
}

static LogicalResult verifyLayout(RecordOp record) {
  auto fields = llvm::to_vector(record.getFields().getAsRange<FieldAttr>());
  llvm::sort(fields, [](FieldAttr a, FieldAttr b) {
    return std::pair(a.getOffset(), a.getName()) <
           std::pair(b.getOffset(), b.getName());
  });
  // Numbers are looked at one by one only where the whole does not settle it.
  for (size_t begin = 0, end; begin < fields.size(); begin = end) {
    int64_t last = getExtent(fields[begin]).second;
    for (end = begin + 1; end < fields.size() && fields[end].getOffset() < last;
         ++end)
      last = std::max(last, getExtent(fields[end]).second);
    if (end == begin + 1 && isRowMajor(fields[begin]))
      continue;
    if (failed(
            verifyDisjoint(record, ArrayRef(fields).slice(begin, end - begin))))
      return failure();
  }
  return success();
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
    int64_t end = getExtent(field).second;
    if (end > size)
      return emitOpError("expected field '")
             << field.getName() << "' to end within the record's " << size
             << " bytes, but got " << end;
    if (failed(verifyAligned(*this, field)))
      return failure();
  }
  if (failed(verifyLayout(*this)))
    return failure();
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
               << port << " of stage '" << getCppName(stage)
               << "' is not connected";
  return success();
}

/// Whether a stage has something to do without primitives, which passes make.
static bool needsNone(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return !stage.getProcess() && stage.getTakesList() && schedule &&
         schedule.getEveryBin();
}

/// Any other stage that no primitive can reach is a mistake in the graph.
static LogicalResult verifyReached(PipelineOp pipeline) {
  llvm::DenseSet<StringAttr> fed;
  for (Operation &op : *pipeline.getBodyBlock()) {
    if (auto source = dyn_cast<SourceOp>(op))
      fed.insert(source.getStageAttr().getAttr());
    if (auto edge = dyn_cast<EdgeOp>(op))
      fed.insert(edge.getConsumerAttr().getAttr());
  }
  for (auto stage : pipeline.getOps<StageOp>())
    if (!fed.contains(stage.getSymNameAttr()) && !needsNone(stage))
      return stage.emitError("stage '")
             << getCppName(stage)
             << "' has no input: expected an edge or a source that feeds it";
  return success();
}

LogicalResult PipelineOp::verifyRegions() {
  for (Operation &op : *getBodyBlock())
    if (!isa<ConstantOp, BufferOp, ImageOp, SourceOp, EdgeOp, StageOp, KernelOp,
             ProgramOp, CheckRecordOp, CounterOp, FixedOp, ContractOp>(op))
      return op.emitOpError(
          "expected only state, sources, edges, stages, kernels and a program "
          "in a pipeline");
  if (auto programs = getOps<ProgramOp>();
      !programs.empty() && !llvm::hasSingleElement(programs))
    return emitOpError("expected one program");
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
