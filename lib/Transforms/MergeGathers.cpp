// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-merge-gathers: lanes read fields of one record at once.

#include "Piko/Transforms/Passes.h"
#include "StateAccess.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/MapVector.h"

namespace piko {
#define GEN_PASS_DEF_MERGEGATHERS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct MergeGathersPass : piko::impl::MergeGathersBase<MergeGathersPass> {
  void runOnOperation() override;

private:
  void mergeState(Block &block, const llvm::DenseSet<StringAttr> &written);
  void mergePrimitives(KernelOp kernel);
  template <typename OpT>
  void merge(ArrayRef<OpT> reads, Value addresses, FlatSymbolRefAttr record,
             OpBuilder &builder);
};

} // namespace

/// How many fields are worth loads of whole pieces of a record.
static constexpr size_t leastFields = 3;

/// Whether a field is as wide as the words that are transposed.
static bool isWord(Type lanes) {
  return cast<VectorType>(lanes).getElementTypeBitWidth() == 32;
}

template <typename OpT>
void MergeGathersPass::merge(ArrayRef<OpT> reads, Value addresses,
                             FlatSymbolRefAttr record, OpBuilder &builder) {
  SmallVector<Attribute> fields;
  SmallVector<Type> types;
  for (OpT read : reads) {
    fields.push_back(read.getFieldAttr());
    types.push_back(read.getResult().getType());
  }
  OpT first = reads.front();
  auto all = LaneGetFieldsOp::create(builder, first.getLoc(), types, addresses,
                                     builder.getArrayAttr(fields), record,
                                     first.getMask());
  for (auto [i, read] : llvm::enumerate(reads)) {
    Operation *op = OpT(read);
    op->getResult(0).replaceAllUsesWith(all.getResult(i));
    op->erase();
  }
  merged += reads.size();
}

void MergeGathersPass::mergeState(Block &block,
                                  const llvm::DenseSet<StringAttr> &written) {
  llvm::MapVector<std::pair<Attribute, Value>, SmallVector<GatherOp>> elements;
  for (auto gather : block.getOps<GatherOp>()) {
    if (gather.getConsecutive() || gather.getIndices().empty() ||
        !gather.getElements().empty() || !isWord(gather.getType()) ||
        written.contains(gather.getStateAttr().getAttr()))
      continue;
    SmallVector<GatherOp> &reads =
        elements[{gather.getStateAttr(), gather.getMask()}];
    if (reads.empty() || reads.front().getIndices() == gather.getIndices())
      reads.push_back(gather);
  }
  for (auto &[element, reads] : elements) {
    if (reads.size() < leastFields)
      continue;
    GatherOp first = reads.front();
    OpBuilder builder(first);
    auto words = VectorType::get(cast<VectorType>(first.getType()).getShape(),
                                 builder.getIndexType());
    Value addresses =
        LaneElementsOp::create(builder, first.getLoc(), words,
                               first.getStateAttr(), first.getIndices());
    FlatSymbolRefAttr record = getStateRecord(
        lookupInPipeline<Operation *>(first, first.getStateAttr()));
    merge<GatherOp>(reads, addresses, record, builder);
  }
}

/// Whether a mask is known to hold for no lane for which another does not.
static bool isWithin(Value mask, Value outer, unsigned depth = 8) {
  if (mask == outer)
    return true;
  if (depth == 0)
    return false;
  if (auto both = mask.getDefiningOp<arith::AndIOp>())
    return isWithin(both.getLhs(), outer, depth - 1) ||
           isWithin(both.getRhs(), outer, depth - 1);
  auto choice = mask.getDefiningOp<arith::SelectOp>();
  return choice && matchPattern(choice.getFalseValue(), m_Zero()) &&
         (isWithin(choice.getCondition(), outer, depth - 1) ||
          isWithin(choice.getTrueValue(), outer, depth - 1));
}

/// Primitives do not change while they are read.
void MergeGathersPass::mergePrimitives(KernelOp kernel) {
  llvm::MapVector<Value, SmallVector<LaneGetOp>> primitives;
  kernel.walk<WalkOrder::PreOrder>([&](LaneGetOp get) {
    if (!get.getElements().empty() || !isWord(get.getType()))
      return;
    SmallVector<LaneGetOp> &reads = primitives[get.getAddresses()];
    bool isBehind = reads.empty() ||
                    (reads.front().getRecordAttr() == get.getRecordAttr() &&
                     reads.front()->getBlock()->findAncestorOpInBlock(*get) &&
                     isWithin(get.getMask(), reads.front().getMask()));
    if (isBehind)
      reads.push_back(get);
  });
  for (auto &[primitive, reads] : primitives)
    if (reads.size() >= leastFields) {
      OpBuilder builder(reads.front());
      merge<LaneGetOp>(reads, primitive, reads.front().getRecordAttr(),
                       builder);
    }
}

void MergeGathersPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
    SmallVector<Block *> blocks;
    kernel.walk([&](Block *block) { blocks.push_back(block); });
    for (Block *block : blocks)
      mergeState(*block, written);
    mergePrimitives(kernel);
  }
}
