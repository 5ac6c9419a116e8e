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

std::optional<double> piko::getTurnProbability(Operation *loop) {
  return getMark(loop);
}

std::optional<double> piko::getProbableTurns(Operation *loop) {
  constexpr double most = 1 << 20;
  std::optional<double> again = getTurnProbability(loop);
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

//===----------------------------------------------------------------------===//
// Bodies of loops
//===----------------------------------------------------------------------===//

namespace {

/// Follows the ways through a body to their ends; inner loops end.
class Turn {
public:
  explicit Turn(BlockArgument again) : again(again) {}
  /// How probable another turn is at the begin of a block; `returns` where all
  /// ways lead back to a block that was passed.
  std::optional<double> at(Block *block);

  static constexpr double returns = -1;

private:
  std::optional<double> find(Block *block);
  std::optional<double> along(Operation *branch, unsigned successor);

  BlockArgument again;
  llvm::DenseMap<Block *, std::optional<double>> known;
};

} // namespace

std::optional<double> Turn::along(Operation *branch, unsigned successor) {
  Block *to = branch->getSuccessor(successor);
  if (to != again.getOwner())
    return at(to);
  Value value = cast<BranchOpInterface>(branch).getSuccessorOperands(
      successor)[again.getArgNumber()];
  APInt flag;
  if (!value || !matchPattern(value, m_ConstantInt(&flag)))
    return std::nullopt;
  return flag.isZero() ? 0 : 1;
}

std::optional<double> Turn::find(Block *block) {
  Operation *branch = block->getTerminator();
  SmallVector<std::optional<double>> ways;
  if (!isa<BranchOpInterface>(branch))
    return std::nullopt;
  for (unsigned i = 0; i < branch->getNumSuccessors(); ++i)
    if (std::optional<double> way = along(branch, i); way != returns)
      ways.push_back(way);
  if (ways.empty())
    return returns;
  if (llvm::all_equal(ways))
    return ways.front();
  auto choice = dyn_cast<cf::CondBranchOp>(branch);
  std::optional<double> first = choice ? getProbability(choice) : std::nullopt;
  if (!first || ways.size() != 2 || !ways[0] || !ways[1])
    return std::nullopt;
  return *first * *ways[0] + (1 - *first) * *ways[1];
}

std::optional<double> Turn::at(Block *block) {
  // A block that was entered and has no answer yet is in front of itself.
  auto [found, isNew] = known.try_emplace(block, returns);
  if (!isNew)
    return found->second;
  std::optional<double> probability = find(block);
  known[block] = probability;
  return probability;
}

std::optional<double> piko::computeTurnProbability(Block *first,
                                                   BlockArgument again) {
  std::optional<double> probability = Turn(again).at(first);
  return probability == Turn::returns ? std::nullopt : probability;
}

//===----------------------------------------------------------------------===//
// Rewriters
//===----------------------------------------------------------------------===//

namespace {

struct Keeper : RewriterBase::Listener {
  void notifyOperationReplaced(Operation *op, ValueRange values) override {
    std::optional<double> known = getMark(op);
    Operation *made = known ? findMade(op, values) : nullptr;
    if (made && !getMark(made) && decidesAlike(op, made))
      setProbability(made, known);
  }
  void notifyOperationReplaced(Operation *op, Operation *made) override {
    notifyOperationReplaced(op, ValueRange(made->getResults()));
  }

  /// The operation that is in place of another one, whose name it has.
  static Operation *findMade(Operation *op, ValueRange values) {
    for (Value value : values)
      if (Operation *made = value ? value.getDefiningOp() : nullptr;
          made && made != op && made->getName() == op->getName())
        return made;
    // It took the body of one that has no results.
    Operation *before = op->getPrevNode();
    bool isMoved = op->getNumRegions() > 0 && op->getRegion(0).empty();
    return isMoved && before && before->getName() == op->getName() ? before
                                                                   : nullptr;
  }

  static bool decidesAlike(Operation *op, Operation *made) {
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
