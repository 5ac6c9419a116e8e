//===- Cleanup.cpp - Removing C++ from a pipeline's LLVM IR ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The list of passes is ours. Nothing moves code out of loops, unrolls,
// vectorizes or numbers values over the whole function: later levels know
// better what a pipeline needs.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"

#include "Cleanup/FillVariables.h"
#include "Cleanup/ParallelLoops.h"
#include "Import/MathCalls.h"
#include "Parse/Wrappers.h"
#include "Support/CallChain.h"
#include "Support/Shifts.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/Analysis/CFG.h"
#include "llvm/Analysis/LoopInfo.h"
#include "llvm/IR/DebugInfoMetadata.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"
#include "llvm/Passes/PassBuilder.h"
#include "llvm/Transforms/IPO/AlwaysInliner.h"
#include "llvm/Transforms/IPO/GlobalDCE.h"
#include "llvm/Transforms/InstCombine/InstCombine.h"
#include "llvm/Transforms/Scalar/ADCE.h"
#include "llvm/Transforms/Scalar/DCE.h"
#include "llvm/Transforms/Scalar/EarlyCSE.h"
#include "llvm/Transforms/Scalar/LoopPassManager.h"
#include "llvm/Transforms/Scalar/LoopUnrollPass.h"
#include "llvm/Transforms/Scalar/LowerExpectIntrinsic.h"
#include "llvm/Transforms/Scalar/SROA.h"
#include "llvm/Transforms/Scalar/SimplifyCFG.h"
#include "llvm/Transforms/Utils/Cloning.h"
#include "llvm/Transforms/Utils/Local.h"

using namespace piko;
using llvm::dyn_cast;

//===----------------------------------------------------------------------===//
// Passes
//===----------------------------------------------------------------------===//

namespace {

/// Runs LLVM's passes; one set of analyses for all.
class PassRunner {
public:
  PassRunner() {
    llvm::PassBuilder builder;
    builder.registerModuleAnalyses(modules);
    builder.registerCGSCCAnalyses(components);
    builder.registerFunctionAnalyses(functions);
    builder.registerLoopAnalyses(loops);
    builder.crossRegisterProxies(loops, functions, components, modules);
  }
  void run(llvm::ModulePassManager &passes, llvm::Module &module) {
    passes.run(module, modules);
  }
  /// What ran in between may have changed the function.
  void run(llvm::FunctionPassManager &passes, llvm::Function &function) {
    functions.invalidate(function, llvm::PreservedAnalyses::none());
    passes.run(function, functions);
  }

private:
  llvm::LoopAnalysisManager loops;
  llvm::FunctionAnalysisManager functions;
  llvm::CGSCCAnalysisManager components;
  llvm::ModuleAnalysisManager modules;
};

} // namespace

/// Calls that mean nothing here: lifetimes, and what is expected of values but
/// of branches' conditions, which have become weights.
static void dropHints(llvm::Function &function) {
  for (llvm::Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    auto *call = dyn_cast<llvm::IntrinsicInst>(&instruction);
    if (!call)
      continue;
    switch (call->getIntrinsicID()) {
    case llvm::Intrinsic::expect:
    case llvm::Intrinsic::expect_with_probability:
      call->replaceAllUsesWith(call->getArgOperand(0));
      call->eraseFromParent();
      break;
    case llvm::Intrinsic::lifetime_start:
    case llvm::Intrinsic::lifetime_end:
    case llvm::Intrinsic::assume:
    case llvm::Intrinsic::experimental_noalias_scope_decl:
    case llvm::Intrinsic::stacksave:
    case llvm::Intrinsic::stackrestore:
      if (call->use_empty())
        call->eraseFromParent();
      break;
    case llvm::Intrinsic::is_constant:
      call->replaceAllUsesWith(llvm::ConstantInt::getFalse(call->getType()));
      call->eraseFromParent();
      break;
    default:
      break;
    }
  }
}

/// Inlines calls whose callee has become known; whether there were any.
static bool inlineKnownCalls(llvm::Function &function) {
  bool changed = false;
  // A function that was returned by one call may be called by the next.
  for (bool again = true; again;) {
    again = false;
    llvm::SmallVector<llvm::WeakTrackingVH> calls; // the next one last
    for (llvm::Instruction &instruction : llvm::instructions(function))
      if (llvm::isa<llvm::CallInst>(instruction))
        calls.push_back(&instruction);
    std::reverse(calls.begin(), calls.end());
    while (!calls.empty()) {
      auto *call = llvm::dyn_cast_or_null<llvm::CallInst>(
          static_cast<llvm::Value *>(calls.pop_back_val()));
      llvm::Function *callee = call ? call->getCalledFunction() : nullptr;
      if (!callee || callee->isDeclaration())
        continue;
      llvm::InlineFunctionInfo info;
      if (!llvm::InlineFunction(*call, info).isSuccess())
        continue;
      again = true;
      for (llvm::CallBase *inner : llvm::reverse(info.InlinedCallSites))
        calls.push_back(inner);
    }
    changed |= again;
  }
  return changed;
}

/// A phase may read what the pipeline's constructor left in its stage, and no
/// more: its calls are concurrent. False after an error.
static bool checkObject(llvm::Function &function, const ParsedUnit &unit,
                        MemoryMap &memory, mlir::MLIRContext &context) {
  const llvm::Value *object = memory.objects.lookup(&function);
  const llvm::CallInst *begin = nullptr;
  for (const llvm::Instruction &instruction : llvm::instructions(function))
    if (auto *call = dyn_cast<llvm::CallInst>(&instruction))
      if (const Marker *marker = getMarker(call, unit.markers))
        if (marker->kind == MarkerKind::phase)
          begin = call;
  if (!object || !begin)
    return true;
  for (llvm::Instruction &instruction : llvm::instructions(function)) {
    auto *store = dyn_cast<llvm::StoreInst>(&instruction);
    if (!store ||
        getAddress(store->getPointerOperand(), memory.data).base != object ||
        !llvm::isPotentiallyReachable(begin, store))
      continue;
    emitUserError(store, unit, context)
        << "not supported in Piko: changing a member of a stage in a phase, "
           "whose calls are concurrent";
    return false;
  }
  return true;
}

/// Where all values have a case, the last case serves as the default: a block
/// that is never reached would belong to no loop.
static void dropUnreachableDefaults(llvm::Function &function) {
  for (llvm::BasicBlock &block : function) {
    auto *choice = dyn_cast<llvm::SwitchInst>(block.getTerminator());
    if (!choice || choice->getNumCases() == 0)
      continue;
    llvm::BasicBlock *never = choice->getDefaultDest();
    if (!llvm::isa<llvm::UnreachableInst>(never->front()))
      continue;
    auto last = std::prev(choice->case_end());
    choice->setDefaultDest(last->getCaseSuccessor());
    choice->removeCase(last);
  }
  llvm::removeUnreachableBlocks(function);
}

/// What runs when the pipeline does; the other wrappers are computed now.
static bool isPhase(WrapperKind wrapper) {
  return wrapper != WrapperKind::Wire && wrapper != WrapperKind::Clear;
}

/// Refuses loops that nothing leaves; false after an error.
static bool checkLoops(llvm::Function &function, const ParsedUnit &unit,
                       mlir::MLIRContext &context) {
  llvm::DominatorTree dominance(function);
  llvm::LoopInfo loops(dominance);
  // The innermost ones first.
  auto ordered = loops.getLoopsInPreorder();
  for (llvm::Loop *loop : llvm::reverse(ordered)) {
    if (!loop->hasNoExitBlocks())
      continue;
    const llvm::Instruction *at = loop->getHeader()->getTerminator();
    for (const llvm::BasicBlock *block : loop->blocks())
      for (const llvm::Instruction &instruction : *block)
        if (instruction.getDebugLoc() && !at->getDebugLoc())
          at = &instruction;
    mlir::emitError(getUserLocation(at, unit, context))
        << "expected a loop that can end, but nothing leaves this one";
    return false;
  }
  return true;
}

static void prepareFunction(llvm::Function &function, ParsedUnit &unit,
                            MemoryMap &memory, PassRunner &runner,
                            mlir::MLIRContext &context) {
  WrapperKind wrapper = unit.wrappers.getKind(function);
  redirectMathCalls(function, unit, context);
  inlineKnownCalls(function);
  llvm::FunctionPassManager weigh;
  weigh.addPass(llvm::LowerExpectIntrinsicPass());
  runner.run(weigh, function);
  if (unit.module->getModuleFlag(checkingFlag) &&
      wrapper == WrapperKind::Process)
    fillVariables(function, memory);
  labelLoops(function, memory);
  dropHints(function);
  expandMarkers(function, memory, /*isWiring=*/wrapper == WrapperKind::Wire);
  if (isPhase(wrapper))
    holdDivisions(function);
}

/// Initial values are constants, even where they are set in a loop.
static void unrollLoops(llvm::Function &function, PassRunner &runner) {
  llvm::LLVMContext &context = function.getContext();
  llvm::DominatorTree dominance(function);
  llvm::LoopInfo loops(dominance);
  for (llvm::Loop *loop : loops.getLoopsInPreorder())
    loop->setLoopID(llvm::makePostTransformationMetadata(
        context, loop->getLoopID(), {"llvm.loop.unroll."},
        {llvm::MDNode::get(
            context, llvm::MDString::get(context, "llvm.loop.unroll.full"))}));
  llvm::FunctionPassManager unroll;
  unroll.addPass(
      llvm::createFunctionToLoopPassAdaptor(llvm::LoopFullUnrollPass(3)));
  runner.run(unroll, function);
}

/// References nested deeper than this are an error.
static constexpr int roundLimit = 32;

static bool cleanUpFunction(llvm::Function &function, ParsedUnit &unit,
                            MemoryMap &memory, PassRunner &runner,
                            mlir::MLIRContext &context) {
  prepareFunction(function, unit, memory, runner, context);
  llvm::FunctionPassManager simplify;
  simplify.addPass(llvm::EarlyCSEPass(/*UseMemorySSA=*/false));
  simplify.addPass(llvm::DCEPass()); // a dead copy may hold an address
  simplify.addPass(llvm::SimplifyCFGPass());
  if (!promoteVariables(function, unit, context))
    return false;
  holdMembers(function);
  runner.run(simplify, function);
  bool isClear = unit.wrappers.getKind(function) == WrapperKind::Clear;
  if (isClear) {
    releaseMembers(function);
    unrollLoops(function, runner);
  }
  // Of a matrix, the columns' components and then the columns.
  for (int depth = 0; depth < 2 && unrollComponents(function); ++depth)
    runner.run(simplify, function);
  // Each round sees through one more level of references.
  bool localized = false;
  for (int round = 0; round < roundLimit; ++round) {
    if (!checkObject(function, unit, memory, context))
      return false;
    bool changed = releaseDivisions(function);
    changed |= splitMemory(function, memory);
    changed |= expandCopies(function, unit, memory);
    changed |= flattenPointers(function, memory);
    if (!expandLocalAtomics(function, unit, memory, context, changed))
      return false;
    changed |= redirectMathCalls(function, unit, context);
    if (inlineKnownCalls(function)) {
      prepareFunction(function, unit, memory, runner, context);
      changed = true;
    }
    if (!releasePixels(function, unit, memory, context, /*all=*/!changed,
                       changed))
      return false;
    if (!changed) {
      if (localized || !localizeTables(function, memory))
        break;
      localized = true;
    }
    if (!promoteVariables(function, unit, context))
      return false;
    holdMembers(function);
    runner.run(simplify, function);
  }
  bool released = false;
  if (!releasePixels(function, unit, memory, context, /*all=*/true, released))
    return false;
  shareArrays(function, memory);
  llvm::FunctionPassManager promote;
  if (isClear) {
    promote.addPass(llvm::InstCombinePass());
    runner.run(promote, function);
    promote = llvm::FunctionPassManager();
    unrollLoops(function, runner);
  }
  promote.addPass(llvm::SROAPass(llvm::SROAOptions::PreserveCFG));
  promote.addPass(llvm::EarlyCSEPass(/*UseMemorySSA=*/true));
  promote.addPass(llvm::SimplifyCFGPass());
  releaseMembers(function, /*onlyLocal=*/true);
  runner.run(promote, function);
  if (!resolveAccesses(function, unit, memory, context))
    return false;
  releaseMembers(function);
  releaseDivisions(function);

  llvm::FunctionPassManager finish;
  finish.addPass(llvm::EarlyCSEPass(/*UseMemorySSA=*/true));
  finish.addPass(llvm::SimplifyCFGPass());
  finish.addPass(llvm::InstCombinePass());
  finish.addPass(llvm::EarlyCSEPass(/*UseMemorySSA=*/true));
  finish.addPass(llvm::SimplifyCFGPass());
  finish.addPass(llvm::InstCombinePass());
  finish.addPass(llvm::ADCEPass());
  finish.addPass(llvm::SimplifyCFGPass());
  runner.run(finish, function);
  // instcombine reads the elements of an array that two branches read once,
  // through the one of the two addresses that is chosen.
  for (int round = 0; round < roundLimit && flattenPointers(function, memory);
       ++round)
    runner.run(simplify, function);
  dropUnreachableDefaults(function);
  releaseDivisions(function);
  return checkLoops(function, unit, context);
}

/// Gives bases of the state as places in it.
static void rebaseState(llvm::Module &module, MarkerTable &markers) {
  for (llvm::Function &function : module) {
    auto found = markers.find(function.getName());
    if (found == markers.end() || found->second.kind != MarkerKind::state ||
        found->second.offset == 0)
      continue;
    int64_t offset = found->second.offset;
    llvm::FunctionCallee whole =
        module.getOrInsertFunction("piko.state", function.getFunctionType());
    markers["piko.state"] = Marker{MarkerKind::state};
    for (llvm::User *user : llvm::make_early_inc_range(function.users())) {
      auto *call = llvm::cast<llvm::CallInst>(user);
      llvm::IRBuilder<> builder(call);
      call->replaceAllUsesWith(
          makeMemberAddress(builder, builder.CreateCall(whole), offset));
      call->eraseFromParent();
    }
  }
}

/// The call of the pipeline's constructor in a wrapper, if it has one.
static llvm::CallInst *findConstructorCall(llvm::Function &wrapper,
                                           const MemoryMap &memory) {
  const llvm::Value *object = memory.objects.lookup(&wrapper);
  for (llvm::Instruction &instruction : wrapper.getEntryBlock())
    if (auto *call = dyn_cast<llvm::CallInst>(&instruction))
      if (llvm::Function *callee = call->getCalledFunction();
          callee && !callee->isDeclaration() && object && call->arg_size() == 1)
        return call->getArgOperand(0) == object ? call : nullptr;
  return nullptr;
}

/// What a constructor leaves in its object, without the edges that it adds.
static void dropWiring(llvm::Function &constructor, const MarkerTable &markers,
                       PassRunner &runner) {
  for (llvm::Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(constructor)))
    if (auto *call = dyn_cast<llvm::CallInst>(&instruction))
      if (const Marker *marker = getMarker(call, markers);
          marker && (marker->kind == MarkerKind::source ||
                     marker->kind == MarkerKind::connect ||
                     marker->kind == MarkerKind::allocateForSource ||
                     marker->kind == MarkerKind::expectIndex))
        call->eraseFromParent();
  dropHints(constructor);
  llvm::FunctionPassManager simplify;
  simplify.addPass(llvm::SROAPass(llvm::SROAOptions::PreserveCFG));
  simplify.addPass(llvm::ADCEPass());
  runner.run(simplify, constructor);
}

/// Wrappers become one function each. Each of a phase builds the pipeline: the
/// edges, as many as stages, are for the one that is read for them.
static void inlineCalls(llvm::ArrayRef<llvm::Function *> wrappers,
                        const ParsedUnit &unit, const MemoryMap &memory,
                        PassRunner &runner) {
  llvm::Module &module = *unit.module;
  llvm::CallInst *wiring =
      findConstructorCall(unit.wrappers.get(module, WrapperKind::Wire), memory);
  llvm::Function *constructor = wiring ? wiring->getCalledFunction() : nullptr;
  if (constructor)
    constructor->removeFnAttr(llvm::Attribute::AlwaysInline);
  llvm::ModulePassManager inlining;
  inlining.addPass(llvm::GlobalDCEPass());
  inlining.addPass(llvm::AlwaysInlinerPass(/*InsertLifetime=*/true));
  runner.run(inlining, module);
  if (!constructor)
    return;
  llvm::InlineFunctionInfo info;
  llvm::InlineFunction(*wiring, info);
  dropWiring(*constructor, unit.markers, runner);
  for (llvm::Function *wrapper : wrappers)
    if (llvm::CallInst *call = findConstructorCall(*wrapper, memory))
      llvm::InlineFunction(*call, info);
  if (constructor->use_empty())
    constructor->eraseFromParent();
}

bool piko::cleanUp(ParsedUnit &unit, MemoryMap &memory,
                   mlir::MLIRContext &context) {
  llvm::Module &module = *unit.module;
  rebaseState(module, unit.markers);
  setMarkerEffects(module, unit.markers);
  std::vector<llvm::Function *> wrappers, mathFunctions;
  for (llvm::Function &function : module) {
    if (unit.wrappers.contains(function))
      wrappers.push_back(&function);
    else if (function.getName().starts_with(mathPrefix)) {
      // Kept until calls have been redirected to it.
      function.setLinkage(llvm::GlobalValue::ExternalLinkage);
      mathFunctions.push_back(&function);
    } else if (!function.isDeclaration())
      function.setLinkage(llvm::GlobalValue::InternalLinkage);
    if (!function.isDeclaration())
      function.setComdat(nullptr);
    defineShifts(function);
  }
  if (auto *constructors = module.getNamedGlobal("llvm.global_ctors"))
    constructors->eraseFromParent();
  for (const char *used : {"llvm.used", "llvm.compiler.used"})
    if (auto *list = module.getNamedGlobal(used))
      list->eraseFromParent();

  for (llvm::Function *wrapper : wrappers)
    for (llvm::Instruction &instruction : wrapper->getEntryBlock())
      if (auto *variable = dyn_cast<llvm::AllocaInst>(&instruction)) {
        memory.objects[wrapper] = variable;
        break;
      }
  std::vector<llvm::Function *> roots = wrappers;
  llvm::append_range(roots, mathFunctions);
  expandComparisons(module);
  if (!checkCalls(roots, unit, context))
    return false;

  PassRunner runner;
  inlineCalls(wrappers, unit, memory, runner);
  for (llvm::Function *wrapper : wrappers)
    if (!cleanUpFunction(*wrapper, unit, memory, runner, context))
      return false;
  return true;
}
