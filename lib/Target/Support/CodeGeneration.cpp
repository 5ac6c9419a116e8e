// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM's optimizer and emission, for any machine.

#include "Piko/Target/CodeGeneration.h"

#include "llvm/ADT/ScopeExit.h"
#include "llvm/IR/DiagnosticInfo.h"
#include "llvm/IR/DiagnosticPrinter.h"
#include "llvm/IR/LegacyPassManager.h"
#include "llvm/MC/MCSubtargetInfo.h"
#include "llvm/MC/TargetRegistry.h"
#include "llvm/Passes/PassBuilder.h"
#include "llvm/Transforms/InstCombine/InstCombine.h"
#include "llvm/Transforms/Scalar/ADCE.h"
#include "llvm/Transforms/Scalar/EarlyCSE.h"
#include "llvm/Transforms/Scalar/SROA.h"
#include "llvm/Transforms/Scalar/SimplifyCFG.h"

using namespace llvm;

Expected<const Target *> piko::lookUpTarget(const Triple &triple) {
  std::string message;
  const Target *target = TargetRegistry::lookupTarget(triple, message);
  if (!target)
    return createStringError(message);
  return target;
}

bool piko::hasProcessor(const Target &target, const Triple &triple,
                        StringRef processor) {
  std::unique_ptr<MCSubtargetInfo> info(
      target.createMCSubtargetInfo(triple, "", ""));
  return info->isCPUStringValid(processor);
}

/// What LLVM finds by looking at pairs, of blocks or of live ranges, takes time
/// that grows with the square of a function. Of functions of more instructions
/// than these, far more than people write, it is left out: before they are
/// optimized, and after that.
static constexpr unsigned hugeText = 40000, hugeFunction = 15000;

static bool hasFunctionAbove(const Module &module, unsigned instructions) {
  return any_of(module, [&](const Function &function) {
    return function.getInstructionCount() > instructions;
  });
}

/// What takes time in proportion to the text.
static ModulePassManager buildLinearPipeline(PassBuilder &builder) {
  ModulePassManager passes =
      builder.buildO0DefaultPipeline(OptimizationLevel::O0);
  FunctionPassManager functions;
  functions.addPass(SROAPass(SROAOptions::ModifyCFG));
  functions.addPass(EarlyCSEPass());
  functions.addPass(InstCombinePass());
  functions.addPass(SimplifyCFGPass());
  functions.addPass(EarlyCSEPass());
  functions.addPass(ADCEPass());
  passes.addPass(createModuleToFunctionPassAdaptor(std::move(functions)));
  return passes;
}

static void optimize(Module &module, TargetMachine &machine,
                     const piko::OptimizerOptions &options,
                     ModulePassManager last) {
  static const OptimizationLevel levels[] = {
      OptimizationLevel::O0, OptimizationLevel::O1, OptimizationLevel::O2,
      OptimizationLevel::O3};
  LoopAnalysisManager loops;
  FunctionAnalysisManager functions;
  CGSCCAnalysisManager components;
  ModuleAnalysisManager modules;
  PipelineTuningOptions tuning;
  // As Clang has it.
  tuning.LoopVectorization = options.loopVectorize;
  tuning.SLPVectorization = options.slpVectorize && options.level >= 2;
  PassBuilder builder(&machine, tuning);
  builder.registerModuleAnalyses(modules);
  builder.registerCGSCCAnalyses(components);
  builder.registerFunctionAnalyses(functions);
  builder.registerLoopAnalyses(loops);
  builder.crossRegisterProxies(loops, functions, components, modules);
  OptimizationLevel level = levels[options.level];
  ModulePassManager passes = options.level == 0
                                 ? builder.buildO0DefaultPipeline(level)
                             : hasFunctionAbove(module, hugeText)
                                 ? buildLinearPipeline(builder)
                                 : builder.buildPerModuleDefaultPipeline(level);
  passes.addPass(std::move(last));
  passes.run(module, modules);
}

/// Instruction selection takes time that grows with the square of a block.
static constexpr unsigned hugeBlock = 4000, partOfBlock = 500;

static bool hasBlockAbove(const Module &module, unsigned instructions) {
  return any_of(module, [&](const Function &function) {
    return any_of(function, [&](const BasicBlock &block) {
      return block.size() > instructions;
    });
  });
}

static void divideBlock(BasicBlock *block) {
  while (block->size() > hugeBlock / 2)
    block = block->splitBasicBlock(
        std::next(block->getFirstInsertionPt(), partOfBlock));
}

/// Whether a module is to get its code without optimization, for which huge
/// blocks are divided: what merges them again does not run then.
static bool prepareHuge(Module &module) {
  bool hasBlocks = hasBlockAbove(module, hugeBlock);
  if (hasBlocks)
    for (Function &function : module)
      for (BasicBlock &block : make_early_inc_range(function))
        divideBlock(&block);
  return hasBlocks || hasFunctionAbove(module, hugeFunction);
}

namespace {
/// A level of code generation for as long as it lives.
class LowerLevel {
public:
  LowerLevel(TargetMachine &machine, Module &module)
      : machine(machine), before(machine.getOptLevel()) {
    if (prepareHuge(module))
      machine.setOptLevel(CodeGenOptLevel::None);
  }
  ~LowerLevel() { machine.setOptLevel(before); }

private:
  TargetMachine &machine;
  CodeGenOptLevel before;
};
} // namespace

namespace {
/// Keeps what a back end refuses: LLVM would print it, and end the process.
class RefusalKeeper : public DiagnosticHandler {
public:
  explicit RefusalKeeper(std::string &refusal) : refusal(refusal) {}
  bool handleDiagnostics(const DiagnosticInfo &info) override {
    if (info.getSeverity() == DS_Error && refusal.empty()) {
      raw_string_ostream stream(refusal);
      DiagnosticPrinterRawOStream printer(stream);
      info.print(printer);
    }
    return true;
  }

private:
  std::string &refusal;
};
} // namespace

Expected<std::string> piko::emitCode(Module &module, TargetMachine &machine,
                                     const piko::OptimizerOptions &options,
                                     CodeGenFileType type,
                                     ModulePassManager last) {
  // Nobody reads what it calls its values.
  LLVMContext &context = module.getContext();
  context.setDiscardValueNames(true);
  std::string refusal;
  context.setDiagnosticHandler(std::make_unique<RefusalKeeper>(refusal));
  auto restore =
      make_scope_exit([&] { context.setDiagnosticHandler(nullptr); });
  module.setTargetTriple(machine.getTargetTriple());
  module.setDataLayout(machine.createDataLayout());
  optimize(module, machine, options, std::move(last));
  LowerLevel level(machine, module);
  SmallString<0> code;
  raw_svector_ostream stream(code);
  legacy::PassManager passes;
  if (machine.addPassesToEmitFile(passes, stream, nullptr, type))
    return createStringError("cannot make code for " +
                             machine.getTargetTriple().str());
  passes.run(module);
  if (!refusal.empty())
    return createStringError("cannot make code for " +
                             machine.getTargetTriple().str() + ": " + refusal);
  return std::string(code);
}
