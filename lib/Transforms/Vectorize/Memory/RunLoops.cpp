// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Vectorize/Memory/RunLoops.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/SCF/Utils/Utils.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/Dominance.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/CSE.h"

using namespace mlir;
using namespace piko;

namespace {

/// What numbers are in an iteration of a loop, as far as its count says.
class IterationValues {
public:
  explicit IterationValues(scf::ForOp loop) : loop(loop) {}
  /// By how much a number grows from one count to another.
  std::optional<int64_t> getGrowth(Value value, int64_t from, int64_t to);

private:
  std::optional<int64_t> evaluate(Value value, int64_t count);

  scf::ForOp loop;
};

} // namespace

std::optional<int64_t> IterationValues::evaluate(Value value, int64_t count) {
  if (value == loop.getInductionVar())
    return count;
  APInt number;
  if (matchPattern(value, m_ConstantInt(&number)))
    return number.getSExtValue();
  Operation *op = value.getDefiningOp();
  if (!op || !loop->isAncestor(op) || op->getNumOperands() == 0 ||
      op->getNumOperands() > 2)
    return std::nullopt;
  std::optional<int64_t> a = evaluate(op->getOperand(0), count);
  if (a && isa<arith::IndexCastOp, arith::ExtSIOp>(op))
    return a;
  if (!a || op->getNumOperands() != 2)
    return std::nullopt;
  std::optional<int64_t> b = evaluate(op->getOperand(1), count);
  constexpr int64_t most = 31; // Shifts by more are not of interest.
  bool isDivisor = b && *a >= 0 && *b > 0,
       isDistance = b && *b >= 0 && *b < most;
  if (!b)
    return std::nullopt;
  if (isa<arith::AddIOp>(op))
    return *a + *b;
  if (isa<arith::SubIOp>(op))
    return *a - *b;
  if (isa<arith::MulIOp>(op))
    return *a * *b;
  if (isa<arith::AndIOp>(op))
    return *a & *b;
  if (isa<arith::DivSIOp, arith::DivUIOp>(op) && isDivisor)
    return *a / *b;
  if (isa<arith::RemSIOp, arith::RemUIOp>(op) && isDivisor)
    return *a % *b;
  if (isa<arith::ShLIOp>(op) && isDistance)
    return *a << *b;
  if (isa<arith::ShRSIOp, arith::ShRUIOp>(op) && isDistance && *a >= 0)
    return *a >> *b;
  return std::nullopt;
}

std::optional<int64_t> IterationValues::getGrowth(Value value, int64_t from,
                                                  int64_t to) {
  Operation *op = value.getDefiningOp();
  if (op ? !loop->isAncestor(op) : value.getParentBlock() != loop.getBody())
    return 0;
  if (std::optional<int64_t> a = evaluate(value, from))
    if (std::optional<int64_t> b = evaluate(value, to))
      return *b - *a;
  if (!op || op->getNumRegions() > 0 || !isPure(op))
    return std::nullopt;
  SmallVector<int64_t> growths;
  for (Value operand : op->getOperands()) {
    std::optional<int64_t> growth = getGrowth(operand, from, to);
    if (!growth)
      return std::nullopt;
    growths.push_back(*growth);
  }
  if (isa<arith::AddIOp>(op))
    return growths[0] + growths[1];
  if (isa<arith::SubIOp>(op))
    return growths[0] - growths[1];
  if (isa<vector::BroadcastOp, arith::IndexCastOp, arith::ExtSIOp>(op))
    return growths[0];
  return llvm::all_of(growths, [](int64_t growth) { return growth == 0; })
             ? std::optional<int64_t>(0)
             : std::nullopt;
}

/// Whether some gather of an iteration reads the element after that of the
/// iteration before.
static bool readsRun(scf::ForOp loop, int64_t first) {
  IterationValues values(loop);
  return loop
      .walk([&](GatherOp gather) {
        bool isNext =
            !gather.getConsecutive() && gather.getIndices().size() == 1 &&
            values.getGrowth(gather.getIndices().front(), first, first + 1) ==
                1;
        return isNext ? WalkResult::interrupt() : WalkResult::advance();
      })
      .wasInterrupted();
}

static bool isWorthUnrolling(scf::ForOp loop) {
  constexpr int64_t mostIterations = 64, mostOperations = 2048;
  std::optional<int64_t> first = getConstantIntValue(loop.getLowerBound());
  std::optional<APInt> iterations = loop.getStaticTripCount();
  if (!first || !iterations || iterations->ugt(mostIterations) ||
      iterations->ult(2) || !matchPattern(loop.getStep(), m_One()))
    return false;
  int64_t operations = 0;
  bool isInnermost = true;
  loop->walk([&](Operation *op) {
    ++operations;
    isInnermost &= op == loop || !isa<scf::ForOp>(op);
  });
  return isInnermost &&
         operations * int64_t(iterations->getZExtValue()) <= mostOperations &&
         readsRun(loop, *first);
}

/// Constants of the iteration that a loop was, as far as they follow.
static void foldOperations(Block &block) {
  IRRewriter rewriter(block.getParentOp()->getContext());
  for (Operation &op : llvm::make_early_inc_range(block)) {
    rewriter.setInsertionPoint(&op);
    SmallVector<Value> folded;
    OpBuilder builder(&op);
    if (isPure(&op) && op.getNumResults() == 1 &&
        succeeded(builder.tryFold(&op, folded)) && !folded.empty())
      rewriter.replaceOp(&op, folded);
  }
}

void piko::unrollRuns(Operation *kernel) {
  SmallVector<scf::ForOp> loops;
  kernel->walk([&](scf::ForOp loop) {
    if (isWorthUnrolling(loop))
      loops.push_back(loop);
  });
  for (scf::ForOp loop : loops) {
    Block *block = loop->getBlock();
    if (succeeded(loopUnrollFull(loop)))
      foldOperations(*block);
  }
  if (loops.empty())
    return;
  // What iterations compute alike is one value then.
  IRRewriter rewriter(kernel->getContext());
  DominanceInfo dominance(kernel);
  eliminateCommonSubExpressions(rewriter, dominance, kernel);
}
