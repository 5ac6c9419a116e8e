// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins as arithmetic.

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

using namespace mlir;
using namespace piko;

Value BinArithmetic::constant(int64_t value) {
  return arith::ConstantIndexOp::create(builder, loc, value);
}

Value BinArithmetic::toIndex(Value coordinate) {
  if (coordinate.getType().isIndex())
    return coordinate;
  return arith::IndexCastOp::create(builder, loc, builder.getIndexType(),
                                    coordinate);
}

Value BinArithmetic::grid(int64_t dim) {
  if (!extent(dim))
    return constant(1);
  return GridOp::create(builder, loc, stage.getSymName(), dim, /*tiles=*/false);
}

Value BinArithmetic::binCount() {
  Value count = grid(0);
  for (int64_t dim = 1; dim < rank(); ++dim)
    count = arith::MulIOp::create(builder, loc, count, grid(dim));
  return count;
}

Value BinArithmetic::gridCoordinate(Value bin, int64_t dim) {
  for (int64_t before = 0; before < dim; ++before)
    if (extent(before))
      bin = arith::DivUIOp::create(builder, loc, bin, grid(before));
  bool last = true;
  for (int64_t after = dim + 1; after < rank(); ++after)
    last &= !extent(after);
  return last ? bin : arith::RemUIOp::create(builder, loc, bin, grid(dim));
}

Value BinArithmetic::lo(Value bin, int64_t dim) {
  return loAt(extent(dim) ? gridCoordinate(bin, dim) : Value(), dim);
}

Value BinArithmetic::hi(Value bin, int64_t dim) {
  return hiAt(extent(dim) ? gridCoordinate(bin, dim) : Value(), dim);
}

Value BinArithmetic::loAt(Value place, int64_t dim) {
  if (!extent(dim))
    return constant(0);
  return arith::MulIOp::create(builder, loc, place, constant(extent(dim)));
}

Value BinArithmetic::hiAt(Value place, int64_t dim) {
  Value domain = DomainOp::create(builder, loc, dim);
  if (!extent(dim))
    return domain;
  Value end = arith::AddIOp::create(builder, loc, loAt(place, dim),
                                    constant(extent(dim)));
  return arith::MinSIOp::create(builder, loc, end, domain);
}

Value BinArithmetic::binAt(ValueRange coordinates) {
  Value inside, bin, stride;
  for (auto [dim, coordinate] : llvm::enumerate(coordinates)) {
    Value at = toIndex(coordinate);
    // Negative coordinates are large unsigned ones.
    Value ok = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ult,
                                     at, DomainOp::create(builder, loc, dim));
    inside = inside ? arith::AndIOp::create(builder, loc, inside, ok) : ok;
    if (!extent(dim))
      continue;
    Value place =
        arith::DivUIOp::create(builder, loc, at, constant(extent(dim)));
    bin = bin ? arith::AddIOp::create(
                    builder, loc, bin,
                    arith::MulIOp::create(builder, loc, place, stride))
              : place;
    stride = stride ? arith::MulIOp::create(builder, loc, stride, grid(dim))
                    : grid(dim);
  }
  return arith::SelectOp::create(builder, loc, inside, bin ? bin : constant(0),
                                 constant(-1));
}

Value BinArithmetic::tileAt(Value bin, ValueRange coordinates) {
  Value tile, stride;
  for (auto [dim, coordinate] : llvm::enumerate(coordinates)) {
    Value tiles = GridOp::create(builder, loc, stage.getSymName(), dim,
                                 /*tiles=*/true);
    Value inside =
        arith::SubIOp::create(builder, loc, toIndex(coordinate), lo(bin, dim));
    inside = arith::MaxSIOp::create(builder, loc, inside, constant(0));
    Value place = arith::DivUIOp::create(builder, loc, inside,
                                         constant(*stage.getTile()));
    Value last = arith::SubIOp::create(builder, loc, tiles, constant(1));
    place = arith::MinSIOp::create(builder, loc, place, last);
    tile = tile ? arith::AddIOp::create(
                      builder, loc, tile,
                      arith::MulIOp::create(builder, loc, place, stride))
                : place;
    stride =
        stride ? arith::MulIOp::create(builder, loc, stride, tiles) : tiles;
  }
  return tile;
}

void BinArithmetic::forEachBinIn(
    ValueRange lo, ValueRange hi,
    llvm::function_ref<void(OpBuilder &, Value, ValueRange)> body) {
  // Bounds of the loops over the grid, half open.
  SmallVector<Value> begins, ends;
  Value zero = constant(0), one = constant(1);
  for (auto [dim, from, to] : llvm::enumerate(lo, hi)) {
    Value domain = DomainOp::create(builder, loc, dim);
    Value last = arith::SubIOp::create(builder, loc, domain, one);
    Value first = arith::MaxSIOp::create(builder, loc, toIndex(from), zero);
    last = arith::MinSIOp::create(builder, loc, toIndex(to), last);
    Value empty = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::sgt,
                                        first, last);
    Value begin = zero, end = one;
    if (int64_t size = extent(dim)) {
      begin = arith::DivUIOp::create(builder, loc, first, constant(size));
      end = arith::AddIOp::create(
          builder, loc,
          arith::DivUIOp::create(builder, loc, last, constant(size)), one);
    }
    begins.push_back(begin);
    ends.push_back(arith::SelectOp::create(builder, loc, empty, begin, end));
  }
  // Row-major, x fastest: the last dimension is the outermost loop.
  OpBuilder::InsertionGuard guard(builder);
  Value bin = zero;
  SmallVector<Value> strides{one};
  for (int64_t dim = 1; dim < rank(); ++dim)
    strides.push_back(
        arith::MulIOp::create(builder, loc, strides.back(), grid(dim - 1)));
  SmallVector<Value> place(rank());
  for (int64_t dim = rank() - 1; dim >= 0; --dim) {
    auto loop = scf::ForOp::create(builder, loc, begins[dim], ends[dim], one);
    builder.setInsertionPointToStart(loop.getBody());
    place[dim] = loop.getInductionVar();
    Value offset = arith::MulIOp::create(builder, loc, loop.getInductionVar(),
                                         strides[dim]);
    bin = arith::AddIOp::create(builder, loc, bin, offset);
  }
  body(builder, bin, place);
}

Value BinArithmetic::isInside(ValueRange at, ValueRange lo, ValueRange hi) {
  Value inside;
  for (auto [a, from, to] : llvm::zip(at, lo, hi)) {
    // A negative difference is a large unsigned one.
    Value offset = arith::SubIOp::create(builder, loc, a, from);
    Value extent = arith::SubIOp::create(builder, loc, to, from);
    Value ok = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ult,
                                     offset, extent);
    inside = inside ? arith::AndIOp::create(builder, loc, inside, ok) : ok;
  }
  return inside;
}

Value BinArithmetic::isInBin(ValueRange at, Value bin) {
  SmallVector<Value> first, end;
  for (int64_t dim = 0, e = at.size(); dim < e; ++dim) {
    first.push_back(lo(bin, dim));
    end.push_back(hi(bin, dim));
  }
  return isInside(at, first, end);
}

Value BinArithmetic::isInState(StringRef state, ValueRange indices) {
  SmallVector<Value> at, lo, hi;
  for (auto [dim, index] : llvm::enumerate(indices)) {
    at.push_back(toIndex(index));
    lo.push_back(constant(0));
    hi.push_back(ExtentOp::create(builder, loc, state, dim));
  }
  return isInside(at, lo, hi);
}

Value piko::findBin(OpBuilder &builder, Operation *op) {
  for (auto loop = op->getParentOfType<scf::ForOp>(); loop;
       loop = loop->getParentOfType<scf::ForOp>()) {
    auto cells = loop.getLowerBound().getDefiningOp<UnitBucketsOp>();
    if (!cells)
      continue;
    auto bins = cells.getBins().getDefiningOp<OpenBinsOp>();
    if (!bins)
      continue; // over the calls of a piko.storage.local_bin, which is of one
                // bin
    if (bins.getSource())
      return {};
    auto stage = lookupInPipeline<StageOp>(op, bins.getStageAttr());
    Value cell = loop.getInductionVar();
    if (stage.getTakesList())
      return CallBinOp::create(builder, op->getLoc(), bins, cell);
    return BucketBinOp::create(builder, op->getLoc(), bins, cell);
  }
  return {};
}
