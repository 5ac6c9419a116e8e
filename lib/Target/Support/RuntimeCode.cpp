// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The runtime's bitcode, linked and inlined:
//   1. read what was made of runtime/inline, and forget for which machine;
//   2. tag its accesses with TBAA, as convert-piko-to-llvm does those that it
//      writes: on a CPU they are the writer's;
//   3. link what the module declares;
//   4. inline each call, so that LLVM's passes see the code where they would
//      see it had the conversion written it.

#include "Piko/Target/RuntimeCode.h"

#include "Piko/Conversion/AliasNames.h"

#include "llvm/Bitcode/BitcodeReader.h"
#include "llvm/IR/AttributeMask.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/MDBuilder.h"
#include "llvm/Linker/Linker.h"
#include "llvm/Transforms/Utils/Cloning.h"

using namespace llvm;
using namespace piko;

/// Made by the build (cmake/EmbedBitcode.cmake).
extern const StringRef cpuRuntimeCode, gpuRuntimeCode;

/// Nor is anything said of loops: their own module's build left them as they
/// are.
static void forgetMachine(Module &library, const Module &user) {
  library.setTargetTriple(user.getTargetTriple());
  library.setDataLayout(user.getDataLayout());
  for (NamedMDNode &metadata : make_early_inc_range(library.named_metadata()))
    metadata.eraseFromParent();
  for (Function &function : library) {
    AttributeMask machine;
    for (Attribute attribute : function.getAttributes().getFnAttrs())
      if (attribute.isStringAttribute())
        machine.addAttribute(attribute.getKindAsString());
    function.removeFnAttrs(machine);
    for (Instruction &each : instructions(function))
      each.setMetadata(LLVMContext::MD_loop, nullptr);
  }
}

static void tagAccesses(Module &library) {
  MDBuilder builder(library.getContext());
  MDNode *root = builder.createTBAARoot(aliasNames::root),
         *runtime = builder.createTBAAScalarTypeNode(aliasNames::runtime, root),
         *writer =
             builder.createTBAAScalarTypeNode(aliasNames::writer, runtime);
  auto tag = [&](Instruction &instruction, MDNode *type) {
    instruction.setMetadata(LLVMContext::MD_tbaa,
                            builder.createTBAAStructTagNode(type, type, 0));
  };
  for (Function &function : library)
    for (Instruction &each : instructions(function))
      if (isa<LoadInst, StoreInst>(each))
        tag(each, writer);
      else if (isa<CallInst>(each) && !isa<IntrinsicInst>(each))
        tag(each, runtime);
}

/// All calls of a function; then it is gone.
static Error inlineCalls(Function &function) {
  for (User *user : make_early_inc_range(function.users())) {
    auto *call = dyn_cast<CallInst>(user);
    if (!call || call->getCalledOperand() != &function)
      return createStringError("expected only calls of '" + function.getName() +
                               "'");
    InlineFunctionInfo info;
    InlineResult result = InlineFunction(*call, info);
    if (!result.isSuccess())
      return createStringError("cannot inline '" + function.getName() +
                               "': " + result.getFailureReason());
  }
  function.eraseFromParent();
  return Error::success();
}

/// What acts on a log is inline; checks, of a GPU that is emulated, are calls.
static Error checkKernels(const Module &kernels) {
  for (const Function &function : kernels)
    if (function.isDeclaration() &&
        function.getName().starts_with("pikoir_grid_"))
      return createStringError("kernels have no function '" +
                               function.getName() + "' inline");
  return Error::success();
}

Error piko::inlineRuntimeCode(Module &module, RuntimeCode kind) {
  bool isCPU = kind == RuntimeCode::CPU;
  StringRef code = isCPU ? cpuRuntimeCode : gpuRuntimeCode;
  Expected<std::unique_ptr<Module>> library =
      parseBitcodeFile({code, "runtime"}, module.getContext());
  if (!library)
    return library.takeError();
  SmallVector<std::string> names;
  for (Function &function : **library) {
    const Function *declared = module.getFunction(function.getName());
    if (function.isDeclaration() || !declared || !declared->isDeclaration())
      continue;
    if (declared->getFunctionType() != function.getFunctionType())
      return createStringError("expected the arguments and the result of '" +
                               function.getName() +
                               "' as the runtime's header has them");
    names.push_back(function.getName().str());
  }
  if (names.empty())
    return isCPU ? Error::success() : checkKernels(module);
  forgetMachine(**library, module);
  if (isCPU)
    tagAccesses(**library);
  if (Linker::linkModules(module, std::move(*library),
                          Linker::Flags::LinkOnlyNeeded))
    return createStringError("cannot link the runtime's inline code");
  for (StringRef name : names)
    if (Error error = inlineCalls(*module.getFunction(name)))
      return error;
  return isCPU ? Error::success() : checkKernels(module);
}
