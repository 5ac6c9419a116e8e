// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// NAME.run: a piko.program as branches between calls of kernels.

#include "PikoToLLVM/Program/ProgramRegions.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"

#include "pikort/abi_ranks.h"

using namespace mlir;
using namespace piko;

static_assert(int(AtomicKind::Add) == PIKOIR_SHARE_ADD &&
              int(AtomicKind::MinS) == PIKOIR_SHARE_MIN &&
              int(AtomicKind::MaxS) == PIKOIR_SHARE_MAX &&
              int(AtomicKind::MinU) == PIKOIR_SHARE_UMIN &&
              int(AtomicKind::MaxU) == PIKOIR_SHARE_UMAX &&
              int(AtomicKind::And) == PIKOIR_SHARE_AND &&
              int(AtomicKind::Or) == PIKOIR_SHARE_OR &&
              int(AtomicKind::Xor) == PIKOIR_SHARE_XOR);

namespace {

/// Writes NAME.run. The next kernel runs only if the one before it gave 0;
/// where a region repeats kernels, the runtime says what there is to do.
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
  Value call(const RuntimeFunction &function, ArrayRef<Value> arguments = {}) {
    SmallVector<Value> all{frame};
    llvm::append_range(all, arguments);
    return context.call(builder, loc, function, all).getResult();
  }
  /// Goes on, in `next`, only if a status is 0.
  void check(Value status, Block *next);
  void launch(LaunchOp launch, Block *next);
  /// Calls the kernel of the stage that a step names, and then goes to `next`;
  /// where it names none, control goes on.
  void createChoice(Value step, ArrayRef<LaunchOp> launches, Block *next);
  void createWaves(WavesOp waves);
  void createRounds(RoundsOp rounds);
  void createSpread(Operation &statement);
  void createClear(ClearOp clear);
  void createRankStatement(Operation &statement);
  void createStatements(Block &statements);
  void createStrips(StripsOp strips);
  void checkStatus() {
    check(call(PIKO_RUNTIME_FUNCTION(pikoir_status)), createBlock(exit));
  }

  const PipelineNumbers &numbers;
  PipelineOp pipeline;
  LoweringContext &context;
  OpBuilder &builder;
  Location loc;
  Value frame;
  Block *exit = nullptr; ///< Where a status goes that is not 0.
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

void RunWriter::createChoice(Value step, ArrayRef<LaunchOp> launches,
                             Block *next) {
  Block *choose = createBlock(exit);
  Block *after = createBlock(exit);
  Value ended = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                      step, createI32(builder, loc, 0));
  cf::CondBranchOp::create(builder, loc, ended, after, choose);
  SmallVector<int32_t> stages;
  SmallVector<Block *> calls;
  for (LaunchOp member : launches) {
    stages.push_back(findStages(member, numbers).front());
    calls.push_back(createBlock(after));
    builder.setInsertionPointToEnd(calls.back());
    launch(member, next);
  }
  builder.setInsertionPointToEnd(choose);
  cf::SwitchOp::create(builder, loc, step, after, ValueRange(), stages, calls,
                       SmallVector<ValueRange>(calls.size()));
  builder.setInsertionPointToEnd(after);
}

/// The runtime names a stage for which there is something in this wave.
void RunWriter::createWaves(WavesOp waves) {
  Block *step = createBlock(exit);
  cf::BranchOp::create(builder, loc, step);
  builder.setInsertionPointToEnd(step);
  Value number = createI32(builder, loc, getNumber(waves));
  createChoice(call(PIKO_RUNTIME_FUNCTION(pikoir_loop_step), {number}),
               llvm::to_vector(waves.getOps<LaunchOp>()), step);
}

/// A kernel that does not collect runs if something has come for it.
void RunWriter::createSpread(Operation &statement) {
  if (auto waves = dyn_cast<WavesOp>(statement))
    return createWaves(waves);
  auto member = dyn_cast<LaunchOp>(statement);
  if (!member || member.getTurn())
    return;
  int32_t stage = findStages(member, numbers).front();
  Value takes = call(PIKO_RUNTIME_FUNCTION(pikoir_cycle_takes),
                     {createI32(builder, loc, stage)});
  Value none = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                     takes, createI32(builder, loc, 0));
  Block *run = createBlock(exit);
  Block *after = createBlock(exit);
  cf::CondBranchOp::create(builder, loc, none, after, run);
  builder.setInsertionPointToEnd(run);
  launch(member, after);
}

void RunWriter::createRounds(RoundsOp rounds) {
  Block *spread = createBlock(exit);
  cf::BranchOp::create(builder, loc, spread);
  builder.setInsertionPointToEnd(spread);
  SmallVector<LaunchOp> turns;
  for (Operation &statement : rounds.getBody().front()) {
    createSpread(statement);
    if (auto member = dyn_cast<LaunchOp>(statement); member && member.getTurn())
      turns.push_back(member);
  }
  Value number = createI32(builder, loc, getNumber(rounds, /*asCycle=*/true));
  createChoice(call(PIKO_RUNTIME_FUNCTION(pikoir_cycle_turn), {number}), turns,
               spread);
}

void RunWriter::createClear(ClearOp clear) {
  for (auto name : clear.getStates().getAsRange<FlatSymbolRefAttr>())
    context.call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_clear),
                 {frame, createI32(builder, loc,
                                   numbers.states.lookup(name.getAttr()))});
}

/// What ranks do between launches.
void RunWriter::createRankStatement(Operation &statement) {
  auto i32 = [&](int64_t v) { return createI32(builder, loc, v); };
  auto i64 = [&](int64_t v) { return createI64(builder, loc, v); };
  auto numberOf = [&](FlatSymbolRefAttr state) {
    return i32(numbers.states.lookup(state.getAttr()));
  };
  Value status;
  if (auto exchange = dyn_cast<ExchangeOp>(statement)) {
    Operation *origin = getOrigin(exchange.getEdge());
    if (auto source = dyn_cast<SourceOp>(origin)) {
      status = call(PIKO_RUNTIME_FUNCTION(pikoir_exchange_source),
                    {i32(getSourceNumber(source))});
    } else {
      auto edge = cast<EdgeOp>(origin);
      status =
          call(PIKO_RUNTIME_FUNCTION(pikoir_exchange),
               {i32(numbers.stages.lookup(edge.getProducerAttr().getAttr())),
                i32(edge.getPort())});
    }
  } else if (auto keep = dyn_cast<KeepOp>(statement)) {
    status = call(keep.getCleared() ? PIKO_RUNTIME_FUNCTION(pikoir_keep_cleared)
                                    : PIKO_RUNTIME_FUNCTION(pikoir_keep),
                  {numberOf(keep.getStateAttr())});
  } else if (auto share = dyn_cast<ShareOp>(statement)) {
    FlatSymbolRefAttr name = share.getStateAttr();
    RecordOp record = context.record(
        getStateRecord(SymbolTable::lookupSymbolIn(pipeline, name)));
    ArrayAttr reduce = share.getReduceAttr();
    for (size_t i = 0; reduce && i < reduce.size(); i += 2) {
      FieldAttr field = record.getField(cast<StringAttr>(reduce[i]).getValue());
      auto kind =
          *symbolizeAtomicKind(cast<StringAttr>(reduce[i + 1]).getValue());
      int64_t bytes = field.getType().getIntOrFloatBitWidth() / 8;
      for (int64_t element = 0; element < field.getElementCount(); ++element)
        context.call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_share_field),
                     {frame, numberOf(name),
                      i64(field.getElementOffset(element)), i64(1), i64(0),
                      i64(bytes), i32(int64_t(kind))});
    }
    FlatSymbolRefAttr stage = share.getStageAttr();
    status =
        call(PIKO_RUNTIME_FUNCTION(pikoir_share),
             {numberOf(name),
              i32(stage ? int64_t(numbers.stages.lookup(stage.getAttr())) : -1),
              i32((share.getFromFirst() ? PIKOIR_SHARE_FROM_FIRST : 0) |
                  (share.getToFirst() ? PIKOIR_SHARE_TO_FIRST : 0) |
                  (share.getToOwners() ? PIKOIR_SHARE_TO_OWNERS : 0))});
  }
  if (status)
    check(status, createBlock(exit));
}

void RunWriter::createStatements(Block &statements) {
  for (Operation &op : statements) {
    if (auto clear = dyn_cast<ClearOp>(op))
      createClear(clear);
    else if (auto kernel = dyn_cast<LaunchOp>(op))
      launch(kernel, createBlock(exit));
    else if (auto strips = dyn_cast<StripsOp>(op))
      createStrips(strips);
    else if (auto waves = dyn_cast<WavesOp>(op))
      createWaves(waves);
    else if (auto rounds = dyn_cast<RoundsOp>(op))
      createRounds(rounds);
    else
      createRankStatement(op);
    if (isa<WavesOp, RoundsOp>(op))
      checkStatus();
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
  Value more = call(PIKO_RUNTIME_FUNCTION(pikoir_strips_next),
                    {createI32(builder, loc, getNumber(strips))});
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
  checkStatus();
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
  func::FuncOp setup = createSetup(program, numbers, context, builder);
  RunWriter(numbers, context, builder).run(program);
  WalkResult grids =
      pipeline.walk([](BlockCountOp) { return WalkResult::interrupt(); });
  if (grids.wasInterrupted())
    setup->setAttr(marks::steps, describeSteps(program, numbers));
  return setup;
}
