// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An iteration of a loop can begin when what the iteration before hands on is
// there: the longest cycle of dependences says how long that takes, the sum of
// all operations how long units of the processor are busy. Where the first is
// much longer, a second vector takes hardly any time.

#include "Vectorize/Cost/LaneLatency.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Analysis/Expectations.h"
#include "Piko/Dialect/Piko/IR/PikoApproximation.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/IR/TypeUtilities.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

using namespace mlir;
using namespace piko;

namespace {

/// Cycles until a result is there, and for which units are busy.
struct Time {
  double latency = 0, work = 0;
};

/// Of a loop that lanes go through together, or until the last one leaves.
class LoopTimer {
public:
  explicit LoopTimer(const IterationLanes &lanes) : lanes(lanes) {}

  /// Of one iteration, on average.
  Time getIteration(Operation *loop);
  /// Of what stands in a block.
  double getWork(Block &block);

private:
  /// When a value is there, of those that follow from what an iteration begins
  /// with.
  using Ready = llvm::DenseMap<Value, double>;
  static constexpr double never = -1e9;

  Time getTime(Operation *op) const;
  void visit(Block &block, Ready &ready, double mask);
  void visitLoop(Operation *loop, Ready &ready, double start);
  static double get(const Ready &ready, Value value) {
    auto found = ready.find(value);
    return found == ready.end() ? never : found->second;
  }
  static double get(const Ready &ready, ValueRange values) {
    double last = never;
    for (Value value : values)
      last = std::max(last, get(ready, value));
    return last;
  }
  /// When what an iteration hands on is there, if only its input `from` is
  /// late; the last one is the mask.
  SmallVector<double> getOutputs(Operation *loop, size_t from);

  /// Whether LLVM will move an operation out of the loop that is timed.
  bool isInvariant(Operation *op);

  const IterationLanes &lanes;
  double work = 0;
  Operation *timed = nullptr;
  llvm::DenseSet<Value> invariant; ///< in the loop
  llvm::DenseMap<Operation *, Time> iterations;
};

} // namespace

static double countIterations(Operation *loop) {
  double iterations =
      getExpectedIterations(loop).value_or(expected::iterations);
  return isa<scf::ForOp>(loop) ? iterations : std::max(1.0, iterations);
}

/// Whether a number is only where rows begin, of which the first lane's is kept
/// as the loop goes on.
static bool isForRows(Value number, const IterationLanes &lanes,
                      unsigned depth = 6) {
  return depth > 0 && number.getType().isIntOrIndex() && !number.use_empty() &&
         llvm::all_of(number.getUsers(), [&](Operation *user) {
           if (isa<LoadOp, StoreOp>(user))
             return user->getOperand(0) != number || isa<LoadOp>(user)
                        ? lanes.isRow(user) || lanes.findLimited(user)
                        : false;
           return isa<arith::ArithDialect>(user->getDialect()) &&
                  isForRows(user->getResult(0), lanes, depth - 1);
         });
}

/// With vectors of 512 bits: Sapphire Rapids, Zen 4.
Time LoopTimer::getTime(Operation *op) const {
  LaneForm form = lanes.getForm(op);
  constexpr double scalar = 0.15;
  if (form == LaneForm::Uniform)
    return {1, scalar};
  if (form == LaneForm::Access) {
    bool isArray = isa<memref::LoadOp, memref::StoreOp>(op);
    return lanes.isRow(op) || lanes.findLimited(op) || isArray ? Time{8, 0.5}
                                                               : Time{28, 7};
  }
  if (form != LaneForm::Vector)
    return {1, 0};
  if (isForRows(op->getResult(0), lanes))
    return {1, scalar};
  auto isWide = [](Type type) {
    return type.isF64() || type.isInteger(64) || type.isIndex();
  };
  double vectors =
      isWide(op->getResult(0).getType()) || isWide(op->getOperand(0).getType())
          ? 2
          : 1;
  if (isa<math::SqrtOp>(op))
    return {20, 13 * vectors};
  if (isDivision(op))
    return {vectors > 1 || isIntegerDivision(op) ? 24.0 : 15.0, 10 * vectors};
  if (isa<arith::MulIOp>(op))
    return {10, vectors};
  if (isa<FloatType>(getElementTypeOrSelf(op->getOperand(0))) ||
      isa<FloatType>(op->getResult(0).getType()))
    return {4, 0.5 * vectors};
  return {1, 0.5 * vectors};
}

bool LoopTimer::isInvariant(Operation *op) {
  bool isMovable =
      timed && (isPure(op) || lanes.readsFixed(op)) &&
      llvm::all_of(op->getOperands(), [&](Value operand) {
        return invariant.contains(operand) ||
               !timed->isAncestor(operand.getParentBlock()->getParentOp());
      });
  if (isMovable)
    invariant.insert(op->result_begin(), op->result_end());
  return isMovable;
}

void LoopTimer::visitLoop(Operation *loop, Ready &ready, double start) {
  Time iteration = getIteration(loop);
  double count = countIterations(loop);
  work += count * iteration.work;
  if (start == never)
    return;
  for (Value result : loop->getResults())
    ready[result] = start + count * iteration.latency;
}

/// Masks count where memory is accessed, and at last, where values are chosen.
void LoopTimer::visit(Block &block, Ready &ready, double mask) {
  constexpr double choice = 4;
  for (Operation &op : block.without_terminator()) {
    double start = get(ready, op.getOperands());
    if (isa<scf::ForOp, scf::WhileOp>(op)) {
      visitLoop(&op, ready, std::max(start, mask));
    } else if (isStructure(&op)) {
      double inside = std::max(mask, start);
      for (Region &region : op.getRegions()) {
        bool fails =
            !region.empty() && llvm::any_of(region.front(), [](Operation &one) {
              return one.hasTrait<Failure>();
            });
        if (region.empty() || fails)
          continue;
        visit(region.front(), ready, inside);
        for (auto [result, value] :
             llvm::zip(op.getResults(),
                       region.front().getTerminator()->getOperands())) {
          double last = std::max(start, get(ready, value));
          if (last != never)
            ready[result] = std::max(get(ready, result), last + choice);
        }
      }
    } else {
      if (lanes.getForm(&op) == LaneForm::Access)
        start = std::max(start, mask);
      Time time = getTime(&op);
      work += isInvariant(&op) ? 0 : time.work;
      if (start != never)
        for (Value result : op.getResults())
          if (lanes.isVarying(result))
            ready[result] = start + time.latency;
    }
  }
}

SmallVector<double> LoopTimer::getOutputs(Operation *loop, size_t from) {
  constexpr double choice = 4;
  Ready ready;
  auto begin = [&](ValueRange inputs) {
    if (from < inputs.size() && lanes.isVarying(inputs[from]))
      ready[inputs[from]] = 0;
    return from == inputs.size() && !lanes.isSharedLoop(loop) ? 0 : never;
  };
  SmallVector<double> outputs;
  auto end = [&](ValueRange values, double mask) {
    for (Value value : values)
      outputs.push_back(get(ready, value));
    outputs.push_back(lanes.isSharedLoop(loop) ? never : mask);
  };
  if (auto counted = dyn_cast<scf::ForOp>(loop)) {
    double mask = begin(counted.getRegionIterArgs());
    visit(*counted.getBody(), ready, mask);
    end(counted.getYieldedValues(), mask);
    return outputs;
  }
  auto other = cast<scf::WhileOp>(loop);
  double mask = begin(other.getBeforeArguments());
  visit(*other.getBeforeBody(), ready, mask);
  scf::ConditionOp condition = other.getConditionOp();
  double goes = get(ready, condition.getCondition());
  mask = std::max(mask, goes == never ? never : goes + choice);
  for (auto [value, argument] :
       llvm::zip(condition.getArgs(), other.getAfterArguments()))
    if (double at = get(ready, value); at != never)
      ready[argument] = at;
  visit(*other.getAfterBody(), ready, mask);
  end(other.getYieldOp().getOperands(), mask);
  return outputs;
}

Time LoopTimer::getIteration(Operation *loop) {
  if (auto known = iterations.find(loop); known != iterations.end())
    return known->second;
  double outside = work;
  Operation *around = std::exchange(timed, loop);
  SmallVector<SmallVector<double>> outputs;
  size_t count;
  do {
    work = 0;
    outputs.push_back(getOutputs(loop, outputs.size()));
    count = outputs.front().size();
  } while (outputs.size() < count);
  Time iteration{0, work};
  work = outside;
  timed = around;
  // The mean of the longest cycle: what many iterations take.
  constexpr int many = 32;
  SmallVector<double> at(count, 0);
  for (int i = 0; i < many; ++i) {
    SmallVector<double> next(count, never);
    for (size_t from = 0; from < count; ++from)
      for (size_t to = 0; to < count; ++to)
        next[to] = std::max(next[to], at[from] + outputs[from][to]);
    at = next;
  }
  iteration.latency = std::max(0.0, *llvm::max_element(at) / many);
  iterations[loop] = iteration;
  return iteration;
}

double LoopTimer::getWork(Block &block) {
  Ready none;
  work = 0;
  visit(block, none, never);
  return work;
}

/// How many registers hold what differs between lanes in all iterations of a
/// loop.
static int64_t countRegisters(Operation *loop, const IterationLanes &lanes) {
  llvm::DenseSet<Value> values;
  for (Region &region : loop->getRegions())
    for (Value argument : region.getArguments())
      if (isa<scf::ForOp>(loop) || region.getRegionNumber() == 1)
        values.insert(argument);
  loop->walk([&](Operation *op) {
    for (Value operand : op->getOperands())
      if (!loop->isAncestor(operand.getParentBlock()->getParentOp()))
        values.insert(operand);
  });
  return llvm::count_if(values, [&](Value value) {
    return lanes.isVarying(value) && isLaneType(value.getType());
  });
}

/// Whether an operation is made for a certain number of lanes, or takes longer
/// for each of them.
static bool isForOneVector(Operation *op, const IterationLanes &lanes) {
  if (op->hasTrait<OpTrait::IsTerminator>() || op->hasTrait<Failure>() ||
      isa<NextOp>(op))
    return false;
  auto counted = dyn_cast<scf::ForOp>(op);
  return isBarrier(op) || isPrefetch(op) || isApproximation(op) ||
         isa<memref::AllocaOp>(op) || lanes.getForm(op) == LaneForm::Serial ||
         lanes.findGroup(op) || (counted && !lanes.getNest(counted).empty());
}

static bool isPlain(const IterationLanes &lanes) {
  scf::ForOp root = lanes.getLoop();
  return lanes.getEmissions().empty() &&
         !root.walk([&](Operation *op) {
                return op != root && isForOneVector(op, lanes)
                           ? WalkResult::interrupt()
                           : WalkResult::advance();
              })
              .wasInterrupted();
}

bool piko::isBoundByLatency(const IterationLanes &lanes) {
  constexpr int64_t mostRegisters = 12;
  constexpr double least = 1.1;
  if (!isPlain(lanes))
    return false;
  LoopTimer timer(lanes);
  scf::ForOp root = lanes.getLoop();
  double one = 0, two = 0, inLoops = 0;
  int64_t registers = 0;
  root.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (op == root || !isa<scf::ForOp, scf::WhileOp>(op))
      return WalkResult::advance();
    Time iteration = timer.getIteration(op);
    double count = countIterations(op);
    inLoops += count * iteration.work;
    one += count * std::max(iteration.latency, iteration.work);
    two += count * std::max(iteration.latency, 2 * iteration.work);
    registers = std::max(registers, countRegisters(op, lanes));
    return WalkResult::skip();
  });
  double rest = timer.getWork(*root.getBody()) - inLoops;
  one += rest;
  two += 2 * rest;
  return registers <= mostRegisters && 2 * one > least * two;
}
