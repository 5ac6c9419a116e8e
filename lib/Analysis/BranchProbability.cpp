// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/BranchProbability.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/Matchers.h"

#include "llvm/ADT/DenseMap.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Branches and loops
//===----------------------------------------------------------------------===//

static std::optional<double> getMark(Operation *op) {
  auto mark = op->getAttrOfType<FloatAttr>(marks::probability);
  return mark ? std::optional(mark.getValueAsDouble()) : std::nullopt;
}

std::optional<double> piko::getProbability(scf::IfOp branch, Region &region) {
  std::optional<double> first = getMark(branch);
  return first && &region != &branch.getThenRegion() ? 1 - *first : first;
}

std::optional<double> piko::getProbability(scf::IndexSwitchOp choice,
                                           Region &region) {
  auto all = choice->getAttrOfType<DenseF64ArrayAttr>(marks::probabilities);
  if (!all || all.size() != choice->getNumRegions())
    return std::nullopt;
  return all[region.getRegionNumber()];
}

std::optional<double> piko::getProbability(cf::CondBranchOp branch) {
  std::optional<ArrayRef<int32_t>> weights = branch.getBranchWeights();
  if (!weights)
    return std::nullopt;
  double first = weights->front(), second = weights->back();
  if (first < 0 || second < 0 || first + second == 0)
    return std::nullopt;
  return first / (first + second);
}

std::optional<double> piko::getIterationProbability(Operation *loop) {
  // As branch weights have it, none is impossible.
  constexpr double least = 1.0 / (1 << 20);
  std::optional<double> again = getMark(loop);
  return again ? std::optional(std::max(*again, least)) : std::nullopt;
}

std::optional<double> piko::getProbableIterations(Operation *loop) {
  constexpr double most = 1 << 20;
  std::optional<double> again = getIterationProbability(loop);
  if (!again)
    return std::nullopt;
  return *again < 1 ? std::min(most, *again / (1 - *again)) : most;
}

void piko::setProbability(Operation *op, std::optional<double> probability) {
  if (probability)
    op->setAttr(marks::probability, Builder(op).getF64FloatAttr(*probability));
  else
    op->removeAttr(marks::probability);
}

int64_t piko::countOperations(Region &region) {
  int64_t count = 0;
  for (Block &block : region)
    for (Operation &op : block)
      count += countOperations(&op);
  return count;
}

int64_t piko::countOperations(Operation *op) {
  constexpr double least = 1e-5;
  int64_t count = 1;
  auto branch = dyn_cast<scf::IfOp>(op);
  for (Region &region : op->getRegions())
    if (!branch || getProbability(branch, region).value_or(1) >= least)
      count += countOperations(region);
  return count;
}

//===----------------------------------------------------------------------===//
// Bodies of loops
//===----------------------------------------------------------------------===//

namespace {

/// Follows the ways through a body to their ends; inner loops end.
class AnotherIteration {
public:
  explicit AnotherIteration(BlockArgument again) : again(again) {}

  /// What is known where a block begins: how probable another iteration is,
  /// unless all ways return to a block that was entered before; and the first
  /// one of these that any of them returns to.
  struct Answer {
    std::optional<double> probability;
    bool returns = false;
    size_t back = none;
  };
  Answer at(Block *block);

private:
  static constexpr size_t none = ~size_t(0);

  Answer find(Block *block, size_t number);
  Answer along(Operation *branch, unsigned successor);

  struct Entered {
    size_t number;
    std::optional<Answer> answer; ///< None on the way to a block.
  };
  BlockArgument again;
  llvm::DenseMap<Block *, Entered> known;
};

} // namespace

AnotherIteration::Answer AnotherIteration::along(Operation *branch,
                                                 unsigned successor) {
  Block *to = branch->getSuccessor(successor);
  if (to != again.getOwner())
    return at(to);
  Value value = cast<BranchOpInterface>(branch).getSuccessorOperands(
      successor)[again.getArgNumber()];
  APInt flag;
  if (!value || !matchPattern(value, m_ConstantInt(&flag)))
    return {};
  return {flag.isZero() ? 0.0 : 1.0};
}

AnotherIteration::Answer AnotherIteration::find(Block *block, size_t number) {
  Operation *branch = block->getTerminator();
  if (!isa<BranchOpInterface>(branch))
    return {};
  Answer all;
  SmallVector<std::optional<double>> ways;
  for (unsigned i = 0; i < branch->getNumSuccessors(); ++i) {
    Answer way = along(branch, i);
    all.back = std::min(all.back, way.back);
    if (!way.returns)
      ways.push_back(way.probability);
  }
  // Who returns here comes back until one of the other ways is taken.
  const bool returns = all.back != none;
  if (all.back >= number)
    all.back = none;
  all.returns = ways.empty();
  if (ways.empty() || llvm::all_equal(ways)) {
    all.probability = ways.empty() ? std::nullopt : ways.front();
    return all;
  }
  auto choice = dyn_cast<cf::CondBranchOp>(branch);
  std::optional<double> first = choice ? getProbability(choice) : std::nullopt;
  // How often it came back decides, too.
  if (returns || !first || ways.size() != 2 || !ways[0] || !ways[1])
    return all;
  all.probability = *first * *ways[0] + (1 - *first) * *ways[1];
  return all;
}

AnotherIteration::Answer AnotherIteration::at(Block *block) {
  const size_t number = known.size();
  auto [found, isNew] = known.try_emplace(block, Entered{number, {}});
  if (!isNew) {
    if (found->second.answer)
      return *found->second.answer;
    return {std::nullopt, true, found->second.number};
  }
  Answer answer = find(block, number);
  known[block].answer = answer;
  return answer;
}

std::optional<double> piko::computeIterationProbability(Block *first,
                                                        BlockArgument again) {
  return AnotherIteration(again).at(first).probability;
}

//===----------------------------------------------------------------------===//
// Rewriters
//===----------------------------------------------------------------------===//

namespace {

struct Keeper : RewriterBase::Listener {
  void notifyOperationReplaced(Operation *op, ValueRange values) override {
    std::optional<double> known = getMark(op);
    if (Operation *made = known ? findMade(op, values) : nullptr)
      setProbability(made, known);
  }
  void notifyOperationReplaced(Operation *op, Operation *made) override {
    notifyOperationReplaced(op, ValueRange(made->getResults()));
  }

  /// The operation that is in place of another one, whose body it took.
  static Operation *findMade(Operation *op, ValueRange values) {
    if (op->getNumRegions() == 0 || !op->getRegion(0).empty())
      return nullptr;
    for (Value value : values)
      if (Operation *made = value ? value.getDefiningOp() : nullptr;
          made && isLike(op, made))
        return made;
    Operation *before = op->getPrevNode();
    return values.empty() && before && isLike(op, before) ? before : nullptr;
  }

  static bool isLike(Operation *op, Operation *made) {
    if (made == op || made->getName() != op->getName() || getMark(made))
      return false;
    auto branch = dyn_cast<scf::IfOp>(op);
    return !branch ||
           branch.getCondition() == cast<scf::IfOp>(made).getCondition();
  }
};

} // namespace

RewriterBase::Listener *piko::getProbabilityKeeper() {
  static Keeper keeper;
  return &keeper;
}
