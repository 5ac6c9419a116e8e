// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Into which bins assign phases put their primitives.

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "StageUses.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

static LogicalResult verifyInAssign(Operation *op) {
  if (!op->getParentOfType<AssignOp>())
    return op->emitOpError("expected to be inside an assign phase");
  return success();
}

LogicalResult AssignToOp::verify() { return verifyInAssign(*this); }
LogicalResult AssignAllOp::verify() { return verifyInAssign(*this); }

LogicalResult AssignPreviousOp::verify() {
  if (failed(verifyInAssign(*this)))
    return failure();
  StageOp stage = getPhaseStage(*this);
  if (!stage)
    return success(); // the phase reports it
  FlatSymbolRefAttr name = FlatSymbolRefAttr::get(stage.getSymNameAttr());
  PipelineOp pipeline = getPipeline(*this);
  for (auto source : pipeline.getOps<SourceOp>())
    if (source.getStageAttr() == name)
      return emitOpError("expected a previous stage, but stage '")
             << getCppName(stage) << "' has a source";
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    if (edge.getConsumerAttr() != name)
      continue;
    auto producer = lookupInPipeline<StageOp>(*this, edge.getProducerAttr());
    if (producer && producer.getBins() != stage.getBins())
      return emitOpError("expected stage '")
             << getCppName(producer) << "' to have bins of the same size as '"
             << getCppName(stage) << "', [" << stage.getBins() << "], but got ["
             << producer.getBins() << "]";
  }
  return success();
}

LogicalResult AssignBoxOp::verify() {
  if (failed(verifyInAssign(*this)) ||
      failed(verifyRank(*this, getLo().size())))
    return failure();
  return verifyRank(*this, getHi().size());
}

LogicalResult AssignLineOp::verify() {
  if (failed(verifyInAssign(*this)) ||
      failed(verifyRank(*this, getFrom().size())))
    return failure();
  return verifyRank(*this, getTo().size());
}

LogicalResult OwnerOp::verify() {
  if (failed(verifyInAssign(*this)))
    return failure();
  return verifyRank(*this, getCoordinates().size());
}

//===----------------------------------------------------------------------===//
// Bins
//===----------------------------------------------------------------------===//

void AssignToOp::buildBins(OpBuilder &builder, Operation *, Value,
                           PutInBin put) {
  put(builder, getBin());
}

void AssignPreviousOp::buildBins(OpBuilder &builder, Operation *,
                                 Value previous, PutInBin put) {
  put(builder, previous);
}
bool AssignPreviousOp::keepsBin() { return true; }
bool AssignPreviousOp::canFail() { return false; }

void AssignAllOp::buildBins(OpBuilder &builder, Operation *stage, Value,
                            PutInBin put) {
  BinArithmetic bins(builder, getLoc(), cast<StageOp>(stage));
  auto loop = scf::ForOp::create(builder, getLoc(), bins.constant(0),
                                 bins.binCount(), bins.constant(1));
  OpBuilder inside = OpBuilder::atBlockBegin(loop.getBody());
  put(inside, loop.getInductionVar());
}
bool AssignAllOp::canFail() { return false; }

void AssignBoxOp::buildBins(OpBuilder &builder, Operation *stage, Value,
                            PutInBin put) {
  BinArithmetic(builder, getLoc(), cast<StageOp>(stage))
      .forEachBinIn(
          getLo(), getHi(),
          [&](OpBuilder &inside, Value bin, ValueRange) { put(inside, bin); });
}
bool AssignBoxOp::canFail() { return false; }

//===----------------------------------------------------------------------===//
// Lines
//===----------------------------------------------------------------------===//

/// A coordinate as an index of 32 bits.
static Value saturate(OpBuilder &builder, Location loc, BinArithmetic &bins,
                      Value coordinate) {
  Value at = bins.toIndex(coordinate);
  APInt constant;
  if (coordinate.getType().isInteger(32) ||
      (matchPattern(coordinate, m_ConstantInt(&constant)) &&
       constant.isSignedIntN(32)))
    return at;
  at = arith::MaxSIOp::create(builder, loc, at, bins.constant(INT32_MIN));
  return arith::MinSIOp::create(builder, loc, at, bins.constant(INT32_MAX));
}

namespace {

/// Tests whether the segment between the middles of two cells has a point of a
/// bin. In each dimension it has, because the bin is one of those of the box
/// around both cells: the bin and the box are made of whole cells, and share
/// one. Intervals of a segment that meet pairwise have a point in common, so
/// that two dimensions are looked at a time: there, the corners of the bin may
/// not all be on one side of the line. Lengths are doubled, so that middles are
/// integers, of 35 bits; the sums of their products have 70.
class LineTest {
public:
  LineTest(OpBuilder &builder, Location loc) : builder(builder), loc(loc) {}

  /// The next dimension; `lo` and `hi` are the bin's.
  void addDimension(Value from, Value to, Value lo, Value hi);
  /// Null if there is one dimension.
  Value build();

private:
  struct Dimension {
    Value along;  ///< from one cell to the other
    Value offset; ///< from the first cell's middle to the bin's, doubled
    Value extent; ///< of the bin
  };

  Value widen(Value value) {
    value =
        arith::IndexCastOp::create(builder, loc, builder.getI64Type(), value);
    return arith::ExtSIOp::create(builder, loc, builder.getIntegerType(128),
                                  value);
  }
  Value add(Value a, Value b) {
    return arith::AddIOp::create(builder, loc, a, b);
  }
  Value subtract(Value a, Value b) {
    return arith::SubIOp::create(builder, loc, a, b);
  }
  Value multiply(Value a, Value b) {
    return arith::MulIOp::create(builder, loc, widen(a), widen(b));
  }
  Value magnitude(Value value) {
    Value zero = arith::ConstantOp::create(
        builder, loc, builder.getIntegerAttr(value.getType(), 0));
    return arith::MaxSIOp::create(builder, loc, value, subtract(zero, value));
  }
  Value touches(const Dimension &a, const Dimension &b);

  OpBuilder &builder;
  Location loc;
  SmallVector<Dimension> dimensions;
};

} // namespace

void LineTest::addDimension(Value from, Value to, Value lo, Value hi) {
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value middle = add(add(from, from), one);
  dimensions.push_back(
      {subtract(to, from), subtract(add(lo, hi), middle), subtract(hi, lo)});
}

Value LineTest::touches(const Dimension &a, const Dimension &b) {
  Value distance =
      subtract(multiply(a.along, b.offset), multiply(b.along, a.offset));
  Value reach = add(multiply(magnitude(a.along), b.extent),
                    multiply(magnitude(b.along), a.extent));
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::sle,
                               magnitude(distance), reach);
}

Value LineTest::build() {
  Value all;
  for (size_t i = 0; i < dimensions.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      Value pair = touches(dimensions[j], dimensions[i]);
      all = all ? arith::AndIOp::create(builder, loc, all, pair) : pair;
    }
  return all;
}

void AssignLineOp::buildBins(OpBuilder &builder, Operation *stage, Value,
                             PutInBin put) {
  Location loc = getLoc();
  BinArithmetic bins(builder, loc, cast<StageOp>(stage));
  SmallVector<Value> from, to, lo, hi;
  for (auto [a, b] : llvm::zip(getFrom(), getTo())) {
    from.push_back(saturate(builder, loc, bins, a));
    to.push_back(saturate(builder, loc, bins, b));
    lo.push_back(arith::MinSIOp::create(builder, loc, from.back(), to.back()));
    hi.push_back(arith::MaxSIOp::create(builder, loc, from.back(), to.back()));
  }
  bins.forEachBinIn(lo, hi, [&](OpBuilder &inside, Value bin, ValueRange at) {
    BinArithmetic around(inside, loc, cast<StageOp>(stage));
    LineTest test(inside, loc);
    for (auto [dim, place] : llvm::enumerate(at))
      test.addDimension(from[dim], to[dim], around.loAt(place, dim),
                        around.hiAt(place, dim));
    Value touches = test.build();
    if (!touches)
      return put(inside, bin);
    auto choice = scf::IfOp::create(inside, loc, touches,
                                    /*withElseRegion=*/false);
    OpBuilder then = choice.getThenBodyBuilder();
    put(then, bin);
  });
}
bool AssignLineOp::canFail() { return false; }
