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
  void mergeState(KernelOp kernel);
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

/// Whether the first read may do what the other one does, too: it comes to all
/// that the other one comes to, with all of its lanes.
template <typename OpT> static bool isBehind(OpT read, OpT first) {
  return first->getBlock()->findAncestorOpInBlock(*read) &&
         isWithin(read.getMask(), first.getMask());
}

/// What lanes read in a condition is read in front of it as well where its
/// record is as short as a line of the cache.
static bool isNear(GatherOp read, GatherOp first, RecordOp record) {
  constexpr int64_t lineSize = 64;
  return read->getBlock() == first->getBlock() || record.getSize() <= lineSize;
}

void MergeGathersPass::mergeState(KernelOp kernel) {
  llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
  // By state and first index; those of one place at a time.
  llvm::MapVector<std::pair<Attribute, Value>,
                  SmallVector<SmallVector<GatherOp>>>
      places;
  auto getRecord = [](GatherOp gather) {
    return getStateRecord(
        lookupInPipeline<Operation *>(gather, gather.getStateAttr()));
  };
  kernel.walk<WalkOrder::PreOrder>([&](GatherOp gather) {
    if (gather.getConsecutive() || gather.getIndices().empty() ||
        !gather.getElements().empty() || !isWord(gather.getType()) ||
        written.contains(gather.getStateAttr().getAttr()))
      return;
    RecordOp record = lookupRecord(gather, getRecord(gather));
    auto &groups = places[{gather.getStateAttr(), gather.getIndices()[0]}];
    for (SmallVector<GatherOp> &reads : groups)
      if (reads.front().getIndices() == gather.getIndices() &&
          isBehind(gather, reads.front()) &&
          isNear(gather, reads.front(), record))
        return reads.push_back(gather);
    groups.push_back({gather});
  });
  for (auto &[place, groups] : places)
    for (SmallVector<GatherOp> &reads : groups) {
      if (reads.size() < leastFields)
        continue;
      GatherOp first = reads.front();
      OpBuilder builder(first);
      auto words = VectorType::get(cast<VectorType>(first.getType()).getShape(),
                                   builder.getIndexType());
      Value addresses =
          LaneElementsOp::create(builder, first.getLoc(), words,
                                 first.getStateAttr(), first.getIndices());
      merge<GatherOp>(reads, addresses, getRecord(first), builder);
    }
}

/// Primitives do not change while they are read.
void MergeGathersPass::mergePrimitives(KernelOp kernel) {
  llvm::MapVector<Value, SmallVector<LaneGetOp>> primitives;
  kernel.walk<WalkOrder::PreOrder>([&](LaneGetOp get) {
    if (!get.getElements().empty() || !isWord(get.getType()))
      return;
    SmallVector<LaneGetOp> &reads = primitives[get.getAddresses()];
    if (reads.empty() ||
        (reads.front().getRecordAttr() == get.getRecordAttr() &&
         isBehind(get, reads.front())))
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
    mergeState(kernel);
    mergePrimitives(kernel);
  }
}
