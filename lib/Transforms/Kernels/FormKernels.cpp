// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-kernels: BASELINE kernels. A stage's process phase goes together
// with the assign phases of the stages that it feeds.

#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"

namespace piko {
#define GEN_PASS_DEF_FORMKERNELS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct FormKernelsPass : piko::impl::FormKernelsBase<FormKernelsPass> {
  void runOnOperation() override;
  KernelOp createKernel(OpBuilder &builder, Location loc, const Twine &name);
};
} // namespace

KernelOp FormKernelsPass::createKernel(OpBuilder &builder, Location loc,
                                       const Twine &name) {
  auto isTaken = [&](StringRef candidate) {
    return bool(SymbolTable::lookupSymbolIn(getOperation(), candidate));
  };
  std::string unique = name.str();
  for (int i = 0; isTaken(unique); ++i)
    unique = (name + "_" + Twine(i)).str();
  auto kernel = KernelOp::create(builder, loc, unique);
  kernel.getBody().emplaceBlock();
  return kernel;
}

/// Copies an assign phase to the end of a kernel.
static AssignOp copyAssign(AssignOp assign, KernelOp kernel) {
  OpBuilder builder = OpBuilder::atBlockEnd(kernel.getBodyBlock());
  auto copy = cast<AssignOp>(builder.clone(*assign));
  copy.setStage(assign->getParentOfType<StageOp>().getSymName());
  return copy;
}

/// The sources whose primitives can reach a stage without waiting on the way;
/// fails if a stage on the way, or the stage itself, collects.
static LogicalResult collectSources(StageOp stage,
                                    llvm::SmallDenseSet<int64_t> &numbers,
                                    llvm::SmallPtrSetImpl<Operation *> &seen) {
  if (!seen.insert(stage).second)
    return success();
  if (stage.collects())
    return failure();
  auto name = FlatSymbolRefAttr::get(stage.getSymNameAttr());
  PipelineOp pipeline = getPipeline(stage);
  for (auto [number, source] : llvm::enumerate(pipeline.getOps<SourceOp>()))
    if (source.getStageAttr() == name)
      numbers.insert(number);
  for (auto edge : pipeline.getOps<EdgeOp>())
    if (edge.getConsumerAttr() == name &&
        failed(collectSources(
            lookupInPipeline<StageOp>(edge, edge.getProducerAttr()), numbers,
            seen)))
      return failure();
  return success();
}

/// Whether all that `writer` writes is there when `reader`'s primitives are
/// assigned: they all come from sources, which the reader's kernel places once
/// its wait is over and which come after the writer's.
static bool isWrittenBefore(StageOp writer, StageOp reader) {
  auto name = FlatSymbolRefAttr::get(reader.getSymNameAttr());
  auto writerName = FlatSymbolRefAttr::get(writer.getSymNameAttr());
  PipelineOp pipeline = getPipeline(reader);
  ScheduleOp schedule = reader.getSchedule();
  if (!schedule || !schedule.getEndStageAttr() ||
      !llvm::is_contained(schedule.getEndStageAttr(), Attribute(writerName)))
    return false;
  for (auto edge : pipeline.getOps<EdgeOp>())
    if (edge.getConsumerAttr() == name)
      return false;
  llvm::SmallDenseSet<int64_t> before;
  llvm::SmallPtrSet<Operation *, 8> seen;
  if (failed(collectSources(writer, before, seen)))
    return false;
  for (auto [number, source] : llvm::enumerate(pipeline.getOps<SourceOp>()))
    if (source.getStageAttr() == name)
      for (int64_t earlier : before)
        if (earlier >= int64_t(number))
          return false;
  return true;
}

/// An assign phase must not see what it reads change.
static LogicalResult checkAssignReads(PipelineOp pipeline) {
  llvm::DenseMap<Attribute, SmallVector<Operation *>> writes;
  pipeline.walk([&](Operation *op) {
    if (auto [state, kind] = getStateAccess(op);
        state && kind != StateAccess::reads)
      writes[state].push_back(op);
  });
  WalkResult result = pipeline.walk([&](StateAccessOpInterface read) {
    if (!read->getParentOfType<AssignOp>())
      return WalkResult::advance();
    StageOp reader = getPhaseStage(read);
    for (Operation *write : writes.lookup(read.getAccessedState())) {
      StageOp writer = getPhaseStage(write);
      if (isWrittenBefore(writer, reader))
        continue;
      InFlightDiagnostic error =
          read->emitError("expected the assign phase of stage '")
          << getCppName(reader) << "' to read what is complete when its "
          << "primitives arrive, but stage '" << getCppName(writer)
          << "' may still write " << read.getAccessedState();
      error.attachNote(write->getLoc()) << "it is written here";
      return WalkResult::interrupt();
    }
    return WalkResult::advance();
  });
  return failure(result.wasInterrupted());
}

/// Whether an assign phase only says that each primitive is in the one bin that
/// there is, which holds without it.
static bool isTrivial(AssignOp assign, StageOp stage) {
  bool assigned = false;
  for (Operation &op : assign.getBody().front().without_terminator()) {
    auto to = dyn_cast<AssignToOp>(op);
    bool isFirstBin = to && matchPattern(to.getBin(), m_Zero());
    if (isFirstBin || isa<AssignPreviousOp, AssignAllOp>(op))
      assigned = true;
    else if (!isMemoryEffectFree(&op))
      return false;
  }
  return assigned && stage.isWholeDomain();
}

void FormKernelsPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  if (failed(checkAssignReads(pipeline)))
    return signalPassFailure();
  for (auto stage : pipeline.getOps<StageOp>())
    if (AssignOp assign = stage.getAssign(); assign && isTrivial(assign, stage))
      assign.erase();
  OpBuilder builder = OpBuilder::atBlockEnd(pipeline.getBodyBlock());
  SmallVector<StageOp> stages(pipeline.getOps<StageOp>());
  SmallVector<SourceOp> sources(pipeline.getOps<SourceOp>());

  for (StageOp stage : stages) {
    ProcessOp process = stage.getProcess();
    if (!process)
      continue;
    auto name = FlatSymbolRefAttr::get(stage.getSymNameAttr());
    // A source's primitives are placed when the stage starts: its assign phase
    // may read what the stage waits for.
    for (auto [index, source] : llvm::enumerate(sources)) {
      if (source.getStageAttr() != name || !stage.getAssign())
        continue;
      KernelOp kernel =
          createKernel(builder, source.getLoc(),
                       "source_" + Twine(index) + "_" + stage.getSymName());
      copyAssign(stage.getAssign(), kernel).setSource(index);
    }
    KernelOp kernel =
        createKernel(builder, stage.getLoc(), "kernel_" + stage.getSymName());
    process->moveBefore(kernel.getBodyBlock(), kernel.getBodyBlock()->end());
    process.setStageAttr(name);
    for (auto edge : pipeline.getOps<EdgeOp>()) {
      if (edge.getProducerAttr() != name)
        continue;
      auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
      if (AssignOp assign = consumer.getAssign())
        copyAssign(assign, kernel).setPort(edge.getPort());
    }
  }
  for (StageOp stage : stages)
    if (AssignOp assign = stage.getAssign())
      assign.erase();
}
