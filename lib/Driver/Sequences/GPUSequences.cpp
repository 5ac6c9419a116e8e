// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The sequences of passes to kernels for a GPU. NoGPU.cpp takes their place in
// a build without them.

#include "Piko/Driver/Sequences.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Transforms/Passes.h"
#include "Sequences/SequenceParts.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/GPU/Transforms/Passes.h"
#include "mlir/Dialect/LLVMIR/NVVMDialect.h"
#include "mlir/Target/LLVMIR/Dialect/NVVM/NVVMToLLVMIRTranslation.h"

using namespace mlir;
using namespace piko;

void piko::registerGPUDialects(DialectRegistry &registry) {
  registry.insert<NVVM::NVVMDialect>();
  registerNVVMDialectTranslation(registry);
}

void piko::addGridSequence(OpPassManager &passes,
                           const SynthesisOptions &synthesis) {
  bool isOfPipeline =
      passes.getOpAnchorName() == PipelineOp::getOperationName();
  OpPassManager &pipeline = isOfPipeline ? passes : passes.nest<PipelineOp>();
  pipeline.addPass(createFormGrids());
  pipeline.addPass(createSharePixels());
  pipeline.addPass(createShareLoops());
  if (synthesis.has("compact-work"))
    pipeline.addPass(createCompactWork());
  if (synthesis.has("split-rare"))
    pipeline.addPass(createSplitRare());
  pipeline.addPass(createMapBlocks());
  pipeline.addPass(createTakeUnits());
}

void piko::addGPUSequence(OpPassManager &passes, const GPUOptions &options,
                          const SynthesisOptions &synthesis) {
  if (synthesis.has("reduce-by-atomics")) {
    passes.addPass(createReduceByAtomics());
    addCleanUp(passes);
  }
  MapThreadsOptions mapping;
  mapping.threads = options.threads;
  mapping.collapses = synthesis.has("collapse-pixels");
  mapping.groups = synthesis.has("group-updates");
  mapping.counts = synthesis.has("share-by-count");
  OpPassManager &pipeline = passes.nest<PipelineOp>();
  if (synthesis.has("share-appends"))
    pipeline.addPass(createShareAppends());
  pipeline.addPass(createMapThreads(mapping));
  pipeline.addPass(createExpandRemainders());
  addGridSequence(pipeline, synthesis);
  addCleanUp(passes);
  addUnitsToLoops(passes, SynthesisOptions::none());
  // Each test that is left writes an entry of its own.
  passes.nest<PipelineOp>().addPass(createMergeBounds());
  addCleanUp(passes);
  addVectorSequence(passes, SynthesisOptions::none(), {});
  // Or constants would be arguments.
  passes.addPass(createGpuLaunchSinkIndexComputationsPass());
  passes.addPass(createGpuKernelOutliningPass());
  addCleanUp(passes);
  if (options.target != GPUTarget::None)
    addLaunchSequence(passes, options);
}

void piko::addLaunchSequence(OpPassManager &passes, const GPUOptions &options) {
  addNVVMSequence(passes);
  if (options.target == GPUTarget::CUDA) {
    passes.addPass(createConvertGPUToCUDA());
  } else {
    ConvertGPUToEmulatorOptions emulation;
    emulation.seed = options.seed;
    emulation.blocks = options.blocks;
    passes.addPass(createConvertGPUToEmulator(emulation));
  }
  addCleanUp(passes);
}

void piko::addNVVMSequence(OpPassManager &passes) {
  OpPassManager &kernels = passes.nest<gpu::GPUModuleOp>();
  kernels.addPass(createReloadInputs());
  kernels.addPass(createOutlineRareWork());
  kernels.addPass(createSpillToBlock());
  kernels.addPass(createConvertSCFToControlFlowInReverse());
  kernels.addPass(createConvertGPUToExactNVVM());
  addCleanUp(kernels);
}
