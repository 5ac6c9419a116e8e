// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What code for a CPU and PTX share: LLVM's optimizer and its emission of text
// or objects for a machine.

#ifndef PIKO_TARGET_CODEGENERATION_H
#define PIKO_TARGET_CODEGENERATION_H

#include "llvm/IR/Module.h"
#include "llvm/IR/PassManager.h"
#include "llvm/Support/CodeGen.h"
#include "llvm/Support/Error.h"
#include "llvm/Target/TargetMachine.h"

#include <string>

namespace piko {

/// LLVM's target of a triple, which must have been initialised.
llvm::Expected<const llvm::Target *> lookUpTarget(const llvm::Triple &triple);

/// Whether the target of `triple` has a processor of this name; LLVM prints a
/// complaint of its own where it makes a machine of another.
bool hasProcessor(const llvm::Target &target, const llvm::Triple &triple,
                  llvm::StringRef processor);

/// LLVM's optimizer, but for the machine.
struct OptimizerOptions {
  int level = 3; ///< 0 to 3
  bool loopVectorize = true, slpVectorize = true;
};

/// Optimises the module, runs `last` on the result, and gives the code of
/// `machine`. No flag allows arithmetic to change: the IR says what may.
llvm::Expected<std::string>
emitCode(llvm::Module &module, llvm::TargetMachine &machine,
         const OptimizerOptions &options, llvm::CodeGenFileType type,
         llvm::ModulePassManager last = llvm::ModulePassManager());

} // namespace piko

#endif // PIKO_TARGET_CODEGENERATION_H
