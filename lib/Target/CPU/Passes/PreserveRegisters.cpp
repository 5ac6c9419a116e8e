// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/PreserveRegisters.h"

#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"

#include <map>

using namespace llvm;
using namespace piko;

/// A call of the runtime that reports an error, and gives nothing: a result
/// would be in a register. Other cold functions are called too often for that.
static bool isFailure(const CallInst &call) {
  const Function *callee = call.getCalledFunction();
  return callee && callee->isDeclaration() &&
         callee->getName().starts_with("pikoir_fail") &&
         callee->getReturnType()->isVoidTy();
}

/// What calls `callee` and saves all registers of the processor of `caller`.
static Function *makePreserving(Function &callee, const Function &caller,
                                const TargetMachine &machine) {
  Module &module = *callee.getParent();
  Attribute processor = caller.getFnAttribute("target-cpu"),
            features = caller.getFnAttribute("target-features");
  std::string name = (callee.getName() + ".preserving").str();
  if (processor.isValid())
    name += ("." + processor.getValueAsString()).str();
  Function *function = Function::Create(
      callee.getFunctionType(), GlobalValue::InternalLinkage, name, module);
  for (Attribute::AttrKind kind :
       {Attribute::Cold, Attribute::NoInline, Attribute::NoUnwind})
    function->addFnAttr(kind);
  function->addFnAttr("no_caller_saved_registers");
  if (processor.isValid())
    function->addFnAttr(processor);
  // What is restored must not be cleared before it returns.
  StringRef others = features.isValid() ? features.getValueAsString()
                                        : machine.getTargetFeatureString();
  function->addFnAttr("target-features", others.empty()
                                             ? std::string("-vzeroupper")
                                             : (others + ",-vzeroupper").str());
  IRBuilder<> builder(
      BasicBlock::Create(module.getContext(), "entry", function));
  SmallVector<Value *> arguments(make_pointer_range(function->args()));
  CallInst *call = builder.CreateCall(&callee, arguments);
  call->setAttributes(callee.getAttributes());
  call->setDoesNotThrow();
  builder.CreateRetVoid();
  return function;
}

PreservedAnalyses PreserveRegistersPass::run(Module &module,
                                             ModuleAnalysisManager &) {
  // By the processor, as versions of a program have several.
  std::map<std::pair<Function *, std::string>, Function *> preserving;
  SmallVector<CallInst *> calls;
  for (Function &function : module)
    for (Instruction &each : instructions(function))
      if (auto *call = dyn_cast<CallInst>(&each); call && isFailure(*call))
        calls.push_back(call);
  for (CallInst *call : calls) {
    Function &caller = *call->getFunction(),
             *callee = call->getCalledFunction();
    std::string processor =
        (caller.getFnAttribute("target-cpu").getValueAsString() + "/" +
         caller.getFnAttribute("target-features").getValueAsString())
            .str();
    Function *&function = preserving[{callee, processor}];
    if (!function)
      function = makePreserving(*callee, caller, *machine);
    call->setCalledFunction(function);
  }
  return calls.empty() ? PreservedAnalyses::all() : PreservedAnalyses::none();
}
