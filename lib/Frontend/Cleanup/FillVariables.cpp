//===- FillVariables.cpp - Local variables that nobody has written --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Cleanup/FillVariables.h"

#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"

using namespace piko;
using llvm::dyn_cast;

bool piko::isChecking(const FrontendOptions &options) {
  return llvm::any_of(options.defines, [](llvm::StringRef macro) {
    return macro.split('=').first == "PIKO_CHECK";
  });
}

/// Variables of more numbers than this count as written.
static constexpr int64_t fillLimit = 64;

/// A function without a body whose value nobody can know.
static llvm::FunctionCallee getUndefined(llvm::Module &module,
                                         llvm::Type *type) {
  std::string name = undefinedName.str();
  llvm::raw_string_ostream(name) << *type;
  llvm::FunctionCallee callee = module.getOrInsertFunction(name, type);
  auto *function = llvm::cast<llvm::Function>(callee.getCallee());
  function->setDoesNotAccessMemory();
  function->setDoesNotThrow();
  function->setWillReturn();
  return callee;
}

static void fill(llvm::AllocaInst *variable, llvm::Instruction *before,
                 MemoryMap &memory) {
  llvm::Type *type = variable->getAllocatedType();
  const MemoryLayout &layout = memory.getTypeLayout(type);
  auto pieces = getPieces(layout, Address{variable}, layout.size, fillLimit);
  if (!pieces || variable->isArrayAllocation())
    return;
  llvm::IRBuilder<> builder(before);
  builder.SetCurrentDebugLocation(llvm::DebugLoc());
  for (const MemoryPiece &piece : *pieces) {
    if (piece.type->isPointerTy())
      continue;
    llvm::Value *value =
        builder.CreateCall(getUndefined(*variable->getModule(), piece.type));
    builder.CreateStore(value,
                        makeMemberAddress(builder, variable, piece.offset));
  }
}

void piko::fillVariables(llvm::Function &function, MemoryMap &memory) {
  llvm::StringRef mark = "piko.filled"; // once, though a function grows
  // What the pipeline's constructor leaves is given.
  const llvm::Value *object = memory.objects.lookup(&function);
  llvm::SmallVector<llvm::AllocaInst *> variables;
  llvm::SmallVector<llvm::IntrinsicInst *> births;
  for (llvm::Instruction &instruction : llvm::instructions(function)) {
    if (auto *variable = dyn_cast<llvm::AllocaInst>(&instruction))
      variables.push_back(variable);
    else if (auto *call = dyn_cast<llvm::IntrinsicInst>(&instruction);
             call && call->getIntrinsicID() == llvm::Intrinsic::lifetime_start)
      births.push_back(call);
  }
  llvm::DenseSet<llvm::AllocaInst *> born;
  for (llvm::IntrinsicInst *birth : births)
    if (auto *variable = dyn_cast<llvm::AllocaInst>(
            birth->getArgOperand(birth->arg_size() - 1))) {
      born.insert(variable);
      if (!variable->hasMetadata(mark) && variable != object)
        fill(variable, birth->getNextNode(), memory);
    }
  for (llvm::AllocaInst *variable : variables) {
    if (variable->hasMetadata(mark))
      continue;
    variable->setMetadata(mark, llvm::MDNode::get(function.getContext(), {}));
    // Those without a begin are temporaries.
    if (!born.contains(variable) && variable != object)
      fill(variable, variable->getNextNode(), memory);
  }
}
