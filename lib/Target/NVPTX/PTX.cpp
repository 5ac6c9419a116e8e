// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM IR to PTX.

#include "Piko/Target/PTX.h"
#include "Piko/Target/Approximation.h"
#include "Piko/Target/CodeGeneration.h"
#include "Piko/Target/KeepZeros.h"

#include "llvm/IR/IntrinsicsNVPTX.h"
#include "llvm/MC/TargetRegistry.h"
#include "llvm/Support/TargetSelect.h"

using namespace llvm;
using namespace piko;

static constexpr const char *defaultProcessor = "sm_90",
                            *nvptx = "nvptx64-nvidia-cuda";

static Expected<const Target *> findTarget(const Triple &triple,
                                           StringRef processor) {
  LLVMInitializeNVPTXTargetInfo();
  LLVMInitializeNVPTXTarget();
  LLVMInitializeNVPTXTargetMC();
  LLVMInitializeNVPTXAsmPrinter();
  Expected<const Target *> target = lookUpTarget(triple);
  if (target && !hasProcessor(**target, triple, processor))
    return createStringError("there is no processor '" + processor +
                             "' for PTX; expected a name such as '" +
                             defaultProcessor + "'");
  return target;
}

std::string piko::getPTXLayout() { return Triple(nvptx).computeDataLayout(); }

Error piko::checkChip(StringRef chip) {
  return findTarget(Triple(nvptx), chip).takeError();
}

/// What asks which lanes are active came with PTX 6.2; every driver that knows
/// CUDA 10 takes 6.3. LLVM has less for chips before sm_75.
static StringRef getFeatures(StringRef processor) {
  unsigned chip = 0;
  processor.consume_front("sm_");
  return !processor.consumeInteger(10, chip) && chip < 75 ? "+ptx63" : "";
}

static Expected<std::unique_ptr<TargetMachine>>
createMachine(StringRef processor, int optLevel) {
  Triple triple(nvptx);
  Expected<const Target *> target = findTarget(triple, processor);
  if (!target)
    return target.takeError();
  llvm::TargetOptions flags;
  // Contraction would give bits that a CPU does not.
  flags.AllowFPOpFusion = FPOpFusion::Strict;
  auto level = optLevel == 0 ? CodeGenOptLevel::None : CodeGenOptLevel::Default;
  return std::unique_ptr<TargetMachine>(
      (*target)->createTargetMachine(triple, processor, getFeatures(processor),
                                     flags, std::nullopt, std::nullopt, level));
}

/// By instructions; kernels have no vectors of floats.
static Value *writeApproximation(IRBuilderBase &builder, Approximation kind,
                                 Value *x) {
  Value *first = builder.CreateIntrinsic(
      kind == Approximation::Reciprocal ? Intrinsic::nvvm_rcp_approx_ftz_f
                                        : Intrinsic::nvvm_rsqrt_approx_ftz_f,
      {x});
  return refine(builder, kind, x, first);
}

/// The optimizer may join accesses to 16 bytes, and takes it that the variable
/// is aligned for them: so it shall be from the start.
static void alignBlockMemory(Module &module) {
  constexpr unsigned sharedSpace = 3;
  for (GlobalVariable &variable : module.globals())
    if (variable.getAddressSpace() == sharedSpace) {
      uint64_t bytes =
          module.getDataLayout().getTypeAllocSize(variable.getValueType());
      Align wanted(std::min<uint64_t>(
          16, llvm::bit_floor(std::max<uint64_t>(bytes, 1))));
      variable.setAlignment(std::max(wanted, variable.getAlign().valueOrOne()));
    }
}

Expected<std::string> piko::generatePTX(Module &module, StringRef processor,
                                        int optLevel) {
  auto machine =
      createMachine(processor.empty() ? defaultProcessor : processor, optLevel);
  if (!machine)
    return machine.takeError();
  replaceApproximations(module, writeApproximation);
  alignBlockMemory(module);
  ModulePassManager last;
  last.addPass(createModuleToFunctionPassAdaptor(KeepZerosPass()));
  return emitCode(module, **machine, {.level = optLevel},
                  CodeGenFileType::AssemblyFile, std::move(last));
}
