//===- Divisions.cpp - Integer divisions that may have no result ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A division by 0, and one whose quotient overflows, is undefined in LLVM IR,
// and LLVM's passes make of it what suits them. In Piko it is an error of the
// run. So divisions are calls until the passes have run, but for those that
// are known to have a result.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"
#include "Support/Accessors.h"

#include "llvm/Analysis/SimplifyQuery.h"
#include "llvm/Analysis/ValueTracking.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/Module.h"
#include "llvm/IR/PatternMatch.h"

using namespace piko;
using llvm::dyn_cast;
using llvm::Instruction;

static bool isSigned(unsigned opcode) {
  return opcode == Instruction::SDiv || opcode == Instruction::SRem;
}

static bool isDivision(const Instruction &instruction) {
  switch (instruction.getOpcode()) {
  case Instruction::SDiv:
  case Instruction::UDiv:
  case Instruction::SRem:
  case Instruction::URem:
    return instruction.getType()->isIntegerTy();
  default:
    return false;
  }
}

std::optional<unsigned> piko::getDivision(llvm::StringRef callee) {
  if (!callee.consume_front(accessor::divide))
    return std::nullopt;
  for (unsigned opcode : {Instruction::SDiv, Instruction::UDiv,
                          Instruction::SRem, Instruction::URem})
    if (callee.starts_with(Instruction::getOpcodeName(opcode)))
      return opcode;
  return std::nullopt;
}

static llvm::FunctionCallee getCallee(llvm::Module &module, unsigned opcode,
                                      llvm::Type *type) {
  std::string name = accessor::divide.str();
  llvm::raw_string_ostream(name)
      << Instruction::getOpcodeName(opcode) << "." << *type;
  llvm::FunctionCallee callee =
      module.getOrInsertFunction(name, type, type, type);
  auto *function = llvm::cast<llvm::Function>(callee.getCallee());
  function->setDoesNotAccessMemory();
  function->setDoesNotThrow();
  function->setWillReturn();
  return callee;
}

void piko::holdDivisions(llvm::Function &function) {
  for (Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    if (!isDivision(instruction))
      continue;
    llvm::IRBuilder<> builder(&instruction);
    llvm::Value *call = builder.CreateCall(
        getCallee(*function.getParent(), instruction.getOpcode(),
                  instruction.getType()),
        {instruction.getOperand(0), instruction.getOperand(1)});
    instruction.replaceAllUsesWith(call);
    instruction.eraseFromParent();
  }
}

/// Whether a division is known to have a result.
static bool hasResult(unsigned opcode, llvm::Value *a, llvm::Value *b,
                      const Instruction *at, const llvm::DataLayout &data) {
  llvm::SimplifyQuery query(data, at);
  llvm::Constant *zero = llvm::Constant::getNullValue(b->getType());
  bool isNonZero =
      llvm::isKnownNonZero(b, query) ||
      llvm::isImpliedByDomCondition(llvm::ICmpInst::ICMP_NE, b, zero, at, data)
          .value_or(false);
  return isNonZero &&
         (!isSigned(opcode) || llvm::isKnownNonNegative(a, query) ||
          llvm::isKnownNonNegative(b, query) ||
          (llvm::isa<llvm::ConstantInt>(b) &&
           !llvm::cast<llvm::ConstantInt>(b)->isMinusOne()));
}

bool piko::releaseDivisions(llvm::Function &function) {
  const llvm::DataLayout &data = function.getDataLayout();
  bool changed = false;
  for (Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    auto *call = dyn_cast<llvm::CallInst>(&instruction);
    if (!call || !call->getCalledFunction())
      continue;
    std::optional<unsigned> opcode =
        getDivision(call->getCalledFunction()->getName());
    if (!opcode)
      continue;
    llvm::Value *a = call->getArgOperand(0), *b = call->getArgOperand(1);
    llvm::IRBuilder<> builder(call);
    llvm::Value *result = nullptr;
    if (isSigned(*opcode) &&
        llvm::PatternMatch::match(b, llvm::PatternMatch::m_AllOnes()))
      // As C++ compilers have it where they know the divisor.
      result = *opcode == Instruction::SDiv
                   ? builder.CreateNeg(a)
                   : llvm::Constant::getNullValue(a->getType());
    else if (hasResult(*opcode, a, b, call, data))
      result = builder.CreateBinOp(static_cast<Instruction::BinaryOps>(*opcode),
                                   a, b);
    if (!result)
      continue;
    call->replaceAllUsesWith(result);
    call->eraseFromParent();
    changed = true;
  }
  return changed;
}
