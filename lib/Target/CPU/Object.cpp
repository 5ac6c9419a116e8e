// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM IR to machine code for a CPU.

#include "Piko/Target/Object.h"

#include "Passes/BroadcastLoads.h"
#include "Passes/CompressStores.h"
#include "Passes/LowerArithmetic.h"
#include "Passes/LowerPermutations.h"
#include "Passes/SelectBits.h"
#include "Passes/SplitRows.h"
#include "Passes/StoreLanes.h"
#include "Passes/TransposeGathers.h"
#include "Passes/UniformGathers.h"
#include "Passes/WidenGathers.h"
#include "Passes/WidenMasks.h"
#include "Piko/Target/CodeGeneration.h"
#include "Piko/Target/KeepZeros.h"

#include "llvm/ExecutionEngine/Orc/ExecutionUtils.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/Target/TargetMachine.h"
#include "llvm/Transforms/Instrumentation/AddressSanitizer.h"
#include "llvm/Transforms/Instrumentation/ThreadSanitizer.h"

#include <map>

using namespace llvm;
using namespace piko;

static Expected<std::unique_ptr<TargetMachine>>
createMachine(const piko::TargetOptions &options) {
  Expected<Triple> triple = resolveTriple(options.arch);
  if (!triple)
    return triple.takeError();
  Expected<const Target *> target = initializeTarget(*triple);
  if (!target)
    return target.takeError();
  Expected<Processor> processor = resolveProcessor(options.cpu, *triple);
  if (!processor)
    return processor.takeError();
  llvm::TargetOptions flags;
  // JITCode has no thread-local storage of the system: the reference executor's
  // variables would lie in memory that is not theirs.
  flags.EmulatedTLS = true;
  // Contraction would give bits that other targets do not.
  flags.AllowFPOpFusion = FPOpFusion::Strict;
  auto level = options.optLevel == 0   ? CodeGenOptLevel::None
               : options.optLevel == 1 ? CodeGenOptLevel::Less
                                       : CodeGenOptLevel::Default;
  return std::unique_ptr<TargetMachine>((*target)->createTargetMachine(
      *triple, processor->name, processor->features, flags, Reloc::PIC_,
      CodeModel::Small, level));
}

/// Asks for the instrumentation of all functions, which also keeps the
/// optimizer from accesses that the program does not make.
static void markForSanitizer(Module &module, Sanitizer sanitizer) {
  if (sanitizer == Sanitizer::None)
    return;
  for (Function &function : module)
    if (!function.isDeclaration())
      function.addFnAttr(sanitizer == Sanitizer::Address
                             ? Attribute::SanitizeAddress
                             : Attribute::SanitizeThread);
}

namespace {
/// Keeps redzones from constants: they would be registered, and outlive
/// JITCode.
struct LeaveOutGlobals : PassInfoMixin<LeaveOutGlobals> {
  PreservedAnalyses run(Module &module, ModuleAnalysisManager &) {
    for (GlobalVariable &variable : module.globals()) {
      GlobalValue::SanitizerMetadata metadata;
      metadata.NoAddress = true;
      variable.setSanitizerMetadata(metadata);
    }
    return PreservedAnalyses::all();
  }
};
} // namespace

/// What runs behind the optimizer: instructions of the machine that it does not
/// know, and the instrumentation, without a constructor, as the program has
/// initialised the runtime.
static ModulePassManager makeLastPasses(const TargetMachine &machine,
                                        int optLevel, Sanitizer sanitizer) {
  ModulePassManager passes;
  passes.addPass(LowerArithmeticPass(machine));
  if (!machine.getTargetTriple().isX86())
    passes.addPass(createModuleToFunctionPassAdaptor(KeepZerosPass()));
  if (machine.getTargetTriple().isX86() && optLevel > 0) {
    passes.addPass(createModuleToFunctionPassAdaptor(SelectBitsPass()));
    passes.addPass(
        createModuleToFunctionPassAdaptor(CompressStoresPass(machine)));
    passes.addPass(createModuleToFunctionPassAdaptor(SplitRowsPass(machine)));
    passes.addPass(createModuleToFunctionPassAdaptor(WidenMasksPass(machine)));
    passes.addPass(
        createModuleToFunctionPassAdaptor(UniformGathersPass(machine)));
    passes.addPass(
        createModuleToFunctionPassAdaptor(TransposeGathersPass(machine)));
    passes.addPass(
        createModuleToFunctionPassAdaptor(WidenGathersPass(machine)));
    passes.addPass(createModuleToFunctionPassAdaptor(StoreLanesPass(machine)));
    passes.addPass(
        createModuleToFunctionPassAdaptor(BroadcastLoadsPass(machine)));
  }
  if (sanitizer == Sanitizer::Thread)
    passes.addPass(createModuleToFunctionPassAdaptor(ThreadSanitizerPass()));
  if (sanitizer == Sanitizer::Address) {
    passes.addPass(LeaveOutGlobals());
    passes.addPass(AddressSanitizerPass(
        {}, /*UseGlobalGC=*/false,
        /*UseOdrIndicator=*/false, AsanDtorKind::None, AsanCtorKind::None));
  }
  return passes;
}

/// ORC runs the initialisers of an object that it has not seen as IR only where
/// they are one function of such a name.
static void gatherInitializers(Module &module) {
  std::map<unsigned, std::vector<Function *>> initializers; // by priority
  for (orc::CtorDtorIterator::Element element : orc::getConstructors(module))
    if (element.Func)
      initializers[element.Priority].push_back(element.Func);
  if (initializers.empty())
    return;
  auto *function = Function::Create(
      FunctionType::get(Type::getVoidTy(module.getContext()), false),
      GlobalValue::ExternalLinkage,
      "__orc_init_func." + module.getModuleIdentifier(), module);
  IRBuilder<> builder(
      BasicBlock::Create(module.getContext(), "entry", function));
  for (auto &[priority, group] : initializers)
    for (Function *initializer : group)
      builder.CreateCall(initializer);
  builder.CreateRetVoid();
  module.getGlobalVariable("llvm.global_ctors")->eraseFromParent();
}

Expected<std::string> piko::generateCode(Module &module,
                                         const piko::TargetOptions &options,
                                         CodeFormat format) {
  Expected<std::unique_ptr<TargetMachine>> machine = createMachine(options);
  if (!machine)
    return machine.takeError();
  module.setPICLevel(PICLevel::BigPIC);
  gatherInitializers(module);
  markForSanitizer(module, options.sanitizer);
  prepareArithmetic(module, **machine);
  lowerPermutations(module, **machine);
  return emitCode(
      module, **machine,
      {.level = options.optLevel,
       .loopVectorize = options.loopVectorize,
       .slpVectorize = options.slpVectorize},
      format == CodeFormat::Object ? CodeGenFileType::ObjectFile
                                   : CodeGenFileType::AssemblyFile,
      makeLastPasses(**machine, options.optLevel, options.sanitizer));
}
