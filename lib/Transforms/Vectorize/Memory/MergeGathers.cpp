// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-merge-gathers: lanes read, and write, fields of one record at once.
//
// What is made of it is up to convert-piko-to-llvm (Records): lanes that read
// nothing load zeros; if all lanes write, each stores pieces of up to 16 bytes.
// Of 16 lanes, consecutive elements of two to eight words (of up to four for
// one field) are loaded and stored as vectors of their words, de-interleaved
// and interleaved. So are primitives at consecutive positions loaded, where
// bins have no order of their own: hence one field of them is enough.

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Transforms/Passes.h"
#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
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
  void mergeWrites(Block &block);
  void mergeWrites(ArrayRef<ScatterOp> writes);
  template <typename OpT>
  void merge(ArrayRef<OpT> reads, Value addresses, FlatSymbolRefAttr record,
             OpBuilder &builder);
};

} // namespace

static constexpr int64_t wordSize = 4;

/// Whether fields are worth loads of whole pieces of a record: three, or two
/// side by side.
template <typename OpT>
static bool areWorthPieces(ArrayRef<OpT> reads, RecordOp record) {
  if (reads.size() != 2)
    return reads.size() > 2;
  auto getOffset = [&](OpT read) {
    return int64_t(record.getField(read.getField()).getOffset());
  };
  return std::abs(getOffset(reads[0]) - getOffset(reads[1])) == wordSize;
}

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
template <typename OpT> static bool isAfter(OpT read, OpT first) {
  return first->getBlock()->findAncestorOpInBlock(*read) &&
         isWithin(read.getMask(), first.getMask());
}

/// What lanes read in a condition is read before it as well where its
/// record is as short as a line of the cache.
static bool isNear(GatherOp read, GatherOp first, RecordOp record) {
  return read->getBlock() == first->getBlock() || record.getSize() <= lineSize;
}

template <typename OpT> static RecordOp getRecord(OpT access) {
  return lookupRecord(access, getStateRecord(lookupInPipeline<Operation *>(
                                  access, access.getStateAttr())));
}

/// Whether what an operation does to a piece of state leaves a word of its
/// elements as it is.
static bool keeps(Operation *op, GatherOp read, RecordOp record) {
  auto [state, access] = getStateAccess(op);
  if (state != read.getStateAttr() || access == StateAccess::reads)
    return true;
  auto write = dyn_cast<ScatterOp>(op);
  if (!write || !write.getElements().empty())
    return false;
  int64_t from = record.getField(write.getField()).getOffset(),
          at = record.getField(read.getField()).getOffset();
  constexpr int64_t byteBits = 8;
  int64_t size =
      cast<VectorType>(write.getValue().getType()).getElementTypeBitWidth() /
      byteBits;
  return from + size <= at || at + wordSize <= from;
}

/// Whether a word of state that the kernel changes is the same where the first
/// read stands.
static bool isUnchanged(GatherOp read, GatherOp first, RecordOp record) {
  if (read->getBlock() != first->getBlock())
    return false;
  for (Operation *op = first; op != read; op = op->getNextNode())
    if (op->walk([&](Operation *inner) {
            return keeps(inner, read, record) ? WalkResult::advance()
                                              : WalkResult::interrupt();
          }).wasInterrupted())
      return false;
  return true;
}

/// The address of each lane's element.
template <typename OpT>
static Value createElements(OpT access, OpBuilder &builder) {
  auto words =
      VectorType::get(cast<VectorType>(access.getMask().getType()).getShape(),
                      builder.getIndexType());
  return LaneElementsOp::create(builder, access.getLoc(), words,
                                access.getStateAttr(), access.getIndices(),
                                access.getConsecutiveAttr());
}

void MergeGathersPass::mergeState(KernelOp kernel) {
  llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
  // By state and first index; those of one place at a time.
  llvm::MapVector<std::pair<Attribute, Value>,
                  SmallVector<SmallVector<GatherOp>>>
      places;
  kernel.walk<WalkOrder::PreOrder>([&](GatherOp gather) {
    if (gather.getIndices().empty() || !gather.getElements().empty() ||
        !isWord(gather.getType()))
      return;
    RecordOp record = getRecord(gather);
    if (gather.getConsecutive() && record.getSize() == wordSize)
      return; // a row
    bool isWritten = written.contains(gather.getStateAttr().getAttr());
    auto &groups = places[{gather.getStateAttr(), gather.getIndices()[0]}];
    for (SmallVector<GatherOp> &reads : groups) {
      GatherOp first = reads.front();
      if (first.getIndices() == gather.getIndices() &&
          first.getConsecutive() == gather.getConsecutive() &&
          isAfter(gather, first) && isNear(gather, first, record) &&
          (!isWritten || isUnchanged(gather, first, record)))
        return reads.push_back(gather);
    }
    groups.push_back({gather});
  });
  for (auto &[place, groups] : places)
    for (SmallVector<GatherOp> &reads : groups) {
      GatherOp first = reads.front();
      if (!areWorthPieces<GatherOp>(reads, getRecord(first)))
        continue;
      OpBuilder builder(first);
      merge<GatherOp>(reads, createElements(first, builder),
                      FlatSymbolRefAttr::get(getRecord(first).getSymNameAttr()),
                      builder);
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
         isAfter(get, reads.front())))
      reads.push_back(get);
  });
  for (auto &[primitive, reads] : primitives) {
    FlatSymbolRefAttr record = reads.front().getRecordAttr();
    // Those at consecutive positions may be read as rows, one field as well.
    if (primitive.getDefiningOp<LaneItemsOp>() ||
        areWorthPieces<LaneGetOp>(reads, lookupRecord(reads.front(), record))) {
      OpBuilder builder(reads.front());
      merge<LaneGetOp>(reads, primitive, record, builder);
    }
  }
}

/// Whether a write is of another word of the same elements, by the same lanes.
static bool isBeside(ScatterOp write, ArrayRef<ScatterOp> others) {
  ScatterOp first = others.front();
  return write.getStateAttr() == first.getStateAttr() &&
         write.getIndices() == first.getIndices() &&
         write.getMask() == first.getMask() &&
         write.getConsecutive() == first.getConsecutive() &&
         llvm::none_of(others, [&](ScatterOp other) {
           return other.getFieldAttr() == write.getFieldAttr();
         });
}

/// Whether writes to a piece of state may be put off after an operation.
static bool mayPass(Operation *op, FlatSymbolRefAttr state) {
  if (isMemoryEffectFree(op))
    return true;
  auto [other, access] = getStateAccess(op);
  return op->getNumRegions() == 0 && other && other != state;
}

void MergeGathersPass::mergeWrites(ArrayRef<ScatterOp> writes) {
  constexpr size_t leastFields = 3;
  if (writes.size() < leastFields)
    return;
  ScatterOp last = writes.back();
  OpBuilder builder(last);
  SmallVector<Value> values;
  SmallVector<Attribute> fields;
  for (ScatterOp write : writes) {
    values.push_back(write.getValue());
    fields.push_back(write.getFieldAttr());
  }
  LaneSetFieldsOp::create(
      builder, last.getLoc(), values, createElements(last, builder),
      builder.getArrayAttr(fields), last.getStateAttr(), last.getMask());
  for (ScatterOp write : writes)
    write.erase();
}

/// Writes to elements of one piece of state each, and all of them done where
/// the last one is.
void MergeGathersPass::mergeWrites(Block &block) {
  SmallVector<SmallVector<ScatterOp>> groups;
  for (Operation &op : llvm::make_early_inc_range(block)) {
    auto write = dyn_cast<ScatterOp>(op);
    bool isPart = write && !write.getIndices().empty() &&
                  write.getElements().empty() &&
                  isWord(write.getValue().getType()) &&
                  getRecord(write).getSize() != wordSize;
    bool isMore = false;
    for (SmallVector<ScatterOp> &writes : groups) {
      if (isPart && isBeside(write, writes)) {
        writes.push_back(write);
        isMore = true;
      } else if (!mayPass(&op, writes.front().getStateAttr())) {
        mergeWrites(writes);
        writes.clear();
      }
    }
    llvm::erase_if(groups, [](const auto &writes) { return writes.empty(); });
    if (isPart && !isMore)
      groups.push_back({write});
  }
  for (ArrayRef<ScatterOp> writes : groups)
    mergeWrites(writes);
}

void MergeGathersPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    mergeState(kernel);
    mergePrimitives(kernel);
    kernel.walk([&](Block *block) { mergeWrites(*block); });
  }
}
