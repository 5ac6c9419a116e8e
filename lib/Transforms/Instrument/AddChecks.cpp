// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-add-checks, for each pipeline:
//   1. give primitives records with a lineage after the user's fields;
//   2. test indices of arrays, and how often loops go round;
//   3. in process phases, test what is emitted and stored;
//   4. tell the runtime of calls, emissions, accesses, iterations and barriers.

#include "Piko/Transforms/Passes.h"

#include "Instrument/Bounds.h"
#include "Instrument/Unwritten.h"
#include "Piko/Analysis/PhaseGraph.h"
#include "Piko/Analysis/Uniformity.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/MathExtras.h"

namespace piko {
#define GEN_PASS_DEF_ADDCHECKS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// By record: the fields that must hold numbers.
using NumberFields = llvm::MapVector<StringAttr, SmallVector<std::string>>;

struct AddChecksPass : piko::impl::AddChecksBase<AddChecksPass> {
  using AddChecksBase::AddChecksBase;
  void runOnOperation() override;
  FailureOr<NumberFields> findNumbers(ArrayRef<StringAttr> records);
};

/// Adds checks to one pipeline.
class Checker {
public:
  Checker(PipelineOp pipeline, const NumberFields &numbers)
      : pipeline(pipeline), numbers(numbers) {}

  void run();

private:
  FlatSymbolRefAttr withLineage(FlatSymbolRefAttr record);
  FlatSymbolRefAttr hostOf(FlatSymbolRefAttr record) const;
  void changeTypes(StageOp stage);
  void checkAssign(StageOp stage, AssignOp assign);
  void checkProcess(StageOp stage, ProcessOp process);
  /// `iteration` is that of the loop around, if its iterations meet.
  void checkBlock(Block &block, Value iteration);
  void checkEmit(EmitOp emit);
  void checkNumbers(EmitOp emit, RecordOp record);

  PipelineOp pipeline;
  const NumberFields &numbers;
  /// The checked form of each record.
  llvm::MapVector<StringAttr, FlatSymbolRefAttr> records;
  /// The images that the stage at hand updates.
  llvm::SmallPtrSet<Attribute, 4> updated;
};

} // namespace

//===----------------------------------------------------------------------===//
// Records
//===----------------------------------------------------------------------===//

FlatSymbolRefAttr Checker::withLineage(FlatSymbolRefAttr name) {
  FlatSymbolRefAttr &known = records[name.getAttr()];
  if (known)
    return known;
  RecordOp record = lookupRecord(pipeline, name);
  OpBuilder builder(record);
  builder.setInsertionPointAfter(record);
  std::string unique = (name.getValue() + ".checked").str();
  while (lookupRecord(pipeline,
                      FlatSymbolRefAttr::get(builder.getContext(), unique)))
    unique += "_";
  int64_t offset = llvm::alignTo(record.getSize(), 8);
  SmallVector<Attribute> fields(record.getFields().getValue());
  fields.push_back(FieldAttr::get(builder.getContext(), lineageField,
                                  builder.getI64Type(), offset, {}, {}));
  int64_t align = std::max<int64_t>(record.getAlign(), 8);
  RecordOp::create(builder, record.getLoc(), unique,
                   builder.getArrayAttr(fields),
                   llvm::alignTo(offset + 8, align), align);
  return known = FlatSymbolRefAttr::get(builder.getContext(), unique);
}

FlatSymbolRefAttr Checker::hostOf(FlatSymbolRefAttr record) const {
  for (auto [host, checked] : records)
    if (checked == record)
      return FlatSymbolRefAttr::get(host);
  return record;
}

void Checker::changeTypes(StageOp stage) {
  auto change = [&](Value value) {
    Type type = value.getType();
    MLIRContext *context = type.getContext();
    if (auto prim = dyn_cast<PrimType>(type))
      value.setType(PrimType::get(context, withLineage(prim.getRecord())));
    else if (auto list = dyn_cast<ListType>(type))
      value.setType(ListType::get(context, withLineage(list.getRecord())));
  };
  stage.walk([&](Operation *op) {
    for (Value result : op->getResults())
      change(result);
    for (Region &region : op->getRegions())
      for (Block &block : region)
        for (Value argument : block.getArguments())
          change(argument);
  });
  stage.setInputAttr(withLineage(stage.getInputAttr()));
  SmallVector<Attribute> outputs;
  for (auto output : stage.getOutputs().getAsRange<FlatSymbolRefAttr>())
    outputs.push_back(withLineage(output));
  stage.setOutputsAttr(ArrayAttr::get(stage.getContext(), outputs));
}

//===----------------------------------------------------------------------===//
// Phases
//===----------------------------------------------------------------------===//

static Value getLineage(OpBuilder &builder, Location loc, Value prim) {
  return GetOp::create(builder, loc, builder.getI64Type(), prim, lineageField,
                       ValueRange());
}

void Checker::checkAssign(StageOp stage, AssignOp assign) {
  checkIndices(assign);
  checkUnwritten(assign,
                 [&](FlatSymbolRefAttr record) { return hostOf(record); });
  checkTrips(assign);
  assign.walk([&](Operation *op) {
    auto load = dyn_cast<LoadOp>(op);
    auto assignment = dyn_cast<AssignmentOpInterface>(op);
    if ((load && !load.getIndices().empty()) || isa<DivideOp>(op) ||
        (assignment && assignment.canFail())) {
      OpBuilder builder(op);
      CheckPlaceOp::create(builder, op->getLoc());
    }
  });
  Block &body = assign.getBody().front();
  OpBuilder builder = OpBuilder::atBlockBegin(&body);
  Location loc = assign.getLoc();
  Value lineage = getLineage(builder, loc, body.getArgument(0));
  CheckAssignOp::create(builder, loc, stage.getSymName(), lineage);
  builder.setInsertionPoint(body.getTerminator());
  CheckAssignOp::create(builder, loc, stage.getSymName(), Value());
}

void Checker::checkProcess(StageOp stage, ProcessOp process) {
  checkIndices(process);
  checkUnwritten(process,
                 [&](FlatSymbolRefAttr record) { return hostOf(record); });
  updated.clear();
  process.walk([&](UpdateOp update) { updated.insert(update.getImageAttr()); });
  checkTrips(process);
  process.walk([](EmissionOpInterface emit) { asEmit(emit); });
  Block &body = process.getBody().front();
  checkBlock(body, Value());
  OpBuilder builder = OpBuilder::atBlockBegin(&body);
  Location loc = process.getLoc();
  Value bin = BinOp::create(builder, loc, builder.getIndexType());
  Value lineage;
  if (isa<PrimType>(body.getArgument(0).getType()))
    lineage = getLineage(builder, loc, body.getArgument(0));
  CheckCallOp::create(builder, loc, stage.getSymName(), bin, lineage);
}

namespace {
/// An access, if the op is one.
struct Access {
  CheckedAccess kind;
  FlatSymbolRefAttr state;
  ValueRange indices;
};
} // namespace

static std::optional<Access> getAccess(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op); load && !load.getIndices().empty())
    return Access{CheckedAccess::Read, load.getStateAttr(), load.getIndices()};
  if (auto store = dyn_cast<StoreOp>(op))
    return Access{CheckedAccess::Store, store.getStateAttr(),
                  store.getIndices()};
  if (auto atomic = dyn_cast<AtomicOp>(op))
    return Access{CheckedAccess::Atomic, atomic.getStateAttr(),
                  atomic.getIndices()};
  if (auto update = dyn_cast<UpdateOp>(op))
    return Access{CheckedAccess::Update, update.getImageAttr(),
                  update.getCoordinates()};
  return std::nullopt;
}

void Checker::checkBlock(Block &block, Value iteration) {
  OpBuilder builder(block.getParentOp()->getContext());
  // The accesses of one block to one element need one check.
  SmallVector<CheckAccessOp> known;
  auto mark = [&](Location loc, CheckedLoop event, Value i) {
    CheckLoopOp::create(builder, loc, event, i);
    known.clear();
  };
  for (Operation &op : llvm::make_early_inc_range(block)) {
    Location loc = op.getLoc();
    builder.setInsertionPoint(&op);
    if (isa<DivideOp>(op)) {
      CheckPlaceOp::create(builder, loc);
    } else if (auto emit = dyn_cast<EmitOp>(op)) {
      checkEmit(emit);
    } else if (std::optional<Access> access = getAccess(&op)) {
      bool isKnown = llvm::any_of(known, [&](CheckAccessOp check) {
        return check.getKind() == access->kind &&
               check.getStateAttr() == access->state &&
               check.getIndices() == access->indices;
      });
      if (!isKnown) {
        known.push_back(CheckAccessOp::create(
            builder, loc,
            CheckedAccessAttr::get(builder.getContext(), access->kind),
            updated.contains(access->state) ? builder.getUnitAttr()
                                            : UnitAttr(),
            access->state, access->indices));
      }
    }
    if (auto loop = dyn_cast<ParallelLoopOpInterface>(op)) {
      mark(loc, CheckedLoop::Begin, Value());
      builder.setInsertionPointToStart(loop.getBodyBlock());
      Value number = loop.buildIteration(builder);
      mark(loc, CheckedLoop::Iteration, number);
      checkBlock(*loop.getBodyBlock(), loop.hasBarriers() ? number : Value());
      builder.setInsertionPointAfter(loop);
      mark(loc, CheckedLoop::End, Value());
      continue;
    }
    if (isBarrier(&op)) {
      builder.setInsertionPointAfter(&op);
      mark(loc, CheckedLoop::Barrier, iteration);
      continue;
    }
    // Between barriers iterations run one after the other: what follows one
    // may be another's.
    Operation *meets =
        iteration && op.getNumRegions() ? findBarrier(&op) : nullptr;
    if (meets) {
      // Here it shows whether all of them come to the barrier.
      auto loop = dyn_cast<scf::WhileOp>(op);
      OpBuilder ahead(loop ? loop.getConditionOp().getOperation() : &op);
      CheckPlaceOp::create(ahead, meets->getLoc());
    }
    for (Region &region : op.getRegions())
      for (Block &inner : region) {
        checkBlock(inner, iteration);
        builder.setInsertionPointToStart(&inner);
        if (meets)
          mark(loc, CheckedLoop::Iteration, iteration);
      }
    builder.setInsertionPointAfter(&op);
    if (meets)
      mark(loc, CheckedLoop::Iteration, iteration);
  }
}

//===----------------------------------------------------------------------===//
// Emissions
//===----------------------------------------------------------------------===//

static bool isPartOf(StringRef leaf, StringRef field) {
  return leaf.consume_front(field) &&
         (leaf.empty() || leaf.front() == '.' || leaf.front() == '[');
}

void Checker::checkNumbers(EmitOp emit, RecordOp record) {
  FlatSymbolRefAttr host =
      hostOf(FlatSymbolRefAttr::get(record.getSymNameAttr()));
  OpBuilder builder(emit);
  for (const std::string &field : numbers.lookup(host.getAttr())) {
    Value isNaN;
    int64_t number = 0;
    for (auto leaf : record.getFields().getAsRange<FieldAttr>()) {
      int64_t begin = number;
      number += leaf.getElementCount();
      if (!isPartOf(leaf.getName(), field))
        continue;
      for (Value value : emit.getValues().slice(begin, number - begin)) {
        Value test = arith::CmpFOp::create(
            builder, emit.getLoc(), arith::CmpFPredicate::UNO, value, value);
        isNaN = isNaN
                    ? arith::OrIOp::create(builder, emit.getLoc(), isNaN, test)
                    : test;
      }
    }
    CheckValueOp::create(builder, emit.getLoc(), CheckedValue::NaN, isNaN,
                         field, host.getValue());
  }
}

void Checker::checkEmit(EmitOp emit) {
  auto output =
      cast<FlatSymbolRefAttr>(getPhaseStage(emit).getOutputs()[emit.getPort()]);
  checkNumbers(emit, lookupRecord(emit, output));
  OpBuilder builder(emit);
  CheckPlaceOp::create(builder, emit.getLoc());
  Value lineage =
      CheckEmitOp::create(builder, emit.getLoc(), builder.getI64Type());
  emit.getValuesMutable().append(lineage);
}

void Checker::run() {
  for (auto stage : pipeline.getOps<StageOp>())
    changeTypes(stage);
  for (auto stage : pipeline.getOps<StageOp>()) {
    if (AssignOp assign = stage.getAssign())
      checkAssign(stage, assign);
    if (ProcessOp process = stage.getProcess())
      checkProcess(stage, process);
  }
  OpBuilder builder = OpBuilder::atBlockBegin(pipeline.getBodyBlock());
  for (auto [host, checked] : records) {
    auto named = numbers.lookup(host);
    SmallVector<StringRef> fields(named.begin(), named.end());
    CheckRecordOp::create(
        builder, pipeline.getLoc(), checked, FlatSymbolRefAttr::get(host),
        fields.empty() ? ArrayAttr() : builder.getStrArrayAttr(fields));
  }
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// Whether the record has the field, and it holds floats alone.
static LogicalResult verifyNumbers(RecordOp record, StringRef field) {
  bool found = false;
  for (auto leaf : record.getFields().getAsRange<FieldAttr>()) {
    if (!isPartOf(leaf.getName(), field))
      continue;
    found = true;
    if (!isa<FloatType>(leaf.getType()))
      return record.emitError("expected field '")
             << field << "' of '" << record.getSymName()
             << "' to hold floats, because it is to be checked for NaN, but "
                "got "
             << leaf.getType();
  }
  if (!found)
    return record.emitError("expected a field of '")
           << record.getSymName() << "' to be checked for NaN, but got '"
           << field << "', which is none";
  return success();
}

FailureOr<NumberFields>
AddChecksPass::findNumbers(ArrayRef<StringAttr> records) {
  NumberFields fields;
  for (const std::string &name : numbers) {
    auto [record, field] = StringRef(name).split('.');
    auto symbol = StringAttr::get(&getContext(), record);
    if (!llvm::is_contained(records, symbol)) {
      getOperation().emitError("expected the record of a primitive, one of '")
          << llvm::join(llvm::map_range(
                            records,
                            [](StringAttr known) { return known.getValue(); }),
                        "', '")
          << "', to be checked for NaN, but got '" << record << "'";
      return failure();
    }
    if (failed(verifyNumbers(
            lookupRecord(*getOperation().getOps<PipelineOp>().begin(),
                         FlatSymbolRefAttr::get(symbol)),
            field)))
      return failure();
    fields[symbol].push_back(field.str());
  }
  return fields;
}

/// Whether each access is one whose element can be told to the runtime.
static LogicalResult verifyAccesses(PipelineOp pipeline) {
  WalkResult result = pipeline.walk([](StateAccessOpInterface access)
                                        -> WalkResult {
    if (isa<LoadOp, StoreOp, AtomicOp, UpdateOp>(*access))
      return WalkResult::advance();
    return access->emitError(
               "expected an access of the piko dialect, because checking mode "
               "tells which element it is to, but got '")
           << access->getName() << "'";
  });
  return failure(result.wasInterrupted());
}

void AddChecksPass::runOnOperation() {
  SmallVector<PipelineOp> pipelines(getOperation().getOps<PipelineOp>());
  for (PipelineOp pipeline : pipelines)
    if (failed(verifyAccesses(pipeline)))
      return signalPassFailure();
  SmallVector<StringAttr> records;
  auto add = [&](FlatSymbolRefAttr record) {
    if (!llvm::is_contained(records, record.getAttr()))
      records.push_back(record.getAttr());
  };
  for (PipelineOp pipeline : pipelines)
    for (auto stage : pipeline.getOps<StageOp>()) {
      add(stage.getInputAttr());
      for (auto output : stage.getOutputs().getAsRange<FlatSymbolRefAttr>())
        add(output);
    }
  FailureOr<NumberFields> fields = findNumbers(records);
  if (failed(fields))
    return signalPassFailure();
  for (PipelineOp pipeline : pipelines)
    Checker(pipeline, *fields).run();
}
