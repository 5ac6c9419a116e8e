// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Approximations, refined: `first + share * error`, where `error` tells how far
// `first` is off, 1 - x * first for a reciprocal. Where `first` is infinite or
// 0, `error` is NaN or infinite, and `first` is the result. So nothing is lost
// where no number is near.

#include "Piko/Target/Approximation.h"

#include "Piko/Conversion/Approximations.h"

using namespace llvm;
using namespace piko;

std::optional<Approximation> piko::getApproximation(const Function &function) {
  if (!function.isDeclaration())
    return std::nullopt;
  StringRef kind = function.getName().rsplit('.').first;
  if (kind == approximateReciprocal)
    return Approximation::Reciprocal;
  if (kind == approximateRsqrt)
    return Approximation::Rsqrt;
  if (kind == approximateSqrt)
    return Approximation::Sqrt;
  return std::nullopt;
}

Value *piko::refine(IRBuilderBase &builder, Approximation kind, Value *x,
                    Value *first) {
  auto constant = [&](double value) {
    return ConstantFP::get(x->getType(), value);
  };
  auto fma = [&](Value *a, Value *b, Value *c) {
    return builder.CreateIntrinsic(Intrinsic::fma, {x->getType()}, {a, b, c});
  };
  bool isRoot = kind == Approximation::Sqrt;
  // What is refined, and what it is when there is nothing to refine.
  Value *start = first, *otherwise = first;
  Value *near = x; // near * first is 1 but for the error
  if (kind != Approximation::Reciprocal)
    near = builder.CreateFMul(x, first);
  if (isRoot) {
    start = near;
    // 0 and infinity, which are their own roots, and what counts as 0; but of a
    // negative number there is none.
    otherwise =
        builder.CreateSelect(builder.CreateFCmpUNO(first, first), first, x);
  }
  Value *error = fma(builder.CreateFNeg(near), first, constant(1));
  Value *share = kind == Approximation::Reciprocal
                     ? start
                     : builder.CreateFMul(start, constant(0.5));
  // Of 0 and infinity the error is NaN; of what counted as 0, -infinity.
  Value *isNumber = builder.CreateFCmpOGT(error, constant(-1));
  // Of a negative number that counted as 0 it is +infinity, as `first` is
  // -infinity: only a root shows that.
  if (isRoot)
    isNumber =
        builder.CreateAnd(isNumber, builder.CreateFCmpOLT(error, constant(1)));
  return builder.CreateSelect(isNumber, fma(share, error, start), otherwise);
}

Value *piko::computeExactly(IRBuilderBase &builder, Approximation kind,
                            Value *x) {
  if (kind != Approximation::Reciprocal)
    x = builder.CreateUnaryIntrinsic(Intrinsic::sqrt, x);
  return kind == Approximation::Sqrt
             ? x
             : builder.CreateFDiv(ConstantFP::get(x->getType(), 1.0), x);
}

void piko::replaceApproximations(
    Module &module,
    function_ref<Value *(IRBuilderBase &, Approximation, Value *)> write) {
  for (Function &function : make_early_inc_range(module)) {
    std::optional<Approximation> kind = getApproximation(function);
    if (!kind)
      continue;
    for (User *user : make_early_inc_range(function.users())) {
      auto *call = dyn_cast<CallInst>(user);
      if (!call)
        continue;
      IRBuilder<> builder(call);
      call->replaceAllUsesWith(write(builder, *kind, call->getArgOperand(0)));
      call->eraseFromParent();
    }
    if (function.use_empty())
      function.eraseFromParent();
  }
}
