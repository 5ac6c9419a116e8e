//===- MathCalls.cpp - Functions with one meaning everywhere --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "MathCalls.h"

#include "Cleanup.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/ADT/StringSwitch.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"

using namespace piko;

/// The C library's name for a transcendental function of floats, without the
/// f; empty if the function is not one.
static llvm::StringRef getMathName(const llvm::Function &function) {
  if (!function.getReturnType()->isFloatTy())
    return "";
  switch (function.getIntrinsicID()) {
#define MATH(NAME)                                                             \
  case llvm::Intrinsic::NAME:                                                  \
    return #NAME;
    MATH(exp)
    MATH(exp2)
    MATH(log)
    MATH(log2)
    MATH(pow)
    MATH(sin)
    MATH(cos)
    MATH(tan)
    MATH(asin)
    MATH(acos)
    MATH(atan)
    MATH(atan2)
#undef MATH
  case llvm::Intrinsic::not_intrinsic:
    break;
  default:
    return "";
  }
  if (!function.isDeclaration())
    return "";
  return llvm::StringSwitch<llvm::StringRef>(function.getName())
      .Case("expf", "exp")
      .Case("exp2f", "exp2")
      .Case("logf", "log")
      .Case("log2f", "log2")
      .Case("powf", "pow")
      .Case("sinf", "sin")
      .Case("cosf", "cos")
      .Case("tanf", "tan")
      .Case("asinf", "asin")
      .Case("acosf", "acos")
      .Case("atanf", "atan")
      .Case("atan2f", "atan2")
      .Case("cbrtf", "cbrt")
      .Default("");
}

bool piko::isMathFunction(const llvm::Function &function) {
  return !getMathName(function).empty();
}

/// min is b < a ? b : a, max is a < b ? b : a.
static bool redirectExtremum(llvm::CallInst *call) {
  bool isMin;
  switch (call->getIntrinsicID()) {
  case llvm::Intrinsic::minnum:
  case llvm::Intrinsic::minimum:
  case llvm::Intrinsic::minimumnum:
    isMin = true;
    break;
  case llvm::Intrinsic::maxnum:
  case llvm::Intrinsic::maximum:
  case llvm::Intrinsic::maximumnum:
    isMin = false;
    break;
  default:
    return false;
  }
  llvm::IRBuilder<> builder(call);
  llvm::Value *a = call->getArgOperand(0), *b = call->getArgOperand(1);
  llvm::Value *takesB =
      isMin ? builder.CreateFCmpOLT(b, a) : builder.CreateFCmpOLT(a, b);
  call->replaceAllUsesWith(builder.CreateSelect(takesB, b, a));
  call->eraseFromParent();
  return true;
}

void piko::redirectMathCalls(llvm::Function &function, ParsedUnit &unit,
                             mlir::MLIRContext &context) {
  for (llvm::Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    auto *call = llvm::dyn_cast<llvm::CallInst>(&instruction);
    if (!call || !call->getCalledFunction() || redirectExtremum(call))
      continue;
    llvm::StringRef name = getMathName(*call->getCalledFunction());
    if (name.empty())
      continue;
    llvm::Function *ours =
        function.getParent()->getFunction((mathPrefix + name).str());
    if (!ours)
      continue;
    mlir::Location location = getUserLocation(call, unit, context);
    if (unit.warned.insert(location).second)
      mlir::emitWarning(location)
          << "'" << name << "' is compiled as piko::" << name
          << ": a plain C++ build of this file may differ";
    call->setCalledFunction(ours);
  }
}
