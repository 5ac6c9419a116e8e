// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Warp.cpp - 32 threads in lockstep ----------------------------------===//

#include "ptx/Machine.h"

#include <algorithm>
#include <cstring>
#include <utility>

using namespace piko::ptx;

Warp::Warp(Block &block, uint32_t number, uint32_t threads,
           Workspace &workspace)
    : program(&block.launch.program), block(block), number(number),
      first(number * warpSize), threads(threads) {
  bank[0] = workspace.take(program->filledBytes);
  // Written by no instruction.
  bank[1] = const_cast<uint8_t *>(program->constants.data());
  bank[2] = workspace.take(program->registerBytes);
  local = workspace.take(size_t(program->localBytes) * warpSize);
  calls = workspace.take(size_t(program->callBytes) * warpSize);
  parameters = block.launch.parameters.data();
}

static uint32_t valueOf(Special special, const Block &block, uint32_t thread) {
  const auto &threads = block.launch.threads;
  uint32_t lane = thread % warpSize, bit = 1u << lane;
  switch (special) {
  case Special::ThreadX:
    return thread % threads[0];
  case Special::ThreadY:
    return thread / threads[0] % threads[1];
  case Special::ThreadZ:
    return thread / threads[0] / threads[1];
  case Special::ThreadsX:
  case Special::ThreadsY:
  case Special::ThreadsZ:
    return threads[size_t(special) - size_t(Special::ThreadsX)];
  case Special::BlockX:
  case Special::BlockY:
  case Special::BlockZ:
    return block.index[size_t(special) - size_t(Special::BlockX)];
  case Special::BlocksX:
  case Special::BlocksY:
  case Special::BlocksZ:
    return block.launch.blocks[size_t(special) - size_t(Special::BlocksX)];
  case Special::Lane:
    return lane;
  case Special::WarpNumber:
    return thread / warpSize;
  case Special::Warps:
    return (block.threadCount + warpSize - 1) / warpSize;
  case Special::Multiprocessor:
    return 0;
  case Special::Multiprocessors:
    return 1;
  case Special::LanesEqual:
    return bit;
  case Special::LanesLess:
    return bit - 1;
  case Special::LanesLessEqual:
    return bit | (bit - 1);
  case Special::LanesGreater:
    return ~(bit | (bit - 1));
  case Special::LanesGreaterEqual:
    return ~(bit - 1);
  }
  return 0;
}

void Warp::reset() {
  std::memset(bank[0], unwritten, program->filledBytes);
  std::memset(local, unwritten, size_t(program->localBytes) * warpSize);
  std::memset(calls, unwritten, size_t(program->callBytes) * warpSize);
  for (const SpecialRegister &it : program->specials)
    for (uint32_t lane = 0; lane < warpSize; ++lane) {
      uint32_t value = valueOf(it.special, block, first + lane);
      if (it.place.bytes == 8)
        lanes<uint64_t>(it.place)[lane] = value;
      else
        lanes<uint32_t>(it.place)[lane] = value;
    }
  ran = 0;
  seen.clear();
  if (block.launch.latencies)
    scoreboard.reset(*program);
  live = threads == warpSize ? allLanes : (1u << threads) - 1;
  groups.assign(1, Group());
  groups[0].state = Group::Ready;
  groups[0].mask = live;
  current = 0;
  changed = false;
}

bool Warp::run(uint32_t steps) {
  bool any = false;
  while (steps && select()) {
    uint32_t taken = runGroup(steps);
    endYield();
    steps -= std::min(steps, taken);
    any = true;
  }
  return any;
}

/// The group that was made last goes first: what has parted meets soon. One
/// that may wait for others in a loop lets them have their turn.
bool Warp::select() {
  const auto count = static_cast<int32_t>(groups.size());
  const int32_t start = block.launch.apart
                            ? static_cast<int32_t>(block.pick(groups.size()))
                        : exhausted ? current
                                    : count;
  for (int32_t i = 1; i <= count; ++i) {
    int32_t group = (start - i + count) % count;
    if (groups[group].state == Group::Ready) {
      current = group;
      return true;
    }
  }
  return false;
}

void Warp::noteChange(uint64_t address, uint64_t value) {
  Launch &launch = block.launch;
  if (!launch.latencies || !launch.cooperative)
    return;
  std::vector<Launch::Change> &changes = launch.changes[address];
  changes.push_back({value, scoreboard.now.after({launch.latencies->miss,
                                                  launch.latencies->miss})});
  seen[address] = changes.size();
  scoreboard.endLoop();
}

uint64_t Warp::see(uint64_t address, uint64_t value) {
  Launch &launch = block.launch;
  auto found = launch.changes.find(address);
  if (found == launch.changes.end() || found->second.back().value != value)
    return value;
  size_t &next = seen[address];
  if (next == found->second.size())
    return value;
  const Launch::Change &change = found->second[next++];
  scoreboard.now.wait(change.at);
  return change.value;
}

uint32_t Warp::runGroup(uint32_t steps) {
  Group &group = groups[current];
  const Instruction *code = program->code.data();
  Site *sites = block.launch.sites.data();
  const Latencies *latencies = block.launch.latencies;
  const uint32_t mask = group.mask, end = group.reconverge;
  const auto count = static_cast<uint32_t>(std::popcount(mask));
  reselect = exhausted = false;
  next = group.pc;
  for (uint32_t step = 0; step < steps;) {
    if (next == end) {
      group.pc = next;
      ran += step;
      finish(current);
      return step + 1;
    }
    pc = next++;
    ++step;
    const Instruction &instruction = code[pc];
    site = sites + pc;
    ++site->warps;
    if (latencies)
      scoreboard.issue(*program, pc, *latencies);
    if (!instruction.guarded) {
      active = mask;
      site->lanes += count;
    } else {
      uint32_t guard = predicate(instruction.guard);
      active = mask & (instruction.guardNegated ? ~guard : guard);
      if (!active)
        continue;
      site->lanes += static_cast<uint32_t>(std::popcount(active));
    }
    instruction.run(*this, instruction);
    if (reselect) {
      ran += step;
      return step;
    }
  }
  ran += steps;
  group.pc = next;
  exhausted = true;
  return steps;
}

int32_t Warp::add(const Group &group) {
  for (size_t i = 0; i < groups.size(); ++i)
    if (groups[i].state == Group::Free) {
      groups[i] = group;
      return static_cast<int32_t>(i);
    }
  groups.push_back(group);
  return static_cast<int32_t>(groups.size()) - 1;
}

/// A group has come to its end or has lost its last lane.
void Warp::finish(int32_t number) {
  while (number >= 0) {
    groups[number].state = Group::Free;
    number = groups[number].parent;
    if (number < 0)
      return;
    Group &parent = groups[number];
    if (--parent.children)
      return;
    parent.state = Group::Ready;
    if (parent.mask && parent.pc != parent.reconverge)
      return;
  }
}

void Warp::branch(uint32_t target, uint32_t reconverge) {
  const uint32_t mask = groups[current].mask;
  if (active == mask || target == next)
    next = target;
  else
    part(std::array{Part{mask & ~active, next}, Part{active, target}},
         reconverge);
}

void Warp::part(std::span<const Part> parts, uint32_t reconverge) {
  if (parts.size() == 1) {
    next = parts[0].target;
    return;
  }
  reselect = true;
  if (block.launch.apart && block.pick(4) == 0)
    reconverge = groups[current].reconverge;
  Group child;
  child.state = Group::Ready;
  child.reconverge = reconverge;
  // Where the group ends there, its parent waits for what has parted.
  const bool ends = reconverge == groups[current].reconverge;
  int32_t reused = ends ? current : -1;
  child.parent = ends ? groups[current].parent : current;
  child.callee = ends && groups[current].callee;
  if (!ends) {
    groups[current].state = Group::Parted;
    groups[current].pc = reconverge;
  }
  for (const Part &it : parts) {
    if (it.target == reconverge)
      continue;
    child.mask = it.mask;
    child.pc = it.target;
    if (reused >= 0) {
      child.children = 0;
      groups[reused] = child;
      reused = -1;
      continue;
    }
    if (child.parent >= 0)
      ++groups[child.parent].children;
    add(child);
  }
}

void Warp::call(uint32_t target) {
  Group child;
  child.state = Group::Ready;
  child.callee = true;
  child.parent = current;
  child.mask = active;
  child.pc = target;
  groups[current].state = Group::Parted;
  groups[current].pc = next;
  groups[current].children = 1;
  reselect = true;
  add(child);
}

/// Takes lanes out of the current group and of those that wait for it: of the
/// function that it is in, or of its callers, too.
void Warp::removeLanes(uint32_t mask, bool fromCallers) {
  groups[current].pc = next;
  bool left = false;
  for (int32_t i = current; i >= 0; i = groups[i].parent) {
    if (left && !fromCallers)
      break;
    groups[i].mask &= ~mask;
    left |= groups[i].callee;
  }
  reselect = true;
  if (!groups[current].mask)
    finish(current);
}

void Warp::returnLanes() {
  bool inCall = false;
  for (int32_t i = current; i >= 0; i = groups[i].parent)
    inCall |= groups[i].callee;
  if (inCall)
    removeLanes(active, false);
  else
    exitLanes();
}

void Warp::exitLanes() {
  live &= ~active;
  removeLanes(active, true);
  for (Group &group : groups)
    if (group.state == Group::Gathering)
      group.state = Group::Ready;
  // Others may wait for nobody else now.
  block.arrive();
}

bool Warp::separate() {
  for (size_t i = 0; i < groups.size(); ++i) {
    if (groups[i].state != Group::Parted)
      continue;
    uint32_t elsewhere = 0;
    for (const Group &group : groups)
      if (group.state != Group::Free && group.parent == static_cast<int32_t>(i))
        elsewhere |= group.mask;
    Group here = groups[i];
    here.mask &= ~elsewhere;
    if (!here.mask)
      continue;
    groups[i].mask = elsewhere;
    here.state = Group::Ready;
    here.children = 0;
    if (here.parent >= 0)
      ++groups[here.parent].children;
    add(here);
    return true;
  }
  return false;
}

void Warp::waitAtBarrier(uint32_t barrier, uint32_t arrivals, bool aligned) {
  Group &group = groups[current];
  if (active != group.mask)
    fault(FaultKind::IllegalInstruction,
          "barrier for which lanes of a warp have different predicates",
          static_cast<uint32_t>(std::countr_zero(active)));
  group.state = Group::AtBarrier;
  group.pc = next;
  group.barrier = barrier;
  group.arrivals = arrivals;
  group.aligned = aligned;
  reselect = true;
  block.arrive();
}

bool Warp::isAt(uint32_t barrier) const {
  return std::any_of(groups.begin(), groups.end(), [&](const Group &group) {
    return group.state == Group::AtBarrier && group.barrier == barrier;
  });
}

uint32_t Warp::lanesThatHold(uint32_t barrier) const {
  uint32_t lanes = 0;
  for (const Group &group : groups) {
    if (group.state != Group::AtBarrier || group.barrier != barrier)
      continue;
    const Instruction &it = program->code[group.pc - 1];
    if (it.extra)
      lanes |= group.mask & (it.negated ? ~predicate(it.c) : predicate(it.c));
  }
  return lanes;
}

/// Gives a group that has waited at a barrier what came of it.
void Warp::reduce(const Group &group, uint32_t arrived, uint32_t holding) {
  const Instruction &it = program->code[group.pc - 1];
  active = group.mask;
  switch (static_cast<Reduction>(it.extra)) {
  case Reduction::None:
    return;
  case Reduction::Count:
    for (uint32_t lane = 0; lane < warpSize; ++lane)
      if (active >> lane & 1)
        lanes<uint32_t>(it.result)[lane] = holding;
    return;
  case Reduction::All:
    return setPredicate(it.result, holding == arrived ? allLanes : 0);
  case Reduction::Any:
    return setPredicate(it.result, holding ? allLanes : 0);
  }
}

void Warp::release(uint32_t barrier, uint32_t arrived, uint32_t holding) {
  uint32_t place = nowhere;
  for (Group &group : groups) {
    if (group.state != Group::AtBarrier || group.barrier != barrier)
      continue;
    pc = group.pc - 1;
    if (group.aligned && place != nowhere && place != pc)
      fault(FaultKind::IllegalInstruction,
            "aligned barrier that lanes of a warp come to at different places",
            static_cast<uint32_t>(std::countr_zero(group.mask)));
    place = pc;
    group.state = Group::Ready;
    reduce(group, arrived, holding);
  }
}

void Warp::sleep() {
  groups[current].state = Group::Sleeping;
  groups[current].pc = next;
  reselect = true;
}

void Warp::sleepInLoop() {
  scoreboard.sleep(pc);
  sleep();
}

bool Warp::yield() {
  Group &group = groups[current];
  if (!block.takesTurns() || std::exchange(group.yielded, false))
    return false;
  group.yielded = true;
  next = pc; // which has not been run
  --site->warps;
  site->lanes -= static_cast<uint64_t>(std::popcount(active));
  --ran;
  scoreboard.takeBack();
  sleep();
  return true;
}

/// A group has asked for its turn: it is its turn now, or it sleeps.
void Warp::endYield() {
  Group &group = groups[current];
  if (group.state == Group::Sleeping && group.yielded && !block.endTurn(ran))
    group.state = Group::Ready;
}

void Warp::wake() {
  for (Group &group : groups)
    if (group.state == Group::Sleeping)
      group.state = Group::Ready;
}

const Group *Warp::sleeper() const {
  for (const Group &group : groups)
    if (group.state == Group::Sleeping)
      return &group;
  return nullptr;
}

bool Warp::gather(uint32_t members) {
  if (active & ~members)
    fault(FaultKind::IllegalInstruction,
          "warp operation by a lane that its mask leaves out",
          static_cast<uint32_t>(std::countr_zero(active & ~members)));
  const uint32_t wanted = members & live;
  if (active == wanted)
    return true;
  // Others that wait at this instruction take part.
  uint32_t here = active;
  for (const Group &group : groups)
    if (group.state == Group::Gathering && group.pc == pc &&
        group.wanted == members)
      here |= group.mask;
  if (here != wanted) {
    Group &group = groups[current];
    group.state = Group::Gathering;
    group.pc = pc;
    group.wanted = members;
    reselect = true;
    return false;
  }
  for (Group &group : groups)
    if (group.state == Group::Gathering && group.pc == pc &&
        group.wanted == members) {
      group.state = Group::Ready;
      group.pc = next;
    }
  site->lanes += static_cast<uint32_t>(std::popcount(wanted & ~active));
  active = wanted;
  return true;
}
