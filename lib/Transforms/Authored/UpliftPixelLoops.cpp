// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-uplift-pixel-loops, for each nest of as many counted loops as the
// pipeline has dimensions, outermost loops first:
//   1. find the counters and the bounds of the loops;
//   2. prove that the counters are a pixel of the bin, if need be under a test
//      around the whole body;
//   3. check that iterations are independent, and that nothing but them has an
//      effect;
//   4. make a box of the bounds, and one body of all that the loops hold.

#include "Piko/Transforms/Passes.h"

#include "Authored/PixelLoops.h"

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"

namespace piko {
#define GEN_PASS_DEF_UPLIFTPIXELLOOPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct UpliftPixelLoopsPass
    : piko::impl::UpliftPixelLoopsBase<UpliftPixelLoopsPass> {
  void runOnOperation() override;
  void runOnProcess(ProcessOp process, int64_t rank);
  /// Whether the loop is gone.
  bool runOnLoop(Operation *loop, int64_t rank);
  void reportOthers(ProcessOp process, int64_t rank);
  void report(Operation *loop, const Refusal &refusal);

  llvm::DenseSet<Operation *> reported;
};

/// Makes the operation of a nest.
class Uplift {
public:
  Uplift(PixelLoops &loops, bool clips)
      : loops(loops), clips(clips), builder(loops.getOuter().loop),
        loc(loops.getOuter().loop->getLoc()) {}
  ParallelPixelsOp run();

private:
  Value createLower(unsigned dim);
  Value createUpper(unsigned dim);
  Value createEnd(Value last, bool isOnly, Value inBin);
  Value createCorner(bool isUpper, unsigned dim);
  Value hoist(Value bound);

  PixelLoops &loops;
  bool clips;
  OpBuilder builder;
  Location loc;
};

} // namespace

//===----------------------------------------------------------------------===//
// The bin
//===----------------------------------------------------------------------===//

/// Whether the counters are a pixel of the bin where an operation stands.
static bool isInBin(const PixelLoops &loops, Operation *at,
                    FactsProvider &provider) {
  LinearFacts facts(at, provider);
  for (unsigned dim = 0; dim < loops.getRank(); ++dim) {
    Value counter = loops.getCounter(dim);
    if (!facts.isAboveBin(counter, dim) || !facts.isBelowBin(counter, dim))
      return false;
  }
  return true;
}

/// A bound that a counter ends at only if it meets it, and may have passed.
static Refusal findPassed(const PixelLoops &loops, FactsProvider &provider) {
  for (const LoopOverPixels &loop : loops.getLoops())
    for (const CountedLoop::Bound &bound : loop.bounds) {
      if (bound.predicate != arith::CmpIPredicate::ne)
        continue;
      LinearFacts facts(loop.loop, provider);
      if (!facts.isAtLeastZero(facts.get(bound.end) - facts.get(loop.first)))
        return {bound.at, "the counter may pass this bound"};
    }
  return {};
}

//===----------------------------------------------------------------------===//
// Rewriting
//===----------------------------------------------------------------------===//

/// A bound before the loops.
Value Uplift::hoist(Value bound) {
  SetVector<Operation *> slice;
  loops.collectInvariant(bound, slice);
  for (Operation *op : slice)
    op->moveBefore(loops.getOuter().loop);
  return bound;
}

/// A bound of the bin, as C++ has it.
Value Uplift::createCorner(bool isUpper, unsigned dim) {
  Type index = builder.getIndexType();
  Value bin = BinOp::create(builder, loc, index);
  Value corner =
      isUpper ? BinHiOp::create(builder, loc, index, bin, dim).getResult()
              : BinLoOp::create(builder, loc, index, bin, dim).getResult();
  return arith::IndexCastOp::create(builder, loc, builder.getI32Type(), corner);
}

Value Uplift::createLower(unsigned dim) {
  Value lower = hoist(loops.getLoop(dim).first);
  if (!clips)
    return lower;
  return arith::MaxSIOp::create(builder, loc, lower,
                                createCorner(/*isUpper=*/false, dim));
}

/// The end after a last pixel. The loop ends, so that this is not the largest
/// int, unless another bound ends it before, as that of the bin does.
Value Uplift::createEnd(Value last, bool isOnly, Value inBin) {
  auto number = [&](int64_t value) {
    return arith::ConstantIntOp::create(builder, loc, value, /*width=*/32);
  };
  if (inBin) {
    inBin = arith::SubIOp::create(builder, loc, inBin, number(1));
    last = arith::MinSIOp::create(builder, loc, inBin, last);
  } else if (!isOnly) {
    last = arith::MinSIOp::create(builder, loc, last, number(INT32_MAX - 1));
  }
  return arith::AddIOp::create(builder, loc, last, number(1));
}

/// The least of the bounds.
Value Uplift::createUpper(unsigned dim) {
  ArrayRef<CountedLoop::Bound> bounds = loops.getLoop(dim).bounds;
  Value inBin = clips ? createCorner(/*isUpper=*/true, dim) : Value();
  Value result = inBin;
  for (const CountedLoop::Bound &bound : bounds) {
    Value end = hoist(bound.end);
    if (bound.predicate == arith::CmpIPredicate::sle)
      end = createEnd(end, bounds.size() == 1, inBin);
    if (result)
      end = arith::MinSIOp::create(builder, loc, result, end);
    result = end;
  }
  return result;
}

ParallelPixelsOp Uplift::run() {
  SmallVector<Value> lo, hi;
  for (unsigned dim = 0; dim < loops.getRank(); ++dim) {
    lo.push_back(createLower(dim));
    hi.push_back(createUpper(dim));
  }
  auto pixels = ParallelPixelsOp::create(builder, loc, lo, hi);
  Block *body = builder.createBlock(&pixels.getBody());
  for (unsigned dim = 0; dim < loops.getRank(); ++dim) {
    Value counter = loops.getCounter(dim);
    counter.replaceAllUsesWith(
        body->addArgument(counter.getType(), counter.getLoc()));
  }
  // From the outside in: what stands before the inner loop. After it are
  // only the steps to the next iteration.
  for (unsigned dim = loops.getRank(); dim-- > 0;) {
    Operation *inner = dim ? loops.getLoop(dim - 1).loop : nullptr;
    for (Operation &op : llvm::make_early_inc_range(
             loops.getLoop(dim).body->without_terminator())) {
      if (&op == inner)
        break;
      op.moveBefore(body, body->end());
    }
  }
  builder.setInsertionPointToEnd(body);
  YieldOp::create(builder, loc, ValueRange(), ValueRange());
  loops.getOuter().loop->erase();
  return pixels;
}

/// A comparison of the pixel's bin with the bin says nothing any more.
static void dropTest(scf::IfOp guard, ParallelPixelsOp pixels) {
  auto compare = guard.getCondition().getDefiningOp<arith::CmpIOp>();
  if (!compare || compare.getPredicate() != arith::CmpIPredicate::eq)
    return;
  Value a = stripWidening(compare.getLhs()),
        b = stripWidening(compare.getRhs());
  if (a.getDefiningOp<BinOp>())
    std::swap(a, b);
  auto cell = a.getDefiningOp<BinAtOp>();
  if (!cell || !b.getDefiningOp<BinOp>() ||
      !llvm::equal(cell.getCoordinates(), pixels.getCell()))
    return;
  OpBuilder builder(guard);
  guard.getConditionMutable().assign(arith::ConstantOp::create(
      builder, guard.getLoc(), builder.getBoolAttr(true)));
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

bool UpliftPixelLoopsPass::runOnLoop(Operation *outer, int64_t rank) {
  PixelLoops loops;
  if (!loops.find(outer, rank))
    return false;
  BinIdentity provider;
  Operation *inside = &loops.getBody()->front();
  bool isKnown = isInBin(loops, inside, provider), clips = false;
  scf::IfOp guard = isKnown ? scf::IfOp() : loops.findGuard();
  if (guard && isInBin(loops, &guard.thenBlock()->front(), provider))
    isKnown = clips = true;
  // What is not known to be over pixels may be any loop.
  if (!isKnown && !loops.accessesPixels())
    return false;
  Refusal refusal = loops.getRefusal();
  if (!refusal.at && !isKnown)
    refusal = {outer, "its pixels are not known to lie in the bin"};
  if (!refusal.at)
    refusal = loops.checkIterations();
  if (!refusal.at)
    refusal = findPassed(loops, provider);
  if (!refusal.at) {
    ParallelPixelsOp pixels = Uplift(loops, clips).run();
    if (clips)
      dropTest(guard, pixels);
    return true;
  }
  report(outer, refusal);
  return false;
}

void UpliftPixelLoopsPass::report(Operation *loop, const Refusal &refusal) {
  reported.insert(loop);
  InFlightDiagnostic remark =
      loop->emitRemark()
      << "this loop over pixels of stage '" << getCppName(getPhaseStage(loop))
      << "' stays one that counts; parallelForPixels(lo, hi, f) has "
         "independent iterations";
  remark.attachNote(refusal.at->getLoc()) << refusal.why;
}

/// Loops that hand on the pixel of an access, and are no nest as it should be.
void UpliftPixelLoopsPass::reportOthers(ProcessOp process, int64_t rank) {
  process.walk([&](Operation *op) {
    llvm::SetVector<Operation *> owners;
    for (Value coordinate : getPixel(op))
      if (auto argument = dyn_cast<BlockArgument>(stripWidening(coordinate)))
        if (Operation *loop = argument.getOwner()->getParentOp();
            isa<scf::WhileOp, scf::ForOp>(loop))
          owners.insert(loop);
    if (int64_t(owners.size()) != rank)
      return;
    Operation *outer = owners[0];
    for (Operation *loop : owners)
      if (loop->isProperAncestor(outer))
        outer = loop;
    if (!reported.contains(outer))
      report(outer, {outer, PixelLoops().find(outer, rank)
                                ? "x is not what its innermost loop counts"
                                : "not all of its loops end by a test of their "
                                  "counter alone"});
  });
}

void UpliftPixelLoopsPass::runOnProcess(ProcessOp process, int64_t rank) {
  SmallVector<Operation *> loops; // outermost first
  process.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (isa<scf::WhileOp, scf::ForOp>(op))
      loops.push_back(op);
  });
  // Those inside one that is uplifted are gone, or are no nests any more.
  llvm::DenseSet<Operation *> done;
  for (Operation *loop : loops) {
    if (done.contains(loop))
      continue;
    SmallVector<Operation *> inside;
    loop->walk([&](Operation *op) { inside.push_back(op); });
    if (runOnLoop(loop, rank))
      done.insert_range(inside);
  }
  reportOthers(process, rank);
  reported.clear();
}

void UpliftPixelLoopsPass::runOnOperation() {
  int64_t rank = getOperation().getRank();
  getOperation().walk([&](ProcessOp process) {
    // Checks of iterations are in their order.
    if (process.getOps<CheckCallOp>().empty())
      runOnProcess(process, rank);
  });
}
