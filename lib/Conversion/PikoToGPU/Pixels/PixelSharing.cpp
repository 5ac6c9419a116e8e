// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Shares the pixels of a bin among the threads of a block. For each dimension,
//   1. a loop that counts through the coordinate of all that it does steps from
//      one of the thread's own pixels to the next;
//   2. other updates, and what depends on their outcomes, are under a test.

#include "PikoToGPU/Pixels/PixelSharing.h"

#include "llvm/Support/MathExtras.h"

using namespace mlir;
using namespace piko;

namespace {

/// Of one dimension.
class PixelSharing {
public:
  PixelSharing(const ThreadTile &tile, int64_t dim)
      : tile(tile), dim(dim), mask(tile.extents[dim] - 1) {}

  void stride(scf::ForOp loop);
  void guard(ArrayRef<Operation *> operations, Value root);

private:
  /// A constant, or the thread's place in the tile, of an integer type.
  static Value constant(OpBuilder &builder, Location loc, Type type,
                        int64_t value) {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(type, value));
  }
  Value place(OpBuilder &builder, Location loc, Type type) {
    Value index = tile.place[dim];
    return type.isIndex()
               ? index
               : Value(arith::IndexCastOp::create(builder, loc, type, index));
  }

  const ThreadTile &tile;
  int64_t dim, mask;
};

} // namespace

/// Counts how often the loop comes to a pixel of the thread, and makes it a
/// loop over that count: the bounds may be any numbers, and a step of more than
/// one could miss the end and wrap. The count has the type of the bounds, which
/// may take half the registers of an index.
void PixelSharing::stride(scf::ForOp loop) {
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  Value lo = loop.getLowerBound(), hi = loop.getUpperBound();
  Type type = lo.getType();
  auto number = [&](int64_t value) {
    return constant(builder, loc, type, value);
  };
  auto compare = [&](arith::CmpIPredicate predicate, Value a, Value b) {
    return arith::CmpIOp::create(builder, loc, predicate, a, b);
  };
  Value first = arith::AndIOp::create(
      builder, loc,
      arith::SubIOp::create(builder, loc, place(builder, loc, type), lo),
      number(mask));
  Value distance = arith::SubIOp::create(builder, loc, hi, lo);
  Value any = arith::AndIOp::create(
      builder, loc, compare(arith::CmpIPredicate::slt, lo, hi),
      compare(arith::CmpIPredicate::ult, first, distance));
  Value rest = arith::SubIOp::create(builder, loc, distance, first);
  rest = arith::SubIOp::create(builder, loc, rest, number(1));
  Value count = arith::ShRUIOp::create(builder, loc, rest,
                                       number(llvm::Log2_64(mask + 1)));
  count = arith::AddIOp::create(builder, loc, count, number(1));
  count = arith::SelectOp::create(builder, loc, any, count, number(0));
  first = arith::AddIOp::create(builder, loc, lo, first);

  auto steps = scf::ForOp::create(builder, loc, number(0), count, number(1));
  steps.setUnsignedCmp(true);
  builder.setInsertionPointToStart(steps.getBody());
  Value offset = arith::MulIOp::create(builder, loc, steps.getInductionVar(),
                                       number(mask + 1));
  Value at = arith::AddIOp::create(builder, loc, first, offset);
  loop.getInductionVar().replaceAllUsesWith(at);
  loop.getBody()->getTerminator()->erase();
  steps.getBody()->getOperations().splice(
      steps.getBody()->getTerminator()->getIterator(),
      loop.getBody()->getOperations());
  loop.erase();
}

/// What stands between the operations comes first now.
void PixelSharing::guard(ArrayRef<Operation *> operations, Value root) {
  OpBuilder builder(operations.back());
  Location loc = operations.front()->getLoc();
  Type type = root.getType();
  Value rest = arith::AndIOp::create(builder, loc, root,
                                     constant(builder, loc, type, mask));
  Value mine = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                     rest, place(builder, loc, type));
  auto ifOp = scf::IfOp::create(builder, loc, mine);
  for (Operation *op : operations)
    op->moveBefore(ifOp.thenBlock()->getTerminator());
}

LogicalResult piko::sharePixels(scf::ForOp items, const ThreadTile &tile) {
  for (int64_t dim = 0, e = tile.extents.size(); dim < e; ++dim) {
    if (tile.extents[dim] == 1)
      continue;
    OwnedWorks found = findOwnedWorks(items, dim);
    if (found.obstacle)
      return emitError(found.obstacle->at) << found.obstacle->text;
    PixelSharing sharing(tile, dim);
    for (const OwnedWork &work : found.works)
      if (work.loop)
        sharing.stride(cast<scf::ForOp>(work.loop));
      else
        sharing.guard(work.operations, work.root);
  }
  return success();
}
