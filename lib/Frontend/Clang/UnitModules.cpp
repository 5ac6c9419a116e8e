// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM IR of a file, divided among its pipelines.

#include "Clang/UnitModules.h"

#include "Import/MathCalls.h"

#include "llvm/ADT/DenseSet.h"
#include "llvm/ADT/STLExtras.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/TargetParser/Triple.h"
#include "llvm/Transforms/Utils/Cloning.h"

using namespace piko;

/// All that the functions whose names end in `suffix` refer to, and what calls
/// of the standard library's functions will be replaced by.
static llvm::DenseSet<const llvm::GlobalValue *>
findReachable(const llvm::Module &module, llvm::StringRef suffix) {
  llvm::DenseSet<const llvm::GlobalValue *> reached;
  llvm::SmallVector<const llvm::User *> work;
  llvm::DenseSet<const llvm::Constant *> seen;
  auto visit = [&](const llvm::User &user) {
    for (const llvm::Value *operand : user.operands())
      if (auto *constant = llvm::dyn_cast<llvm::Constant>(operand))
        if (seen.insert(constant).second)
          work.push_back(constant);
  };
  for (const llvm::Function &function : module)
    if (function.getName().ends_with(suffix) ||
        function.getName().starts_with(mathPrefix))
      work.push_back(&function);
  while (!work.empty()) {
    const llvm::User *user = work.pop_back_val();
    if (auto *global = llvm::dyn_cast<llvm::GlobalValue>(user))
      reached.insert(global);
    visit(*user);
    if (auto *function = llvm::dyn_cast<llvm::Function>(user))
      for (const llvm::BasicBlock &block : *function)
        for (const llvm::Instruction &instruction : block)
          visit(instruction);
  }
  return reached;
}

std::unique_ptr<llvm::Module> piko::extractUnit(const llvm::Module &module,
                                                llvm::StringRef suffix) {
  llvm::DenseSet<const llvm::GlobalValue *> reached =
      findReachable(module, suffix);
  llvm::ValueToValueMapTy map;
  std::unique_ptr<llvm::Module> unit =
      llvm::CloneModule(module, map, [&](const llvm::GlobalValue *value) {
        return reached.contains(value);
      });
  for (llvm::Function &function : llvm::make_early_inc_range(*unit))
    if (function.isDeclaration() && function.use_empty())
      function.eraseFromParent();
  for (llvm::GlobalVariable &global :
       llvm::make_early_inc_range(unit->globals()))
    if (global.isDeclaration() && global.use_empty())
      global.eraseFromParent();
  return unit;
}

void piko::dropSuffix(llvm::Module &module, llvm::StringRef suffix) {
  for (llvm::Function &function : module)
    if (function.getName().ends_with(suffix))
      function.setName(function.getName().drop_back(suffix.size()).str());
}

void piko::adaptModule(llvm::Module &module) {
  module.setDataLayout(module.getTargetTriple().computeDataLayout());
  for (llvm::Function &function : module) {
    function.setDoesNotThrow();
    for (llvm::Instruction &instruction : llvm::instructions(function))
      if (auto *call = llvm::dyn_cast<llvm::CallBase>(&instruction))
        call->setDoesNotThrow();
  }
  // That target casts null pointers between what are two address spaces there.
  auto *pointer = llvm::PointerType::getUnqual(module.getContext());
  auto *null = llvm::ConstantPointerNull::get(pointer);
  llvm::ConstantExpr::getAddrSpaceCast(null, pointer)->replaceAllUsesWith(null);
}
