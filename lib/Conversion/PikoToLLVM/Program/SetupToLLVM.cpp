// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// NAME.setup, which declares a pipeline to the runtime.

#include "PikoToLLVM/Program/ProgramRegions.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Dialect/Piko/IR/PikoCount.h"
#include "Piko/Dialect/Piko/IR/PikoFixed.h"

#include "pikort/abi_ranks.h"

using namespace mlir;
using namespace piko;

namespace {

/// Writes NAME.setup.
class SetupWriter {
public:
  SetupWriter(const PipelineNumbers &numbers, LoweringContext &context,
              OpBuilder &builder, Value frame)
      : numbers(numbers), pipeline(numbers.pipeline), context(context),
        builder(builder), loc(pipeline.getLoc()), frame(frame) {}

  void run(ProgramOp program);

private:
  Value i32(int64_t v) { return createI32(builder, loc, v); }
  Value i64(int64_t v) { return createI64(builder, loc, v); }
  /// The address of constant bytes.
  Value bytes(StringRef data);
  Value text(StringRef s) { return bytes((s + StringRef("\0", 1)).str()); }
  Value null() {
    return LLVM::ZeroOp::create(
        builder, loc, LLVM::LLVMPointerType::get(builder.getContext()));
  }
  void call(const RuntimeFunction &function, ArrayRef<Value> arguments) {
    SmallVector<Value> all{frame};
    llvm::append_range(all, arguments);
    context.call(builder, loc, function, all);
  }

  void declareRecord(StringAttr name, int32_t number);
  void declareField(FieldAttr field, int32_t record);
  /// With the name, offset, length and stride of each part of a field.
  void
  forRows(FieldAttr field,
          llvm::function_ref<void(std::string, Value, Value, Value)> declare);
  void declareCheckedRecord(CheckRecordOp record);
  void declareCounter(CounterOp counter);
  void declareFixed(FixedOp fixed);
  void declareContract(ContractOp contract);
  void declareState(Operation *state, int32_t number);
  void declareStage(StageOp stage, int32_t number);
  void declareEdge(EdgeOp edge);
  void declareJoin(JoinOp join);
  void declareClears(LaunchOp launch);
  void declareMappings(KernelOp kernel);
  void declareRoots(ProgramOp program);
  void declareRegion(Operation *region);
  void declareRanks(ProgramOp program);
  Value recordBytes(FlatSymbolRefAttr record, ArrayAttr numbers);

  const PipelineNumbers &numbers;
  int constants = 0; ///< That `bytes` has made.
  PipelineOp pipeline;
  LoweringContext &context;
  OpBuilder &builder;
  Location loc;
  Value frame;
};

} // namespace

Value SetupWriter::bytes(StringRef data) {
  auto module = pipeline->getParentOfType<ModuleOp>();
  auto type = LLVM::LLVMArrayType::get(builder.getI8Type(), data.size());
  // Names of the text have no dot.
  std::string name = (pipeline.getSymName() + ".data").str();
  if (constants++ > 0)
    name += "_" + std::to_string(constants - 2);
  OpBuilder atStart(module.getBodyRegion());
  auto global = LLVM::GlobalOp::create(
      atStart, loc, type, /*isConstant=*/true, LLVM::Linkage::Internal, name,
      builder.getStringAttr(data), /*alignment=*/16);
  return LLVM::AddressOfOp::create(builder, loc, global);
}

static int64_t fieldType(Type type) {
  if (type.isF32())
    return PIKORT_F32;
  if (type.isF64())
    return PIKORT_F64;
  switch (type.getIntOrFloatBitWidth()) {
  case 8:
    return PIKORT_I8;
  case 16:
    return PIKORT_I16;
  case 32:
    return PIKORT_I32;
  default:
    return PIKORT_I64;
  }
}

void SetupWriter::declareRecord(StringAttr name, int32_t number) {
  RecordOp record = context.record(FlatSymbolRefAttr::get(name));
  call(
      PIKO_RUNTIME_FUNCTION(pikoir_declare_record),
      {i32(number), text(name), i64(record.getSize()), i64(record.getAlign())});
  for (auto field : record.getFields().getAsRange<FieldAttr>())
    declareField(field, number);
}

/// The runtime's fields are evenly spaced: an array that is not, such as one
/// inside the elements of another, is declared row by row.
void SetupWriter::forRows(
    FieldAttr field,
    llvm::function_ref<void(std::string, Value, Value, Value)> declare) {
  ArrayRef<int64_t> counts = field.getCounts(), strides = field.getStrides();
  bool isEven = true;
  for (size_t d = 1; d < counts.size(); ++d)
    isEven &= strides[d - 1] == strides[d] * counts[d];
  int64_t rowLength = isEven ? field.getElementCount() : counts.back();
  for (int64_t row = 0; row * rowLength < field.getElementCount(); ++row) {
    std::string name = field.getName().str();
    if (!isEven)
      name += "[" + std::to_string(row) + "]";
    declare(name, i64(field.getElementOffset(row * rowLength)), i64(rowLength),
            i64(strides.empty() ? 0 : strides.back()));
  }
}

void SetupWriter::declareField(FieldAttr field, int32_t record) {
  forRows(field,
          [&](std::string name, Value offset, Value length, Value stride) {
            call(PIKO_RUNTIME_FUNCTION(pikoir_declare_field),
                 {i32(record), text(name), i32(fieldType(field.getType())),
                  offset, length, stride});
          });
}

void SetupWriter::declareContract(ContractOp contract) {
  auto number = [&](FlatSymbolRefAttr state) {
    return i32(state ? numbers.states.lookup(state.getAttr()) : -1);
  };
  FieldAttr field =
      context.record(contract.getRecord()).getField(contract.getField());
  forRows(field,
          [&](std::string name, Value offset, Value length, Value stride) {
            call(PIKO_RUNTIME_FUNCTION(pikoir_declare_contract),
                 {i32(contract.getSource().value_or(-1)),
                  number(contract.getBufferAttr()), text(name),
                  i32(fieldType(field.getType())), i32(contract.getHasNoSign()),
                  offset, length, stride, number(contract.getTargetAttr()),
                  i64(contract.getBelow().value_or(0))});
          });
}

void SetupWriter::declareCounter(CounterOp counter) {
  int64_t part = counter.getPort().value_or(-1);
  if (FlatSymbolRefAttr state = counter.getStateAttr())
    part = numbers.states.lookup(state.getAttr());
  call(PIKO_RUNTIME_FUNCTION(pikoir_declare_counter),
       {i32(counter.getNumber()), i32(int64_t(counter.getKind())),
        text(counter.getStage()), i32(part),
        i32(counter.getInside() ? int64_t(*counter.getInside()) : -1),
        context.place(builder, counter)});
}

void SetupWriter::declareFixed(FixedOp fixed) {
  int64_t offset = 0, size = 0;
  StringRef name = fixed.getField().value_or("");
  if (!name.empty()) {
    Operation *state =
        SymbolTable::lookupSymbolIn(pipeline, fixed.getStateAttr());
    FieldAttr field = context.record(getStateRecord(state)).getField(name);
    offset = field.getElementOffset(fixed.getElement().value_or(0));
    size = field.getType().getIntOrFloatBitWidth() / 8;
  }
  call(PIKO_RUNTIME_FUNCTION(pikoir_declare_fixed),
       {i32(numbers.states.lookup(fixed.getStateAttr().getAttr())), text(name),
        i64(offset), i64(size), i64(static_cast<int64_t>(fixed.getBits()))});
}

void SetupWriter::declareCheckedRecord(CheckRecordOp check) {
  auto number = [&](FlatSymbolRefAttr record) {
    return i32(numbers.records.lookup(record.getAttr()));
  };
  RecordOp record = context.record(check.getRecordAttr());
  call(PIKO_RUNTIME_FUNCTION(pikoir_declare_checked_record),
       {number(check.getRecordAttr()), number(check.getHostAttr()),
        i64(record.getField(lineageField).getOffset())});
  if (ArrayAttr fields = check.getNumbersAttr())
    for (auto field : fields.getAsRange<StringAttr>())
      call(PIKO_RUNTIME_FUNCTION(pikoir_declare_number),
           {number(check.getHostAttr()), text(field.getValue())});
}

Value SetupWriter::recordBytes(FlatSymbolRefAttr name, ArrayAttr numbers) {
  if (!numbers)
    return null();
  RecordOp record = context.record(name);
  std::string data(record.getSize(), '\0');
  for (auto [value, offset] : llvm::zip(numbers, record.getElementOffsets())) {
    APInt bits = isa<FloatAttr>(value)
                     ? cast<FloatAttr>(value).getValue().bitcastToAPInt()
                     : cast<IntegerAttr>(value).getValue();
    for (unsigned i = 0; i < bits.getBitWidth() / 8; ++i)
      data[offset + i] = char(bits.extractBitsAsZExtValue(8, 8 * i));
  }
  return bytes(data);
}

void SetupWriter::declareState(Operation *state, int32_t number) {
  auto image = dyn_cast<ImageOp>(state);
  auto buffer = dyn_cast<BufferOp>(state);
  auto constant = dyn_cast<ConstantOp>(state);
  int64_t perSource = buffer ? buffer.getPerSource().value_or(-1) : -1;
  call(PIKO_RUNTIME_FUNCTION(pikoir_declare_state),
       {i32(number), text(SymbolTable::getSymbolName(state)),
        i32(image    ? PIKORT_IMAGE
            : buffer ? PIKORT_BUFFER
                     : PIKORT_CONSTANT),
        i32(numbers.records.lookup(getStateRecord(state).getAttr())),
        i32(getStateRank(state)), i32(perSource),
        image ? recordBytes(image.getRecordAttr(), image.getClearAttr())
        : constant
            ? recordBytes(constant.getRecordAttr(), constant.getValueAttr())
            : null()});
  if (image && image.getInternal())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_internal), {i32(number)});
  if (numbers.writtenBuffers.contains(SymbolTable::getSymbolName(state)))
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_written), {i32(number)});
  if (numbers.unusedBuffers.contains(SymbolTable::getSymbolName(state)))
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_unused), {i32(number)});
}

// A dialect's schedule is the runtime's by number.
static_assert(int(ScheduleKind::LoadBalance) == PIKOIR_LOAD_BALANCE &&
              int(ScheduleKind::DirectMap) == PIKOIR_DIRECT_MAP &&
              int(ScheduleKind::Serialize) == PIKOIR_SERIALIZE &&
              int(ScheduleKind::All) == PIKOIR_ALL);

/// pikoir_stage_flags
static int64_t stageFlags(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  // Of a stage that runs after another nothing shows where its lineage starts.
  bool isAfter = schedule && schedule.getAfter();
  return (stage.collects() || isAfter ? PIKOIR_COLLECTS : 0) |
         (stage.getSplit() ? PIKOIR_SPLIT : 0) |
         (stage.getPlaced() ? PIKOIR_PLACED : 0) |
         (schedule && schedule.getUnordered() ? PIKOIR_UNORDERED : 0) |
         (stage.getTakesList() ? PIKOIR_LIST : 0) |
         (stage.getOrdered() ? PIKOIR_ORDERED : 0) |
         (stage.getWrites() ? PIKOIR_WRITES : 0);
}

/// The bytes of a number.
static void appendBytes(std::string &to, int64_t number, int count) {
  for (int byte = 0; byte < count; ++byte)
    to += char(uint64_t(number) >> (8 * byte));
}

void SetupWriter::declareStage(StageOp stage, int32_t number) {
  std::string extents;
  for (int64_t extent : stage.getBins())
    appendBytes(extents, extent, 8);
  ScheduleOp schedule = stage.getSchedule();
  call(PIKO_RUNTIME_FUNCTION(pikoir_declare_stage),
       {i32(number), text(getCppName(stage)),
        i32(numbers.records.lookup(stage.getInputAttr().getAttr())),
        bytes(extents), i32(schedule ? int64_t(schedule.getKind()) : 0),
        i64(schedule ? schedule.getTileSplit().value_or(0) : 0),
        i32(stageFlags(stage)), i64(stage.getTile().value_or(0))});
  if (!schedule)
    return;
  if (schedule.getBatch() || schedule.getEveryBin())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_schedule),
         {i32(number), i64(schedule.getBatch().value_or(0)),
          i32(schedule.getEveryBin())});
  if (ArrayAttr waits = schedule.getEndStageAttr())
    for (auto name : waits.getAsRange<FlatSymbolRefAttr>())
      call(PIKO_RUNTIME_FUNCTION(pikoir_declare_wait),
           {i32(number), i32(numbers.stages.lookup(name.getAttr()))});
}

void SetupWriter::declareEdge(EdgeOp edge) {
  Value producer = i32(numbers.stages.lookup(edge.getProducerAttr().getAttr()));
  call(PIKO_RUNTIME_FUNCTION(pikoir_declare_edge),
       {producer, i32(edge.getPort()),
        i32(numbers.stages.lookup(edge.getConsumerAttr().getAttr()))});
  if (edge.getLocal())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_local),
         {producer, i32(edge.getPort())});
}

//===----------------------------------------------------------------------===//
// What a program says of stages and edges
//===----------------------------------------------------------------------===//

/// What a stage emits has keys only if it is merged, and keeps them only then.
void SetupWriter::declareJoin(JoinOp join) {
  for (auto [edge, permute, keys] :
       llvm::zip(join.getEdges(), join.getPermutes(), join.getKeys()))
    if (auto from = dyn_cast<EdgeOp>(getOrigin(edge)))
      call(PIKO_RUNTIME_FUNCTION(pikoir_declare_join),
           {i32(numbers.stages.lookup(from.getProducerAttr().getAttr())),
            i32(from.getPort()), i32(permute), i32(keys)});
  if (auto keeps = join.getKeeps())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_keys),
         {i32(numbers.stages.lookup(join.getStageAttr().getAttr())),
          i32(*keeps)});
}

/// Lineages of the run count after those of the sources; what one cycle emits
/// is told apart by its launches.
void SetupWriter::declareRoots(ProgramOp program) {
  if (!program.getRootsAttr())
    return;
  llvm::DenseMap<int32_t, Operation *> rounds;
  program.walk([&](RoundsOp op) {
    for (int32_t stage : findStages(op, numbers))
      rounds[stage] = op;
  });
  llvm::DenseMap<Operation *, int64_t> shared;
  auto sources = pipeline.getOps<SourceOp>();
  int64_t next = std::distance(sources.begin(), sources.end());
  for (auto name : program.getRootsAttr().getAsRange<FlatSymbolRefAttr>()) {
    int32_t stage = numbers.stages.lookup(name.getAttr());
    int64_t root = next++;
    if (Operation *cycle = rounds.lookup(stage))
      root = shared.try_emplace(cycle, root).first->second;
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_root), {i32(stage), i32(root)});
  }
}

static_assert(mostMappings == PIKOIR_MOST_MAPPINGS);

void SetupWriter::declareMappings(KernelOp kernel) {
  SmallVector<TakesVectorsOp> loops;
  kernel.walk([&](TakesVectorsOp op) { loops.push_back(op); });
  if (loops.empty())
    return;
  llvm::sort(loops, [](TakesVectorsOp a, TakesVectorsOp b) {
    return a.getNumber() < b.getNumber();
  });
  OpenBinsOp bins = *kernel.getOps<OpenBinsOp>().begin();
  int64_t stage = numbers.stages.lookup(bins.getStageAttr().getAttr());
  int64_t source = bins.getSource() ? int64_t(*bins.getSource()) : -1;
  for (TakesVectorsOp op : loops)
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_mapping),
         {i32(stage), i32(source), i32(op.getNumber()), text(op.getLoop()),
          i32(op.getWithin() ? int64_t(*op.getWithin()) : -1),
          i32(op.getExpected()), i64(op.getVectors()), i64(op.getScalar())});
}

void SetupWriter::declareClears(LaunchOp launch) {
  if (!launch.getClearsAttr())
    return;
  Value stage = i32(findStages(launch, numbers).front());
  for (auto image : launch.getClearsAttr().getAsRange<FlatSymbolRefAttr>())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_clears),
         {stage, i32(numbers.states.lookup(image.getAttr()))});
}

void SetupWriter::declareRegion(Operation *region) {
  auto stages = findStages(region, numbers);
  std::string list;
  for (int32_t stage : stages)
    appendBytes(list, stage, 4);
  Value count = i32(stages.size());
  if (auto strips = dyn_cast<StripsOp>(region)) {
    auto feed = strips.getSource().getDefiningOp<FeedOp>();
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_strips),
         {i32(getNumber(region)), i32(feed.getSource()),
          i64(strips.getChunk().value_or(0)), bytes(list), count});
    return;
  }
  if (!region->getParentOfType<RoundsOp>())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_cycle),
         {i32(getNumber(region, /*asCycle=*/true)), bytes(list), count});
  if (auto waves = dyn_cast<WavesOp>(region))
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_loop),
         {i32(getNumber(region)), bytes(list), count,
          i32(waves.getKeys().value_or(0))});
}

/// Who runs which stage, in the order of launches, and what is exchanged.
void SetupWriter::declareRanks(ProgramOp program) {
  if (!program.getRanks())
    return;
  llvm::DenseMap<int32_t, PartitionOp> partitions;
  for (auto partition : program.getBodyBlock()->getOps<PartitionOp>())
    partitions[numbers.stages.lookup(partition.getStageAttr().getAttr())] =
        partition;
  for (int32_t stage : findStages(program, numbers)) {
    PartitionOp partition = partitions.lookup(stage);
    RankDivision division =
        partition ? partition.getDivision() : RankDivision::First;
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_partition),
         {i32(stage), i32(int64_t(division))});
    if (partition && partition.getOwners())
      call(PIKO_RUNTIME_FUNCTION(pikoir_declare_owners),
           {i32(stage), i32(int64_t(*partition.getOwners()))});
  }
  for (auto common : program.getBodyBlock()->getOps<CommonOp>())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_common),
         {i32(numbers.states.lookup(common.getImageAttr().getAttr())),
          i32(numbers.stages.lookup(common.getStageAttr().getAttr()))});
  program.walk([&](ExchangeOp exchange) {
    Operation *origin = getOrigin(exchange.getEdge());
    if (auto source = dyn_cast<SourceOp>(origin)) {
      call(PIKO_RUNTIME_FUNCTION(pikoir_declare_exchange_source),
           {i32(getSourceNumber(source))});
      return;
    }
    auto edge = cast<EdgeOp>(origin);
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_exchange),
         {i32(numbers.stages.lookup(edge.getProducerAttr().getAttr())),
          i32(edge.getPort())});
  });
}

void SetupWriter::run(ProgramOp program) {
  call(PIKO_RUNTIME_FUNCTION(pikoir_declare_pipeline),
       {text(pipeline.getSymName()), i32(pipeline.getRank())});
  if (std::optional<int64_t> buckets = pipeline.getMaxExtent())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_max_extent), {i64(*buckets)});
  for (auto [name, number] : numbers.records)
    declareRecord(name, number);
  for (auto check : pipeline.getOps<CheckRecordOp>())
    declareCheckedRecord(check);
  for (auto [name, number] : numbers.stages)
    declareStage(cast<StageOp>(SymbolTable::lookupSymbolIn(pipeline, name)),
                 number);
  for (auto [index, source] : llvm::enumerate(pipeline.getOps<SourceOp>()))
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_source),
         {i32(index),
          i32(numbers.stages.lookup(source.getStageAttr().getAttr()))});
  for (auto edge : pipeline.getOps<EdgeOp>())
    declareEdge(edge);
  for (auto [name, number] : numbers.states)
    declareState(SymbolTable::lookupSymbolIn(pipeline, name), number);
  for (auto fixed : pipeline.getOps<FixedOp>())
    declareFixed(fixed);
  for (auto contract : pipeline.getOps<ContractOp>())
    declareContract(contract);
  for (auto counter : pipeline.getOps<CounterOp>())
    declareCounter(counter);
  declareReductions(builder, frame, numbers, context);
  declareSelections(builder, frame, numbers, context);
  for (auto kernel : pipeline.getOps<KernelOp>())
    declareMappings(kernel);
  declareRoots(program);
  declareRanks(program);
  program.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (auto join = dyn_cast<JoinOp>(op))
      declareJoin(join);
    else if (auto launch = dyn_cast<LaunchOp>(op))
      declareClears(launch);
    else if (isa<StripsOp, WavesOp, RoundsOp>(op))
      declareRegion(op);
  });
}

func::FuncOp piko::createSetup(ProgramOp program,
                               const PipelineNumbers &numbers,
                               LoweringContext &context, OpBuilder &builder) {
  PipelineOp pipeline = numbers.pipeline;
  auto setup = func::FuncOp::create(
      builder, pipeline.getLoc(), (pipeline.getSymName() + ".setup").str(),
      builder.getFunctionType(LLVM::LLVMPointerType::get(builder.getContext()),
                              {}));
  OpBuilder::InsertionGuard guard(builder);
  Block *body = setup.addEntryBlock();
  builder.setInsertionPointToEnd(body);
  SetupWriter(numbers, context, builder, body->getArgument(0)).run(program);
  func::ReturnOp::create(builder, pipeline.getLoc());
  return setup;
}
