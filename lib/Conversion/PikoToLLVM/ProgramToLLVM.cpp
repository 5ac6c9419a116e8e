// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The two functions of a program: NAME.setup declares the pipeline to the
// runtime, NAME.run is the piko.program as branches between calls of kernels.

#include "LoweringContext.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"

#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"

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
  void declareCheckedRecord(CheckRecordOp record);
  void declareState(Operation *state, int32_t number);
  void declareStage(StageOp stage, int32_t number);
  void declareStrips(StripsOp strips, int32_t number);
  Value recordBytes(FlatSymbolRefAttr record, ArrayAttr numbers);

  const PipelineNumbers &numbers;
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
  unsigned counter = 0;
  SmallString<32> name = SymbolTable::generateSymbolName<32>(
      (pipeline.getSymName() + ".data").str(),
      [&](StringRef candidate) { return module.lookupSymbol(candidate); },
      counter);
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
void SetupWriter::declareField(FieldAttr field, int32_t record) {
  ArrayRef<int64_t> counts = field.getCounts(), strides = field.getStrides();
  bool isEven = true;
  for (size_t d = 1; d < counts.size(); ++d)
    isEven &= strides[d - 1] == strides[d] * counts[d];
  int64_t rowLength = isEven ? field.getElementCount() : counts.back();
  for (int64_t row = 0; row * rowLength < field.getElementCount(); ++row) {
    std::string name = field.getName().str();
    if (!isEven)
      name += "[" + std::to_string(row) + "]";
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_field),
         {i32(record), text(name), i32(fieldType(field.getType())),
          i64(field.getElementOffset(row * rowLength)), i64(rowLength),
          i64(strides.empty() ? 0 : strides.back())});
  }
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
  return (stage.collects() ? PIKOIR_COLLECTS : 0) |
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

/// The stages whose kernels are launched in a region, in order.
static llvm::SmallSetVector<int32_t, 8>
findStages(Operation *region, const PipelineNumbers &numbers) {
  llvm::SmallSetVector<int32_t, 8> stages;
  region->walk([&](LaunchOp launch) {
    for (StageOp stage : getStages(launch.getKernelOp()))
      stages.insert(numbers.stages.lookup(stage.getSymNameAttr()));
  });
  return stages;
}

void SetupWriter::declareStrips(StripsOp strips, int32_t number) {
  auto stages = findStages(strips, numbers);
  std::string list;
  for (int64_t stage : stages)
    appendBytes(list, stage, 4);
  auto feed = strips.getSource().getDefiningOp<FeedOp>();
  call("pikoir_declare_strips",
       {i32(number), i32(feed.getSource()), i64(strips.getChunk().value_or(0)),
        bytes(list), i32(stages.size())});
}

void SetupWriter::run(ProgramOp program) {
  call("pikoir_declare_pipeline",
       {text(pipeline.getSymName()), i32(pipeline.getRank())});
  if (std::optional<int64_t> cells = pipeline.getMaxExtent())
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_max_extent), {i64(*cells)});
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
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    int32_t producer = numbers.stages.lookup(edge.getProducerAttr().getAttr());
    call(PIKO_RUNTIME_FUNCTION(pikoir_declare_edge),
         {i32(producer), i32(edge.getPort()),
          i32(numbers.stages.lookup(edge.getConsumerAttr().getAttr()))});
    if (edge.getLocal())
      call(PIKO_RUNTIME_FUNCTION(pikoir_declare_local),
           {i32(producer), i32(edge.getPort())});
  }
  for (auto [name, number] : numbers.states)
    declareState(SymbolTable::lookupSymbolIn(pipeline, name), number);
  for (auto [number, strips] : llvm::enumerate(program.getOps<StripsOp>()))
    declareStrips(strips, number);
}

namespace {

/// Writes NAME.run. The next kernel runs only if the one before it gave 0;
/// those of a cycle run as the runtime says, those of strips for each strip.
class RunWriter {
public:
  RunWriter(const PipelineNumbers &numbers, LoweringContext &context,
            OpBuilder &builder)
      : numbers(numbers), pipeline(numbers.pipeline), context(context),
        builder(builder), loc(pipeline.getLoc()) {}

  void run(ProgramOp program);

private:
  Block *createBlock(Block *before) {
    OpBuilder::InsertionGuard guard(builder);
    return builder.createBlock(before);
  }
  Value call(StringRef function, ArrayRef<Value> arguments = {}) {
    SmallVector<Value> all{frame};
    llvm::append_range(all, arguments);
    return context.call(builder, loc, function, builder.getI32Type(), all)
        .getResult();
  }
  /// Goes on, in `next`, only if a status is 0.
  void check(Value status, Block *next);
  void launch(LaunchOp launch, Block *next);
  void createCycle(Operation *cycle);
  void createStatements(Block &statements);
  void createStrips(StripsOp strips);

  const PipelineNumbers &numbers;
  PipelineOp pipeline;
  LoweringContext &context;
  OpBuilder &builder;
  Location loc;
  Value frame;
  Block *exit = nullptr; ///< Where a status goes that is not 0.
  int64_t stripsCount = 0;
};

} // namespace

void RunWriter::check(Value status, Block *next) {
  builder.setInsertionPointAfterValue(status);
  Value failed = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                       status, createI32(builder, loc, 0));
  cf::CondBranchOp::create(builder, loc, failed, exit, status, next,
                           ValueRange());
  builder.setInsertionPointToEnd(next);
}

void RunWriter::launch(LaunchOp launch, Block *next) {
  KernelOp kernel = launch.getKernelOp();
  auto call =
      func::CallOp::create(builder, kernel.getLoc(), getFunctionName(kernel),
                           builder.getI32Type(), frame);
  check(call.getResult(0), next);
}

void RunWriter::createCycle(Operation *cycle) {
  Block *step = createBlock(exit);
  Block *choose = createBlock(exit);
  Block *after = createBlock(exit);
  cf::BranchOp::create(builder, loc, step);

  auto stages = llvm::to_vector(findStages(cycle, numbers));
  builder.setInsertionPointToEnd(step);
  Value next =
      call("pikoir_cycle_step", {createI32(builder, loc, stages.front())});
  Value ended = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                      next, createI32(builder, loc, 0));
  cf::CondBranchOp::create(builder, loc, ended, after, choose);

  SmallVector<Block *> calls;
  cycle->walk([&](LaunchOp member) {
    calls.push_back(createBlock(after));
    builder.setInsertionPointToEnd(calls.back());
    launch(member, step);
  });
  builder.setInsertionPointToEnd(choose);
  cf::SwitchOp::create(builder, loc, next, after, ValueRange(), stages, calls,
                       SmallVector<ValueRange>(calls.size()));

  builder.setInsertionPointToEnd(after);
  check(call("pikoir_status"), createBlock(exit));
}

void RunWriter::createStatements(Block &statements) {
  for (Operation &op : statements) {
    if (auto kernel = dyn_cast<LaunchOp>(op))
      launch(kernel, createBlock(exit));
    else if (auto strips = dyn_cast<StripsOp>(op))
      createStrips(strips);
    else if (isa<WavesOp, RoundsOp>(op))
      createCycle(&op);
  }
}

/// A kernel that fails ends its strip; the runtime knows whether it can be run
/// again as a smaller one.
void RunWriter::createStrips(StripsOp strips) {
  Block *next = createBlock(exit);
  Block *strip = createBlock(exit);
  Block *after = createBlock(exit);
  cf::BranchOp::create(builder, loc, next);

  builder.setInsertionPointToEnd(next);
  Value more =
      call("pikoir_strips_next", {createI32(builder, loc, stripsCount++)});
  Value ended = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                      more, createI32(builder, loc, 0));
  cf::CondBranchOp::create(builder, loc, ended, after, strip);

  Block *failed = builder.createBlock(after, builder.getI32Type(), loc);
  cf::BranchOp::create(builder, loc, next);
  Block *outer = std::exchange(exit, failed);
  builder.setInsertionPointToEnd(strip);
  createStatements(strips.getBody().front());
  cf::BranchOp::create(builder, loc, next);
  exit = outer;

  builder.setInsertionPointToEnd(after);
  check(call("pikoir_status"), createBlock(exit));
}

void RunWriter::run(ProgramOp program) {
  auto pointer = LLVM::LLVMPointerType::get(builder.getContext());
  auto function = func::FuncOp::create(
      builder, loc, (pipeline.getSymName() + ".run").str(),
      builder.getFunctionType(pointer, builder.getI32Type()));
  OpBuilder::InsertionGuard guard(builder);
  Block *entry = function.addEntryBlock();
  frame = entry->getArgument(0);
  exit =
      builder.createBlock(&function.getBody(), {}, builder.getI32Type(), loc);
  func::ReturnOp::create(builder, loc, exit->getArgument(0));
  builder.setInsertionPointToEnd(entry);
  createStatements(*program.getBodyBlock());
  cf::BranchOp::create(builder, loc, exit, createI32(builder, loc, 0));
}

func::FuncOp piko::createProgram(const PipelineNumbers &numbers,
                                 LoweringContext &context) {
  PipelineOp pipeline = numbers.pipeline;
  ProgramOp program = getProgram(pipeline);
  auto module = pipeline->getParentOfType<ModuleOp>();
  OpBuilder builder = OpBuilder::atBlockEnd(module.getBody());
  auto setup = func::FuncOp::create(
      builder, pipeline.getLoc(), (pipeline.getSymName() + ".setup").str(),
      builder.getFunctionType(LLVM::LLVMPointerType::get(builder.getContext()),
                              {}));
  {
    OpBuilder::InsertionGuard guard(builder);
    Block *body = setup.addEntryBlock();
    builder.setInsertionPointToEnd(body);
    SetupWriter(numbers, context, builder, body->getArgument(0)).run(program);
    func::ReturnOp::create(builder, pipeline.getLoc());
  }
  RunWriter(numbers, context, builder).run(program);
  return setup;
}
