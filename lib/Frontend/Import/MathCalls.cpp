//===- MathCalls.cpp - Functions with one meaning everywhere --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/MathCalls.h"

#include "Support/CallChain.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/IR/IRBuilder.h"
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
/// Functions that LLVM knows, by whose names Clang calls them unless their
/// address is taken.
static constexpr std::pair<llvm::StringLiteral, llvm::Intrinsic::ID> known[] = {
    {"ceil", llvm::Intrinsic::ceil},
    {"copysign", llvm::Intrinsic::copysign},
    {"fabs", llvm::Intrinsic::fabs},
    {"floor", llvm::Intrinsic::floor},
    {"fma", llvm::Intrinsic::fma},
    {"fmax", llvm::Intrinsic::maxnum},
    {"fmin", llvm::Intrinsic::minnum},
    {"nearbyint", llvm::Intrinsic::nearbyint},
    {"rint", llvm::Intrinsic::rint},
    {"round", llvm::Intrinsic::round},
    {"roundeven", llvm::Intrinsic::roundeven},
    {"sqrt", llvm::Intrinsic::sqrt},
    {"trunc", llvm::Intrinsic::trunc}};

/// The name of a function of the C library, without the f of float.
static llvm::StringRef getLibraryName(const llvm::Function &function) {
  llvm::StringRef name = function.getName();
  if (!function.isDeclaration() || function.arg_empty())
    return "";
  if (function.getArg(0)->getType()->isFloatTy())
    name.consume_back("f");
  return name;
}

llvm::StringRef piko::getMathName(const llvm::Function &function) {
  llvm::StringRef name = function.getName();
  if (name.consume_front("llvm."))
    name = name.split('.').first;
  else
    name = getLibraryName(function);
  if (name == "scalbn")
    name = "ldexp";
  bool found =
      llvm::is_contained(inexact, name) || llvm::is_contained(exact, name);
  return found ? name : "";
}

/// What Piko lacks for a function of another type than float; empty if nothing.
std::string piko::getMissingMath(const llvm::Function &function) {
  llvm::StringRef name = getMathName(function);
  if (name.empty())
    return "";
  llvm::Type *type = function.getArg(0)->getType();
  bool isExact = llvm::is_contained(exact, name);
  if (type->isFloatTy() || (isExact && type->isDoubleTy()))
    return "";
  return ("'" + name + "' of a " +
          (type->isDoubleTy() ? "double"
           : type->isHalfTy() ? "_Float16"
                              : "long double") +
          ": Piko has only that of a float" + (isExact ? " or a double" : ""))
      .str();
}

/// Calls a function that LLVM knows as Clang does.
static void callIntrinsic(llvm::CallInst *call) {
  llvm::Function *callee = call->getCalledFunction();
  llvm::Type *type = call->getType();
  if (callee->isIntrinsic() || (!type->isFloatTy() && !type->isDoubleTy()))
    return;
  llvm::StringRef name = getLibraryName(*callee);
  for (auto [function, intrinsic] : known) {
    if (name != function)
      continue;
    llvm::Function *declared = llvm::Intrinsic::getOrInsertDeclaration(
        call->getModule(), intrinsic, {type});
    if (declared->getFunctionType() == callee->getFunctionType())
      call->setCalledFunction(declared);
  }
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

/// A call of ours with as many of the arguments as it takes.
static llvm::Value *callOurs(llvm::CallInst *call, const llvm::Twine &name) {
  bool isDouble = call->getArgOperand(0)->getType()->isDoubleTy();
  llvm::Function *ours = call->getModule()->getFunction(
      (mathPrefix + name + (isDouble ? "_double" : "")).str());
  llvm::SmallVector<llvm::Value *> arguments(call->args());
  arguments.truncate(ours->arg_size());
  return llvm::IRBuilder<>(call).CreateCall(ours, arguments);
}

/// The same for a function with one or two results. The second is an element of
/// a structure, or goes to where a pointer says.
static llvm::Value *expandCall(llvm::CallInst *call, llvm::StringRef name) {
  if (name != "frexp" && name != "modf")
    return callOurs(call, name);
  llvm::IRBuilder<> builder(call);
  llvm::Value *first = callOurs(call, name + "0");
  llvm::Value *second = callOurs(call, name + "1");
  if (!call->getType()->isStructTy()) {
    builder.CreateStore(second, call->getArgOperand(1));
    return first;
  }
  llvm::Value *results = llvm::PoisonValue::get(call->getType());
  results = builder.CreateInsertValue(results, first, 0);
  return builder.CreateInsertValue(results, second, 1);
}

static void warn(llvm::CallInst *call, llvm::StringRef name, ParsedUnit &unit,
                 mlir::MLIRContext &context) {
  mlir::Location location = getUserLocation(call, unit, context);
  if (unit.warned.insert(location).second)
    mlir::emitWarning(location)
        << "'" << name << "' is compiled as piko::" << name
        << ": a plain C++ build of this file may differ, unless you write that";
}

bool piko::redirectMathCalls(llvm::Function &function, ParsedUnit &unit,
                             mlir::MLIRContext &context) {
  bool changed = false;
  for (llvm::Instruction &instruction :
       llvm::make_early_inc_range(llvm::instructions(function))) {
    auto *call = llvm::dyn_cast<llvm::CallInst>(&instruction);
    if (!call || !call->getCalledFunction())
      continue;
    callIntrinsic(call);
    llvm::Value *result = expandExtremum(call);
    if (!result) {
      llvm::StringRef name = getMathName(*call->getCalledFunction());
      if (name.empty() || !getMissingMath(*call->getCalledFunction()).empty())
        continue;
      result = expandCall(call, name);
      if (llvm::is_contained(inexact, name))
        warn(call, name, unit, context);
    }
    call->replaceAllUsesWith(result);
    call->eraseFromParent();
    changed = true;
  }
  return changed;
}
