//===- ExpandComparisons.cpp - Comparisons of arrays of integers ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The standard library compares arrays of integers, as == of std::array and
// std::equal do, by bytes, and says how many elements there are. It becomes a
// loop over elements:
//
//   memcmp(a, b, 4 * n)   ->   for k in 0 .. n: a[k] != b[k] ends it
//
// Of elements of several bytes it only asks whether all are equal: what comes
// first by bytes is not what comes first by numbers.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"

#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/PatternMatch.h"

using namespace piko;

/// Whether a call only finds out if all is equal.
static bool asksForEquality(const llvm::CallInst &call) {
  // Inside of std::equal.
  if (call.getFunction()->getName().starts_with("_ZSt8__memcmpI"))
    return true;
  return llvm::all_of(call.users(), [](const llvm::User *user) {
    auto *compare = llvm::dyn_cast<llvm::ICmpInst>(user);
    return compare && compare->isEquality() &&
           llvm::PatternMatch::match(compare->getOperand(1),
                                     llvm::PatternMatch::m_Zero());
  });
}

/// Bytes of the elements that a call compares, and how many there are; 0 if the
/// call does not say so.
static std::pair<uint64_t, llvm::Value *>
getElements(const llvm::CallInst &call) {
  using namespace llvm::PatternMatch;
  const llvm::APInt *size = nullptr;
  llvm::Value *count = nullptr;
  if (call.arg_size() == 3 &&
      match(call.getArgOperand(2), m_c_Mul(m_APInt(size), m_Value(count))) &&
      size->isPowerOf2() && size->ule(8))
    return {size->getZExtValue(), count};
  return {0, nullptr};
}

/// Compares numbers of these bits, in the order of unsigned ones.
static llvm::Function *createComparison(llvm::Module &module,
                                        llvm::FunctionType *type,
                                        unsigned bits) {
  std::string name = "piko.compare.i" + std::to_string(bits);
  if (llvm::Function *known = module.getFunction(name))
    return known;
  auto *function = llvm::Function::Create(
      type, llvm::GlobalValue::InternalLinkage, name, module);
  llvm::LLVMContext &context = module.getContext();
  auto block = [&](const char *label) {
    return llvm::BasicBlock::Create(context, label, function);
  };
  llvm::BasicBlock *entry = block("entry"), *head = block("head"),
                   *body = block("body"), *next = block("next"),
                   *differ = block("differ"), *equal = block("equal");
  llvm::Value *count = function->getArg(2);
  llvm::IRBuilder<> builder(entry);
  builder.CreateBr(head);

  builder.SetInsertPoint(head);
  llvm::PHINode *k = builder.CreatePHI(count->getType(), 2);
  k->addIncoming(llvm::ConstantInt::get(k->getType(), 0), entry);
  builder.CreateCondBr(builder.CreateICmpULT(k, count), body, equal);

  builder.SetInsertPoint(body);
  llvm::Type *element = builder.getIntNTy(bits);
  auto load = [&](unsigned array) {
    return builder.CreateLoad(
        element,
        builder.CreateInBoundsGEP(element, function->getArg(array), {k}));
  };
  llvm::Value *a = load(0), *b = load(1);
  builder.CreateCondBr(builder.CreateICmpEQ(a, b), next, differ);

  builder.SetInsertPoint(next);
  k->addIncoming(builder.CreateAdd(k, llvm::ConstantInt::get(k->getType(), 1)),
                 next);
  builder.CreateBr(head);

  builder.SetInsertPoint(differ);
  llvm::Type *result = type->getReturnType();
  builder.CreateRet(builder.CreateSelect(
      builder.CreateICmpULT(a, b), llvm::ConstantInt::getSigned(result, -1),
      llvm::ConstantInt::get(result, 1)));
  builder.SetInsertPoint(equal);
  builder.CreateRet(llvm::ConstantInt::get(result, 0));
  return function;
}

void piko::expandComparisons(llvm::Module &module) {
  llvm::Function *compare = module.getFunction("memcmp");
  if (!compare || !compare->isDeclaration())
    return;
  for (llvm::User *user : llvm::make_early_inc_range(compare->users())) {
    auto *call = llvm::dyn_cast<llvm::CallInst>(user);
    if (!call || call->getCalledFunction() != compare)
      continue;
    auto [size, count] = getElements(*call);
    if (size == 0 || (size > 1 && !asksForEquality(*call)))
      continue;
    call->setArgOperand(2, count);
    call->setCalledFunction(createComparison(module, compare->getFunctionType(),
                                             unsigned(8 * size)));
  }
}
