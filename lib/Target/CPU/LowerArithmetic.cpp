// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "LowerArithmetic.h"

#include "Piko/Conversion/Approximations.h"

#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/IntrinsicsX86.h"
#include "llvm/IR/Module.h"
#include "llvm/IR/VFABIDemangler.h"
#include "llvm/MC/MCSubtargetInfo.h"
#include "llvm/Transforms/Utils/ModuleUtils.h"

using namespace llvm;
using namespace piko;

namespace {

/// What x86 has for an approximation, by the number of lanes.
struct Approximation {
  int64_t lanes;
  Intrinsic::ID reciprocal, rsqrt;
  /// Whether it also takes a vector and a mask, for lanes that are left out.
  bool isMasked;
};

constexpr Approximation instructions14[] = {
    {4, Intrinsic::x86_avx512_rcp14_ps_128,
     Intrinsic::x86_avx512_rsqrt14_ps_128, true},
    {8, Intrinsic::x86_avx512_rcp14_ps_256,
     Intrinsic::x86_avx512_rsqrt14_ps_256, true},
    {16, Intrinsic::x86_avx512_rcp14_ps_512,
     Intrinsic::x86_avx512_rsqrt14_ps_512, true}};
constexpr Approximation instructions12[] = {
    {4, Intrinsic::x86_sse_rcp_ps, Intrinsic::x86_sse_rsqrt_ps, false},
    {8, Intrinsic::x86_avx_rcp_ps_256, Intrinsic::x86_avx_rsqrt_ps_256, false}};

/// Writes an approximation in front of the call that it replaces.
class Writer {
public:
  Writer(CallInst *call, bool isRsqrt, ArrayRef<Approximation> instructions)
      : builder(call), operand(call->getArgOperand(0)), isRsqrt(isRsqrt),
        instructions(instructions) {}
  Value *write();

private:
  Value *divide();
  Value *apply(const Approximation &instruction, Value *vector);

  IRBuilder<> builder;
  Value *operand;
  bool isRsqrt;
  ArrayRef<Approximation> instructions;
};

} // namespace

/// Of no instruction there is the exact result.
Value *Writer::divide() {
  Value *divisor = isRsqrt
                       ? builder.CreateUnaryIntrinsic(Intrinsic::sqrt, operand)
                       : operand;
  return builder.CreateFDiv(ConstantFP::get(operand->getType(), 1.0), divisor);
}

Value *Writer::apply(const Approximation &instruction, Value *vector) {
  SmallVector<Value *> arguments{vector};
  if (instruction.isMasked) {
    arguments.push_back(Constant::getNullValue(vector->getType()));
    arguments.push_back(Constant::getAllOnesValue(
        builder.getIntNTy(std::max<int64_t>(instruction.lanes, 8))));
  }
  return builder.CreateIntrinsic(
      isRsqrt ? instruction.rsqrt : instruction.reciprocal, arguments);
}

/// Cuts a vector into those that instructions take, and fills up the last one.
Value *Writer::write() {
  if (instructions.empty())
    return divide();
  auto *type = dyn_cast<FixedVectorType>(operand->getType());
  int64_t lanes = type ? type->getNumElements() : 1;
  const Approximation *widest = find_if(
      instructions, [&](const Approximation &i) { return i.lanes >= lanes; });
  if (widest == instructions.end())
    --widest;
  if (!type) {
    Value *vector = PoisonValue::get(
        FixedVectorType::get(operand->getType(), widest->lanes));
    vector = builder.CreateInsertElement(vector, operand, uint64_t(0));
    return builder.CreateExtractElement(apply(*widest, vector), uint64_t(0));
  }
  Value *result = PoisonValue::get(type);
  for (int64_t first = 0; first < lanes; first += widest->lanes) {
    SmallVector<int> cut, paste(lanes);
    for (int64_t lane = 0; lane < widest->lanes; ++lane)
      cut.push_back(first + lane < lanes ? int(first + lane) : PoisonMaskElem);
    Value *part = apply(*widest, builder.CreateShuffleVector(operand, cut));
    // As long as the result, to be put into it.
    SmallVector<int> widen;
    for (int64_t lane = 0; lane < lanes; ++lane) {
      bool isHere = lane >= first && lane < first + widest->lanes;
      widen.push_back(isHere ? int(lane - first) : PoisonMaskElem);
      paste[lane] = isHere ? int(lanes + lane) : int(lane);
    }
    result = builder.CreateShuffleVector(
        result, builder.CreateShuffleVector(part, widen), paste);
  }
  return result;
}

/// What the machine has, narrowest first.
static ArrayRef<Approximation> getInstructions(const TargetMachine &machine) {
  const MCSubtargetInfo &info = *machine.getMCSubtargetInfo();
  if (!machine.getTargetTriple().isX86())
    return {};
  if (info.checkFeatures("+avx512vl"))
    return instructions14;
  return ArrayRef(instructions12).drop_back(!info.checkFeatures("+avx"));
}

/// a * b + c, rounded once. The product is exact in double; the sum is rounded
/// to odd, so that rounding it again, to float, is as good as rounding once.
static Value *expandFma(CallInst *call) {
  IRBuilder<> builder(call);
  auto getLike = [&](Type *scalar) -> Type * {
    auto *vector = dyn_cast<VectorType>(call->getType());
    return vector ? VectorType::get(scalar, vector->getElementCount()) : scalar;
  };
  Type *wide = getLike(builder.getDoubleTy());
  Type *word = getLike(builder.getInt64Ty());
  auto widen = [&](unsigned i) {
    return builder.CreateFPExt(call->getArgOperand(i), wide);
  };
  Value *product = builder.CreateFMul(widen(0), widen(1)), *addend = widen(2);
  Value *sum = builder.CreateFAdd(product, addend);
  Value *part = builder.CreateFSub(sum, product);
  Value *error = builder.CreateFAdd(
      builder.CreateFSub(product, builder.CreateFSub(sum, part)),
      builder.CreateFSub(addend, part));
  Constant *zero = Constant::getNullValue(wide);
  Value *bits = builder.CreateBitCast(sum, word);
  Value *isEven =
      builder.CreateICmpEQ(builder.CreateAnd(bits, ConstantInt::get(word, 1)),
                           Constant::getNullValue(word));
  Value *isLarger = builder.CreateICmpEQ(builder.CreateFCmpOGT(error, zero),
                                         builder.CreateFCmpOGT(sum, zero));
  Value *odd = builder.CreateSelect(
      isLarger, builder.CreateAdd(bits, ConstantInt::get(word, 1)),
      builder.CreateSub(bits, ConstantInt::get(word, 1)));
  Value *isInexact = builder.CreateFCmpONE(error, zero);
  bits = builder.CreateSelect(builder.CreateAnd(isInexact, isEven), odd, bits);
  return builder.CreateFPTrunc(builder.CreateBitCast(bits, wide),
                               call->getType());
}

static void replaceCalls(Function &function,
                         function_ref<Value *(CallInst *)> write) {
  for (User *user : make_early_inc_range(function.users()))
    if (auto *call = dyn_cast<CallInst>(user)) {
      call->replaceAllUsesWith(write(call));
      call->eraseFromParent();
    }
}

static bool isApproximation(const Function &function) {
  return function.isDeclaration() &&
         (function.getName().starts_with(approximateReciprocal) ||
          function.getName().starts_with(approximateRsqrt));
}

PreservedAnalyses LowerArithmeticPass::run(Module &module,
                                           ModuleAnalysisManager &) {
  ArrayRef<Approximation> instructions = getInstructions(*machine);
  // It kept the vector forms from being removed.
  removeFromUsedLists(module, [](Constant *kept) {
    auto *function = dyn_cast<Function>(kept->stripPointerCasts());
    return function && isApproximation(*function);
  });
  for (Function &function : make_early_inc_range(module)) {
    if (!isApproximation(function))
      continue;
    bool isRsqrt = function.getName().starts_with(approximateRsqrt);
    replaceCalls(function, [&](CallInst *call) {
      return Writer(call, isRsqrt, instructions).write();
    });
    if (function.use_empty())
      function.eraseFromParent();
  }
  return PreservedAnalyses::none();
}

static void expandFmas(Module &module, const TargetMachine &machine) {
  if (!machine.getTargetTriple().isX86() ||
      machine.getMCSubtargetInfo()->checkFeatures("+fma"))
    return;
  for (Function &function : module)
    if (function.getIntrinsicID() == Intrinsic::fma &&
        function.getReturnType()->getScalarType()->isFloatTy())
      replaceCalls(function, expandFma);
}

static void declareVectorForms(Module &module) {
  for (StringRef kind : {approximateReciprocal, approximateRsqrt}) {
    std::string name = getApproximationName(kind, 0);
    Function *scalar = module.getFunction(name);
    if (!scalar)
      continue;
    std::vector<std::string> forms;
    SmallVector<GlobalValue *> kept;
    for (int64_t lanes : {4, 8, 16}) {
      std::string form = getApproximationName(kind, lanes);
      auto *type = FixedVectorType::get(scalar->getReturnType(), lanes);
      auto *function = cast<Function>(
          module.getOrInsertFunction(form, FunctionType::get(type, type, false))
              .getCallee());
      function->copyAttributesFrom(scalar);
      kept.push_back(function);
      forms.push_back("_ZGV_LLVM_N" + std::to_string(lanes) + "v_" + name +
                      "(" + form + ")");
    }
    appendToCompilerUsed(module, kept);
    for (User *user : scalar->users())
      if (auto *call = dyn_cast<CallInst>(user))
        VFABI::setVectorVariantNames(call, forms);
  }
}

void piko::prepareArithmetic(Module &module, const TargetMachine &machine) {
  expandFmas(module, machine);
  declareVectorForms(module);
}
