// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What turns of a loop cost as lanes, and one after the other.

#include "IterationLanes.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

using namespace mlir;
using namespace piko;

/// What the operations of as many iterations as there are lanes take, in cycles
/// of a processor with vectors of 512 bits (Sapphire Rapids, Zen 4).
namespace cycles {
constexpr double scalar = 5, scalarAccess = 8, scalarDivision = 64;
constexpr double vector = 0.8, row = 1.5, gather = 12, division = 16;
/// To bring lanes apart, for one operation or for a group, and to hand each
/// lane a number.
constexpr double apart = 15, apartInOrder = 40, slot = 8;
constexpr double turns = 8, turnsThatDiffer = 4;
/// Branches that are not foreseen, of a condition that differs, and of a loop
/// whose turns do.
constexpr double branches = 40, exits = 100;
/// To find which lane makes which turn, and to bring there what it has.
constexpr double pairs = 60;
/// How many of the lanes go on, of those that came to a loop whose turns
/// differ; and to one inside of such a loop.
constexpr double goOn = 0.35, goOnInside = 0.7;
} // namespace cycles

namespace {

/// How often code runs, for each time that the loop's lanes do.
struct Frequency {
  double serial = 1, vectors = 1;

  Frequency scaled(double bySerial, double byVectors) const {
    return {serial * bySerial, vectors * byVectors};
  }
};

} // namespace

static int64_t countOperations(Region &region) {
  int64_t count = 0;
  region.walk([&](Operation *) { ++count; });
  return count;
}

/// How often a side of a condition runs, where lanes differ: mostly, if it
/// stands alone; hardly ever, if it does much more than the other, which does
/// something, too.
static Frequency getFrequency(Region &side, Region &other) {
  constexpr int64_t trivial = 16, ratio = 2;
  int64_t count = countOperations(side),
          countOther = other.empty() ? 0 : countOperations(other);
  if (countOther > trivial && count > ratio * countOther)
    return {0.001, 0.016};
  if (countOther <= trivial || countOther > ratio * count)
    return {0.8, 1};
  return {0.5, 1};
}

namespace {

/// Adds up what code takes.
class CostModel {
public:
  explicit CostModel(const IterationLanes &lanes) : lanes(lanes) {}
  void add(Region &region, Frequency times, bool laneByLane);

  IterationLanes::Cost cost;

private:
  void addOperation(Operation *op, Frequency times, bool laneByLane);
  void addBranches(double part, bool laneByLane) {
    cost.serial += part;
    cost.vectors += laneByLane ? part : 0;
  }
  void addStructure(Operation *op, Frequency times, bool laneByLane);

  /// What it takes to bring lanes apart, with what they have.
  void addTurns(const OrderedGroup &group, Frequency times);

  const IterationLanes &lanes;
  llvm::DenseSet<Operation *> turns;
};

} // namespace

void CostModel::add(Region &region, Frequency times, bool laneByLane) {
  for (Operation &op : region.front().without_terminator()) {
    if (isa<NextOp>(op))
      continue; // mostly has nothing to do
    const OrderedGroup *group = laneByLane ? nullptr : lanes.findGroup(&op);
    if (group && group->first == &op)
      addTurns(*group, times);
    bool isApart = laneByLane || turns.contains(&op);
    if (isStructure(&op))
      addStructure(&op, times, isApart);
    else
      addOperation(&op, times, isApart);
  }
}

void CostModel::addTurns(const OrderedGroup &group, Frequency times) {
  llvm::SetVector<Operation *> ops = lanes.findTurns(group);
  turns.insert(ops.begin(), ops.end());
  llvm::DenseSet<Value> inputs;
  for (Operation *op : ops)
    op->walk([&](Operation *inner) {
      for (Value operand : inner->getOperands())
        if (isLaneType(operand.getType()) && lanes.isVarying(operand) &&
            (!operand.getDefiningOp() ||
             !ops.contains(group.first->getBlock()->findAncestorOpInBlock(
                 *operand.getDefiningOp()))))
          inputs.insert(operand);
    });
  cost.vectors += cycles::apartInOrder * times.vectors +
                  cycles::slot * times.serial * inputs.size();
}

void CostModel::addStructure(Operation *op, Frequency times, bool laneByLane) {
  if (auto choice = dyn_cast<scf::IfOp>(op)) {
    Region &yes = choice.getThenRegion(), &no = choice.getElseRegion();
    auto addSide = [&](Region &side, Region &other) {
      if (side.empty())
        return;
      Frequency share = getFrequency(side, other);
      if (!lanes.isVarying(choice.getCondition()))
        share.vectors = share.serial;
      add(side, times.scaled(share.serial, share.vectors), laneByLane);
    };
    addSide(yes, no);
    addSide(no, yes);
    bool isShort = lanes.isCheap(yes) && (no.empty() || lanes.isCheap(no));
    if (lanes.isVarying(choice.getCondition()) && !isShort)
      addBranches(cycles::branches * times.serial, laneByLane);
    return;
  }
  if (auto choice = dyn_cast<scf::IndexSwitchOp>(op)) {
    double share = 1.0 / choice->getNumRegions();
    double shared = lanes.isVarying(choice.getArg()) ? 1 : share;
    for (Region &region : choice->getRegions())
      add(region, times.scaled(share, shared), laneByLane);
    return;
  }
  bool isInside = false;
  for (Operation *at = op->getParentOp(); at != lanes.getLoop();
       at = at->getParentOp())
    isInside |= isa<scf::ForOp, scf::WhileOp>(at) && !lanes.isSharedLoop(at);
  double going = lanes.isSharedLoop(op) ? 1
                 : isInside             ? cycles::goOnInside
                                        : cycles::goOn;
  if (!lanes.isSharedLoop(op))
    addBranches(cycles::exits * times.serial, laneByLane);
  auto loop = dyn_cast<scf::ForOp>(op);
  if (!laneByLane && loop && !lanes.getNest(loop).empty()) {
    Frequency full;
    for (size_t i = 0, e = lanes.getNest(loop).size(); i < e; ++i)
      full.serial *= cycles::turnsThatDiffer *
                     (i == 0 ? cycles::goOn : cycles::goOnInside);
    cost.vectors += cycles::pairs * times.vectors * full.serial;
    add(lanes.getNest(loop).back().getRegion(),
        times.scaled(full.serial, full.serial), laneByLane);
    return;
  }
  double turns =
      lanes.isSharedLoop(op) ? cycles::turns : cycles::turnsThatDiffer;
  for (Region &region : op->getRegions())
    add(region, times.scaled(turns * going, turns), laneByLane);
}

void CostModel::addOperation(Operation *op, Frequency times, bool laneByLane) {
  if (isPrefetch(op) || isa<FailOp, FailListOp, FailDivideOp>(op))
    return; // free, or rare
  LaneForm form = lanes.getForm(op);
  if (form == LaneForm::Uniform || form == LaneForm::Private ||
      form == LaneForm::Lazy)
    return; // as much for one as for all, or nothing
  bool isAccess = form == LaneForm::Access;
  bool isDivided = isDivision(op);
  double serial = times.serial * (isDivided  ? cycles::scalarDivision
                                  : isAccess ? cycles::scalarAccess
                                             : cycles::scalar);
  bool isTurns = form == LaneForm::Serial || form == LaneForm::Ordered;
  bool isGather = isAccess && !lanes.isRow(op);
  double vectors = times.vectors * (isGather    ? cycles::gather
                                    : isAccess  ? cycles::row
                                    : isDivided ? cycles::division
                                                : cycles::vector);
  if (laneByLane || isTurns)
    vectors = serial + (laneByLane ? 0 : times.vectors * cycles::apart);
  else
    cost.computes |= !isAccess;
  cost.serial += serial;
  cost.vectors += vectors;
  if (isTurns || isGather)
    cost.obstacles.emplace(vectors, op);
}

IterationLanes::Cost IterationLanes::getCost() const {
  CostModel model(*this);
  model.add(loop.getRegion(), {}, /*laneByLane=*/false);
  return model.cost;
}
