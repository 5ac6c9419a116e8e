// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The dialect's types and attributes, and look-ups that its operations share.

#include "FieldAccess.h"
#include "IsolatedBody.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoApproximation.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Dialect/Piko/IR/PikoCount.h"
#include "Piko/Dialect/Piko/IR/PikoFixed.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"

#include "mlir/IR/DialectImplementation.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/StringSwitch.h"
#include "llvm/ADT/TypeSwitch.h"
#include "llvm/Support/MathExtras.h"

using namespace mlir;
using namespace piko;

#include "Piko/Dialect/Piko/IR/PikoDialect.cpp.inc"
#include "Piko/Dialect/Piko/IR/PikoEnums.cpp.inc"
#define GET_TYPEDEF_CLASSES
#include "Piko/Dialect/Piko/IR/PikoTypes.cpp.inc"
#define GET_ATTRDEF_CLASSES
#include "Piko/Dialect/Piko/IR/PikoAttributes.cpp.inc"

void PikoDialect::initialize() {
  addTypes<
#define GET_TYPEDEF_LIST
#include "Piko/Dialect/Piko/IR/PikoTypes.cpp.inc"
      >();
  addAttributes<
#define GET_ATTRDEF_LIST
#include "Piko/Dialect/Piko/IR/PikoAttributes.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoOps.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoCheckOps.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoCountOps.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoFixedOps.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoCPUOps.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoProgramOps.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoGPUOps.cpp.inc"
      >();
  addOperations<
#define GET_OP_LIST
#include "Piko/Dialect/Piko/IR/PikoApproximationOps.cpp.inc"
      >();
}

//===----------------------------------------------------------------------===//
// Discardable attributes
//===----------------------------------------------------------------------===//

/// What an attribute of that name has to be; null where there is none.
static StringRef getExpectedKind(StringRef name) {
  return llvm::StringSwitch<StringRef>(name)
      .Cases({marks::lanes,        marks::rows,          marks::shared,
              marks::disjoint,     marks::again,         marks::reordered,
              marks::rare,         marks::fails,         marks::input,
              marks::shortCircuit, marks::inside,        marks::source,
              marks::versions,     marks::turns,         marks::barriers,
              marks::lastLanes,    marks::ordered,       marks::threaded,
              marks::rest,         marks::blockCounters, marks::blockBuffers,
              marks::blockValues},
             "a unit")
      .Case(marks::mapping, "what lanes are given, as #piko<lanes items>")
      .Case(marks::units, "how threads share units, as #piko<units shared>")
      .Case(marks::threads, "how threads share work, as #piko<threads shared>")
      .Case(marks::steps, "an array of steps, such as #piko.step<clear 0>")
      .Cases(
          {marks::number, marks::blockSize, marks::fewest, marks::vectorLanes},
          "a 64-bit integer")
      .Cases({marks::iterations, marks::advances, marks::probability},
             "a 64-bit float")
      .Case(marks::probabilities, "an array of 64-bit floats")
      .Cases({marks::pixels, cppNameAttr}, "a string")
      .Case(cppTypesAttr, "a dictionary")
      .Default({});
}

static bool hasExpectedKind(NamedAttribute attribute) {
  StringRef name = attribute.getName();
  Attribute value = attribute.getValue();
  if (name == marks::mapping)
    return isa<LaneMappingAttr>(value);
  if (name == marks::units)
    return isa<UnitLoopAttr>(value);
  if (name == marks::threads)
    return isa<ThreadMappingAttr>(value);
  if (auto steps = dyn_cast<ArrayAttr>(value); name == marks::steps)
    return steps && llvm::all_of(steps, llvm::IsaPred<StepAttr>);
  if (name == marks::probabilities)
    return isa<DenseF64ArrayAttr>(value);
  if (name == cppNameAttr || name == marks::pixels)
    return isa<StringAttr>(value);
  if (name == cppTypesAttr)
    return isa<DictionaryAttr>(value);
  if (name == marks::iterations || name == marks::advances ||
      name == marks::probability)
    return isa<FloatAttr>(value) && cast<FloatAttr>(value).getType().isF64();
  if (name == marks::number || name == marks::blockSize ||
      name == marks::fewest || name == marks::vectorLanes)
    return isa<IntegerAttr>(value) &&
           cast<IntegerAttr>(value).getType().isInteger(64);
  return isa<UnitAttr>(value);
}

LogicalResult PikoDialect::verifyOperationAttribute(Operation *op,
                                                    NamedAttribute attribute) {
  StringRef name = attribute.getName(), kind = getExpectedKind(name);
  if (kind.empty())
    return op->emitOpError("expected no attribute '")
           << name << "', which the dialect does not know";
  if (!hasExpectedKind(attribute))
    return op->emitOpError("expected '")
           << name << "' to be " << kind << ", but got "
           << attribute.getValue();
  return success();
}

//===----------------------------------------------------------------------===//
// Fields
//===----------------------------------------------------------------------===//

// "w" : f32[16 : 4] at 8
Attribute FieldAttr::parse(AsmParser &parser, Type) {
  std::string name;
  Type type;
  int64_t offset;
  SmallVector<int64_t> counts, strides;
  auto dimension = [&]() {
    return failure(parser.parseInteger(counts.emplace_back()) ||
                   parser.parseColon() ||
                   parser.parseInteger(strides.emplace_back()));
  };
  SMLoc loc = parser.getCurrentLocation();
  bool braces = succeeded(parser.parseOptionalLess());
  if (parser.parseString(&name) || parser.parseColon() ||
      parser.parseType(type) ||
      parser.parseCommaSeparatedList(AsmParser::Delimiter::OptionalSquare,
                                     dimension) ||
      parser.parseKeyword("at") || parser.parseInteger(offset) ||
      (braces && parser.parseGreater()))
    return {};
  return FieldAttr::getChecked([&] { return parser.emitError(loc); },
                               parser.getContext(), name, type, offset, counts,
                               strides);
}

static void printField(AsmPrinter &printer, FieldAttr field) {
  printer.printString(field.getName());
  printer << " : " << field.getType();
  if (!field.getCounts().empty()) {
    printer << '[';
    llvm::interleaveComma(llvm::zip(field.getCounts(), field.getStrides()),
                          printer, [&](auto dimension) {
                            printer << std::get<0>(dimension) << " : "
                                    << std::get<1>(dimension);
                          });
    printer << ']';
  }
  printer << " at " << field.getOffset();
}

void FieldAttr::print(AsmPrinter &printer) const {
  printer << '<';
  printField(printer, *this);
  printer << '>';
}

LogicalResult FieldAttr::verify(function_ref<InFlightDiagnostic()> emitError,
                                StringRef name, Type type, int64_t offset,
                                ArrayRef<int64_t> counts,
                                ArrayRef<int64_t> strides) {
  if (!type.isF32() && !type.isF64() && !type.isInteger(8) &&
      !type.isInteger(16) && !type.isInteger(32) && !type.isInteger(64))
    return emitError() << "expected field '" << name
                       << "' to be f32, f64, i8, i16, i32 or i64, but got "
                       << type;
  if (offset < 0)
    return emitError() << "expected field '" << name
                       << "' to have an offset of at least 0, but got "
                       << offset;
  if (counts.size() != strides.size())
    return emitError() << "expected a stride for each count of field '" << name
                       << "', but got " << counts.size() << " counts and "
                       << strides.size() << " strides";
  for (auto [count, stride] : llvm::zip(counts, strides))
    if (count < 1 || stride < 1)
      return emitError() << "expected the counts and strides of field '" << name
                         << "' to be positive, but got " << count << " : "
                         << stride;
  // So that no offset in it wraps.
  constexpr int64_t mostBytes = int64_t(1) << 48;
  int64_t numbers = 1, end = offset;
  for (auto [count, stride] : llvm::zip(counts, strides)) {
    int64_t extent;
    if (llvm::MulOverflow(numbers, count, numbers) ||
        llvm::MulOverflow(count - 1, stride, extent) ||
        llvm::AddOverflow(end, extent, end) || numbers > mostBytes ||
        end > mostBytes)
      return emitError() << "expected field '" << name << "' to end within "
                         << mostBytes << " bytes";
  }
  return success();
}

int64_t FieldAttr::getElementCount() const {
  int64_t product = 1;
  for (int64_t count : getCounts())
    product *= count;
  return product;
}

int64_t FieldAttr::getElementOffset(int64_t i) const {
  int64_t offset = getOffset();
  for (auto [count, stride] :
       llvm::reverse(llvm::zip(getCounts(), getStrides()))) {
    offset += i % count * stride;
    i /= count;
  }
  return offset;
}

//===----------------------------------------------------------------------===//
// Look-ups
//===----------------------------------------------------------------------===//

PipelineOp piko::getPipeline(Operation *op) {
  if (auto pipeline = dyn_cast<PipelineOp>(op))
    return pipeline;
  return op->getParentOfType<PipelineOp>();
}

StageOp piko::getPhaseStage(Operation *op) {
  for (Operation *at = op; at; at = at->getParentOp()) {
    FlatSymbolRefAttr name;
    if (auto assign = dyn_cast<AssignOp>(at))
      name = assign.getStageAttr();
    else if (auto process = dyn_cast<ProcessOp>(at))
      name = process.getStageAttr();
    else if (!isa<ScheduleOp>(at))
      continue;
    return name ? lookupInPipeline<StageOp>(at, name)
                : dyn_cast_or_null<StageOp>(at->getParentOp());
  }
  return {};
}

StageOp piko::getKernelStage(Operation *op) {
  for (Operation *at = op; at; at = at->getParentOp())
    if (auto work = dyn_cast<WorkOpInterface>(at))
      return lookupInPipeline<StageOp>(at, work.getStageAttr());
  if (auto local = op->getParentOfType<LocalBinOp>())
    return lookupInPipeline<StageOp>(local, local.getStageAttr());
  auto kernel = op->getParentOfType<KernelOp>();
  if (!kernel)
    return {};
  for (auto bins : kernel.getOps<OpenBinsOp>())
    return lookupInPipeline<StageOp>(kernel, bins.getStageAttr());
  return {};
}

RecordOp piko::lookupRecord(Operation *from, FlatSymbolRefAttr name) {
  auto module = from->getParentOfType<ModuleOp>();
  return module ? module.lookupSymbol<RecordOp>(name) : RecordOp();
}

FlatSymbolRefAttr piko::getStateRecord(Operation *state) {
  return llvm::TypeSwitch<Operation *, FlatSymbolRefAttr>(state)
      .Case<ConstantOp, BufferOp, ImageOp>(
          [](auto op) { return op.getRecordAttr(); })
      .Default([](Operation *) { return FlatSymbolRefAttr(); });
}

int64_t piko::getStateRank(Operation *state) {
  return llvm::TypeSwitch<Operation *, int64_t>(state)
      .Case([](BufferOp) { return 1; })
      .Case([](ImageOp image) { return image.getRank(); })
      .Default([](Operation *) { return 0; });
}

LogicalResult piko::verifyFieldAccess(Operation *op,
                                      FlatSymbolRefAttr recordName,
                                      StringRef name, size_t indices,
                                      Type type) {
  RecordOp record = lookupRecord(op, recordName);
  if (!record)
    return op->emitOpError("expected a record, but got ")
           << recordName << ", which is none";
  FieldAttr field = record.getField(name);
  if (!field) {
    InFlightDiagnostic error = op->emitOpError("record ")
                               << recordName << " has no field '" << name
                               << "'";
    error.attachNote(record.getLoc()) << "the record is declared here";
    return error;
  }
  if (field.getCounts().size() != indices)
    return op->emitOpError("expected ")
           << field.getCounts().size() << " indices into field '" << name
           << "', but got " << indices;
  if (field.getType() != type)
    return op->emitOpError("expected field '")
           << name << "' to be of type " << field.getType() << ", but got "
           << type;
  return success();
}

LogicalResult piko::verifyElement(Operation *op, FlatSymbolRefAttr record,
                                  StringRef name, ValueRange indices) {
  // What a phase reaches only under a condition may never run.
  if (!isa_and_nonnull<StageOp>(op->getParentOp()->getParentOp()))
    return success();
  FieldAttr field = lookupRecord(op, record).getField(name);
  for (auto [index, count] : llvm::zip(indices, field.getCounts())) {
    APInt constant;
    if (!matchPattern(index, m_ConstantInt(&constant)) ||
        (constant.getSExtValue() >= 0 && constant.getSExtValue() < count))
      continue;
    return op->emitOpError("expected an index into field '")
           << name << "' of at least 0 and below " << count << ", but got "
           << constant.getSExtValue();
  }
  return success();
}

//===----------------------------------------------------------------------===//
// Assembly shared by operations
//===----------------------------------------------------------------------===//

static ParseResult parseFields(OpAsmParser &parser, ArrayAttr &fields) {
  SmallVector<Attribute> list;
  if (parser.parseCommaSeparatedList(AsmParser::Delimiter::Braces, [&] {
        list.push_back(FieldAttr::parse(parser, {}));
        return failure(!list.back());
      }))
    return failure();
  fields = parser.getBuilder().getArrayAttr(list);
  return success();
}

static void printFields(OpAsmPrinter &printer, Operation *, ArrayAttr fields) {
  printer << '{';
  llvm::interleaveComma(fields.getAsRange<FieldAttr>(), printer,
                        [&](FieldAttr field) { printField(printer, field); });
  printer << '}';
}

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoOps.cpp.inc"
