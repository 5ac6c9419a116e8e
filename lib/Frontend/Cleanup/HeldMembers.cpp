//===- HeldMembers.cpp - Members that stay apart from elements ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The end of one array is where the next member begins. LLVM's passes take one
// address for the other, as both are so many bytes from one pointer, and then
// an index from the end would count in the wrong array:
//
//   %end = gep i32, %p, 4            %end = gep i32, %p, 4
//   %v = gep %S, %p, 0, 1      ->    %h = call @piko.held_index(0)
//                                    %v = gep %S, %p, %h, 1
//
// So the way to a member begins with an index of which no pass knows what it
// is. getAddress does.
//
//===----------------------------------------------------------------------===//

#include "Support/Memory.h"

#include "llvm/IR/GetElementPtrTypeIterator.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Module.h"

using namespace piko;
using llvm::dyn_cast;

static constexpr llvm::StringLiteral heldName = "piko.held_index";

static const llvm::ConstantInt *getHeld(const llvm::Value *index) {
  auto *call = dyn_cast<llvm::CallInst>(index);
  if (!call || !call->getCalledFunction() ||
      call->getCalledFunction()->getName() != heldName)
    return nullptr;
  return llvm::cast<llvm::ConstantInt>(call->getArgOperand(0));
}

std::optional<int64_t> piko::getConstantIndex(const llvm::Value *index) {
  auto *number = dyn_cast<llvm::ConstantInt>(index);
  if (!number)
    number = getHeld(index);
  return number ? std::optional(number->getSExtValue()) : std::nullopt;
}

/// Whether a step leads to a member. That to a base class is over bytes.
static bool isMemberStep(const llvm::GetElementPtrInst &step) {
  if (step.hasAllZeroIndices())
    return false;
  if (step.getSourceElementType()->isIntegerTy(8))
    return llvm::isa<llvm::ConstantInt>(step.getOperand(1));
  for (auto part = llvm::gep_type_begin(step), end = llvm::gep_type_end(step);
       part != end; ++part)
    if (part.isStruct())
      return true;
  return false;
}

namespace {

class MemberHolder {
public:
  MemberHolder(llvm::Function &function)
      : function(function), builder(function.getContext()) {
    llvm::BasicBlock &entry = function.getEntryBlock();
    for (llvm::Instruction &instruction : llvm::make_early_inc_range(entry))
      if (const llvm::ConstantInt *index = getHeld(&instruction)) {
        held.try_emplace(index->getSExtValue(), &instruction);
        instruction.moveBefore(entry, entry.begin());
      }
  }

  void run() {
    for (llvm::Instruction &instruction : llvm::instructions(function)) {
      auto *step = dyn_cast<llvm::GetElementPtrInst>(&instruction);
      if (!step || !isMemberStep(*step))
        continue;
      llvm::Value *first = step->getOperand(1);
      if (!llvm::isa<llvm::ConstantInt>(first) && !getHeld(first)) {
        // It may yet become a constant.
        builder.SetInsertPoint(step);
        step->setOperand(0, builder.CreateGEP(step->getSourceElementType(),
                                              step->getOperand(0), first));
        first = builder.getInt64(0);
      }
      if (auto *index = dyn_cast<llvm::ConstantInt>(first))
        step->setOperand(1, hold(index->getSExtValue()));
    }
  }

private:
  /// One call for each index, before all that needs it.
  llvm::Value *hold(int64_t index) {
    llvm::Value *&call = held[index];
    if (call)
      return call;
    builder.SetInsertPoint(function.getEntryBlock().begin());
    llvm::Type *type = builder.getInt64Ty();
    llvm::FunctionCallee callee =
        function.getParent()->getOrInsertFunction(heldName, type, type);
    auto *declaration = llvm::cast<llvm::Function>(callee.getCallee());
    declaration->setDoesNotAccessMemory();
    declaration->setDoesNotThrow();
    declaration->setWillReturn();
    return call = builder.CreateCall(callee, {builder.getInt64(index)});
  }

  llvm::Function &function;
  llvm::IRBuilder<> builder;
  llvm::DenseMap<int64_t, llvm::Value *> held;
};

} // namespace

void piko::holdMembers(llvm::Function &function) {
  MemberHolder(function).run();
}

void piko::releaseMembers(llvm::Function &function, bool onlyLocal) {
  const llvm::DataLayout &data = function.getDataLayout();
  for (llvm::Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    const llvm::ConstantInt *index = getHeld(&instruction);
    if (!index)
      continue;
    instruction.replaceUsesWithIf(
        llvm::ConstantInt::get(instruction.getType(), index->getSExtValue()),
        [&](llvm::Use &use) {
          return !onlyLocal || llvm::isa<llvm::AllocaInst>(
                                   getAddress(use.getUser(), data).base);
        });
    if (instruction.use_empty())
      instruction.eraseFromParent();
  }
}
