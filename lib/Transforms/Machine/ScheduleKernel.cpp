// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Dynamic schedules as kernels: a loop over bins with the body in it. What was
// said last about a bin is kept in private memory until the body has ended.

#include "Machine/FormWork.h"
#include "Support/UnusedName.h"

#include "Piko/Dialect/Piko/IR/PikoProgram.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/PatternMatch.h"

using namespace mlir;
using namespace piko;

namespace {

/// A number that the body of a schedule sets.
class Cell {
public:
  Cell(OpBuilder &builder, Location loc, TypedAttr initial)
      : initial(arith::ConstantOp::create(builder, loc, initial)),
        memory(memref::AllocaOp::create(
            builder, loc, MemRefType::get({}, initial.getType()))) {}

  void set(OpBuilder &builder, Location loc, Value value) {
    memref::StoreOp::create(builder, loc, value, memory);
  }
  void reset(OpBuilder &builder, Location loc) { set(builder, loc, initial); }
  Value get(OpBuilder &builder, Location loc) {
    return memref::LoadOp::create(builder, loc, memory);
  }

private:
  Value initial, memory;
};

/// What is said about a bin. The schedule's own directives hold where its body
/// says nothing.
struct DirectiveCells {
  Cell kind, tileSplit, batch, everyBin;

  DirectiveCells(OpBuilder &builder, Location loc, ScheduleOp schedule)
      : kind(builder, loc,
             builder.getI32IntegerAttr(int32_t(schedule.getKind()))),
        tileSplit(
            builder, loc,
            builder.getI64IntegerAttr(schedule.getTileSplit().value_or(0))),
        batch(builder, loc,
              builder.getI64IntegerAttr(schedule.getBatch().value_or(
                  std::numeric_limits<int64_t>::min()))),
        everyBin(builder, loc, builder.getBoolAttr(schedule.getEveryBin())) {}

  void resolve(Operation *op) {
    OpBuilder builder(op);
    Location loc = op->getLoc();
    if (auto set = dyn_cast<SetScheduleOp>(op)) {
      kind.set(builder, loc, set.getKind());
      tileSplit.set(builder, loc, set.getTileSplit());
    } else if (auto set = dyn_cast<SetBatchOp>(op)) {
      batch.set(builder, loc, set.getSize());
    } else {
      Value yes =
          arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
      everyBin.set(builder, loc, yes);
    }
    op->erase();
  }
};

} // namespace

static KernelOp createKernel(StageOp stage) {
  PipelineOp pipeline = getPipeline(stage);
  OpBuilder builder = OpBuilder::atBlockEnd(pipeline.getBodyBlock());
  for (auto first : pipeline.getOps<KernelOp>()) {
    builder.setInsertionPoint(first);
    break;
  }
  // After the kernels of schedules of earlier stages.
  for (auto kernel : pipeline.getOps<KernelOp>())
    if (!kernel.getOps<BeginScheduleOp>().empty())
      builder.setInsertionPointAfter(kernel);
  auto kernel = KernelOp::create(
      builder, stage.getLoc(),
      getUnusedName(pipeline, "schedule_" + stage.getSymName()));
  kernel.getBody().emplaceBlock();
  return kernel;
}

/// The program runs the kernel where it ran the schedule.
static void launch(KernelOp kernel, StageOp stage) {
  ProgramOp program = getProgram(getPipeline(stage));
  if (!program)
    return;
  for (auto bins : llvm::to_vector(program.getOps<ScheduleBinsOp>())) {
    if (bins.getStage() != stage.getSymName())
      continue;
    OpBuilder builder(bins);
    LaunchOp::create(builder, bins.getLoc(), TypeRange(), kernel.getSymName(),
                     Value(), IntegerAttr(), /*clears=*/nullptr);
    bins.erase();
  }
}

void piko::formScheduleKernel(ScheduleOp schedule) {
  auto stage = cast<StageOp>(schedule->getParentOp());
  Location loc = schedule.getLoc();
  KernelOp kernel = createKernel(stage);
  launch(kernel, stage);
  OpBuilder builder = OpBuilder::atBlockEnd(kernel.getBodyBlock());
  Value bins = BeginScheduleOp::create(builder, loc, stage.getSymName());
  DirectiveCells directives(builder, loc, schedule);
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto loop = scf::ForOp::create(builder, loc, zero, bins, one);
  builder.setInsertionPointToStart(loop.getBody());
  for (Cell *cell : {&directives.kind, &directives.tileSplit, &directives.batch,
                     &directives.everyBin})
    cell->reset(builder, loc);
  Value bin = loop.getInductionVar();
  auto end = ScheduleBinOp::create(builder, loc, stage.getSymName(), bin,
                                   directives.kind.get(builder, loc),
                                   directives.tileSplit.get(builder, loc),
                                   directives.batch.get(builder, loc),
                                   directives.everyBin.get(builder, loc));

  // The body goes between.
  Operation *before = end.getKind().getDefiningOp();
  Block &body = schedule.getBody().front();
  body.getTerminator()->erase();
  IRRewriter(builder).inlineBlockBefore(&body, before, bin);
  loop.walk([&](Operation *op) {
    if (isa<SetScheduleOp, SetBatchOp, SetEveryBinOp>(op))
      directives.resolve(op);
  });
  expandQueries(loop, stage, bin);
  schedule.getBody().getBlocks().clear();
}
