// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops over components: what indexes a vector by a loop's counter, as glm's
// own functions do, names its components once the loop is unrolled.

#include "Cleanup.h"

#include "llvm/Analysis/AssumptionCache.h"
#include "llvm/Analysis/LoopInfo.h"
#include "llvm/Analysis/OptimizationRemarkEmitter.h"
#include "llvm/Analysis/ScalarEvolution.h"
#include "llvm/Analysis/TargetLibraryInfo.h"
#include "llvm/Analysis/TargetTransformInfo.h"
#include "llvm/IR/Dominators.h"
#include "llvm/IR/Instructions.h"
#include "llvm/Transforms/Utils/LoopSimplify.h"
#include "llvm/Transforms/Utils/LoopUtils.h"
#include "llvm/Transforms/Utils/UnrollLoop.h"

using namespace piko;

namespace {

class Unroller {
public:
  explicit Unroller(llvm::Function &function)
      : function(function), dominance(function), loops(dominance),
        assumptions(function),
        library(llvm::Triple(function.getParent()->getTargetTriple())),
        info(library), counts(function, info, assumptions, dominance, loops) {}

  /// Unrolls the innermost loops that are short; whether there were any.
  bool run();

private:
  /// How often the loop comes to its condition; 0 if that is unknown, or too
  /// often.
  unsigned countIterations(llvm::Loop &loop);
  bool unroll(llvm::Loop &loop, unsigned iterations);

  llvm::Function &function;
  llvm::DominatorTree dominance;
  llvm::LoopInfo loops;
  llvm::AssumptionCache assumptions;
  llvm::TargetLibraryInfoImpl library;
  llvm::TargetLibraryInfo info;
  llvm::ScalarEvolution counts;
};

} // namespace

/// Whether an instruction may be there several times: what messages and the
/// order of emissions go by may not.
static bool canRepeat(const llvm::Instruction &instruction) {
  auto *call = llvm::dyn_cast<llvm::CallBase>(&instruction);
  return !call || llvm::isa<llvm::IntrinsicInst>(call) ||
         (call->doesNotAccessMemory() && call->doesNotThrow());
}

/// As many iterations as a vector has components, with little to do, and no
/// pointer that walks, which is an index as long as it does so in a loop. The
/// last time that the loop comes to its condition is counted, too.
unsigned Unroller::countIterations(llvm::Loop &loop) {
  constexpr unsigned mostIterations = 4 + 1, mostInstructions = 80;
  unsigned iterations = counts.getSmallConstantTripCount(&loop), size = 0;
  bool walks = llvm::any_of(loop.getHeader()->phis(), [](llvm::PHINode &phi) {
    return phi.getType()->isPointerTy();
  });
  if (!loop.isInnermost() || iterations > mostIterations || walks)
    return 0;
  for (const llvm::BasicBlock *block : loop.blocks())
    for (const llvm::Instruction &instruction : *block)
      if (!canRepeat(instruction) || ++size > mostInstructions)
        return 0;
  return iterations;
}

bool Unroller::unroll(llvm::Loop &loop, unsigned iterations) {
  llvm::simplifyLoop(&loop, &dominance, &loops, &counts, &assumptions,
                     /*MSSAU=*/nullptr, /*PreserveLCSSA=*/false);
  llvm::formLCSSARecursively(loop, dominance, &loops, &counts);
  llvm::UnrollLoopOptions options{};
  options.Count = iterations;
  options.Force = true;
  options.ForgetAllSCEV = true;
  llvm::TargetTransformInfo target(function.getParent()->getDataLayout());
  llvm::OptimizationRemarkEmitter remarks(&function);
  return llvm::UnrollLoop(&loop, options, &loops, &counts, &dominance,
                          &assumptions, &target, &remarks,
                          /*PreserveLCSSA=*/true) !=
         llvm::LoopUnrollResult::Unmodified;
}

bool Unroller::run() {
  bool any = false;
  llvm::SmallVector<llvm::Loop *> all = loops.getLoopsInPreorder();
  for (llvm::Loop *loop : all)
    if (unsigned iterations = countIterations(*loop))
      any |= unroll(*loop, iterations);
  return any;
}

bool piko::unrollComponents(llvm::Function &function) {
  return Unroller(function).run();
}
