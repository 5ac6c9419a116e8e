// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What iterations of a loop cost as lanes, and one after the other: operations,
// times how often they run, and for how many lanes.
//
// How often conditions let code run, BranchFrequency.h says. One iteration
// alone waits for each load whose place a load of the iteration before says
// (LoadChains).

#include "Vectorize/Analysis/IterationLanes.h"
#include "Vectorize/Analysis/LoadChains.h"
#include "Vectorize/Analysis/LoopStreams.h"
#include "Vectorize/Cost/BranchFrequency.h"
#include "Vectorize/Cost/LaneCycles.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Analysis/Expectations.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"

#include <cmath>

using namespace mlir;
using namespace piko;

/// How many operations test whether an index is linear.
static constexpr double rowTest = 5;

namespace {

/// Adds up what code takes.
class CostModel {
public:
  CostModel(const IterationLanes &lanes, const Cycles &cycles)
      : lanes(lanes), cycles(cycles) {}
  explicit CostModel(const IterationLanes &lanes)
      : CostModel(lanes, getCycles(lanes.getLaneCount())) {}
  void add(Region &region, Frequency times, bool laneByLane);

  IterationLanes::Cost cost;

  double getFlatIterations(Operation *outer, Operation *inner) const;
  /// How many iterations one lane makes of a loop.
  double getOfLane(Operation *loop) const {
    return std::max(1.0, getIterations(loop) * getGoing(loop));
  }
  /// The same of a loop that it leaves at a time of its own.
  double getOwnIterations(Operation *loop) const;

private:
  void addOperation(Operation *op, Frequency times, bool laneByLane);
  void addBranches(double part, bool laneByLane) {
    cost.serial += part;
    cost.vectors += laneByLane ? part : 0;
  }
  void addStructure(Operation *op, Frequency times, bool laneByLane);
  /// How often a region of a loop runs for each time that the loop does.
  Frequency getFrequencyInside(Operation *loop, Region &region) const;
  double getIterations(Operation *loop) const;
  /// How many of the lanes make an iteration of a loop.
  double getGoing(Operation *loop) const;
  void addEmission(Operation *op, Frequency times);
  void addPush(PushOp push, Frequency times, bool laneByLane);
  /// What iterations wait for where iterations say where the next ones load.
  void addChase(LoadOp load, Frequency times, bool laneByLane);

  /// What it takes to bring lanes apart, with what they have.
  void addTurns(const OrderedGroup &group, Frequency times);

  double getApart(Operation *access) const;
  bool takesTurns(scf::IfOp choice) const {
    return choice
        ->walk([&](Operation *op) {
          LaneForm form = lanes.getForm(op);
          bool inTurns = form == LaneForm::Serial || form == LaneForm::Ordered;
          return inTurns ? WalkResult::interrupt() : WalkResult::advance();
        })
        .wasInterrupted();
  }
  double getDivision(Operation *op) const;
  double getScalar(Operation *op) const;
  bool isTransposed(LoadOp load) const;
  double getOwnLines(Operation *access) const;

  const IterationLanes &lanes;
  const Cycles &cycles;
  SmallVector<scf::ForOp> inner; ///< loops around the code, in that of lanes
  double along = 1;              ///< How much faster LLVM makes it.
  llvm::DenseSet<Operation *> turns;
  llvm::DenseSet<Value> chased; ///< indices, each of one wait
  bool inSlowPath = false;
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
  ops.remove_if([&](Operation *op) { return lanes.isEmission(op); });
  if (llvm::all_of(ops, llvm::IsaPred<NextOp>))
    return; // mostly has nothing to do
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
  cost.vectors += cycles.apartInOrder * times.vectors +
                  cycles.slot * times.serial * inputs.size();
}

/// How often a loop iterates, as far as is known.
double CostModel::getIterations(Operation *loop) const {
  if (auto iterations = loop->getAttrOfType<FloatAttr>(marks::iterations))
    return iterations.getValueAsDouble();
  if (std::optional<double> iterations = getProbableIterations(loop))
    return *iterations / getGoing(loop);
  if (auto counted = dyn_cast<scf::ForOp>(loop))
    if (std::optional<int64_t> count = getConstantIterations(counted))
      return double(*count);
  return lanes.isSharedLoop(loop) ? expected::iterations
                                  : expected::differingIterations;
}

double CostModel::getGoing(Operation *loop) const {
  if (lanes.isSharedLoop(loop))
    return 1;
  if (loop->hasAttr(marks::iterations))
    return expected::fullness;
  if (auto counted = dyn_cast<scf::ForOp>(loop);
      counted && getConstantIterations(counted))
    return 1;
  for (Operation *at = loop->getParentOp(); at != lanes.getLoop();
       at = at->getParentOp())
    if (isa<scf::ForOp, scf::WhileOp>(at) && !lanes.isSharedLoop(at))
      return cycles.goOnInside;
  // Ranges differ less than what else ends loops.
  constexpr double goOnInRange = 0.75;
  return isa<scf::ForOp>(loop) ? goOnInRange : cycles.goOn;
}

/// Each lane makes the iterations of its own inner loops, and waits in the end.
double CostModel::getFlatIterations(Operation *outer, Operation *inner) const {
  // Measured, of lists and of searches.
  constexpr double goOnInNest = 0.35;
  return getIterations(outer) *
         std::max(1.0, getIterations(inner) * goOnInNest) / expected::fullness;
}

double CostModel::getOwnIterations(Operation *loop) const {
  return std::max(1.0, getIterations(loop) * cycles.goOn);
}

Frequency CostModel::getFrequencyInside(Operation *loop, Region &region) const {
  double iterations = getIterations(loop);
  Frequency each{iterations * getGoing(loop), iterations};
  std::optional<double> again = getIterationProbability(loop);
  if (!again)
    return each;
  // One lane is enough; and what tests is tested once more.
  each.vectors =
      std::max(iterations, 1 - std::pow(1 - *again, lanes.getLaneCount()));
  bool isTest = isa<scf::WhileOp>(loop) && region.getRegionNumber() == 0;
  return {each.serial + isTest, each.vectors + isTest};
}

void CostModel::addStructure(Operation *op, Frequency times, bool laneByLane) {
  if (auto choice = dyn_cast<scf::IfOp>(op)) {
    Region &yes = choice.getThenRegion(), &no = choice.getElseRegion();
    auto elect = choice.getCondition().getDefiningOp<ElectOp>();
    bool isState = !elect && op->getParentOp()->hasAttr(marks::iterations);
    auto addSide = [&](Region &side, Region &other) {
      if (side.empty())
        return;
      std::optional<double> known = getProbability(choice, side);
      Frequency share =
          isState ? Frequency{0.5, 1}
          : known ? Frequency{*known,
                              1 - std::pow(1 - *known, lanes.getLaneCount())}
                  : getFrequency(side, other, lanes.getLaneCount());
      // Many guards, each of which mostly lets through, mostly do together.
      if (!isState && !known && isNextGuard(choice) &&
          isNextGuard(cast<scf::IfOp>(choice->getParentOp())) &&
          doesNextToNothing(other))
        share.serial = share.vectors;
      if (!lanes.isVarying(choice.getCondition()))
        share.vectors = share.serial;
      auto advances = choice->getAttrOfType<FloatAttr>(marks::advances);
      if (advances && &side == &no)
        share.vectors = advances.getValueAsDouble();
      bool isSlow = !inSlowPath && !isState && !known &&
                    lanes.isVarying(choice.getCondition()) &&
                    mayBeSlowPath(choice, side, lanes.getLoop());
      inSlowPath |= isSlow;
      double vectors = cost.vectors, serial = cost.serial;
      add(side, times.scaled(share.serial, share.vectors), laneByLane);
      if (!isSlow)
        return;
      inSlowPath = false;
      cost.slowVectors += cost.vectors - vectors;
      cost.slowSerial += cost.serial - serial;
    };
    addSide(yes, no);
    addSide(no, yes);
    bool isElected = elect && choice.getCondition() == elect.getTakes();
    if (isState || isElected) // It is chosen.
      cost.vectors += times.vectors * cycles.vector * choice.getNumResults();
    bool isShort = lanes.isCheap(yes) && (no.empty() || lanes.isCheap(no));
    if (lanes.isVarying(choice.getCondition()) && !isShort)
      addBranches(times.serial * (fails(yes) || fails(no) ? cycles.checks
                                  : takesTurns(choice)    ? cycles.branches
                                                          : cycles.unforeseen),
                  laneByLane);
    return;
  }
  if (auto choice = dyn_cast<scf::IndexSwitchOp>(op)) {
    for (Region &region : choice->getRegions()) {
      std::optional<double> known = getProbability(choice, region);
      Frequency share{known.value_or(1.0 / choice->getNumRegions()), 1};
      if (!lanes.isVarying(choice.getArg()))
        share.vectors = share.serial;
      else if (known)
        share.vectors = 1 - std::pow(1 - *known, lanes.getLaneCount());
      add(region, times.scaled(share.serial, share.vectors), laneByLane);
    }
    return;
  }
  if (!lanes.isSharedLoop(op))
    addBranches(cycles.exits * times.serial, laneByLane);
  auto loop = dyn_cast<scf::ForOp>(op);
  if (!laneByLane && loop && !lanes.getNest(loop).empty()) {
    Frequency full;
    for (size_t i = 0, e = lanes.getNest(loop).size(); i < e; ++i)
      full.serial *= expected::differingIterations *
                     (i == 0 ? cycles.goOn : cycles.goOnInside);
    cost.vectors += cycles.pairs * times.vectors * full.serial;
    add(lanes.getNest(loop).back().getRegion(),
        times.scaled(full.serial, full.serial), laneByLane);
    return;
  }
  double iterations = getIterations(op);
  if (!lanes.isSharedLoop(op) && !laneByLane)
    cost.vectors += cycles.iteration * times.vectors * iterations;
  double around = along;
  if (loop) {
    inner.push_back(loop);
    along = hasVectorsAlong(loop) ? cycles.along : 1;
  }
  double before = cost.serial;
  for (Region &region : op->getRegions()) {
    Frequency each = getFrequencyInside(op, region);
    add(region, times.scaled(each.serial, each.vectors), laneByLane);
  }
  cost.loops[op] += cost.serial - before;
  along = around;
  if (loop)
    inner.pop_back();
}

/// Whether an access is to numbers of fewer than 32 bits.
static bool isNarrow(Operation *access) {
  Type type = access->getNumResults() != 0 ? access->getResult(0).getType()
                                           : access->getOperand(0).getType();
  return type.isIntOrFloat() && type.getIntOrFloatBitWidth() < 32;
}

/// Whether elements one after the other are more than the number of each that
/// is accessed.
static bool isStrided(Operation *access) {
  auto load = dyn_cast<LoadOp>(access);
  auto store = dyn_cast<StoreOp>(access);
  if (!load && !store)
    return false;
  Operation *state = lookupInPipeline<Operation *>(
      access, load ? load.getStateAttr() : store.getStateAttr());
  Type type = load ? load.getType() : store.getValue().getType();
  constexpr int64_t byteBits = 8;
  return lookupRecord(access, getStateRecord(state)).getSize() !=
         int64_t(type.getIntOrFloatBitWidth()) / byteBits;
}

/// Whether lanes read three words or more of an element, which are loaded and
/// transposed.
bool CostModel::isTransposed(LoadOp load) const {
  auto isAlike = [&](Operation *user) {
    auto other = dyn_cast<LoadOp>(user);
    return other && other.getStateAttr() == load.getStateAttr() &&
           other.getType().getIntOrFloatBitWidth() == 32;
  };
  constexpr int64_t least = 3;
  return !load.getIndices().empty() && load.getElements().empty() &&
         llvm::count_if(load.getIndices().front().getUsers(), isAlike) >= least;
}

/// What lanes take that stream through memory, each on its own, where loops
/// around the stream do not read the same again.
double CostModel::getOwnLines(Operation *access) const {
  auto stream = llvm::find_if(
      inner, [&](scf::ForOp loop) { return isStream(access, loop); });
  if (stream == inner.end())
    return 0;
  double own = cycles.ownLines;
  for (scf::ForOp loop : llvm::make_range(inner.begin(), stream))
    if (isRepeated(access, loop))
      own /= std::max(1.0, getIterations(loop));
  return own;
}

/// Whether an element is read that is then stored.
static bool isReadBefore(memref::StoreOp store) {
  return llvm::any_of(store.getMemRef().getUsers(), [&](Operation *user) {
    auto load = dyn_cast<memref::LoadOp>(user);
    return load && load.getIndices() == store.getIndices();
  });
}

/// What an access in different places takes.
double CostModel::getApart(Operation *access) const {
  auto load = dyn_cast<memref::LoadOp>(access);
  auto store = dyn_cast<memref::StoreOp>(access);
  Value array = load ? load.getMemRef() : store ? store.getMemRef() : Value();
  if (array && lanes.isPrivate(array) && lanes.isShort(array)) {
    auto rows = double(cast<MemRefType>(array.getType()).getNumElements());
    return rows * (store ? cycles.writeRow : cycles.readRow);
  }
  if (auto read = dyn_cast<LoadOp>(access);
      read && isStrided(access) && isTransposed(read))
    return cycles.transposed;
  bool writes = store || isa<StoreOp>(access);
  double apart =
      writes ? (isNarrow(access) ? cycles.narrowScatter : cycles.scatter)
             : (isNarrow(access) ? cycles.narrowGather : cycles.gather);
  // What a scatter wrote is not forwarded to what reads it next, which an
  // iteration that changes what is there soon does.
  constexpr double waits = 2, waitsAtOnce = 8;
  if (store && lanes.isPrivate(array))
    apart *= isReadBefore(store) ? waitsAtOnce : waits;
  return apart;
}

/// How many numbers of an array in a record one lane loads at once, where their
/// places are constant: LLVM makes vectors of them.
static double getInRow(Operation *access) {
  ValueRange elements;
  if (auto load = dyn_cast<LoadOp>(access))
    elements = load.getElements();
  else if (auto get = dyn_cast<GetOp>(access))
    elements = get.getElements();
  constexpr double width = 4;
  bool areConstant =
      !elements.empty() && llvm::all_of(elements, [](Value element) {
        return matchPattern(element, m_Constant());
      });
  return areConstant ? width : 1;
}

double CostModel::getDivision(Operation *op) const {
  if (!isDividedAsFloats(op))
    return cycles.division;
  return lanes.isVarying(op->getOperand(1)) ? cycles.quotient
                                            : cycles.sharedQuotient;
}

/// What an operation of one iteration takes, for as many as there are lanes;
/// what emits stores its numbers, and keeps count.
double CostModel::getScalar(Operation *op) const {
  constexpr double bookkeeping = 12; // operations
  if (auto append = dyn_cast<AppendOp>(op))
    return cycles.scalar * (double(append.getValues().size()) + bookkeeping);
  constexpr double accesses = 4; // to the element and to the note of it
  if (lanes.isPrivateRow(op))
    return accesses * cycles.scalarAccess;
  return isDivision(op) ? cycles.scalarDivision
         : lanes.getForm(op) == LaneForm::Access
             ? cycles.scalarAccess / getInRow(op)
             : cycles.scalar;
}

/// What vectors emit: a transposition, and the stores of all lanes' records.
void CostModel::addEmission(Operation *op, Frequency times) {
  auto append = dyn_cast<AppendOp>(op);
  if (!append)
    return;
  constexpr double wordSize = 4;
  RecordOp record =
      lookupRecord(append, append.getPrim().getType().getRecord());
  cost.serial += times.serial * getScalar(append);
  cost.vectors +=
      times.vectors * (cycles.apartInOrder +
                       cycles.emitted * double(record.getSize()) / wordSize);
}

/// Vectors are compressed and stored, and their lanes counted.
void CostModel::addPush(PushOp push, Frequency times, bool laneByLane) {
  constexpr double counting = 4; // operations
  auto lists = double(push.getArrays().size());
  double serial = times.serial * (cycles.scalarAccess * lists + cycles.scalar);
  cost.computes = true;
  cost.serial += serial;
  cost.vectors += laneByLane ? serial
                             : times.vectors * (cycles.compressed * lists +
                                                counting * cycles.vector);
}

void CostModel::addChase(LoadOp load, Frequency times, bool laneByLane) {
  // A nest that is flattened chooses where its iterations read; it was looked
  // at before.
  Operation *chase = findChase(load);
  if (!chase || !lanes.getLoop()->isProperAncestor(chase) ||
      chase->hasAttr(marks::iterations) ||
      !chased.insert(load.getIndices().front()).second)
    return;
  // Loops inside begin with a wait.
  for (Region *in = load->getParentRegion(); in->getParentOp() != chase;
       in = in->getParentRegion())
    if (Operation *at = in->getParentOp(); isa<scf::ForOp, scf::WhileOp>(at)) {
      Frequency each = getFrequencyInside(at, *in);
      times = times.scaled(1 / each.serial, 1 / each.vectors);
    }
  double one = cycles.chase / double(lanes.getLaneCount());
  cost.serial += times.serial * cycles.chase;
  cost.vectors +=
      laneByLane ? times.serial * cycles.chase : times.vectors * one;
}

void CostModel::addOperation(Operation *op, Frequency times, bool laneByLane) {
  if (isPrefetch(op) || isa<FailOp, FailListOp, FailDivideOp>(op))
    return; // free, or rare
  if (isa<ElectOp>(op)) {
    constexpr double counting = 14; // operations, and a branch
    cost.vectors += counting * cycles.vector * times.vectors;
    return;
  }
  if (isa<VoteOp>(op)) {
    cost.vectors += 2 * cycles.vector * times.vectors;
    return;
  }
  if (!laneByLane && lanes.isEmission(op))
    return addEmission(op, times);
  if (auto push = dyn_cast<PushOp>(op))
    return addPush(push, times, laneByLane);
  LaneForm form = lanes.getForm(op);
  if (form == LaneForm::Barrier) {
    cost.computes |= op->getNumResults() != 0;
    return; // What else would be done is cut there, which costs more.
  }
  if (form == LaneForm::Uniform || form == LaneForm::Private ||
      form == LaneForm::Lazy)
    return; // as much for one as for all, or nothing
  if (auto load = dyn_cast<LoadOp>(op); load && !load.getIndices().empty())
    addChase(load, times, laneByLane);
  bool isAccess = form == LaneForm::Access;
  bool isDivided = isDivision(op);
  // There are no instructions for vectors of it.
  bool isRemainder = isIntegerDivision(op) && !isDividedAsFloats(op) &&
                     !matchPattern(op->getOperand(1), m_Constant());
  double serial = times.serial * getScalar(op) / along;
  bool isReduced = lanes.isPrivateRow(op);
  bool isTurns =
      (form == LaneForm::Serial || form == LaneForm::Ordered) && !isReduced;
  Value limited = lanes.findLimited(op);
  bool isGather = isAccess && ((!lanes.isRow(op) && !limited) || isStrided(op));
  double lines = isGather ? getOwnLines(op) : 0;
  double gather = isGather ? getApart(op) + lines : 0;
  double row = isAccess && isNarrow(op) ? cycles.narrowRow : cycles.row;
  double vectors = times.vectors * (isGather    ? gather
                                    : limited   ? row + cycles.vector * rowTest
                                    : isAccess  ? row
                                    : isReduced ? cycles.reducedRow
                                    : isDivided ? getDivision(op)
                                                : cycles.vector);
  if (laneByLane || isTurns || isRemainder) {
    vectors = serial + (laneByLane ? 0 : times.vectors * cycles.apart);
  } else {
    cost.computes |= !isAccess;
    cost.lines += times.vectors * lines;
  }
  cost.serial += serial;
  cost.vectors += vectors;
  if (isTurns || isGather)
    cost.obstacles.emplace(vectors, op);
}

double IterationLanes::getOwnIterations(Operation *inner) const {
  return CostModel(*this).getOwnIterations(inner);
}

double IterationLanes::getIterations(Operation *inner) const {
  return CostModel(*this).getOfLane(inner);
}

double IterationLanes::getFlatIterations(Operation *outer,
                                         Operation *inner) const {
  return CostModel(*this).getFlatIterations(outer, inner);
}

IterationLanes::Cost IterationLanes::getCost() const {
  return getCost(getCycles(getLaneCount()));
}

IterationLanes::Cost IterationLanes::getCost(const Cycles &cycles) const {
  CostModel model(*this, cycles);
  model.add(loop.getRegion(), {}, /*laneByLane=*/false);
  return model.cost;
}
