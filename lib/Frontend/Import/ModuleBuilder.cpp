//===- ModuleBuilder.cpp - A described pipeline as a module ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/ModuleBuilder.h"

#include "Import/ScalarImport.h"

#include "Import/Import.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoFixed.h"

using namespace piko;
using llvm::failed;

namespace {

class ModuleBuilder {
public:
  ModuleBuilder(ParsedUnit &unit, MemoryMap &memory, mlir::MLIRContext &context)
      : unit(unit), pipeline(unit.pipeline), memory(memory), context(context),
        builder(&context) {}

  mlir::OwningOpRef<mlir::ModuleOp> run() {
    mlir::OwningOpRef<mlir::ModuleOp> module =
        mlir::ModuleOp::create(builder, pipeline.location);
    builder.setInsertionPointToEnd(module->getBody());
    for (const RecordDescription &record : pipeline.records)
      if (isUsed(record))
        buildRecord(record);
    auto op = PipelineOp::create(builder, pipeline.location, pipeline.name,
                                 pipeline.rank, getMaxExtent());
    builder.createBlock(&op.getBody());
    for (const StateDescription &state : pipeline.state)
      buildState(state);
    for (const SourceDescription &source : pipeline.sources)
      SourceOp::create(builder, source.location,
                       pipeline.stages[source.stage].symbol);
    for (const EdgeDescription &edge : pipeline.edges)
      EdgeOp::create(builder, edge.location,
                     pipeline.stages[edge.producer].symbol, edge.port,
                     pipeline.stages[edge.consumer].symbol,
                     /*carried=*/mlir::IntegerAttr());
    for (const ContractDescription &contract : pipeline.contracts)
      buildContract(contract);
    for (unsigned stage = 0; stage < pipeline.stages.size(); ++stage) {
      mlir::OpBuilder::InsertionGuard guard(builder);
      if (!buildStage(stage))
        return nullptr;
    }
    if (!keepContracts(op))
      return nullptr;
    return module;
  }

private:
  void buildContract(const ContractDescription &contract) {
    auto name = [&](std::optional<unsigned> state) {
      return state ? mlir::FlatSymbolRefAttr::get(&context,
                                                  pipeline.state[*state].name)
                   : mlir::FlatSymbolRefAttr();
    };
    auto number = [&](bool has, int64_t value) {
      return has ? builder.getI64IntegerAttr(value) : mlir::IntegerAttr();
    };
    for (llvm::StringRef field : contract.fields)
      ContractOp::create(
          builder, contract.location, name(contract.buffer),
          number(!contract.buffer, contract.source.value_or(0)),
          builder.getStringAttr(field),
          contract.isSigned ? mlir::UnitAttr() : builder.getUnitAttr(),
          name(contract.target), number(!contract.target, contract.below));
  }

  /// Refuses to write what is tested only where the host binds it.
  static bool keepContracts(PipelineOp pipeline) {
    for (auto contract : pipeline.getOps<ContractOp>())
      if (mlir::Operation *write = contract.findWrite()) {
        mlir::InFlightDiagnostic error = mlir::emitError(write->getLoc());
        error << "expected no stage to write '" << *contract.getBuffer()
              << "', whose indices are tested where the host binds them";
        error.attachNote(contract.getLoc())
            << "expectIndex is here: leave it out, or write to another buffer";
        return false;
      }
    return true;
  }

  /// Where phases take positions that are floats, the domain is limited.
  mlir::IntegerAttr getMaxExtent() {
    constexpr int64_t most = int64_t(1) << 23; // of piko/bins.h
    for (const auto &[name, marker] : unit.markers)
      if (marker.kind == MarkerKind::floatPosition)
        return builder.getI64IntegerAttr(most);
    return {};
  }

  mlir::FlatSymbolRefAttr getRecordName(unsigned record) {
    return mlir::FlatSymbolRefAttr::get(&context,
                                        pipeline.records[record].name);
  }

  /// Bodies may name types that cross no edge and are not in the state.
  bool isUsed(const RecordDescription &record) {
    unsigned number = &record - pipeline.records.data();
    for (const StateDescription &state : pipeline.state)
      if (state.record == number)
        return true;
    for (const StageDescription &stage : pipeline.stages)
      if (stage.input == number || llvm::is_contained(stage.outputs, number))
        return true;
    return false;
  }

  void buildRecord(const RecordDescription &record) {
    llvm::SmallVector<mlir::Attribute> fields;
    for (const LeafField &field : record.fields)
      fields.push_back(FieldAttr::get(
          &context, field.name, getScalarType(builder, field.type),
          field.offset, field.counts, field.strides));
    auto op = RecordOp::create(builder, pipeline.location, record.name,
                               builder.getArrayAttr(fields), record.size,
                               record.align);
    llvm::SmallVector<mlir::NamedAttribute> types;
    for (const CppTypeDescription &type : record.types)
      types.push_back(builder.getNamedAttr(type.path, buildCppType(type)));
    if (!types.empty())
      op->setAttr(cppTypesAttr, builder.getDictionaryAttr(types));
  }

  mlir::Attribute buildCppType(const CppTypeDescription &type) {
    llvm::SmallVector<mlir::NamedAttribute> parts;
    if (type.size != 0) {
      parts.push_back(
          builder.getNamedAttr("size", builder.getI64IntegerAttr(type.size)));
      parts.push_back(
          builder.getNamedAttr("align", builder.getI64IntegerAttr(type.align)));
    }
    if (!type.underlying.empty()) {
      parts.push_back(builder.getNamedAttr(
          "underlying", builder.getStringAttr(type.underlying)));
      llvm::SmallVector<mlir::NamedAttribute> values;
      for (const auto &[name, value] : type.enumerators)
        values.push_back(
            builder.getNamedAttr(name, builder.getI64IntegerAttr(value)));
      parts.push_back(
          builder.getNamedAttr("values", builder.getDictionaryAttr(values)));
    }
    if (type.isScoped)
      parts.push_back(builder.getNamedAttr("scoped", builder.getUnitAttr()));
    mlir::StringAttr name = builder.getStringAttr(type.type);
    if (parts.empty())
      return name;
    parts.push_back(builder.getNamedAttr("type", name));
    return builder.getDictionaryAttr(parts);
  }

  void buildState(const StateDescription &state) {
    mlir::StringAttr name = builder.getStringAttr(state.name);
    mlir::FlatSymbolRefAttr record = getRecordName(state.record);
    switch (state.kind) {
    case StateDescription::Constant:
      ConstantOp::create(builder, state.location, name, record,
                         state.hasValue ? buildNumbers(state)
                                        : mlir::ArrayAttr());
      return;
    case StateDescription::Buffer:
      BufferOp::create(builder, state.location, name, record,
                       state.perSource
                           ? builder.getI64IntegerAttr(*state.perSource)
                           : mlir::IntegerAttr());
      return;
    case StateDescription::Image:
      ImageOp::create(builder, state.location, name, record,
                      builder.getI64IntegerAttr(state.rank),
                      isZero(state) ? mlir::ArrayAttr() : buildNumbers(state));
      return;
    }
  }

  static bool isZero(const StateDescription &state) {
    return llvm::all_of(state.clear, [](uint64_t bits) { return bits == 0; });
  }

  mlir::ArrayAttr buildNumbers(const StateDescription &state) {
    llvm::SmallVector<mlir::Attribute> values;
    size_t next = 0;
    for (const LeafField &field : pipeline.records[state.record].fields)
      for (int64_t i = 0, e = field.getElementCount(); i < e; ++i) {
        mlir::Type type = getScalarType(builder, field.type);
        unsigned width = type.getIntOrFloatBitWidth();
        llvm::APInt bits(width, state.clear[next++]);
        if (auto real = llvm::dyn_cast<mlir::FloatType>(type))
          values.push_back(builder.getFloatAttr(
              type, llvm::APFloat(real.getFloatSemantics(), bits)));
        else
          values.push_back(builder.getIntegerAttr(type, bits));
      }
    return builder.getArrayAttr(values);
  }

  bool buildStage(unsigned number) {
    const StageDescription &stage = pipeline.stages[number];
    llvm::SmallVector<mlir::Attribute> outputs;
    for (unsigned output : stage.outputs)
      outputs.push_back(getRecordName(output));
    auto op = StageOp::create(
        builder, stage.location, builder.getStringAttr(stage.symbol),
        builder.getDenseI64ArrayAttr(stage.bins),
        builder.getI64IntegerAttr(stage.threads), getRecordName(stage.input),
        builder.getArrayAttr(outputs));
    op.setTakesList(stage.takesList);
    setAttributes(op, stage.schedule.ofStage);
    if (stage.symbol != stage.name)
      op->setAttr(cppNameAttr, builder.getStringAttr(stage.name));
    builder.createBlock(&op.getBody());
    if (stage.hasAssign) {
      auto assign = AssignOp::create(builder, *stage.assignLocation, nullptr,
                                     nullptr, nullptr);
      if (!buildPhase(WrapperKind::Assign, number, assign.getBody()))
        return false;
    }
    if (!buildSchedule(number))
      return false;
    auto process =
        ProcessOp::create(builder, *stage.processLocation, /*stage=*/nullptr,
                          /*precision=*/nullptr, /*ulps=*/nullptr);
    setAttributes(process, stage.schedule.ofProcess);
    return buildPhase(WrapperKind::Process, number, process.getBody());
  }

  static void setAttributes(mlir::Operation *op,
                            const mlir::NamedAttrList &attributes) {
    for (mlir::NamedAttribute attribute : attributes)
      op->setAttr(attribute.getName(), attribute.getValue());
  }

  bool buildSchedule(unsigned stageNumber) {
    const StageDescription &stage = pipeline.stages[stageNumber];
    const ScheduleDescription &schedule = stage.schedule;
    if (schedule.isEmpty())
      return true;
    // Whether the lanes are possible is found much later.
    auto op = ScheduleOp::create(
        builder, schedule.lanesLocation.value_or(stage.location),
        ScheduleKind::LoadBalance);
    setAttributes(op, schedule.ofSchedule);
    return !schedule.isDynamic ||
           buildPhase(WrapperKind::Schedule, stageNumber, op.getBody());
  }

  bool buildPhase(WrapperKind kind, unsigned stage, mlir::Region &region) {
    llvm::Function &source = unit.wrappers.get(*unit.module, kind, stage);
    mlir::OwningOpRef<mlir::func::FuncOp> function =
        importPhase(source, kind, stage, unit, memory, context);
    if (!function || failed(structurePhase(*function)))
      return false;
    region.takeBody(function->getBody());
    mlir::Operation *end = region.back().getTerminator();
    mlir::OpBuilder phaseBuilder(end);
    ReturnOp::create(phaseBuilder, end->getLoc());
    end->erase();
    return true;
  }

  ParsedUnit &unit;
  PipelineDescription &pipeline;
  MemoryMap &memory;
  mlir::MLIRContext &context;
  mlir::OpBuilder builder;
};

} // namespace

mlir::OwningOpRef<mlir::ModuleOp>
piko::buildModule(ParsedUnit &unit, MemoryMap &memory,
                  mlir::MLIRContext &context) {
  return ModuleBuilder(unit, memory, context).run();
}
