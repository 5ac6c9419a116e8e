// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-defer-shading, for the work of each kernel over bins:
//   1. find the updates that overwrite pixels of images which the kernel does
//      not read: of all that a bin's primitives write there, the last is seen;
//   2. find what all of them compute alike, and where to cut it, so that little
//      has to be kept for each pixel: a minimum cut, with all loops after it;
//   3. keep that in place of the updates, and do the rest in a loop over the
//      bin's pixels after the work.
// The test that decides whether a primitive is seen stays where it is, and may
// be any. An update that tests a pixel and overwrites it, on one condition, is
// split for that: one changes what the test reads, and one overwrites the rest.
//
// This is deferred shading: T. Saito and T. Takahashi, "Comprehensible
// Rendering of 3-D Shapes", 1990.

#include "Deferral/Deferral.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {
#define GEN_PASS_DEF_DEFERSHADING
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct DeferShadingPass : piko::impl::DeferShadingBase<DeferShadingPass> {
  using DeferShadingBase::DeferShadingBase;
  void runOnOperation() override;
  void runOnBins(KernelOp kernel, BinsOp bins);
};

/// Keeps what is deferred in arrays of a bin, after whose work it is done.
class BinDeferral {
public:
  BinDeferral(BinsOp bins, const Deferral &what)
      : bins(bins), work(what.getWork()), what(what), stage(what.getStage()) {}
  int64_t getBytes();
  void apply();

private:
  int64_t getPixels();
  Value getPlace(OpBuilder &builder, Location loc, ValueRange coordinates);
  void createArrays();
  void keepAt(size_t site);
  void createLoop();

  BinsOp bins;
  Operation *work;
  const Deferral &what;
  StageOp stage;
  SmallVector<Value> first;  ///< The bin's first cell.
  Value isOverwritten;       ///< By pixel, whether anything is kept.
  SmallVector<Value> arrays; ///< By pixel, what is kept.
};

} // namespace

int64_t BinDeferral::getPixels() {
  constexpr int64_t most = int64_t(1) << 40;
  int64_t pixels = 1;
  for (int64_t extent : stage.getBins())
    pixels = std::min(most, pixels * std::min(extent, most / pixels + 1));
  return pixels;
}

int64_t BinDeferral::getBytes() { return what.getBytes() * getPixels(); }

/// The number of a pixel among those of the bin.
Value BinDeferral::getPlace(OpBuilder &builder, Location loc,
                            ValueRange coordinates) {
  Value place;
  for (int64_t dim = stage.getBins().size(); dim-- > 0;) {
    Value at = coordinates[dim];
    if (!at.getType().isIndex())
      at = arith::IndexCastOp::create(builder, loc, builder.getIndexType(), at);
    at = arith::SubIOp::create(builder, loc, at, first[dim]);
    if (place) {
      Value extent =
          arith::ConstantIndexOp::create(builder, loc, stage.getBins()[dim]);
      at = arith::AddIOp::create(
          builder, loc, at, arith::MulIOp::create(builder, loc, place, extent));
    }
    place = at;
  }
  return place;
}

/// Makes the arrays of what is kept. No pixel is marked.
void BinDeferral::createArrays() {
  Location loc = work->getLoc();
  OpBuilder builder(work);
  BinArithmetic cells(builder, loc, stage);
  for (int64_t dim = 0; dim < cells.rank(); ++dim)
    first.push_back(cells.lo(bins.getBin(), dim));
  auto createArray = [&](Type type) -> Value {
    auto array = memref::AllocaOp::create(builder, loc,
                                          MemRefType::get({getPixels()}, type),
                                          builder.getI64IntegerAttr(lineSize));
    array->setAttr(marks::pixels, what.getFirst().getImageAttr().getAttr());
    return array;
  };
  isOverwritten = createArray(builder.getI32Type());
  for (Type type : what.getStoredTypes())
    arrays.push_back(createArray(type));
  auto constant = [&](int64_t value) {
    return arith::ConstantIndexOp::create(builder, loc, value);
  };
  auto loop = scf::ForOp::create(builder, loc, constant(0),
                                 constant(getPixels()), constant(1));
  builder.setInsertionPointToStart(loop.getBody());
  Value no = arith::ConstantIntOp::create(builder, loc, 0, 32);
  memref::StoreOp::create(builder, loc, no, isOverwritten,
                          loop.getInductionVar());
}

/// The value after which all values are known.
static Value getInnermost(ValueRange values) {
  Value inner = values.front();
  for (Value value : values.drop_front()) {
    Block *block = value.getParentBlock();
    bool isAfter =
        block == inner.getParentBlock()
            ? value.getDefiningOp() && (!inner.getDefiningOp() ||
                                        inner.getDefiningOp()->isBeforeInBlock(
                                            value.getDefiningOp()))
            : inner.getParentRegion()->isAncestor(value.getParentRegion());
    if (isAfter)
      inner = value;
  }
  return inner;
}

/// Keeps, in place of the updates of a site, what they are computed from.
void BinDeferral::keepAt(size_t site) {
  UpdateOp last = what.getLast(site);
  ValueRange coordinates = last.getCoordinates();
  OpBuilder builder(last);
  Location loc = last.getLoc();
  // Sites that overwrite one pixel of a loop have one place, too.
  builder.setInsertionPointAfterValue(getInnermost(coordinates));
  Value place = getPlace(builder, loc, coordinates);
  builder.setInsertionPoint(last);
  for (auto [value, array] : llvm::zip(what.store(builder, site), arrays))
    memref::StoreOp::create(builder, loc, value, array, place);
  Value yes = arith::ConstantIntOp::create(builder, loc, 1, 32);
  memref::StoreOp::create(builder, loc, yes, isOverwritten, place);
}

/// The loop over the pixels of the bin that does the rest.
void BinDeferral::createLoop() {
  OpBuilder builder(work->getContext());
  builder.setInsertionPointAfter(work);
  Value place;
  what.createLoop(builder, stage, bins.getBin(),
                  [&](ValueRange pixel, std::optional<size_t> number) -> Value {
                    Location loc = work->getLoc();
                    if (!place)
                      place = getPlace(builder, loc, pixel);
                    Value array = number ? arrays[*number] : isOverwritten;
                    return memref::LoadOp::create(builder, loc, array, place);
                  });
}

void BinDeferral::apply() {
  createArrays();
  for (size_t site = 0; site < what.getSites().size(); ++site)
    keepAt(site);
  createLoop();
  for (const Site &site : what.getSites())
    for (UpdateOp update : site.updates)
      update.erase();
}

void DeferShadingPass::runOnBins(KernelOp kernel, BinsOp bins) {
  auto apply = [&](Deferral &what) -> std::optional<Reason> {
    BinDeferral deferral(bins, what);
    if (int64_t bytes = deferral.getBytes(); bytes > budget)
      return Reason{what.getStage().getLoc(),
                    "what is kept of a bin may have " + std::to_string(budget) +
                        " bytes, but this has " + std::to_string(bytes) +
                        "; give the stage smaller bins"};
    UpdateOp update = what.getFirst();
    update.emitRemark("what is written to '")
        << update.getImage()
        << "' is computed once for each pixel, when all primitives of the bin "
        << "are done, from " << what.getBytes() << " bytes";
    deferral.apply();
    return std::nullopt;
  };
  forEachDeferral(kernel, bins, Deferral::To::Bin, apply);
}

void DeferShadingPass::runOnOperation() {
  if (budget < 0) {
    getOperation().emitError("expected a budget of at least 0 bytes, but got ")
        << budget.getValue();
    return signalPassFailure();
  }
  for (auto kernel : getOperation().getOps<KernelOp>())
    for (auto bins : kernel.getOps<BinsOp>())
      // Of others see piko-form-gbuffer.
      if (!llvm::is_contained(
              lookupInPipeline<StageOp>(bins, bins.getStageAttr()).getBins(),
              0))
        runOnBins(kernel, bins);
}
