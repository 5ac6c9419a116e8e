//===- MathCalls.cpp - Functions with one meaning everywhere --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "MathCalls.h"

#include "Cleanup.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"

using namespace piko;

/// Functions whose last bits differ between machines: piko:: has its own.
static constexpr llvm::StringLiteral inexact[] = {
    "acos",  "asin", "atan",  "atan2", "cbrt", "cos", "cosh", "exp", "exp2",
    "hypot", "log",  "log10", "log2",  "pow",  "sin", "sinh", "tan", "tanh"};
/// Functions with one correct result.
static constexpr llvm::StringLiteral exact[] = {
    "fdim", "frexp", "ldexp", "llrint", "llround", "lrint", "lround", "modf"};

llvm::StringRef piko::getMathName(const llvm::Function &function) {
  llvm::StringRef name = function.getName();
  if (name.consume_front("llvm."))
    name = name.split('.').first;
  else if (!function.isDeclaration() || function.arg_empty())
    return "";
  else if (function.getArg(0)->getType()->isFloatTy())
    name.consume_back("f");
  if (name == "scalbn")
    name = "ldexp";
  bool found =
      llvm::is_contained(inexact, name) || llvm::is_contained(exact, name);
  return found ? name : "";
}

/// Minima and maxima as comparisons: the first of equals, and the other number
/// for a NaN, which is one or two instructions on most machines.
static llvm::Value *expandExtremum(llvm::CallInst *call) {
  bool isMin = call->getIntrinsicID() == llvm::Intrinsic::minnum;
  if (!isMin && call->getIntrinsicID() != llvm::Intrinsic::maxnum)
    return nullptr;
  llvm::IRBuilder<> builder(call);
  llvm::Value *a = call->getArgOperand(0), *b = call->getArgOperand(1);
  llvm::Value *beats =
      isMin ? builder.CreateFCmpOLT(b, a) : builder.CreateFCmpOLT(a, b);
  llvm::Value *isNaN = builder.CreateFCmpUNO(a, a);
  return builder.CreateSelect(builder.CreateOr(beats, isNaN), b, a);
}

/// A call of ours with the same arguments; null if there is no such function.
static llvm::Value *callOurs(llvm::CallInst *call, llvm::StringRef name) {
  llvm::Function *ours =
      call->getModule()->getFunction((mathPrefix + name).str());
  if (!ours)
    return nullptr;
  llvm::SmallVector<llvm::Value *> arguments(call->args());
  return llvm::IRBuilder<>(call).CreateCall(ours, arguments);
}

/// The same for a function with one or two results.
static llvm::Value *expandCall(llvm::CallInst *call, llvm::StringRef name) {
  if (!call->getType()->isStructTy())
    return callOurs(call, name);
  llvm::IRBuilder<> builder(call);
  llvm::Value *results = llvm::PoisonValue::get(call->getType());
  for (unsigned i : {0u, 1u})
    results = builder.CreateInsertValue(
        results, callOurs(call, (name + llvm::Twine(i)).str()), i);
  return results;
}

static void warn(llvm::CallInst *call, llvm::StringRef name, ParsedUnit &unit,
                 mlir::MLIRContext &context) {
  mlir::Location location = getUserLocation(call, unit, context);
  if (unit.warned.insert(location).second)
    mlir::emitWarning(location)
        << "'" << name << "' is compiled as piko::" << name
        << ": a plain C++ build of this file may differ";
}

void piko::redirectMathCalls(llvm::Function &function, ParsedUnit &unit,
                             mlir::MLIRContext &context) {
  for (llvm::Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    auto *call = llvm::dyn_cast<llvm::CallInst>(&instruction);
    if (!call || !call->getCalledFunction())
      continue;
    llvm::Value *result = expandExtremum(call);
    if (!result) {
      llvm::StringRef name = getMathName(*call->getCalledFunction());
      if (name.empty())
        continue;
      result = expandCall(call, name);
      if (llvm::is_contained(inexact, name))
        warn(call, name, unit, context);
    }
    call->replaceAllUsesWith(result);
    call->eraseFromParent();
  }
}
