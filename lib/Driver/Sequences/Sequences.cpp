// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The sequences of passes that the tools share.

#include "Piko/Driver/Sequences.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Canonicalization.h"
#include "Piko/Transforms/Passes.h"
#include "Sequences/SequenceParts.h"

#include "mlir/Conversion/MathToLLVM/MathToLLVM.h"
#include "mlir/Conversion/OpenMPToLLVM/ConvertOpenMPToLLVM.h"
#include "mlir/Conversion/ReconcileUnrealizedCasts/ReconcileUnrealizedCasts.h"
#include "mlir/Conversion/UBToLLVM/UBToLLVM.h"
#include "mlir/Conversion/VectorToLLVM/ConvertVectorToLLVMPass.h"
#include "mlir/Pass/PassOptions.h"
#include "mlir/Pass/PassRegistry.h"
#include "mlir/Transforms/Passes.h"

using namespace mlir;
using namespace piko;

void piko::addCleanUp(OpPassManager &passes) {
  passes.addPass(createCanonicalizerPass(
      GreedyRewriteConfig().setListener(getProbabilityKeeper()),
      getInexactPatterns()));
  passes.addPass(createCSEPass());
}

void piko::addCheckSequence(OpPassManager &passes,
                            const CheckOptions &options) {
  AddChecksOptions checks;
  checks.numbers.assign(options.numbers.begin(), options.numbers.end());
  passes.addPass(createAddChecks(checks));
}

static void addFixedConstants(OpPassManager &passes,
                              const SynthesisOptions &options) {
  if (options.fix.empty())
    return;
  FixConstantsOptions constants;
  constants.values.assign(options.fix.begin(), options.fix.end());
  passes.nest<PipelineOp>().addPass(createFixConstants(constants));
  addCleanUp(passes);
}

void piko::addSynthesisSequence(OpPassManager &passes,
                                const SynthesisOptions &options) {
  // What is counted is the work that is left of the text; else precision comes
  // first, because what is folded is rounded.
  bool counts = options.count == Counting::Work;
  if (counts) {
    addFixedConstants(passes, options);
    passes.nest<PipelineOp>().addPass(createCountWork());
  }
  addCleanUp(passes);
  if (!options.directives.empty()) {
    SetDirectivesOptions directives;
    directives.directives.assign(options.directives.begin(),
                                 options.directives.end());
    passes.nest<PipelineOp>().addPass(createSetDirectives(directives));
  }
  // Before all else: proofs are about what is computed. It cannot be left out,
  // as results depend on it.
  passes.nest<PipelineOp>().addPass(createApplyPrecision());
  if (!counts)
    addFixedConstants(passes, options);
  // A field that a loop reads is the same field after it.
  passes.addPass(createLoopInvariantCodeMotionPass());
  addCleanUp(passes);
  passes.addPass(createNormalizeLoops());
  addCleanUp(passes);
  if (options.has("uplift-pixel-loops")) {
    passes.nest<PipelineOp>().addPass(createUpliftPixelLoops());
    addCleanUp(passes);
  }
  {
    OpPassManager &pipeline = passes.nest<PipelineOp>();
    pipeline.addPass(createOrderStages());
    if (options.ranks)
      pipeline.addPass(createBinUpdates());
    if (options.has("prune"))
      pipeline.addPass(createPruneUnreached());
    if (options.has("pre-schedule"))
      pipeline.addPass(createPreSchedule());
    if (options.has("infer-directives"))
      pipeline.addPass(createInferDirectives());
    if (options.has("fuse-stages"))
      pipeline.addPass(createFuseStages());
  }
  addCleanUp(passes);
  if (options.has("test-early"))
    passes.nest<PipelineOp>().addPass(createTestEarly());
  if (options.has("prune"))
    passes.addPass(createPrune());
  OpPassManager &pipeline = passes.nest<PipelineOp>();
  if (options.has("own-pixels"))
    pipeline.addPass(createOwnPixels());
  if (options.has("eliminate-schedules"))
    pipeline.addPass(createEliminateSchedules());
  if (options.has("prove-bounds"))
    pipeline.addPass(createProveBounds());
  pipeline.addPass(createFormKernels());
  if (options.has("fuse-kernels"))
    pipeline.addPass(createFuseKernels());
  pipeline.addPass(createFormProgram());
  if (options.has("form-strips"))
    pipeline.addPass(createFormStrips());
  if (options.ranks)
    pipeline.addPass(createPartitionProgram());
}

void piko::addMachineSequence(OpPassManager &passes,
                              const SynthesisOptions &options) {
  OpPassManager &pipeline = passes.nest<PipelineOp>();
  pipeline.addPass(createFormProgram()); // of what was written by hand
  pipeline.addPass(createFormWork());
  addCleanUp(passes);
  passes.nest<PipelineOp>().addPass(createForwardStores());
  if (options.has("form-gbuffer") && !options.ranks) {
    passes.addPass(createFormGBuffer());
    addCleanUp(passes);
  }
  // Last: it counts what is left to do.
  passes.nest<PipelineOp>().addPass(createMapLanes());
}

/// Parallel loops with barriers that have up to this many iterations are left
/// to vectors.
static void addUnitSequence(OpPassManager &passes, int64_t lockstep) {
  OpPassManager &pipeline = passes.nest<PipelineOp>();
  pipeline.addPass(createFormUnits());
  SplitLoopsOptions loops;
  loops.lockstep = lockstep;
  pipeline.addPass(createSplitLoops(loops));
  addCleanUp(passes);
}

void piko::addUnitSequence(OpPassManager &passes) {
  ::addUnitSequence(passes, /*lockstep=*/0);
}

void piko::addUnitsToLoops(OpPassManager &passes,
                           const SynthesisOptions &options) {
  passes.nest<PipelineOp>().addPass(createFormProgram());
  if (options.has("hoist-loads"))
    passes.nest<PipelineOp>().addPass(createHoistLoads());
  if (options.has("if-convert"))
    passes.nest<PipelineOp>().addPass(createIfConvert());
  if (options.has("prefetch"))
    passes.nest<PipelineOp>().addPass(createPrefetch());
  if (options.has("hoist-bounds"))
    passes.nest<PipelineOp>().addPass(createHoistBounds());
  passes.nest<PipelineOp>().addPass(createConvertPikoToSCF());
  addCleanUp(passes);
  if (options.has("merge-bounds")) {
    passes.nest<PipelineOp>().addPass(createMergeBounds());
    addCleanUp(passes);
  }
  if (options.has("combine-bounds")) {
    passes.nest<PipelineOp>().addPass(createCombineBounds());
    addCleanUp(passes);
  }
  if (options.has("thread-jumps")) {
    passes.nest<PipelineOp>().addPass(createThreadJumps());
    addCleanUp(passes);
  }
}

void piko::addScalarSequence(OpPassManager &passes,
                             const SynthesisOptions &options) {
  if (options.has("defer-shading")) {
    passes.nest<PipelineOp>().addPass(createDeferShading());
    addCleanUp(passes);
  }
  if (options.has("form-tiles"))
    passes.nest<PipelineOp>().addPass(createFormTiles({.loads = true}));
  // The widest vectors that there are: others are made of two or four.
  ::addUnitSequence(
      passes, options.has("vectorize") && options.has("lockstep") ? 16 : 0);
  if (options.has("reduce-updates")) {
    passes.addPass(createReduceUpdates());
    addCleanUp(passes);
  }
  if (options.has("privatize"))
    passes.nest<PipelineOp>().addPass(createPrivatize());
  addUnitsToLoops(passes, options);
}

void piko::addVectorSequence(OpPassManager &passes,
                             const SynthesisOptions &options,
                             const CPUOptions &cpu) {
  if (options.has("narrow-integers")) {
    NarrowIntegersOptions narrow;
    narrow.laneCount = options.has("vectorize") ? cpu.lanes : 0;
    passes.nest<PipelineOp>().addPass(createNarrowIntegers(narrow));
    addCleanUp(passes);
  }
  if (options.has("vectorize")) {
    OpPassManager &pipeline = passes.nest<PipelineOp>();
    if (options.has("lockstep"))
      pipeline.addPass(createLockstep());
    PlanVectorsOptions plan;
    plan.laneCount = cpu.lanes;
    plan.window = options.mappingWindow;
    plan.flattens = options.has("flatten-nests");
    plan.mergeGain = options.has("merge-nests") ? cpu.mergeGain : 0;
    plan.compacts = options.has("compact-loops");
    plan.sensitivities = cpu.printsSensitivities;
    // What one lane after the other does may have vectors of its own, and lanes
    // of these may take turns.
    constexpr int depth = 3;
    for (int level = 0; level < depth; ++level) {
      plan.inTurns = level > 0;
      pipeline.addPass(createPlanVectors(plan));
      pipeline.addPass(createVectorize({/*marksTurns=*/level + 1 < depth}));
    }
    addCleanUp(passes);
  }
  if (options.has("vectorize") && options.has("distribute-loops")) {
    passes.nest<PipelineOp>().addPass(createDistributeLoops({cpu.lanes}));
    addCleanUp(passes);
  }
  if (options.has("vectorize") && options.has("reduce-strength")) {
    passes.nest<PipelineOp>().addPass(createReduceStrength({cpu.lanes}));
    addCleanUp(passes);
  }
  if (options.has("merge-gathers")) {
    passes.nest<PipelineOp>().addPass(createMergeGathers());
    addCleanUp(passes);
  }
  if (options.has("pair-gathers")) {
    passes.nest<PipelineOp>().addPass(createPairGathers());
    addCleanUp(passes);
  }
  if (options.has("tabulate-invariants")) {
    passes.nest<PipelineOp>().addPass(createTabulateInvariants());
    addCleanUp(passes);
  }
  if (options.has("unroll-and-jam")) {
    passes.nest<PipelineOp>().addPass(createUnrollAndJam());
    addCleanUp(passes);
  }
  if (options.count == Counting::Lanes)
    passes.nest<PipelineOp>().addPass(createCountLanes());
  if (options.has("vectorize") && options.has("peel-vectors")) {
    passes.nest<PipelineOp>().addPass(createPeelVectors());
    addCleanUp(passes);
  }
  if (options.has("unswitch-versions"))
    passes.nest<PipelineOp>().addPass(createUnswitchVersions());
  passes.nest<PipelineOp>().addPass(createConvertPikoToOpenMP());
  passes.addPass(createConvertPikoToLLVM());
  addCleanUp(passes);
}

void piko::addCPUSequence(OpPassManager &passes,
                          const SynthesisOptions &options,
                          const CPUOptions &cpu) {
  addScalarSequence(passes, options);
  addVectorSequence(passes, options, cpu);
}

void piko::addLLVMSequence(OpPassManager &passes) {
  passes.addPass(createConvertSCFToControlFlowInReverse());
  passes.addPass(createConvertVectorToLLVMPass());
  passes.addPass(createConvertMathToLLVMPass());
  passes.addPass(createUBToLLVMConversionPass());
  passes.addPass(createConvertOpenMPToLLVMPass());
  passes.addPass(createReconcileUnrealizedCastsPass());
}

namespace {
struct CPUSequenceOptions : PassPipelineOptions<CPUSequenceOptions> {
  Option<int64_t> lanes{*this, "lanes",
                        llvm::cl::desc("Lanes of a vector: 4, 8 or 16"),
                        llvm::cl::init(CPUOptions().lanes)};
  Option<double> window{*this, "window",
                        llvm::cl::desc("Within what factor estimates have a "
                                       "loop held in two versions; 1: none"),
                        llvm::cl::init(1)};
  Option<bool> sensitivities{*this, "sensitivities",
                             llvm::cl::desc("Print what these estimates depend "
                                            "on, as lines of JSON"),
                             llvm::cl::init(false)};
  Option<double> mergeGain{
      *this, "merge-gain",
      llvm::cl::desc("Merge nests of loops where that is expected to take no "
                     "more than this share of what else does"),
      llvm::cl::init(CPUOptions().mergeGain)};
};

struct GridSequenceOptions : PassPipelineOptions<GridSequenceOptions> {
  ListOption<std::string> without{*this, "without",
                                  llvm::cl::desc("Passes to leave out")};
};

struct GPUSequenceOptions : PassPipelineOptions<GPUSequenceOptions> {
  Option<int64_t> threads{*this, "threads",
                          llvm::cl::desc("Threads of a block"),
                          llvm::cl::init(0)};
};
} // namespace

void piko::registerSequences() {
  PassPipelineRegistration<GridSequenceOptions>(
      "piko-to-grids", "From the machine level to grids of blocks and threads",
      [](OpPassManager &passes, const GridSequenceOptions &options) {
        addGridSequence(passes, {.without = {options.without.begin(),
                                             options.without.end()}});
      });
  PassPipelineRegistration<GPUSequenceOptions>(
      "piko-to-gpu", "From the machine level to kernels for a GPU",
      [](OpPassManager &passes, const GPUSequenceOptions &options) {
        addGPUSequence(passes, {.threads = options.threads});
      });
  PassPipelineRegistration<>("piko-gpu-to-nvvm",
                             "From kernels for a GPU to llvm and nvvm",
                             addNVVMSequence);
  PassPipelineRegistration<>(
      "piko-synthesize", "From the authored to the kernels level",
      [](OpPassManager &passes) { addSynthesisSequence(passes); });
  PassPipelineRegistration<>(
      "piko-to-machine", "From the kernels to the machine level",
      [](OpPassManager &passes) { addMachineSequence(passes); });
  PassPipelineRegistration<>(
      "piko-to-units", "From the machine level to loops over units of work",
      addUnitSequence);
  PassPipelineRegistration<CPUSequenceOptions>(
      "piko-to-cpu", "From the machine level to upstream dialects",
      [](OpPassManager &passes, const CPUSequenceOptions &options) {
        SynthesisOptions synthesis;
        synthesis.mappingWindow = options.window;
        addCPUSequence(passes, synthesis,
                       {.lanes = options.lanes,
                        .printsSensitivities = options.sensitivities,
                        .mergeGain = options.mergeGain});
      });
  PassPipelineRegistration<>("piko-cpu-to-llvm",
                             "From upstream dialects to llvm and omp",
                             addLLVMSequence);
}
