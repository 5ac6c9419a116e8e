//===- BinFacts.cpp - Domains, extents and bins ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Analysis/LinearFacts.h"
#include "Piko/Dialect/Piko/IR/PikoFixed.h"

using namespace mlir;
using namespace piko;
using llvm::DynamicAPInt;

Linear BinFacts::getDomain(int64_t dim) {
  auto [found, isNew] = domains.try_emplace(dim);
  if (isNew) {
    found->second = core.system.addVariable();
    int64_t most = core.pipeline.getMaxExtent().value_or(maxDomainExtent);
    core.system.getFacts().addBetween(Linear(1), found->second,
                                      Linear(std::min(most, maxDomainExtent)));
  }
  return found->second;
}

/// How many elements something has.
Linear BinFacts::addSize() {
  Linear size = core.system.addVariable();
  core.system.getFacts().addBetween(Linear(0), size,
                                    Linear((int64_t(1) << 62) - 1));
  return size;
}

/// How many elements a buffer was fixed to have.
static std::optional<int64_t> getFixedSize(PipelineOp pipeline,
                                           StringRef state) {
  for (auto fixed : pipeline.getOps<FixedOp>())
    if (fixed.getState() == state && !fixed.getField())
      return cast<IntegerAttr>(fixed.getValue()).getInt();
  return std::nullopt;
}

Linear BinFacts::getExtent(StringRef state, int64_t dim) {
  Operation *op = SymbolTable::lookupSymbolIn(core.pipeline, state);
  if (isa_and_nonnull<ImageOp>(op))
    return getDomain(dim);
  auto [found, isNew] = extents.try_emplace({state.str(), dim});
  if (isNew) {
    std::optional<int64_t> size = getFixedSize(core.pipeline, state);
    found->second = size ? Linear(*size) : addSize();
  }
  return found->second;
}

Linear BinFacts::getListSize(Value list) {
  unsigned id = core.number(list, 0);
  auto [found, isNew] = core.expressions.try_emplace(id);
  if (isNew) {
    found->second = addSize();
    if (isNeverEmpty(list))
      core.system.getFacts().addAtLeastZero(found->second - Linear(1));
  }
  return found->second;
}

bool BinFacts::isNeverEmpty(Value list) {
  auto process = core.at->getParentOfType<ProcessOp>();
  ScheduleOp schedule = core.stage.getSchedule();
  return process && list == process.getBody().getArgument(0) &&
         (!schedule || (!schedule.getEveryBin() && schedule.getBody().empty()));
}

bool BinFacts::isInside(ListAtOp read) {
  Linear index = core.get(read.getIndex());
  return read.getChecked() ||
         (core.isAtLeastZero(index) &&
          core.isAtLeastZero(getListSize(read.getList()) - index - Linear(1)));
}

/// What stands before the place has run, if the place is reached.
void BinFacts::findItems() {
  constexpr size_t most = 8; // each costs a search for proofs
  for (Operation *op = core.at; !isa<ProcessOp>(op); op = op->getParentOp())
    for (Operation &before : *op->getBlock()) {
      if (&before == op || core.items.size() == most)
        break;
      auto read = dyn_cast<ListAtOp>(before);
      auto isKnown = [&](Value item) {
        return core.number(item, 0) == core.number(read.getPrim(), 0);
      };
      if (read && llvm::none_of(core.items, isKnown) && isInside(read))
        core.items.push_back(read.getPrim());
    }
}

bool BinFacts::isItem(Value prim, unsigned frame) {
  auto process = core.at->getParentOfType<ProcessOp>();
  if (!process || frame != 0)
    return false;
  auto read = prim.getDefiningOp<ListAtOp>();
  return prim == process.getBody().getArgument(0) || (read && isInside(read));
}

void BinFacts::assumeAssigned(Value item) {
  AssignOp assign = core.stage.getAssign();
  if (!assign)
    return;
  Operation *only = getOnlyAssignment(assign);
  auto to = dyn_cast_or_null<AssignToOp>(only);
  auto cell = to ? to.getBin().getDefiningOp<BinAtOp>() : BinAtOp();
  auto box = dyn_cast_or_null<AssignBoxOp>(only);
  if (!cell && !box)
    return;
  unsigned frame = core.addAssign(assign, item);
  core.assumeReached(only, frame);
  if (cell)
    core.facts->add(describeInBin(cell, frame));
  else
    core.facts->add(describeTouched(box, frame));
}

LinearFact BinFacts::describeInBin(BinAtOp cell, unsigned frame) {
  LinearFact fact;
  for (auto [dim, coordinate] : llvm::enumerate(cell.getCoordinates())) {
    auto [low, high] = getBin(dim);
    fact.addBetween(low, core.get(coordinate, frame), high - Linear(1));
  }
  return fact;
}

LinearFact BinFacts::describeTouched(AssignBoxOp box, unsigned frame) {
  LinearFact fact;
  for (auto [dim, first, last] : llvm::enumerate(box.getLo(), box.getHi())) {
    auto [low, high] = getBin(dim);
    Linear from = core.get(first, frame), to = core.get(last, frame);
    fact.addAtLeastZero(to - from);
    fact.addAtLeastZero(high - Linear(1) - from);
    fact.addAtLeastZero(to - low);
  }
  return fact;
}

bool BinFacts::isOwnBin(Value bin, unsigned frame) {
  return frame == 0 && bin.getDefiningOp<BinOp>() &&
         core.at->getParentOfType<ProcessOp>();
}

std::pair<Linear, Linear> BinFacts::getBin(int64_t dim) {
  auto [found, isNew] = bins.try_emplace(dim);
  if (!isNew)
    return found->second;
  Linear domain = getDomain(dim);
  LinearFact &known = core.system.getFacts();
  int64_t size = core.stage.getBins()[dim];
  if (size == 0)
    return found->second = {Linear(0), domain};
  Linear number = core.system.addVariable(), high = core.system.addVariable();
  Linear low = number * DynamicAPInt(size);
  known.addAtLeastZero(number);
  known.addBetween(low + Linear(1), high, low + Linear(size));
  known.addAtLeastZero(domain - high);
  LinearFact whole, last;
  whole.addZero(high - low - Linear(size));
  last.addZero(high - domain);
  known.choices.push_back({whole, last});
  return found->second = {low, high};
}

bool BinFacts::isAboveBin(Value coordinate, int64_t dim, unsigned frame) {
  std::optional<Linear> unknown;
  Linear cell = core.floats.getCell(coordinate, frame, unknown);
  return core.isAtLeastZero(cell - getBin(dim).first) &&
         (!unknown || core.isAtLeastZero(Linear(0) - *unknown));
}

bool BinFacts::isBelowBin(Value coordinate, int64_t dim, unsigned frame) {
  std::optional<Linear> unknown;
  Linear cell = core.floats.getCell(coordinate, frame, unknown);
  return core.isAtLeastZero(getBin(dim).second - cell - Linear(1)) &&
         (!unknown || core.isAtLeastZero(Linear(0) - *unknown));
}
