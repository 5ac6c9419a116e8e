// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-pair-gathers: lanes read elements side by side at once.
//
// As many as fit into 8 bytes make a run, and a power of two of them. Two
// indices that are one apart but for limits, such as clamped ones, make a pair,
// with a test whether they are here.

#include "Piko/Transforms/Passes.h"
#include "Support/StateAccess.h"
#include "Vectorize/Memory/RunLoops.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/Dominance.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_PAIRGATHERS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// How far one index is from another one.
enum class Distance {
  Other,
  Next,       ///< one more, in each lane
  NextOrSame, ///< mostly: but for limits, which a test has to find out
};

/// A gather that may be one of a pair.
struct Candidate {
  mutable GatherOp gather; // whose accessors are not const
  Value index;             ///< integers of 32 bits
  /// What computes no more than this, and is replaced: the gather, or the
  /// condition that some lane reads.
  Operation *whole;
};

/// Gathers whose elements stand side by side, in that order.
struct Run {
  SmallVector<Candidate> reads;
  Distance distance;
};

struct PairGathersPass : piko::impl::PairGathersBase<PairGathersPass> {
  void runOnOperation() override;

private:
  void load(ArrayRef<Candidate> candidates, DominanceInfo &dominance);
  void loadEach(const Candidate &candidate);
};

} // namespace

static bool isWords(Value value) {
  auto type = dyn_cast<VectorType>(value.getType());
  return type && type.getElementType().isInteger(32);
}

/// What an index is cast from, if that is of 32 bits for each lane.
static Value findWords(Value index) {
  while (!isWords(index) &&
         isa_and_nonnull<arith::IndexCastOp, arith::IndexCastUIOp,
                         arith::ExtSIOp, arith::ExtUIOp>(index.getDefiningOp()))
    index = index.getDefiningOp()->getOperand(0);
  return isWords(index) ? index : Value();
}

/// A sum's part that is no constant, and the constant.
static std::pair<Value, int64_t> splitSum(Value value) {
  auto sum = value.getDefiningOp<arith::AddIOp>();
  APInt number;
  if (sum && matchPattern(sum.getRhs(), m_ConstantInt(&number)))
    return {sum.getLhs(), number.getSExtValue()};
  return {value, 0};
}

/// What a limited number may be.
static SmallVector<Value> getChoices(Value value) {
  Operation *op = value.getDefiningOp();
  if (isa_and_nonnull<arith::MinSIOp, arith::MaxSIOp, arith::MinUIOp,
                      arith::MaxUIOp>(op))
    return SmallVector<Value>(op->getOperands());
  if (auto choice = dyn_cast_or_null<arith::SelectOp>(op))
    return {choice.getTrueValue(), choice.getFalseValue()};
  return {};
}

/// How far `to` is from `from`, where sums may wrap around.
static Distance findDistance(Value from, Value to, unsigned depth = 6) {
  if (depth == 0)
    return Distance::Other;
  // What all lanes share is a scalar.
  auto isAlike = [&](auto tag) {
    using Op = decltype(tag);
    return from.getDefiningOp<Op>() && to.getDefiningOp<Op>() &&
           from.getDefiningOp()->getOperand(0).getType() ==
               to.getDefiningOp()->getOperand(0).getType();
  };
  if (isAlike(vector::BroadcastOp()) || isAlike(arith::IndexCastOp()))
    return findDistance(from.getDefiningOp()->getOperand(0),
                        to.getDefiningOp()->getOperand(0), depth - 1);
  auto [a, i] = splitSum(from);
  auto [b, j] = splitSum(to);
  if (a == b)
    return j - i == 1 ? Distance::Next : Distance::Other;
  auto sum = from.getDefiningOp<arith::AddIOp>(),
       other = to.getDefiningOp<arith::AddIOp>();
  if (sum && other)
    for (unsigned left : {0, 1})
      for (unsigned right : {0, 1})
        if (sum.getOperand(left) == other.getOperand(right))
          return findDistance(sum.getOperand(1 - left),
                              other.getOperand(1 - right), depth - 1);
  for (Value choice : getChoices(from))
    if (findDistance(choice, to, depth - 1) != Distance::Other)
      return Distance::NextOrSame;
  for (Value choice : getChoices(to))
    if (findDistance(from, choice, depth - 1) != Distance::Other)
      return Distance::NextOrSame;
  return Distance::Other;
}

static bool isZero(Value value) {
  return matchPattern(value, m_Zero()) || matchPattern(value, m_AnyZeroFloat());
}

/// The condition around a gather whose result is the gather's, or nothing.
static scf::IfOp findGuard(GatherOp gather) {
  auto guard = dyn_cast<scf::IfOp>(gather->getParentOp());
  if (!guard || guard.getNumResults() != 1 || guard.getElseRegion().empty() ||
      !gather.getResult().hasOneUse() ||
      gather->getBlock() != guard.thenBlock() ||
      guard.thenYield().getOperand(0) != gather.getResult() ||
      !guard.elseBlock()->without_terminator().empty() ||
      !isZero(guard.elseYield().getOperand(0)))
    return {};
  for (Operation &op : guard.thenBlock()->without_terminator())
    if (&op != gather && !isPure(&op))
      return {};
  return guard;
}

/// Whether elements have nothing but the number that is read.
static bool isWhole(GatherOp gather) {
  auto buffer = lookupInPipeline<BufferOp>(gather, gather.getStateAttr());
  constexpr int64_t byteBits = 8;
  int64_t bits = cast<VectorType>(gather.getType()).getElementTypeBitWidth();
  return buffer && bits <= 32 &&
         lookupRecord(gather, getStateRecord(buffer)).getSize() * byteBits ==
             bits;
}

static std::optional<Candidate> findCandidate(GatherOp gather) {
  if (gather.getIndices().size() != 1 || !gather.getElements().empty() ||
      gather.getConsecutive() || !isWhole(gather))
    return std::nullopt;
  Value index = gather.getIndices().front();
  if (!isa<VectorType>(index.getType()))
    return std::nullopt;
  if (Value words = findWords(index))
    index = words;
  scf::IfOp guard = findGuard(gather);
  return Candidate{gather, index, guard ? guard : gather.getOperation()};
}

/// A value inside a guard is one of what stands in it, too.
static void leaveGuard(const Candidate &candidate) {
  Operation *whole = candidate.whole;
  if (whole == candidate.gather.getOperation())
    return;
  for (Operation &op : llvm::make_early_inc_range(
           cast<scf::IfOp>(whole).thenBlock()->without_terminator()))
    if (&op != candidate.gather.getOperation())
      op.moveBefore(whole);
}

static Value createAny(CodeBuilder at, Value mask) {
  return vector::ReductionOp::create(at.builder, at.loc,
                                     vector::CombiningKind::OR, mask);
}

/// Whether so many elements follow that of each lane in the buffer.
static Value createAreFollowed(CodeBuilder at, const Candidate &read,
                               int64_t count) {
  OpBuilder &builder = at.builder;
  Location loc = at.loc;
  // What is negative counts as this much or more.
  constexpr int64_t most = int64_t(1) << 31;
  Value extent = ExtentOp::create(builder, loc, read.gather.getStateAttr(),
                                  builder.getI64IntegerAttr(0));
  Value end =
      at.sub(arith::MinUIOp::create(builder, loc, extent, at.index(most)),
             at.index(count));
  end = arith::MaxSIOp::create(builder, loc, end, at.index(0));
  end = arith::IndexCastOp::create(builder, loc, builder.getI32Type(), end);
  end = vector::BroadcastOp::create(builder, loc, read.index.getType(), end);
  return at.compare(CodeBuilder::P::ult, read.index, end);
}

/// Whether indices are side by side, or the same.
static Value createAreNear(CodeBuilder at, Value from, Value to) {
  Value one = arith::ConstantOp::create(
      at.builder, at.loc,
      DenseElementsAttr::get(cast<ShapedType>(from.getType()),
                             at.builder.getI32IntegerAttr(1)));
  return at.compare(CodeBuilder::P::ule, at.sub(to, from), one);
}

/// Whether some lane of a mask has no run of elements here.
static Value createAreApart(CodeBuilder at, const Run &run, Value mask) {
  ArrayRef<Candidate> reads = run.reads;
  Value are = createAreFollowed(at, reads[0], int64_t(reads.size()) - 1);
  if (run.distance == Distance::NextOrSame)
    are = at.both(are, createAreNear(at, reads[0].index, reads[1].index));
  Value yes = arith::ConstantOp::create(
      at.builder, at.loc,
      DenseElementsAttr::get(cast<ShapedType>(are.getType()), true));
  Value areNot = arith::XOrIOp::create(at.builder, at.loc, are, yes);
  return createAny(at, at.both(mask, areNot));
}

static SmallVector<Value> createRun(CodeBuilder at, const Run &run,
                                    Value mask) {
  const Candidate &first = run.reads.front();
  SmallVector<Type> types(run.reads.size(), first.gather.getType());
  auto made = GatherRunOp::create(at.builder, at.loc, types,
                                  first.gather.getStateAttr(), first.index,
                                  first.gather.getFieldAttr(), mask);
  SmallVector<Value> values(made.getResults());
  if (run.distance == Distance::NextOrSame)
    values[1] = at.select(
        at.compare(CodeBuilder::P::eq, first.index, run.reads[1].index),
        values[0], values[1]);
  return values;
}

/// Whether an operation stands where some lane of a mask is known to be.
static bool isWhereSomeAre(Operation *op, Value mask) {
  auto guard = dyn_cast<scf::IfOp>(op->getParentOp());
  if (!guard || op->getBlock() != guard.thenBlock())
    return false;
  auto isAny = [&](Value condition) {
    auto any = condition.getDefiningOp<vector::ReductionOp>();
    return any && any.getKind() == vector::CombiningKind::OR &&
           any.getVector() == mask;
  };
  auto both = guard.getCondition().getDefiningOp<arith::AndIOp>();
  return isAny(guard.getCondition()) ||
         (both && (isAny(both.getLhs()) || isAny(both.getRhs())));
}

/// Reads the elements where the builder stands.
static SmallVector<Value> createReads(CodeBuilder at, const Run &run) {
  llvm::SetVector<Value> masks;
  for (const Candidate &read : run.reads)
    masks.insert(read.gather.getMask());
  Value some = masks.front();
  for (Value mask : ArrayRef(masks.getArrayRef()).drop_front())
    some = at.either(some, mask);
  auto readRun = [&](OpBuilder &builder, Location loc) {
    scf::YieldOp::create(builder, loc, createRun({builder, loc}, run, some));
  };
  auto readApart = [&](OpBuilder &builder, Location loc) {
    SmallVector<Value> values;
    for (const Candidate &read : run.reads)
      values.push_back(builder.clone(*read.gather)->getResult(0));
    scf::YieldOp::create(builder, loc, values);
  };
  // Where all are read, all are here.
  bool areSide = masks.size() == 1 && run.distance == Distance::Next;
  auto read = [&](OpBuilder &builder, Location loc) {
    if (areSide)
      return readRun(builder, loc);
    auto choice = scf::IfOp::create(builder, loc,
                                    createAreApart({builder, loc}, run, some),
                                    readApart, readRun);
    scf::YieldOp::create(builder, loc, choice.getResults());
  };
  auto readNothing = [&](OpBuilder &builder, Location loc) {
    Value none = arith::ConstantOp::create(
        builder, loc, builder.getZeroAttr(run.reads[0].gather.getType()));
    scf::YieldOp::create(builder, loc,
                         SmallVector<Value>(run.reads.size(), none));
  };
  if (areSide && isWhereSomeAre(run.reads.front().gather, some))
    return createRun(at, run, some);
  auto guard = scf::IfOp::create(at.builder, at.loc, createAny(at, some), read,
                                 readNothing);
  return SmallVector<Value>(guard.getResults());
}

/// Whether gathers have become one, before an operation.
static bool replace(const Run &run, Operation *front,
                    DominanceInfo &dominance) {
  SmallVector<Value> needed;
  for (const Candidate &read : run.reads) {
    leaveGuard(read);
    needed.append(
        {read.index, read.gather.getIndices().front(), read.gather.getMask()});
  }
  IRRewriter rewriter(front->getContext());
  if (failed(moveValueDefinitions(rewriter, needed, front, dominance)))
    return false;
  OpBuilder builder(front);
  SmallVector<Value> values = createReads({builder, front->getLoc()}, run);
  for (auto [read, value] : llvm::zip(run.reads, values))
    read.whole->replaceAllUsesWith(ValueRange(value));
  for (const Candidate &read : run.reads)
    read.whole->erase();
  return true;
}

namespace {

/// Finds runs among gathers of a block, the first one of which reads first.
class RunFinder {
public:
  explicit RunFinder(ArrayRef<Candidate> candidates)
      : candidates(candidates), taken(candidates.size()) {}

  /// The numbers of a candidate and of those that stand beside its element.
  SmallVector<size_t> find(size_t first, Distance &distance) const;
  void take(ArrayRef<size_t> run) {
    for (size_t i : run)
      taken[i] = true;
  }
  bool isTaken(size_t i) const { return taken[i]; }

private:
  std::optional<size_t> findBeside(size_t of, bool isAfter,
                                   Distance distance) const;

  ArrayRef<Candidate> candidates;
  SmallVector<bool> taken;
};

} // namespace

std::optional<size_t> RunFinder::findBeside(size_t of, bool isAfter,
                                            Distance distance) const {
  for (size_t i = 0; i < candidates.size(); ++i) {
    Candidate from = candidates[of], to = candidates[i];
    if (i == of || taken[i] || !isWords(from.index) || !isWords(to.index) ||
        from.gather.getType() != to.gather.getType())
      continue;
    if (!isAfter)
      std::swap(from, to);
    if (findDistance(from.index, to.index) == distance)
      return i;
  }
  return std::nullopt;
}

SmallVector<size_t> RunFinder::find(size_t first, Distance &distance) const {
  constexpr size_t mostBits = 64;
  Candidate read = candidates[first];
  size_t most =
      mostBits /
      cast<VectorType>(read.gather.getType()).getElementTypeBitWidth();
  distance = Distance::Next;
  SmallVector<size_t> run{first};
  while (run.size() < most) {
    if (auto after = findBeside(run.back(), /*isAfter=*/true, distance))
      run.push_back(*after);
    else if (auto front = findBeside(run.front(), /*isAfter=*/false, distance))
      run.insert(run.begin(), *front);
    else
      break;
  }
  if (run.size() > 1) {
    // As many as one load takes, with the first.
    size_t count = llvm::bit_floor(run.size()),
           begin = llvm::find(run, first) - run.begin();
    begin = std::min(begin, run.size() - count);
    return SmallVector<size_t>(ArrayRef(run).slice(begin, count));
  }
  distance = Distance::NextOrSame;
  if (auto after = findBeside(first, /*isAfter=*/true, distance))
    return {first, *after};
  if (auto front = findBeside(first, /*isAfter=*/false, distance))
    return {*front, first};
  return run;
}

void PairGathersPass::loadEach(const Candidate &candidate) {
  GatherOp gather = candidate.gather;
  OpBuilder builder(gather);
  auto load = [&](OpBuilder &builder, Location loc) {
    return GatherRunOp::create(builder, loc, gather->getResultTypes(),
                               gather.getStateAttr(), candidate.index,
                               gather.getFieldAttr(), gather.getMask())
        .getResult(0);
  };
  Value value;
  if (isWhereSomeAre(gather, gather.getMask())) {
    value = load(builder, gather.getLoc());
  } else {
    auto guard = scf::IfOp::create(
        builder, gather.getLoc(),
        createAny({builder, gather.getLoc()}, gather.getMask()),
        [&](OpBuilder &inner, Location loc) {
          scf::YieldOp::create(inner, loc, load(inner, loc));
        },
        [&](OpBuilder &inner, Location loc) {
          Value none = arith::ConstantOp::create(
              inner, loc, inner.getZeroAttr(gather.getType()));
          scf::YieldOp::create(inner, loc, none);
        });
    value = guard.getResult(0);
  }
  gather.getResult().replaceAllUsesWith(value);
  gather.erase();
}

void PairGathersPass::load(ArrayRef<Candidate> candidates,
                           DominanceInfo &dominance) {
  constexpr unsigned wordBits = 32;
  RunFinder finder(candidates);
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (finder.isTaken(i))
      continue;
    Run run;
    SmallVector<size_t> found = finder.find(i, run.distance);
    for (size_t number : found)
      run.reads.push_back(candidates[number]);
    if (found.size() > 1 && replace(run, candidates[i].whole, dominance)) {
      finder.take(found);
      continue;
    }
    finder.take(i);
    GatherOp gather = candidates[i].gather;
    if (cast<VectorType>(gather.getType()).getElementTypeBitWidth() < wordBits)
      loadEach(candidates[i]);
  }
}

void PairGathersPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    unrollRuns(kernel);
    DominanceInfo dominance(kernel);
    llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
    // In one block each, of one piece of state.
    llvm::MapVector<std::pair<Block *, Attribute>, SmallVector<Candidate>>
        groups;
    kernel.walk<WalkOrder::PreOrder>([&](GatherOp gather) {
      if (written.contains(gather.getStateAttr().getAttr()))
        return;
      if (std::optional<Candidate> candidate = findCandidate(gather))
        groups[{candidate->whole->getBlock(), gather.getStateAttr()}].push_back(
            *candidate);
    });
    for (auto &[place, candidates] : groups)
      load(candidates, dominance);
  }
}
