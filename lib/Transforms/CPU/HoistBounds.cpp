// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-hoist-bounds: for each nest of loops, outermost first,
//   1. find the tested accesses;
//   2. if the range of each index is known before the nest, write a test
//      there that all are inside;
//   3. copy the nest, for where they are, with accesses that are not tested.
// Where a loop is innermost, and each index a sum of what does not change and,
// at most once, of the loop's count, the copy has indices of 64 bits in a row.

#include "CPU/IndexRanges.h"
#include "Vectorize/Analysis/Lanes.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"

namespace piko {
#define GEN_PASS_DEF_HOISTBOUNDS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// An index: numbers that do not change, perhaps less than others, and the
/// count. All are i32, but for the count.
struct Sum {
  SmallVector<std::pair<Value, bool>> terms; // and whether it is taken off
  int64_t constant = 0;
  bool counts = false;

  bool operator==(const Sum &) const = default;
};

struct Access {
  Operation *op;
  Sum sum;
};

/// Of one innermost loop.
class LoopVersioner {
public:
  explicit LoopVersioner(LoopLikeOpInterface loop)
      : loop(loop), count(findLoopCount(loop)) {}
  bool run();

private:
  bool collect();
  bool add(Value index, Sum &sum, bool isOff);
  Value createTest(OpBuilder &builder);
  void replaceIndices(OpBuilder &builder, IRMapping &mapping);
  Value createSum(OpBuilder &builder, const Sum &sum);

  LoopLikeOpInterface loop;
  std::optional<LoopCount> count;
  SmallVector<Access> accesses;
};

struct HoistBoundsPass : piko::impl::HoistBoundsBase<HoistBoundsPass> {
  using HoistBoundsBase::HoistBoundsBase;
  void runOnOperation() override;

private:
  WalkResult visit(LoopLikeOpInterface nest);
};

} // namespace

/// Calls a function with an access; false for what is none.
template <class Function>
static bool visitAccess(Operation *op, Function &&visit) {
  if (auto load = dyn_cast<LoadOp>(op))
    visit(load);
  else if (auto store = dyn_cast<StoreOp>(op))
    visit(store);
  else if (auto atomic = dyn_cast<AtomicOp>(op))
    visit(atomic);
  else
    return false;
  return true;
}

/// The indices of an access that is tested; none of others.
static ValueRange getTestedIndices(Operation *op) {
  ValueRange indices;
  visitAccess(op, [&](auto access) {
    if (!access.getChecked())
      indices = access.getIndices();
  });
  return indices;
}

static FlatSymbolRefAttr getState(Operation *op) {
  return op->getAttrOfType<FlatSymbolRefAttr>("state");
}

/// Whether a nest is not too large to stand there twice.
static bool isSmall(LoopLikeOpInterface nest, int64_t maxOperations) {
  int64_t operations = 0;
  WalkResult result = nest->walk([&](Operation *op) {
    return ++operations > maxOperations ? WalkResult::interrupt()
                                        : WalkResult::advance();
  });
  return !result.wasInterrupted();
}

static bool isInnermost(LoopLikeOpInterface loop) {
  return !loop->walk([&](LoopLikeOpInterface inner) {
                return inner == loop ? WalkResult::advance()
                                     : WalkResult::interrupt();
              })
              .wasInterrupted();
}

/// Puts a nest and a copy of it under a test; what the copy has of the nest.
static IRMapping version(LoopLikeOpInterface nest, Value test) {
  OpBuilder builder(nest);
  IRMapping mapping;
  Operation *copy = builder.clone(*nest, mapping);
  auto choice =
      scf::IfOp::create(builder, nest.getLoc(), nest->getResultTypes(), test,
                        /*withElseRegion=*/true);
  nest->replaceAllUsesWith(choice);
  auto fill = [&](Block *block, Operation *loop) {
    if (block->empty() || !block->back().hasTrait<OpTrait::IsTerminator>()) {
      builder.setInsertionPointToEnd(block);
      scf::YieldOp::create(builder, nest.getLoc(), loop->getResults());
    }
    loop->moveBefore(block, block->begin());
  };
  fill(choice.thenBlock(), copy);
  fill(choice.elseBlock(), nest);
  return mapping;
}

/// Adds an index to a sum, or takes it off; false if it is none.
bool LoopVersioner::add(Value value, Sum &sum, bool isOff) {
  APInt constant;
  if (matchPattern(value, m_ConstantInt(&constant))) {
    if (!constant.isSignedIntN(32))
      return false;
    sum.constant += isOff ? -constant.getSExtValue() : constant.getSExtValue();
    return true;
  }
  if (count && count->value == value) {
    bool isFirst = !sum.counts && !isOff;
    sum.counts = true;
    return isFirst;
  }
  if (loop.isDefinedOutsideOfLoop(value) && value.getType().isInteger(32)) {
    sum.terms.push_back({value, isOff});
    return sum.terms.size() < 8;
  }
  Operation *op = value.getDefiningOp();
  if (isa_and_nonnull<arith::ExtSIOp>(op) ||
      (isa_and_nonnull<arith::IndexCastOp>(op) &&
       (op->getOperand(0).getType().isInteger() ||
        value.getType().isInteger(64))))
    return add(op->getOperand(0), sum, isOff);
  if (isa_and_nonnull<arith::AddIOp>(op))
    return add(op->getOperand(0), sum, isOff) &&
           add(op->getOperand(1), sum, isOff);
  return isa_and_nonnull<arith::SubIOp>(op) &&
         add(op->getOperand(0), sum, isOff) &&
         add(op->getOperand(1), sum, !isOff);
}

/// Finds the accesses; whether they are all that are tested.
bool LoopVersioner::collect() {
  WalkResult result = loop->walk([&](Operation *op) {
    ValueRange indices = getTestedIndices(op);
    if (indices.empty())
      return WalkResult::advance();
    Access access{op, {}};
    if (indices.size() > 1 ||
        !add(indices.front(), access.sum, /*isOff=*/false))
      return WalkResult::interrupt();
    accesses.push_back(std::move(access));
    return WalkResult::advance();
  });
  return !result.wasInterrupted() && !accesses.empty();
}

/// The sum, but for the count, as an index; it is far from wrapping around.
Value LoopVersioner::createSum(OpBuilder &builder, const Sum &sum) {
  Location loc = loop.getLoc();
  Value total = arith::ConstantIndexOp::create(builder, loc, sum.constant);
  for (auto [value, isOff] : sum.terms) {
    Value term =
        arith::IndexCastOp::create(builder, loc, builder.getIndexType(), value);
    total = isOff ? arith::SubIOp::create(builder, loc, total, term).getResult()
                  : arith::AddIOp::create(builder, loc, total, term);
  }
  return total;
}

Value LoopVersioner::createTest(OpBuilder &builder) {
  using Predicate = arith::CmpIPredicate;
  Location loc = loop.getLoc();
  auto constant = [&](int64_t value) -> Value {
    return arith::ConstantIndexOp::create(builder, loc, value);
  };
  Value all;
  auto expect = [&](Predicate predicate, Value a, Value b) {
    Value holds = arith::CmpIOp::create(builder, loc, predicate, a, b);
    all = all ? arith::AndIOp::create(builder, loc, all, holds).getResult()
              : holds;
  };
  auto toIndex = [&](Value value) -> Value {
    return value.getType().isIndex()
               ? value
               : arith::IndexCastOp::create(builder, loc,
                                            builder.getIndexType(), value);
  };
  Value first, end;
  if (count) {
    first = toIndex(count->first);
    end = toIndex(count->end);
    // So that no sum wraps around.
    if (!count->end.getType().isInteger(32)) {
      expect(Predicate::sge, first, constant(-(int64_t(1) << 40)));
      expect(Predicate::sle, end, constant(int64_t(1) << 40));
    }
  }
  SmallVector<std::pair<FlatSymbolRefAttr, Sum>> known;
  for (const Access &access : accesses) {
    std::pair<FlatSymbolRefAttr, Sum> place(getState(access.op), access.sum);
    if (llvm::is_contained(known, place))
      continue;
    known.push_back(place);
    Value sum = createSum(builder, access.sum);
    Value lowest = sum,
          after = arith::AddIOp::create(builder, loc, sum, constant(1));
    if (access.sum.counts) {
      lowest = arith::AddIOp::create(builder, loc, sum, first);
      after = arith::AddIOp::create(builder, loc, sum, end);
    }
    expect(Predicate::sge, lowest, constant(0));
    expect(Predicate::sle, after,
           ExtentOp::create(builder, loc, place.first.getAttr(), 0));
    // What is computed in 32 bits must be the same number.
    expect(Predicate::sle, after, constant(int64_t(1) << 31));
  }
  return all;
}

/// Gives the accesses of the copy indices in a row, and takes their tests away.
void LoopVersioner::replaceIndices(OpBuilder &builder, IRMapping &mapping) {
  for (const Access &access : accesses) {
    OpBuilder::InsertionGuard guard(builder);
    Value index = createSum(builder, access.sum);
    Operation *copy = mapping.lookup(access.op);
    Location loc = copy->getLoc();
    builder.setInsertionPoint(copy);
    if (access.sum.counts) {
      Value counted = mapping.lookup(count->value);
      if (!counted.getType().isIndex())
        counted = arith::IndexCastOp::create(builder, loc,
                                             builder.getIndexType(), counted);
      index = arith::AddIOp::create(builder, loc, index, counted);
    }
    auto change = [&](auto found) {
      found.getIndicesMutable().assign(index);
      found.setChecked(true);
    };
    visitAccess(copy, change);
  }
}

bool LoopVersioner::run() {
  if (!collect())
    return false;
  OpBuilder builder(loop);
  IRMapping mapping = version(loop, createTest(builder));
  builder.setInsertionPoint(mapping.lookup(loop.getOperation()));
  replaceIndices(builder, mapping);
  return true;
}

/// Sums of which it is known that they do not wrap around.
static void setNoWrap(Operation *op) {
  auto set = [](auto sum) {
    sum.setOverflowFlags(sum.getOverflowFlags() |
                         arith::IntegerOverflowFlags::nsw);
  };
  if (auto sum = dyn_cast<arith::AddIOp>(op))
    set(sum);
  else if (auto difference = dyn_cast<arith::SubIOp>(op))
    set(difference);
  else if (auto product = dyn_cast<arith::MulIOp>(op))
    set(product);
}

/// Versions a nest by the ranges of its indices.
static void versionByRanges(LoopLikeOpInterface nest) {
  auto front = std::make_unique<Block>();
  OpBuilder builder(nest->getContext());
  builder.setInsertionPointToEnd(front.get());
  IndexRanges ranges(nest, builder);
  SmallVector<Operation *> accesses;
  WalkResult result = nest->walk([&](Operation *op) {
    ValueRange indices = getTestedIndices(op);
    if (!indices.empty())
      accesses.push_back(op);
    for (auto [dim, index] : llvm::enumerate(indices)) {
      std::optional<IndexRanges::Range> range = ranges.get(index);
      if (!range)
        return WalkResult::interrupt();
      ranges.expectInside(*range, getState(op), int64_t(dim));
    }
    return WalkResult::advance();
  });
  if (result.wasInterrupted() || accesses.empty())
    return;
  nest->getBlock()->getOperations().splice(nest->getIterator(),
                                           front->getOperations());
  SmallVector<Operation *> sums, divisions;
  nest->walk([&](Operation *op) {
    if (op->getNumResults() == 1 && ranges.isKnown(op->getResult(0)))
      (isa<DivideOp>(op) ? divisions : sums).push_back(op);
  });
  IRMapping mapping = version(nest, ranges.getTest());
  for (Operation *access : accesses)
    visitAccess(mapping.lookup(access),
                [](auto copy) { copy.setChecked(true); });
  for (Operation *sum : sums)
    setNoWrap(mapping.lookup(sum));
  for (Operation *op : divisions) {
    auto division = cast<DivideOp>(mapping.lookup(op));
    IRRewriter rewriter(division);
    rewriter.replaceOp(division, division.createUnchecked(rewriter));
  }
}

WalkResult HoistBoundsPass::visit(LoopLikeOpInterface nest) {
  if (isInnermost(nest) && isSmall(nest, maxOperations) &&
      LoopVersioner(nest).run())
    return WalkResult::skip();
  // Where not all indices are inside, as with a guard around what reads them,
  // those of loops inside may be.
  auto loop = dyn_cast<scf::ForOp>(nest.getOperation());
  if (!(loop && isOverPrimitives(loop)) && isSmall(nest, maxNestOperations))
    versionByRanges(nest);
  return WalkResult::advance();
}

void HoistBoundsPass::runOnOperation() {
  getOperation().walk<WalkOrder::PreOrder>([&](Operation *op) {
    return isa<scf::ForOp, scf::WhileOp>(op)
               ? visit(cast<LoopLikeOpInterface>(op))
               : WalkResult::advance();
  });
}
