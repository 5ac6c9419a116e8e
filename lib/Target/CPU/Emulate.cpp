// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// All but the back end of what a GPU would run: the kernels' LLVM IR as it is,
// with the functions that only a GPU has given by the emulator (pikort/grid.h).
// Address spaces are the CPU's one; a block's shared memory is a variable,
// because blocks run one after the other.

#include "Piko/Target/Emulate.h"

#include "Piko/Conversion/Emulation.h"

#include "llvm/IR/IRBuilder.h"
#include "llvm/Linker/Linker.h"
#include "llvm/Transforms/Utils/ModuleUtils.h"

using namespace llvm;
using namespace piko;

/// The function of the emulator for an intrinsic; empty if there is none.
static StringRef getEmulation(StringRef intrinsic) {
  static const std::pair<StringRef, StringRef> functions[] = {
      {"llvm.nvvm.read.ptx.sreg.tid.x", "pikoir_gpu_thread"},
      {"llvm.nvvm.read.ptx.sreg.ctaid.x", "pikoir_gpu_block"},
      {"llvm.nvvm.read.ptx.sreg.ntid.x", "pikoir_gpu_threads"},
      {"llvm.nvvm.read.ptx.sreg.nctaid.x", "pikoir_gpu_blocks"},
      {"llvm.nvvm.read.ptx.sreg.laneid", "pikoir_gpu_lane"},
      {"llvm.nvvm.read.ptx.sreg.lanemask.lt", "pikoir_gpu_lanes_below"},
      {"llvm.nvvm.barrier0", "pikoir_gpu_barrier"},
      {"llvm.nvvm.barrier.cta.sync.aligned.all", "pikoir_gpu_barrier"},
      {"llvm.nvvm.barrier.cta.red.or.aligned.all", "pikoir_gpu_barrier_or"},
      {"llvm.nvvm.activemask", "pikoir_gpu_activemask"},
      {"llvm.nvvm.vote.ballot.sync", "pikoir_gpu_ballot"},
      {"llvm.nvvm.shfl.sync.idx.i32", "pikoir_gpu_shuffle"}};
  for (auto [name, function] : functions)
    if (name == intrinsic)
      return function;
  return "";
}

static Error replaceIntrinsics(Module &module) {
  for (Function &function : make_early_inc_range(module)) {
    StringRef name = function.getName();
    if (!function.isDeclaration() || !name.starts_with("llvm.nvvm."))
      continue;
    StringRef emulation = getEmulation(name);
    if (emulation.empty())
      return createStringError("the emulator has no '" + name + "'");
    bool isBarrier = emulation == "pikoir_gpu_barrier";
    FunctionType *type =
        isBarrier ? FunctionType::get(function.getReturnType(), false)
                  : function.getFunctionType();
    auto *callee =
        cast<Function>(module.getOrInsertFunction(emulation, type).getCallee());
    callee->addFnAttr(Attribute::NoUnwind);
    callee->addFnAttr(Attribute::Convergent);
    if (function.onlyReadsMemory() && function.doesNotAccessMemory() &&
        !function.isConvergent())
      callee->setDoesNotAccessMemory(); // a number of the thread
    for (User *user : make_early_inc_range(function.users())) {
      auto *call = cast<CallInst>(user);
      IRBuilder<> builder(call);
      SmallVector<Value *> arguments;
      if (!isBarrier)
        append_range(arguments, call->args());
      CallInst *replacement = builder.CreateCall(callee, arguments);
      for (auto [i, argument] : enumerate(arguments))
        if (argument->getType()->isIntegerTy(1))
          replacement->addParamAttr(i, Attribute::ZExt); // a C++ bool
      if (isBarrier)
        call->eraseFromParent();
      else {
        call->replaceAllUsesWith(replacement);
        call->eraseFromParent();
      }
    }
    function.eraseFromParent();
  }
  return Error::success();
}

/// The arguments are in memory, eight bytes each.
static void createThread(Module &module, Function &kernel,
                         const std::string &name) {
  LLVMContext &context = module.getContext();
  auto *pointer = PointerType::getUnqual(context);
  auto *thread = Function::Create(
      FunctionType::get(Type::getVoidTy(context), pointer, false),
      GlobalValue::ExternalLinkage, name, module);
  IRBuilder<> builder(BasicBlock::Create(context, "entry", thread));
  SmallVector<Value *> arguments;
  for (Argument &argument : kernel.args()) {
    Value *place = builder.CreateConstInBoundsGEP1_64(
        builder.getInt64Ty(), thread->getArg(0), argument.getArgNo());
    arguments.push_back(builder.CreateLoad(argument.getType(), place));
  }
  builder.CreateCall(&kernel, arguments);
  builder.CreateRetVoid();
}

Error piko::linkEmulatedKernels(Module &host, std::unique_ptr<Module> kernels,
                                StringRef name) {
  kernels->setTargetTriple(host.getTargetTriple());
  kernels->setDataLayout(host.getDataLayout());
  if (NamedMDNode *annotations = kernels->getNamedMetadata("nvvm.annotations"))
    annotations->eraseFromParent();
  if (Error error = replaceIntrinsics(*kernels))
    return error;
  SmallVector<Function *> defined;
  for (Function &function : *kernels)
    if (!function.isDeclaration())
      defined.push_back(&function);
  for (Function *each : defined) {
    Function &function = *each;
    bool isKernel = function.getCallingConv() == CallingConv::PTX_Kernel;
    function.setCallingConv(CallingConv::C);
    for (const char *attribute : {"nvvm.maxntid", "nvvm.reqntid"})
      function.removeFnAttr(attribute);
    function.setLinkage(GlobalValue::InternalLinkage);
    if (isKernel)
      createThread(*kernels, function,
                   getEmulatedName(name, function.getName()));
  }
  SmallVector<GlobalValue *> memory;
  for (GlobalVariable &variable : kernels->globals()) {
    if (variable.isDeclaration())
      continue;
    variable.setLinkage(GlobalValue::InternalLinkage);
    if (!variable.isConstant())
      memory.push_back(&variable);
  }
  // At a barrier, other threads write it.
  appendToCompilerUsed(*kernels, memory);
  if (Linker::linkModules(host, std::move(kernels)))
    return createStringError("cannot link the kernels to the host's code");
  return Error::success();
}
