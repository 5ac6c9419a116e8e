// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-kernels: BASELINE kernels. A stage's process phase goes together
// with the assign phases of the stages that it feeds.

#include "Piko/Transforms/Passes.h"

#include "mlir/IR/IRMapping.h"

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
  ++kernels;
  return kernel;
}

/// Copies an assign phase to the end of a kernel.
static AssignOp copyAssign(AssignOp assign, KernelOp kernel) {
  OpBuilder builder = OpBuilder::atBlockEnd(kernel.getBodyBlock());
  auto copy = cast<AssignOp>(builder.clone(*assign));
  copy.setStage(assign->getParentOfType<StageOp>().getSymName());
  return copy;
}

void FormKernelsPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
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
