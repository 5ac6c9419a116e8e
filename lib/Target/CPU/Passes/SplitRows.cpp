// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/SplitRows.h"

#include "llvm/Analysis/TargetTransformInfo.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/Transforms/Utils/BasicBlockUtils.h"

using namespace llvm;
using namespace piko;

namespace {

/// A masked access to a row.
struct Row {
  IntrinsicInst *access;
  Value *pointer, *mask;
  Value *stored; ///< Or null, of a load.
  Type *type;
  Align alignment;
};

} // namespace

static std::optional<Row> findRow(Instruction &instruction) {
  auto *access = dyn_cast<IntrinsicInst>(&instruction);
  if (!access)
    return std::nullopt;
  Row row{};
  row.access = access;
  if (access->getIntrinsicID() == Intrinsic::masked_load) {
    row.pointer = access->getArgOperand(0);
    row.mask = access->getArgOperand(1);
    row.type = access->getType();
    row.alignment = access->getParamAlign(0).valueOrOne();
  } else if (access->getIntrinsicID() == Intrinsic::masked_store) {
    row.stored = access->getArgOperand(0);
    row.pointer = access->getArgOperand(1);
    row.mask = access->getArgOperand(2);
    row.type = row.stored->getType();
    row.alignment = access->getParamAlign(1).valueOrOne();
  } else {
    return std::nullopt;
  }
  // A constant mask is what LLVM does well.
  if (isa<Constant>(row.mask) || !isa<FixedVectorType>(row.type))
    return std::nullopt;
  return row;
}

static void split(const Row &row) {
  IRBuilder<> builder(row.access);
  unsigned count = cast<FixedVectorType>(row.type)->getNumElements();
  Value *bits = builder.CreateBitCast(builder.CreateFreeze(row.mask),
                                      builder.getIntNTy(count));
  Value *isFull =
      builder.CreateICmpEQ(bits, ConstantInt::getAllOnesValue(bits->getType()));
  Instruction *full, *rest;
  SplitBlockAndInsertIfThenElse(isFull, row.access, &full, &rest);
  builder.SetInsertPoint(full);
  if (row.stored) {
    auto *store =
        builder.CreateAlignedStore(row.stored, row.pointer, row.alignment);
    store->setAAMetadata(row.access->getAAMetadata());
    row.access->moveBefore(rest->getIterator());
    return;
  }
  auto *load = builder.CreateAlignedLoad(row.type, row.pointer, row.alignment);
  load->setAAMetadata(row.access->getAAMetadata());
  builder.SetInsertPoint(row.access);
  PHINode *loaded = builder.CreatePHI(row.type, 2);
  row.access->replaceAllUsesWith(loaded);
  row.access->moveBefore(rest->getIterator());
  loaded->addIncoming(load, full->getParent());
  loaded->addIncoming(row.access, rest->getParent());
}

bool SplitRowsPass::change(Function &function,
                           FunctionAnalysisManager &analyses) {
  const auto &target = analyses.getResult<TargetIRAnalysis>(function);
  SmallVector<Row> rows;
  for (Instruction &instruction : instructions(function)) {
    std::optional<Row> row = findRow(instruction);
    if (row &&
        !(row->stored ? target.isLegalMaskedStore(row->type, row->alignment, 0)
                      : target.isLegalMaskedLoad(row->type, row->alignment, 0)))
      rows.push_back(*row);
  }
  for (const Row &row : rows)
    split(row);
  return !rows.empty();
}
