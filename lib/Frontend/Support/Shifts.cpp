//===- Shifts.cpp - Shifts by any amount ----------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Support/Shifts.h"

#include "llvm/Analysis/ValueTracking.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Module.h"
#include "llvm/Support/KnownBits.h"

using namespace piko;

void piko::defineShifts(llvm::Function &function) {
  const llvm::DataLayout &data = function.getParent()->getDataLayout();
  for (llvm::Instruction &shift :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    unsigned width = shift.getType()->getScalarSizeInBits();
    if (!shift.isShift() || !llvm::isPowerOf2_32(width))
      continue;
    llvm::Value *amount = shift.getOperand(1);
    if (llvm::computeKnownBits(amount, data).getMaxValue().ult(width))
      continue;
    llvm::IRBuilder<> builder(&shift);
    shift.setOperand(1, builder.CreateAnd(amount, width - 1));
  }
}
