// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/LowerPermutations.h"

#include "Piko/Conversion/Permutations.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/Sequence.h"
#include "llvm/CodeGen/TargetSubtargetInfo.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/IntrinsicsAArch64.h"
#include "llvm/IR/IntrinsicsX86.h"

using namespace llvm;
using namespace piko;

namespace {

/// What a machine has for so many lanes of 32 bits.
struct WordPermutation {
  unsigned lanes;
  StringLiteral feature;
  Intrinsic::ID id;
};

constexpr WordPermutation x86Permutations[] = {
    {16, "+avx512f", Intrinsic::x86_avx512_permvar_si_512},
    {8, "+avx2", Intrinsic::x86_avx2_permd},
    {4, "+avx", Intrinsic::x86_avx_vpermilvar_ps},
    {4, "+ssse3", Intrinsic::x86_ssse3_pshuf_b_128}};
constexpr WordPermutation armPermutations[] = {
    {4, "+neon", Intrinsic::aarch64_neon_tbl1}};

ArrayRef<WordPermutation> getPermutations(const Triple &triple) {
  if (triple.isX86())
    return x86Permutations;
  return triple.isAArch64() ? ArrayRef(armPermutations)
                            : ArrayRef<WordPermutation>();
}

/// Writes what stands for one permutation.
class PermutationWriter {
public:
  /// Before the call.
  PermutationWriter(CallInst *call, const TargetMachine &machine);
  Value *write() { return permute(call->getArgOperand(0)); }
  /// Where the call has a mask.
  Value *compress();

private:
  Value *loadLanes(Value *mask);
  Value *permute(Value *vector);
  Value *permuteWords(Value *vector);
  Value *permuteDoubleWords(Value *vector);
  Value *permuteHalves(Value *vector);
  Value *permuteInMemory(Value *vector);

  CallInst *call;
  IRBuilder<> builder;
  Value *lanes; ///< Or a mask of them.
  unsigned count;
  const WordPermutation *instruction = nullptr; ///< if there is one
};

} // namespace

PermutationWriter::PermutationWriter(CallInst *call,
                                     const TargetMachine &machine)
    : call(call), builder(call), lanes(call->getArgOperand(1)),
      count(cast<FixedVectorType>(lanes->getType())->getNumElements()) {
  const TargetSubtargetInfo &processor =
      *machine.getSubtargetImpl(*call->getFunction());
  for (const WordPermutation &one : getPermutations(machine.getTargetTriple()))
    if (!instruction && one.lanes == count &&
        processor.checkFeatures(one.feature.str()))
      instruction = &one;
}

/// Of 32 bits, by the instruction. All but that for bytes take a lane modulo
/// the number of lanes.
Value *PermutationWriter::permuteWords(Value *vector) {
  Type *type = vector->getType();
  if (instruction->id == Intrinsic::x86_avx_vpermilvar_ps) {
    auto *floats = FixedVectorType::get(builder.getFloatTy(), count);
    Value *moved = builder.CreateIntrinsic(
        instruction->id, {builder.CreateBitCast(vector, floats), lanes});
    return builder.CreateBitCast(moved, type);
  }
  bool isOfBytes = instruction->id == Intrinsic::x86_ssse3_pshuf_b_128 ||
                   instruction->id == Intrinsic::aarch64_neon_tbl1;
  if (!isOfBytes)
    return builder.CreateIntrinsic(instruction->id, {vector, lanes});
  // The bytes of a word are those of a lane, from the lowest on.
  auto *bytes = FixedVectorType::get(builder.getInt8Ty(), 4 * count);
  SmallVector<int> lowest;
  SmallVector<uint8_t> offsets;
  for (unsigned byte = 0; byte < 4 * count; ++byte) {
    lowest.push_back(int(byte / 4 * 4));
    offsets.push_back(byte % 4);
  }
  Value *which = builder.CreateAnd(lanes, count - 1);
  which = builder.CreateShl(which, 2);
  which =
      builder.CreateShuffleVector(builder.CreateBitCast(which, bytes), lowest);
  which = builder.CreateOr(
      which, ConstantDataVector::get(builder.getContext(), offsets));
  SmallVector<Type *> overloads;
  if (instruction->id == Intrinsic::aarch64_neon_tbl1)
    overloads.push_back(bytes);
  Value *moved =
      builder.CreateIntrinsic(instruction->id, overloads,
                              {builder.CreateBitCast(vector, bytes), which});
  return builder.CreateBitCast(moved, type);
}

/// Of 64 bits, where two registers hold the vector, of which one instruction
/// takes what it needs.
Value *PermutationWriter::permuteDoubleWords(Value *vector) {
  auto getHalf = [&](Value *whole, unsigned first) {
    return builder.CreateShuffleVector(
        whole, to_vector(seq<int>(first, first + count / 2)));
  };
  Value *wide = builder.CreateZExt(lanes, vector->getType());
  Value *low = getHalf(vector, 0), *high = getHalf(vector, count / 2);
  Value *moved[2];
  for (unsigned half : {0, 1})
    moved[half] =
        builder.CreateIntrinsic(Intrinsic::x86_avx512_vpermi2var_q_512,
                                {low, getHalf(wide, half * count / 2), high});
  return builder.CreateShuffleVector(moved[0], moved[1],
                                     to_vector(seq<int>(0, count)));
}

/// Of 64 bits, as words, of which a vector holds as many as there are lanes.
Value *PermutationWriter::permuteHalves(Value *vector) {
  auto *words = FixedVectorType::get(builder.getInt32Ty(), 2 * count);
  Value *all = builder.CreateBitCast(vector, words);
  SmallVector<int> low, high, mix;
  for (unsigned lane = 0; lane < count; ++lane) {
    low.push_back(int(2 * lane));
    high.push_back(int(2 * lane + 1));
    mix.append({int(lane), int(count + lane)});
  }
  Value *lows = permuteWords(builder.CreateShuffleVector(all, low));
  Value *highs = permuteWords(builder.CreateShuffleVector(all, high));
  return builder.CreateBitCast(builder.CreateShuffleVector(lows, highs, mix),
                               vector->getType());
}

Value *PermutationWriter::permuteInMemory(Value *vector) {
  auto *type = cast<FixedVectorType>(vector->getType());
  BasicBlock &entry = call->getFunction()->getEntryBlock();
  auto *slot = IRBuilder<>(&entry, entry.begin()).CreateAlloca(type);
  builder.CreateStore(vector, slot);
  Value *which = builder.CreateAnd(lanes, count - 1);
  Value *moved = PoisonValue::get(type);
  for (unsigned lane = 0; lane < count; ++lane) {
    Value *index = builder.CreateZExt(builder.CreateExtractElement(which, lane),
                                      builder.getInt64Ty());
    Value *place =
        builder.CreateInBoundsGEP(type->getElementType(), slot, index);
    moved = builder.CreateInsertElement(
        moved, builder.CreateLoad(type->getElementType(), place), lane);
  }
  return moved;
}

Value *PermutationWriter::permute(Value *vector) {
  Type *type = vector->getType();
  if (!instruction)
    return permuteInMemory(vector);
  unsigned width = type->getScalarSizeInBits();
  if (width == 64)
    return instruction->id == Intrinsic::x86_avx512_permvar_si_512
               ? permuteDoubleWords(vector)
               : permuteHalves(vector);
  Value *words = builder.CreateZExt(
      vector, FixedVectorType::get(builder.getInt32Ty(), count));
  return builder.CreateTrunc(permuteWords(words), type);
}

/// Which lanes there are, by their mask, out of a table. What stands after them
/// does not matter.
Value *PermutationWriter::loadLanes(Value *mask) {
  Module &module = *call->getModule();
  auto *bytes = FixedVectorType::get(builder.getInt8Ty(), count);
  auto *type = ArrayType::get(bytes, size_t(1) << count);
  std::string name = ("piko.compressions.v" + Twine(count)).str();
  auto *table = cast<GlobalVariable>(module.getOrInsertGlobal(name, type, [&] {
    SmallVector<Constant *> rows;
    for (unsigned bits = 0; bits < 1u << count; ++bits) {
      SmallVector<uint8_t> row;
      for (unsigned lane = 0; lane < count; ++lane)
        if (bits >> lane & 1)
          row.push_back(lane);
      row.resize(count);
      rows.push_back(ConstantDataVector::get(module.getContext(), row));
    }
    return new GlobalVariable(module, type, /*isConstant=*/true,
                              GlobalValue::PrivateLinkage,
                              ConstantArray::get(type, rows), name);
  }));
  Value *bits = builder.CreateBitCast(mask, builder.getIntNTy(count));
  Value *row = builder.CreateInBoundsGEP(
      bytes, table, builder.CreateZExt(bits, builder.getInt64Ty()));
  return builder.CreateZExt(builder.CreateLoad(bytes, row),
                            FixedVectorType::get(builder.getInt32Ty(), count));
}

Value *PermutationWriter::compress() {
  constexpr unsigned mostInTable = 8;
  Value *vector = call->getArgOperand(0), *mask = lanes;
  Type *type = vector->getType();
  auto *words = FixedVectorType::get(builder.getInt32Ty(), count);
  auto select = [&](Value *from) {
    return builder.CreateIntrinsic(
        Intrinsic::experimental_vector_compress, {from->getType()},
        {from, mask, PoisonValue::get(from->getType())});
  };
  if (instruction && count <= mostInTable) {
    lanes = loadLanes(mask);
    return permute(vector);
  }
  unsigned width = type->getScalarSizeInBits();
  if (!instruction || width == 32)
    return select(vector);
  if (width < 32)
    return builder.CreateTrunc(select(builder.CreateZExt(vector, words)), type);
  SmallVector<uint32_t> numbers = to_vector(seq<uint32_t>(0, count));
  lanes = select(ConstantDataVector::get(builder.getContext(), numbers));
  return permute(vector);
}

void piko::lowerPermutations(Module &module, const TargetMachine &machine) {
  for (Function &function : make_early_inc_range(module)) {
    bool compresses = function.getName().starts_with(compressionPrefix);
    if (!compresses && !function.getName().starts_with(permutationPrefix))
      continue;
    for (User *user : make_early_inc_range(function.users())) {
      auto *call = cast<CallInst>(user);
      PermutationWriter writer(call, machine);
      call->replaceAllUsesWith(compresses ? writer.compress() : writer.write());
      call->eraseFromParent();
    }
    function.eraseFromParent();
  }
}
