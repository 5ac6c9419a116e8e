//===- BinFacts.cpp - Domains, extents and bins ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/BinIdentity.h"

using namespace mlir;
using namespace piko;
using llvm::DynamicAPInt;

Linear LinearFacts::getDomain(int64_t dim) {
  auto [found, isNew] = domains.try_emplace(dim);
  if (isNew) {
    found->second = system.addVariable();
    int64_t most = pipeline.getMaxExtent().value_or(maxDomainExtent);
    system.getFacts().addBetween(Linear(1), found->second,
                                 Linear(std::min(most, maxDomainExtent)));
  }
  return found->second;
}

/// How many elements something has.
Linear LinearFacts::addSize() {
  Linear size = system.addVariable();
  system.getFacts().addBetween(Linear(0), size, Linear((int64_t(1) << 62) - 1));
  return size;
}

Linear LinearFacts::getExtent(StringRef state, int64_t dim) {
  Operation *op = SymbolTable::lookupSymbolIn(pipeline, state);
  if (isa_and_nonnull<ImageOp>(op))
    return getDomain(dim);
  auto [found, isNew] = extents.try_emplace({state.str(), dim});
  if (isNew)
    found->second = addSize();
  return found->second;
}

Linear LinearFacts::getListSize(Value list) {
  Id id = number(list, 0);
  auto [found, isNew] = expressions.try_emplace(id);
  if (isNew) {
    found->second = addSize();
    if (isNeverEmpty(list))
      system.getFacts().addAtLeastZero(found->second - Linear(1));
  }
  return found->second;
}

bool LinearFacts::isNeverEmpty(Value list) {
  auto process = at->getParentOfType<ProcessOp>();
  ScheduleOp schedule = stage.getSchedule();
  return process && list == process.getBody().getArgument(0) &&
         (!schedule || (!schedule.getEveryBin() && schedule.getBody().empty()));
}

bool LinearFacts::isInside(ListAtOp read) {
  Linear index = get(read.getIndex());
  return read.getChecked() ||
         (isAtLeastZero(index) &&
          isAtLeastZero(getListSize(read.getList()) - index - Linear(1)));
}

/// What stands before the place has run, if the place is reached.
void LinearFacts::findItems() {
  constexpr size_t most = 8; // each costs a search for proofs
  for (Operation *op = at; !isa<ProcessOp>(op); op = op->getParentOp())
    for (Operation &before : *op->getBlock()) {
      if (&before == op || items.size() == most)
        break;
      auto read = dyn_cast<ListAtOp>(before);
      auto isKnown = [&](Value item) {
        return number(item, 0) == number(read.getPrim(), 0);
      };
      if (read && llvm::none_of(items, isKnown) && isInside(read))
        items.push_back(read.getPrim());
    }
}

bool LinearFacts::isItem(Value prim, unsigned frame) {
  auto process = at->getParentOfType<ProcessOp>();
  if (!process || frame != 0)
    return false;
  auto read = prim.getDefiningOp<ListAtOp>();
  return prim == process.getBody().getArgument(0) || (read && isInside(read));
}

void LinearFacts::assumeAssigned(Value item) {
  AssignOp assign = stage.getAssign();
  if (!assign)
    return;
  Operation *only = getOnlyAssignment(assign);
  auto to = dyn_cast_or_null<AssignToOp>(only);
  auto cell = to ? to.getBin().getDefiningOp<BinAtOp>() : BinAtOp();
  auto box = dyn_cast_or_null<AssignBoxOp>(only);
  if (!cell && !box)
    return;
  unsigned frame = addAssign(assign, item);
  assumeReached(only, frame);
  if (cell)
    facts->add(describeInBin(cell, frame));
  else
    facts->add(describeTouched(box, frame));
}

LinearFact LinearFacts::describeInBin(BinAtOp cell, unsigned frame) {
  LinearFact fact;
  for (auto [dim, coordinate] : llvm::enumerate(cell.getCoordinates())) {
    auto [low, high] = getBin(dim);
    fact.addBetween(low, get(coordinate, frame), high - Linear(1));
  }
  return fact;
}

LinearFact LinearFacts::describeTouched(AssignBoxOp box, unsigned frame) {
  LinearFact fact;
  for (auto [dim, first, last] : llvm::enumerate(box.getLo(), box.getHi())) {
    auto [low, high] = getBin(dim);
    Linear from = get(first, frame), to = get(last, frame);
    fact.addAtLeastZero(to - from);
    fact.addAtLeastZero(high - Linear(1) - from);
    fact.addAtLeastZero(to - low);
  }
  return fact;
}

bool LinearFacts::isOwnBin(Value bin, unsigned frame) {
  return frame == 0 && bin.getDefiningOp<BinOp>() &&
         at->getParentOfType<ProcessOp>();
}

std::pair<Linear, Linear> LinearFacts::getBin(int64_t dim) {
  auto [found, isNew] = bins.try_emplace(dim);
  if (!isNew)
    return found->second;
  Linear domain = getDomain(dim);
  LinearFact &known = system.getFacts();
  int64_t size = stage.getBins()[dim];
  if (size == 0)
    return found->second = {Linear(0), domain};
  Linear number = system.addVariable(), high = system.addVariable();
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

bool LinearFacts::isAboveBin(Value coordinate, int64_t dim, unsigned frame) {
  std::optional<Linear> unknown;
  Linear cell = getCell(coordinate, frame, unknown);
  return isAtLeastZero(cell - getBin(dim).first) &&
         (!unknown || isAtLeastZero(Linear(0) - *unknown));
}

bool LinearFacts::isBelowBin(Value coordinate, int64_t dim, unsigned frame) {
  std::optional<Linear> unknown;
  Linear cell = getCell(coordinate, frame, unknown);
  return isAtLeastZero(getBin(dim).second - cell - Linear(1)) &&
         (!unknown || isAtLeastZero(Linear(0) - *unknown));
}
