// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Proofs that an assign phase is the identity on bins.

#include "BinIdentity.h"
#include "Induction.h"
#include "PhaseGraph.h"
#include "Repeatable.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Values between the bounds of a bin
//===----------------------------------------------------------------------===//

static bool isNarrowing(arith::IndexCastOp cast) {
  return cast.getIn().getType().isIndex();
}

/// The value without casts that leave every number as it is: those that widen,
/// and those of bounds, which are less than 2^31.
static Value stripCasts(Value value) {
  while (Operation *op = value.getDefiningOp()) {
    if (auto cast = dyn_cast<arith::IndexCastOp>(op)) {
      if (isNarrowing(cast) && !isa_and_nonnull<BinLoOp, BinHiOp, DomainOp>(
                                   cast.getIn().getDefiningOp()))
        return value;
    } else if (!isa<arith::ExtSIOp>(op)) {
      return value;
    }
    value = op->getOperand(0);
  }
  return value;
}

static bool isConstant(Value value, llvm::function_ref<bool(const APInt &)> f) {
  APInt constant;
  return matchPattern(value, m_ConstantInt(&constant)) && f(constant);
}

namespace piko {
/// Proves at one place of a process phase that a value lies between the bounds
/// of the bin that is processed, in one dimension.
class BinBounds {
public:
  BinBounds(const BinIdentity &identity, StageOp stage, int64_t dim,
            Operation *at)
      : identity(identity), stage(stage), dim(dim), at(at) {}

  bool contains(Value value) {
    // What is between the bounds is the same number in every type.
    if (auto cast = value.getDefiningOp<arith::IndexCastOp>())
      value = cast.getIn();
    return isAtLeastLo(value) && isBelowHi(value);
  }

private:
  bool isWhole() { return stage.getBins()[dim] == 0; }
  bool isLo(Value value);
  bool isHi(Value value);
  /// hi - 1, which is in the bin, because no bin is empty.
  bool isLast(Value value);
  bool isAtLeastLo(Value value);
  bool isBelowHi(Value value);
  bool isAtMostHi(Value value);
  /// A field of the stage's own primitive that is a coordinate in the bin.
  bool isKnown(Value value);
  /// lo + i % (hi - lo)
  bool isWrapped(Value value);
  /// Whether a comparison that holds at this place says so.
  bool isGuarded(Value value, bool below);
  bool holds(Value condition, Value value, bool below);

  const BinIdentity &identity;
  StageOp stage;
  int64_t dim;
  Operation *at;
  /// Values that a proof by induction assumes to be at least lo. Such a proof
  /// is about earlier turns of a loop, too, and cannot use what holds only at
  /// this place.
  llvm::SmallDenseSet<Value> assumed;
};
} // namespace piko

bool BinBounds::isLo(Value value) {
  value = stripCasts(value);
  if (auto lo = value.getDefiningOp<BinLoOp>())
    return int64_t(lo.getDim()) == dim && lo.getBin().getDefiningOp<BinOp>();
  return isWhole() &&
         isConstant(value, [](const APInt &c) { return c.isZero(); });
}

bool BinBounds::isHi(Value value) {
  value = stripCasts(value);
  if (auto hi = value.getDefiningOp<BinHiOp>())
    return int64_t(hi.getDim()) == dim && hi.getBin().getDefiningOp<BinOp>();
  auto domain = value.getDefiningOp<DomainOp>();
  return domain && isWhole() && int64_t(domain.getDim()) == dim;
}

bool BinBounds::isLast(Value value) {
  Operation *op = stripCasts(value).getDefiningOp();
  if (isa_and_nonnull<arith::AddIOp>(op))
    return isHi(op->getOperand(0)) &&
           isConstant(op->getOperand(1),
                      [](const APInt &c) { return c.isAllOnes(); });
  return isa_and_nonnull<arith::SubIOp>(op) && isHi(op->getOperand(0)) &&
         isConstant(op->getOperand(1),
                    [](const APInt &c) { return c.isOne(); });
}

bool BinBounds::isKnown(Value value) {
  auto get = stripCasts(value).getDefiningOp<GetOp>();
  if (!get || !get.getElements().empty())
    return false;
  auto argument = dyn_cast<BlockArgument>(get.getPrim());
  return argument && argument.getOwner()->getParentOp() == stage.getProcess() &&
         identity.facts.contains({stage, get.getFieldAttr(), dim});
}

bool BinBounds::isWrapped(Value value) {
  auto sum = stripCasts(value).getDefiningOp<arith::AddIOp>();
  if (!sum)
    return false;
  for (auto [lo, rest] : {std::pair(sum.getLhs(), sum.getRhs()),
                          std::pair(sum.getRhs(), sum.getLhs())}) {
    Operation *rem = stripCasts(rest).getDefiningOp();
    if (!isLo(lo) || !isa_and_nonnull<arith::RemUIOp>(rem))
      continue;
    auto width = stripCasts(rem->getOperand(1)).getDefiningOp<arith::SubIOp>();
    if (width && isHi(width.getLhs()) && isLo(width.getRhs()))
      return true;
  }
  return false;
}

bool BinBounds::holds(Value condition, Value value, bool below) {
  Operation *op = condition.getDefiningOp();
  if (!op)
    return false;
  if (isa<arith::AndIOp>(op))
    return holds(op->getOperand(0), value, below) ||
           holds(op->getOperand(1), value, below);
  // `a && b` is `select a, b, false`.
  if (auto select = dyn_cast<arith::SelectOp>(op))
    return isConstant(select.getFalseValue(),
                      [](const APInt &c) { return c.isZero(); }) &&
           (holds(select.getCondition(), value, below) ||
            holds(select.getTrueValue(), value, below));
  auto compare = dyn_cast<arith::CmpIOp>(op);
  if (!compare)
    return false;
  using Predicate = arith::CmpIPredicate;
  Predicate predicate = compare.getPredicate();
  Value left = stripCasts(compare.getLhs()),
        right = stripCasts(compare.getRhs());
  if (right == value) { // the other way round
    std::swap(left, right);
    predicate = predicate == Predicate::slt   ? Predicate::sgt
                : predicate == Predicate::sle ? Predicate::sge
                : predicate == Predicate::sgt ? Predicate::slt
                : predicate == Predicate::sge ? Predicate::sle
                                              : predicate;
  }
  if (left != value)
    return false;
  if (below)
    return (predicate == Predicate::slt && isAtMostHi(right)) ||
           (predicate == Predicate::sle && isBelowHi(right));
  return (predicate == Predicate::sge || predicate == Predicate::sgt) &&
         isAtLeastLo(right);
}

bool BinBounds::isGuarded(Value value, bool below) {
  if (!assumed.empty())
    return false;
  for (Operation *op = at; op && !isa<ProcessOp>(op); op = op->getParentOp()) {
    Operation *parent = op->getParentOp();
    if (auto branch = dyn_cast<scf::IfOp>(parent);
        branch && op->getParentRegion() == &branch.getThenRegion() &&
        holds(branch.getCondition(), value, below))
      return true;
    if (auto loop = dyn_cast<scf::WhileOp>(parent);
        loop && op->getParentRegion() == &loop.getAfter() &&
        holds(loop.getConditionOp().getCondition(), value, below))
      return true;
  }
  return false;
}

bool BinBounds::isAtLeastLo(Value value) {
  value = stripCasts(value);
  if (isLo(value) || isLast(value) || isKnown(value) || isWrapped(value) ||
      assumed.contains(value) || isGuarded(value, /*below=*/false))
    return true;
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    Operation *loop = argument.getOwner()->getParentOp();
    if (auto range = dyn_cast<scf::ForOp>(loop))
      return argument == range.getInductionVar() &&
             isAtLeastLo(range.getLowerBound());
    if (Value before = getConditioned(argument).first)
      return isAtLeastLo(before);
    return holdsByInduction(argument, assumed,
                            [&](Value value) { return isAtLeastLo(value); });
  }
  Operation *op = value.getDefiningOp();
  if (isa<arith::MaxSIOp>(op))
    return isAtLeastLo(op->getOperand(0)) || isAtLeastLo(op->getOperand(1));
  if (isa<arith::MinSIOp>(op))
    return isAtLeastLo(op->getOperand(0)) && isAtLeastLo(op->getOperand(1));
  if (auto select = dyn_cast<arith::SelectOp>(op))
    return isAtLeastLo(select.getTrueValue()) &&
           isAtLeastLo(select.getFalseValue());
  // One more than a number that is below another one does not wrap around.
  if (auto sum = dyn_cast<arith::AddIOp>(op)) {
    auto argument = dyn_cast<BlockArgument>(sum.getLhs());
    if (!argument ||
        !isConstant(sum.getRhs(), [](const APInt &c) { return c.isOne(); }) ||
        !isAtLeastLo(argument))
      return false;
    auto [before, condition] = getConditioned(argument);
    auto compare =
        condition ? condition.getDefiningOp<arith::CmpIOp>() : arith::CmpIOp();
    return compare && compare.getPredicate() == arith::CmpIPredicate::slt &&
           compare.getLhs() == before;
  }
  return false;
}

bool BinBounds::isBelowHi(Value value) {
  value = stripCasts(value);
  if (isLo(value) || isLast(value) || isKnown(value) || isWrapped(value) ||
      isGuarded(value, /*below=*/true))
    return true;
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    if (auto range = dyn_cast<scf::ForOp>(argument.getOwner()->getParentOp()))
      return argument == range.getInductionVar() &&
             isAtMostHi(range.getUpperBound());
    auto [before, condition] = getConditioned(argument);
    return before && (holds(condition, stripCasts(before), /*below=*/true) ||
                      isBelowHi(before));
  }
  Operation *op = value.getDefiningOp();
  if (isa<arith::MinSIOp>(op))
    return isBelowHi(op->getOperand(0)) || isBelowHi(op->getOperand(1));
  if (isa<arith::MaxSIOp>(op))
    return isBelowHi(op->getOperand(0)) && isBelowHi(op->getOperand(1));
  if (auto select = dyn_cast<arith::SelectOp>(op))
    return isBelowHi(select.getTrueValue()) &&
           isBelowHi(select.getFalseValue());
  return false;
}

bool BinBounds::isAtMostHi(Value value) {
  value = stripCasts(value);
  if (isHi(value))
    return true;
  Operation *op = value.getDefiningOp();
  if (op && isa<arith::MinSIOp>(op))
    return isAtMostHi(op->getOperand(0)) || isAtMostHi(op->getOperand(1));
  return isBelowHi(value);
}

//===----------------------------------------------------------------------===//
// Stages
//===----------------------------------------------------------------------===//

Operation *piko::getOnlyAssignment(AssignOp assign) {
  Operation *only = nullptr;
  WalkResult result = assign.walk([&](Operation *op) {
    if (!isa<AssignToOp, AssignAllOp, AssignPreviousOp, AssignBoxOp>(op))
      return WalkResult::advance();
    if (only)
      return WalkResult::interrupt();
    only = op;
    return WalkResult::advance();
  });
  return result.wasInterrupted() ? nullptr : only;
}

/// The field that a value is, or null.
static GetOp getField(Value value) {
  auto get = stripCasts(value).getDefiningOp<GetOp>();
  return get && get.getElements().empty() ? get : GetOp();
}

BinIdentity::BinIdentity(PipelineOp pipeline) : pipeline(pipeline) {
  for (auto stage : pipeline.getOps<StageOp>())
    collectFacts(stage);
}

bool BinIdentity::isInBin(StageOp stage, int64_t dim, Operation *at,
                          Value value) const {
  return BinBounds(*this, stage, dim, at).contains(value);
}

void BinIdentity::collectFacts(StageOp stage) {
  AssignOp assign = stage.getAssign();
  Operation *only = assign ? getOnlyAssignment(assign) : nullptr;
  if (!only || !stage.getProcess())
    return;
  if (auto to = dyn_cast<AssignToOp>(only)) {
    auto at = to.getBin().getDefiningOp<BinAtOp>();
    if (!at)
      return;
    for (auto [dim, coordinate] : llvm::enumerate(at.getCoordinates()))
      if (GetOp get = getField(coordinate))
        facts.insert({stage, get.getFieldAttr(), int64_t(dim)});
    return;
  }
  if (!isa<AssignPreviousOp>(only))
    return;
  RecordOp record = lookupRecord(stage, stage.getInputAttr());
  for (auto field : record.getFields().getAsRange<FieldAttr>())
    for (int64_t dim = 0, e = stage.getBins().size(); dim < e; ++dim) {
      Refusal ignored;
      if (field.getCounts().empty() && field.getType().isIntOrIndex() &&
          isEmittedInBin(stage, field.getName(), dim, ignored))
        facts.insert(
            {stage, StringAttr::get(stage.getContext(), field.getName()), dim});
    }
}

bool BinIdentity::isEmittedInBin(StageOp consumer, StringRef field, int64_t dim,
                                 Refusal &refusal) {
  RecordOp record = lookupRecord(consumer, consumer.getInputAttr());
  int64_t place = getElementIndex(record, field);
  for (EdgeOp edge : getEdgesInto(consumer)) {
    auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
    for (EmitOp emit : getEmits(producer, edge.getPort()))
      if (!BinBounds(*this, producer, dim, emit)
               .contains(emit.getValues()[place])) {
        refusal = {emit,
                   ("'" + field + "' is not proved to stay inside the bin here")
                       .str()};
        return false;
      }
  }
  return true;
}

/// Whether two values are computed alike from the primitive that each phase is
/// about.
static bool isSameOfPrim(Value a, Value b) {
  Operation *x = a.getDefiningOp(), *y = b.getDefiningOp();
  if (!x || !y) {
    auto p = dyn_cast<BlockArgument>(a), q = dyn_cast<BlockArgument>(b);
    return p && q && isa<AssignOp, ProcessOp>(p.getOwner()->getParentOp()) &&
           isa<AssignOp, ProcessOp>(q.getOwner()->getParentOp()) &&
           p.getType() == q.getType();
  }
  return isRepeatable(x) && isRepeatable(y) &&
         cast<OpResult>(a).getResultNumber() ==
             cast<OpResult>(b).getResultNumber() &&
         OperationEquivalence::isEquivalentTo(
             x, y, [](Value p, Value q) { return success(isSameOfPrim(p, q)); },
             /*markEquivalent=*/nullptr, OperationEquivalence::IgnoreLocations);
}

/// Whether `a`, computed in the consumer's assign phase, is what `b` is in the
/// producer's, once each field is what `emit` gives it.
static bool isSameThrough(Value a, Value b, EmitOp emit, RecordOp record) {
  if (auto get = a.getDefiningOp<GetOp>()) {
    int64_t place = getElementIndex(record, get.getField());
    return get.getElements().empty() &&
           isSameOfPrim(emit.getValues()[place], b);
  }
  Operation *x = a.getDefiningOp(), *y = b.getDefiningOp();
  return x && y && isRepeatable(x) && isRepeatable(y) &&
         cast<OpResult>(a).getResultNumber() ==
             cast<OpResult>(b).getResultNumber() &&
         OperationEquivalence::isEquivalentTo(
             x, y,
             [&](Value p, Value q) {
               return success(isSameThrough(p, q, emit, record));
             },
             /*markEquivalent=*/nullptr, OperationEquivalence::IgnoreLocations);
}

bool BinIdentity::isSameFunction(EdgeOp edge, AssignToOp assignment) {
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
  AssignOp assign = producer.getAssign();
  auto own = dyn_cast_or_null<AssignToOp>(assign ? getOnlyAssignment(assign)
                                                 : nullptr);
  RecordOp record = lookupRecord(consumer, consumer.getInputAttr());
  return own && !producer.getTakesList() &&
         llvm::all_of(getEmits(producer, edge.getPort()), [&](EmitOp emit) {
           return isSameThrough(assignment.getBin(), own.getBin(), emit,
                                record);
         });
}

LogicalResult BinIdentity::prove(StageOp consumer, Refusal &refusal) {
  auto refuse = [&](Operation *at, const Twine &why) {
    refusal = {at, why.str()};
    return failure();
  };
  AssignOp assign = consumer.getAssign();
  if (!assign)
    return refuse(consumer, "it has no assign phase");
  SmallVector<EdgeOp> edges = getEdgesInto(consumer);
  if (hasSource(consumer) || edges.empty())
    return refuse(consumer, "its primitives come from a source");
  for (EdgeOp edge : edges) {
    auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
    if (producer.getBins() != consumer.getBins())
      return refuse(consumer,
                    "its bins are not of the size of those of stage '" +
                        getCppName(producer) + "'");
  }
  Operation *only = getOnlyAssignment(assign);
  if (!only)
    return refuse(assign, "it is assigned in several places");
  auto to = dyn_cast<AssignToOp>(only);
  if (!to)
    return refuse(only, "this may be several bins");
  if (consumer.isWholeDomain() &&
      isConstant(to.getBin(), [](const APInt &c) { return c.isZero(); }))
    return success();
  auto at = to.getBin().getDefiningOp<BinAtOp>();
  bool isCell = at && llvm::all_of(at.getCoordinates(), [](Value coordinate) {
                  return bool(getField(coordinate));
                });
  Refusal outside{only, "the bin is not that of a cell whose coordinates are "
                        "fields, nor is it computed as the producer's was"};
  for (EdgeOp edge : edges) {
    if (isSameFunction(edge, to))
      continue;
    if (!isCell) {
      refusal = outside;
      return failure();
    }
    for (auto [dim, coordinate] : llvm::enumerate(at.getCoordinates()))
      if (!isEmittedInBin(consumer, getField(coordinate).getField(), dim,
                          refusal))
        return failure();
    break; // isEmittedInBin is about all edges
  }
  return success();
}
