// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/LowerArithmetic.h"

#include "Piko/Conversion/Approximations.h"
#include "Piko/Target/Approximation.h"

#include "llvm/CodeGen/TargetSubtargetInfo.h"
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

/// What x86 has for approximations, by the number of lanes.
struct VectorInstruction {
  int64_t lanes;
  Intrinsic::ID reciprocal, rsqrt;
  /// Whether it also takes a vector and a mask, for lanes that are left out.
  bool isMasked;
};

constexpr VectorInstruction instructions14[] = {
    {4, Intrinsic::x86_avx512_rcp14_ps_128,
     Intrinsic::x86_avx512_rsqrt14_ps_128, true},
    {8, Intrinsic::x86_avx512_rcp14_ps_256,
     Intrinsic::x86_avx512_rsqrt14_ps_256, true},
    {16, Intrinsic::x86_avx512_rcp14_ps_512,
     Intrinsic::x86_avx512_rsqrt14_ps_512, true}};
constexpr VectorInstruction instructions12[] = {
    {4, Intrinsic::x86_sse_rcp_ps, Intrinsic::x86_sse_rsqrt_ps, false},
    {8, Intrinsic::x86_avx_rcp_ps_256, Intrinsic::x86_avx_rsqrt_ps_256, false}};

/// Writes instructions for what approximates a number, or each one of a vector.
class ApproximationWriter {
public:
  ApproximationWriter(IRBuilderBase &builder, bool isReciprocal,
                      ArrayRef<VectorInstruction> instructions)
      : builder(builder), isReciprocal(isReciprocal),
        instructions(instructions) {}
  Value *write(Value *x);

private:
  Value *writeScalar(Value *x);
  /// Of as many lanes as the instruction has.
  Value *apply(const VectorInstruction &instruction, Value *vector);

  IRBuilderBase &builder;
  bool isReciprocal;
  ArrayRef<VectorInstruction> instructions;
};

} // namespace

Value *ApproximationWriter::apply(const VectorInstruction &instruction,
                                  Value *vector) {
  SmallVector<Value *> arguments{vector};
  if (instruction.isMasked) {
    arguments.push_back(Constant::getNullValue(vector->getType()));
    arguments.push_back(Constant::getAllOnesValue(
        builder.getIntNTy(std::max<int64_t>(instruction.lanes, 8))));
  }
  return builder.CreateIntrinsic(
      isReciprocal ? instruction.reciprocal : instruction.rsqrt, arguments);
}

Value *ApproximationWriter::writeScalar(Value *x) {
  const VectorInstruction &narrowest = instructions.front();
  Value *vector =
      PoisonValue::get(FixedVectorType::get(x->getType(), narrowest.lanes));
  vector = builder.CreateInsertElement(vector, x, uint64_t(0));
  return builder.CreateExtractElement(apply(narrowest, vector), uint64_t(0));
}

/// Cuts a vector into those that instructions take, and fills up the last one.
Value *ApproximationWriter::write(Value *x) {
  auto *type = dyn_cast<FixedVectorType>(x->getType());
  if (!type)
    return writeScalar(x);
  int64_t lanes = type->getNumElements();
  const VectorInstruction *found =
      find_if(instructions,
              [&](const VectorInstruction &i) { return i.lanes >= lanes; });
  const VectorInstruction &instruction =
      found == instructions.end() ? instructions.back() : *found;
  Value *result = PoisonValue::get(type);
  for (int64_t first = 0; first < lanes; first += instruction.lanes) {
    SmallVector<int> cut;
    for (int64_t lane = first; lane < first + instruction.lanes; ++lane)
      cut.push_back(lane < lanes ? int(lane) : PoisonMaskElem);
    Value *part = apply(instruction, builder.CreateShuffleVector(x, cut));
    // As long as the result, to be put into it.
    SmallVector<int> widen, paste;
    for (int64_t lane = 0; lane < lanes; ++lane) {
      bool isHere = lane >= first && lane < first + instruction.lanes;
      widen.push_back(isHere ? int(lane - first) : PoisonMaskElem);
      paste.push_back(isHere ? int(lanes + lane) : int(lane));
    }
    result = builder.CreateShuffleVector(
        result, builder.CreateShuffleVector(part, widen), paste);
  }
  return result;
}

/// A function may be for a later processor than the object.
static bool hasFma(const TargetMachine &machine, const Function &function) {
  return !machine.getTargetTriple().isX86() ||
         machine.getSubtargetImpl(function)->checkFeatures("+fma");
}

/// What the machine has, narrowest first. Without instructions for the step of
/// Newton's method, approximations would save nothing.
static ArrayRef<VectorInstruction> getInstructions(const TargetMachine &machine,
                                                   const Function &function) {
  if (!machine.getTargetTriple().isX86() || !hasFma(machine, function))
    return {};
  return machine.getSubtargetImpl(function)->checkFeatures("+avx512vl")
             ? ArrayRef(instructions14)
             : ArrayRef(instructions12);
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

PreservedAnalyses LowerArithmeticPass::run(Module &module,
                                           ModuleAnalysisManager &) {
  // It kept the vector forms from being removed.
  removeFromUsedLists(module, [](Constant *kept) {
    auto *function = dyn_cast<Function>(kept->stripPointerCasts());
    return function && getApproximation(*function);
  });
  replaceApproximations(
      module, [&](IRBuilderBase &builder, Approximation kind, Value *x) {
        ArrayRef<VectorInstruction> instructions =
            getInstructions(*machine, *builder.GetInsertBlock()->getParent());
        if (instructions.empty())
          return computeExactly(builder, kind, x);
        ApproximationWriter writer(builder, kind == Approximation::Reciprocal,
                                   instructions);
        return refine(builder, kind, x, writer.write(x));
      });
  return PreservedAnalyses::none();
}

static void expandFmas(Module &module, const TargetMachine &machine) {
  for (Function &function : module) {
    if (function.getIntrinsicID() != Intrinsic::fma ||
        !function.getReturnType()->getScalarType()->isFloatTy())
      continue;
    for (User *user : make_early_inc_range(function.users())) {
      auto *call = cast<CallInst>(user);
      if (hasFma(machine, *call->getFunction()))
        continue;
      call->replaceAllUsesWith(expandFma(call));
      call->eraseFromParent();
    }
  }
}

static void declareVectorForms(Module &module) {
  for (StringRef kind :
       {approximateReciprocal, approximateRsqrt, approximateSqrt}) {
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
