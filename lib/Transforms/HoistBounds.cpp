// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-hoist-bounds: for each innermost loop,
//   1. find the tested accesses, each at a sum of what does not change and, at
//      most once, of the loop's count;
//   2. if these are all, write a test in front that all are inside;
//   3. copy the loop, for where they are, with accesses that are not tested.

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

/// What a loop counts with: from `first`, by one, while it is less than `end`.
struct Count {
  SmallVector<Value> values; // the count, as an argument of each region
  Value first, end;
};

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

class LoopVersioner {
public:
  LoopVersioner(LoopLikeOpInterface loop, int64_t maxOperations)
      : loop(loop), maxOperations(maxOperations) {}
  bool run();

private:
  bool isLarge();
  void findCount();
  bool collect();
  bool add(Value index, Sum &sum, bool isOff);
  Value createTest(OpBuilder &builder);
  void replaceIndices(OpBuilder &builder, IRMapping &mapping);
  Value createSum(OpBuilder &builder, const Sum &sum);

  LoopLikeOpInterface loop;
  int64_t maxOperations;
  std::optional<Count> count;
  SmallVector<Access> accesses;
};

struct HoistBoundsPass : piko::impl::HoistBoundsBase<HoistBoundsPass> {
  using HoistBoundsBase::HoistBoundsBase;
  void runOnOperation() override;
};

} // namespace

/// The one index of an access to a buffer that is tested; null for others.
static Value getTestedIndex(Operation *op) {
  auto get = [](auto access) {
    return access.getChecked() || access.getIndices().size() != 1
               ? Value()
               : access.getIndices()[0];
  };
  if (auto load = dyn_cast<LoadOp>(op))
    return get(load);
  if (auto store = dyn_cast<StoreOp>(op))
    return get(store);
  if (auto atomic = dyn_cast<AtomicOp>(op))
    return get(atomic);
  return Value();
}

/// Whether an access is tested, whatever its indices.
static bool isTested(Operation *op) {
  auto get = [](auto access) {
    return !access.getChecked() && !access.getIndices().empty();
  };
  if (auto load = dyn_cast<LoadOp>(op))
    return get(load);
  if (auto store = dyn_cast<StoreOp>(op))
    return get(store);
  auto atomic = dyn_cast<AtomicOp>(op);
  return atomic && get(atomic);
}

static StringAttr getState(Operation *op) {
  return op->getAttrOfType<FlatSymbolRefAttr>("state").getAttr();
}

bool LoopVersioner::isLarge() {
  int64_t operations = 0;
  bool isInnermost = true;
  loop->walk([&](Operation *op) {
    ++operations;
    isInnermost &= op == loop.getOperation() || !isa<LoopLikeOpInterface>(op);
  });
  return !isInnermost || operations > maxOperations;
}

void LoopVersioner::findCount() {
  if (auto range = dyn_cast<scf::ForOp>(loop.getOperation())) {
    if (matchPattern(range.getStep(), m_One()))
      count = Count{{range.getInductionVar()},
                    range.getLowerBound(),
                    range.getUpperBound()};
    return;
  }
  auto repeat = dyn_cast<scf::WhileOp>(loop.getOperation());
  if (!repeat)
    return;
  auto compare =
      repeat.getConditionOp().getCondition().getDefiningOp<arith::CmpIOp>();
  if (!compare || compare.getPredicate() != arith::CmpIPredicate::slt ||
      !loop.isDefinedOutsideOfLoop(compare.getRhs()))
    return;
  auto before = dyn_cast<BlockArgument>(compare.getLhs());
  if (!before || before.getOwner() != repeat.getBeforeBody())
    return;
  unsigned i = before.getArgNumber();
  auto step =
      repeat.getYieldOp().getResults()[i].getDefiningOp<arith::AddIOp>();
  if (!step || !matchPattern(step.getRhs(), m_One()))
    return;
  auto after = dyn_cast<BlockArgument>(step.getLhs());
  if (!after || after.getOwner() != repeat.getAfterBody() ||
      repeat.getConditionOp().getArgs()[after.getArgNumber()] != before)
    return;
  count = Count{{after}, repeat.getInits()[i], compare.getRhs()};
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
  if (count && llvm::is_contained(count->values, value)) {
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
    if (!isTested(op))
      return WalkResult::advance();
    Value index = getTestedIndex(op);
    Access access{op, {}};
    if (!index || !add(index, access.sum, /*isOff=*/false))
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
  SmallVector<std::pair<StringAttr, Sum>> known;
  for (const Access &access : accesses) {
    std::pair<StringAttr, Sum> place(getState(access.op), access.sum);
    if (llvm::is_contained(known, place))
      continue;
    known.push_back(place);
    Value sum = createSum(builder, access.sum);
    Value lowest = sum,
          behind = arith::AddIOp::create(builder, loc, sum, constant(1));
    if (access.sum.counts) {
      lowest = arith::AddIOp::create(builder, loc, sum, first);
      behind = arith::AddIOp::create(builder, loc, sum, end);
    }
    expect(Predicate::sge, lowest, constant(0));
    expect(Predicate::sle, behind,
           ExtentOp::create(builder, loc, place.first, 0));
    // What is computed in 32 bits must be the same number.
    expect(Predicate::sle, behind, constant(int64_t(1) << 31));
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
      Value counted = mapping.lookup(count->values.front());
      if (!counted.getType().isIndex())
        counted = arith::IndexCastOp::create(builder, loc,
                                             builder.getIndexType(), counted);
      index = arith::AddIOp::create(builder, loc, index, counted);
    }
    auto change = [&](auto found) {
      found.getIndicesMutable().assign(index);
      found.setChecked(true);
    };
    if (auto load = dyn_cast<LoadOp>(copy))
      change(load);
    else if (auto store = dyn_cast<StoreOp>(copy))
      change(store);
    else
      change(cast<AtomicOp>(copy));
  }
}

bool LoopVersioner::run() {
  if (isLarge())
    return false;
  findCount();
  if (!collect())
    return false;
  OpBuilder builder(loop);
  auto choice = scf::IfOp::create(builder, loop.getLoc(),
                                  loop->getResultTypes(), createTest(builder),
                                  /*withElseRegion=*/true);
  loop->replaceAllUsesWith(choice);
  auto fill = [&](Block *block, Operation *copy) {
    if (block->empty() || !block->back().hasTrait<OpTrait::IsTerminator>()) {
      builder.setInsertionPointToEnd(block);
      scf::YieldOp::create(builder, loop.getLoc(), copy->getResults());
    }
    copy->moveBefore(block, block->begin());
  };
  IRMapping mapping;
  Operation *copy = builder.clone(*loop, mapping);
  fill(choice.thenBlock(), copy);
  fill(choice.elseBlock(), loop);
  builder.setInsertionPoint(copy);
  replaceIndices(builder, mapping);
  return true;
}

void HoistBoundsPass::runOnOperation() {
  SmallVector<LoopLikeOpInterface> loops;
  getOperation().walk([&](LoopLikeOpInterface loop) {
    if (isa<scf::ForOp, scf::WhileOp>(loop.getOperation()))
      loops.push_back(loop);
  });
  for (LoopLikeOpInterface loop : loops)
    versioned += LoopVersioner(loop, maxOperations).run();
}
