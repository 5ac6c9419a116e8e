// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-prefetch: what a later primitive refers to is asked for ahead of time,
// as neither it nor the primitive lies in memory in the order of the bin (S.
// Ainsworth and T. M. Jones, "Software Prefetching for Indirect Memory
// Accesses", 2017).
//
// Primitives of up to 16 bytes are copied into the order of their bins, and
// need no prefetch. Where a stage has one bin for all, primitives come as they
// were made, and neighbours mostly refer to the same.

#include "CPU/PrefetchRows.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Vectorize/Analysis/Lanes.h"

#include "Piko/Analysis/Expectations.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"

namespace piko {
#define GEN_PASS_DEF_PREFETCH
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct PrefetchPass : piko::impl::PrefetchBase<PrefetchPass> {
  void runOnOperation() override;
  void convert(scf::ForOp loop, ItemOp item);
};

/// An element of state whose indices are fields of the primitive, perhaps
/// converted.
struct Reference {
  FlatSymbolRefAttr state;
  SmallVector<Value> indices;
};
} // namespace

/// How many primitives ahead: some hundred nanoseconds at a few tens each.
static constexpr int64_t nearDistance = 8, farDistance = 16;

/// The primitive of the loop's iteration.
static ItemOp findItem(scf::ForOp loop) {
  for (auto item : loop.getBody()->getOps<ItemOp>())
    if (item.getPosition() == loop.getInductionVar())
      return item;
  return {};
}

/// The field that is an index as it is, but for its width, or null.
static GetOp findField(Value index, ItemOp item) {
  while (Operation *cast = index.getDefiningOp()) {
    if (!isa<arith::IndexCastOp, arith::IndexCastUIOp, arith::ExtSIOp,
             arith::ExtUIOp>(cast))
      break;
    index = cast->getOperand(0);
  }
  auto get = index.getDefiningOp<GetOp>();
  return get && get.getPrim() == item && get.getElements().empty() ? get
                                                                   : GetOp();
}

/// Without conversions that a coordinate does not need.
static Value dropConversions(Value index) {
  while (Operation *cast = index.getDefiningOp()) {
    if (!isa<arith::IndexCastOp, arith::ExtSIOp>(cast) ||
        cast->getOperand(0).getType().getIntOrFloatBitWidth() < 32)
      break;
    index = cast->getOperand(0);
  }
  return index;
}

/// Whether an operation is on a side of a condition that is hardly ever taken:
/// one that does much more than the other, which does something, too.
static bool isRare(Operation *op, scf::ForOp loop) {
  for (; op->getParentOp() != loop; op = op->getParentOp()) {
    auto choice = dyn_cast<scf::IfOp>(op->getParentOp());
    if (!choice || choice.getElseRegion().empty())
      continue;
    Region *side = op->getParentRegion();
    if (isMuchLonger(*side, side == &choice.getThenRegion()
                                ? choice.getElseRegion()
                                : choice.getThenRegion()))
      return true;
  }
  return false;
}

static SmallVector<Reference> findReferences(scf::ForOp loop, ItemOp item) {
  SmallVector<Reference> references;
  llvm::DenseSet<Attribute> known;
  loop.walk([&](LoadOp load) {
    auto tile =
        load.getTile() ? load.getTile().getDefiningOp<TileOp>() : TileOp();
    if (tile && tile.getClear())
      return; // at hand
    Reference reference{load.getStateAttr(), {}};
    SmallVector<Attribute> names{load.getStateAttr()};
    for (Value index : load.getIndices()) {
      GetOp field = findField(index, item);
      if (!field)
        return;
      reference.indices.push_back(dropConversions(index));
      names.push_back(field.getFieldAttr());
    }
    auto key = ArrayAttr::get(loop.getContext(), names);
    if (reference.indices.empty() || known.contains(key) || isRare(load, loop))
      return;
    known.insert(key);
    references.push_back(reference);
  });
  return references;
}

/// The same index of another primitive.
static Value cloneIndex(Value index, OpBuilder &builder, IRMapping &mapping) {
  if (Value known = mapping.lookupOrNull(index))
    return known;
  Operation *op = index.getDefiningOp();
  if (!isa<GetOp>(op))
    cloneIndex(op->getOperand(0), builder, mapping);
  return builder.clone(*op, mapping)->getResult(0);
}

/// The stage whose bins a primitive is in, if one is.
static StageOp getStage(ItemOp item) {
  auto bins = item.getBins().getDefiningOp<OpenBinsOp>();
  if (!bins || bins.getSource())
    return {};
  return lookupInPipeline<StageOp>(item, bins.getStageAttr());
}

/// Whether a bin's primitives come from many places. Where a producer puts them
/// into the bin that it is in itself, they follow each other as they were made.
static bool areScattered(ItemOp item) {
  StageOp stage = getStage(item);
  WalkResult result = getPipeline(item)->walk([&](AppendBinOp place) {
    bool isSame =
        isa_and_present<BucketBinOp, CallBinOp>(place.getBin().getDefiningOp());
    return place.getStage() == stage.getSymName() && !isSame
               ? WalkResult::interrupt()
               : WalkResult::advance();
  });
  return result.wasInterrupted();
}

/// Whether to ask for primitives that refer to nothing: small ones are copied
/// into the order of their bins.
static bool areFarApart(ItemOp item) {
  constexpr int64_t copied = 16;
  RecordOp record = lookupRecord(item, item.getPrim().getType().getRecord());
  return record.getSize() > copied && areScattered(item);
}

void PrefetchPass::convert(scf::ForOp loop, ItemOp item) {
  SmallVector<Reference> references = findReferences(loop, item);
  if (references.empty() && !areFarApart(item))
    return;
  Location loc = item.getLoc();
  OpBuilder builder(loop);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value last = arith::SubIOp::create(builder, loc, loop.getUpperBound(), one);
  builder.setInsertionPointToStart(loop.getBody());
  auto ahead = [&](int64_t distance) -> Value {
    Value by = arith::ConstantIndexOp::create(builder, loc, distance);
    return arith::AddIOp::create(builder, loc, loop.getInductionVar(), by);
  };
  // It may be in the next bin, or after the last one.
  PrefetchItemOp::create(builder, loc, item.getBins(), ahead(farDistance));
  if (references.empty())
    return;
  Value near = arith::MinSIOp::create(builder, loc, ahead(nearDistance), last);
  IRMapping mapping;
  mapping.map(loop.getInductionVar(), near);
  builder.clone(*item, mapping);
  for (Reference &reference : references) {
    SmallVector<Value> indices;
    for (Value index : reference.indices)
      indices.push_back(cloneIndex(index, builder, mapping));
    PrefetchOp::create(builder, loc, reference.state, indices);
  }
}

/// Whether primitives are sorted into bins. Others come as they were made, and
/// what neighbours refer to is mostly at hand.
static bool areSorted(ItemOp item) {
  StageOp stage = getStage(item);
  return stage && llvm::any_of(stage.getBins(),
                               [](int64_t extent) { return extent != 0; });
}

/// Whether a loop is the innermost one over the pixels of a bin, which it takes
/// once and not for each primitive.
static bool isOverRows(scf::ForOp loop) {
  if (!loop->hasAttr(marks::lanes) || !isa<scf::ForOp>(loop->getParentOp()) ||
      isOverBox(loop))
    return false;
  for (Operation *at = loop; at; at = at->getParentOp())
    if (auto outer = dyn_cast<scf::ForOp>(at);
        outer && !outer.getBody()->getOps<ItemOp>().empty())
      return false;
  return true;
}

void PrefetchPass::runOnOperation() {
  SmallVector<std::pair<scf::ForOp, ItemOp>> found;
  getOperation().walk([&](scf::ForOp loop) {
    if (ItemOp item = findItem(loop); item && areSorted(item))
      found.push_back({loop, item});
  });
  for (auto [loop, item] : found)
    convert(loop, item);
  SmallVector<scf::ForOp> pixels;
  getOperation().walk([&](scf::ForOp loop) {
    if (isOverRows(loop))
      pixels.push_back(loop);
  });
  for (scf::ForOp loop : pixels)
    prefetchRows(cast<scf::ForOp>(loop->getParentOp()), loop);
}
