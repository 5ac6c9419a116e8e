// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Machine.cpp - Launches of kernels ----------------------------------===//

#include "ptx/Machine.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

using namespace piko::ptx;

/// Instructions that a warp runs before the next one's turn, and such rounds of
/// its warps that a block runs before the next block's.
static constexpr uint32_t turn = 4096, roundsOfBlock = 16;
/// Rounds of the blocks in which all are asleep and find that nothing has
/// changed, until a launch is given up.
static constexpr uint32_t patience = 10000;
/// How many instructions a block may be ahead of others: each change of the
/// block fills caches anew.
static constexpr uint64_t slack = 512;

static std::string text(const std::array<uint32_t, 3> &index) {
  return "(" + std::to_string(index[0]) + ", " + std::to_string(index[1]) +
         ", " + std::to_string(index[2]) + ")";
}

std::string_view piko::ptx::lineOf(std::string_view source, uint32_t line) {
  while (--line) {
    size_t end = source.find('\n');
    if (end == source.npos)
      return {};
    source.remove_prefix(end + 1);
  }
  source = source.substr(0, source.find('\n'));
  size_t start = source.find_first_not_of(" \t");
  return start == source.npos ? source : source.substr(start);
}

void Warp::fault(FaultKind kind, const std::string &what, uint32_t lane) const {
  const Launch &launch = block.launch;
  uint32_t thread = first + lane, line = program->code[pc].line;
  const auto &threads = launch.threads;
  throw Fault{kind,
              what + "; kernel '" + program->name + "', line " +
                  std::to_string(line) + ": " +
                  std::string(lineOf(launch.source, line)) + " block " +
                  text(block.index) + ", thread " +
                  text({thread % threads[0], thread / threads[0] % threads[1],
                        thread / threads[0] / threads[1]})};
}

/// Of a part of a workspace: a cache line and a vector of registers.
static constexpr size_t alignment = 64;

size_t Workspace::sizeOf(std::initializer_list<size_t> parts) {
  size_t sum = 0;
  for (size_t bytes : parts)
    sum += (bytes + alignment - 1) / alignment * alignment;
  return sum;
}

void Workspace::reset(size_t bytes) {
  if (!memory || bytes > capacity) {
    memory.reset(); // Not both at a time.
    memory = std::make_unique_for_overwrite<uint8_t[]>(bytes + alignment);
    capacity = bytes;
  }
  auto start = reinterpret_cast<uintptr_t>(memory.get());
  next = reinterpret_cast<uint8_t *>((start + alignment - 1) / alignment *
                                     alignment);
}

uint8_t *Workspace::take(size_t bytes) {
  return std::exchange(next, next + sizeOf({bytes}));
}

static uint32_t threadsOf(const Launch &launch) {
  return launch.threads[0] * launch.threads[1] * launch.threads[2];
}

static uint64_t sharedBytesOf(const Launch &launch) {
  return uint64_t(launch.program.sharedBytes) + launch.dynamicSharedBytes;
}

/// What a block has of the first-level cache where as many are beside it as
/// there may be: what shared memory leaves, in equal parts.
static uint64_t cacheBytesOf(const Launch &launch) {
  const uint64_t all = launch.latencies->cacheBytes,
                 shared = launch.together * sharedBytesOf(launch);
  if (all == 0)
    return 8192;
  return all > shared ? (all - shared) / launch.together : 0;
}

Block::Block(Launch &launch, Workspace &workspace)
    : launch(launch), threadCount(threadsOf(launch)),
      sharedSize(sharedBytesOf(launch)),
      sharedMemory(workspace.take(sharedSize)) {
  for (uint32_t first = 0; first < threadCount; first += warpSize) {
    warps.push_back(std::make_unique<Warp>(
        *this, first / warpSize, std::min(warpSize, threadCount - first),
        workspace));
    warps.back()->shared = sharedMemory;
    warps.back()->sharedBytes = sharedSize;
    warps.back()->buffer = launch.buffered ? &stores : nullptr;
  }
}

size_t Block::bytesFor(const Launch &launch) {
  const Program &program = launch.program;
  size_t warps = (threadsOf(launch) + warpSize - 1) / warpSize;
  return Workspace::sizeOf({sharedBytesOf(launch)}) +
         warps * Workspace::sizeOf({program.filledBytes, program.registerBytes,
                                    size_t(program.localBytes) * warpSize,
                                    size_t(program.callBytes) * warpSize});
}

/// Each has its turn. With a seed the order and the length of turns vary, so
/// that what lacks a barrier shows.
bool Block::runWarps() {
  bool ran = false;
  uint32_t steps = turn;
  if (launch.seed) {
    std::shuffle(warps.begin(), warps.end(), random);
    steps = 1 + static_cast<uint32_t>(random() % turn);
  }
  for (auto &warp : warps) {
    warp->firstLane =
        launch.seed ? static_cast<uint32_t>(random() % warpSize) : 0;
    ran |= warp->run(steps);
  }
  return ran;
}

void Block::begin(uint64_t number) {
  index = {static_cast<uint32_t>(number % launch.blocks[0]),
           static_cast<uint32_t>(number / launch.blocks[0] % launch.blocks[1]),
           static_cast<uint32_t>(number / launch.blocks[0] / launch.blocks[1])};
  std::memset(sharedMemory, unwritten, sharedSize);
  for (auto &warp : warps)
    warp->reset();
  random.seed(launch.seed + number);
  if (launch.latencies)
    cache.reset(cacheBytesOf(launch));
  fences = 1;
  arrived = yielded = false;
}

uint64_t Block::ran() const {
  uint64_t most = 0;
  for (const auto &warp : warps)
    most = std::max(most, warp->ran);
  return most;
}

Time Block::time() const {
  Time last;
  for (const auto &warp : warps)
    last.wait(warp->scoreboard.now);
  return last;
}

Block::Turn Block::run() {
  for (auto &warp : warps)
    warp->wake();
  yielded = false;
  for (uint32_t round = 0; round < roundsOfBlock; ++round) {
    bool any = runWarps();
    if (arrived)
      any |= releaseBarriers();
    if (!liveThreads()) {
      warps.front()->changed |= stores.flush();
      launch.longestWarp = std::max(launch.longestWarp, ran());
      launch.span.wait(time());
      return Turn::Ended;
    }
    if (any)
      continue;
    if (yielded)
      return Turn::Over;
    if (hasSleepers())
      return Turn::Asleep;
    if (!separate())
      reportDeadlock();
  }
  return Turn::Over;
}

bool Block::separate() {
  return std::any_of(warps.begin(), warps.end(),
                     [](auto &warp) { return warp->separate(); });
}

bool Block::hasSleepers() const {
  return std::any_of(warps.begin(), warps.end(),
                     [](auto &warp) { return warp->sleeper(); });
}

bool Block::takeChange() {
  bool changed = false;
  for (auto &warp : warps)
    changed |= std::exchange(warp->changed, false);
  return changed;
}

uint32_t Block::liveThreads() const {
  int count = 0;
  for (const auto &warp : warps)
    count += std::popcount(warp->live);
  return static_cast<uint32_t>(count);
}

bool Block::releaseBarriers() {
  constexpr uint32_t barriers = 16;
  std::array<uint32_t, barriers> waiting{}, wanted{};
  arrived = false;
  uint32_t all = liveThreads();
  for (const auto &warp : warps)
    for (const Group &group : warp->groups)
      if (group.state == Group::AtBarrier) {
        waiting[group.barrier] +=
            static_cast<uint32_t>(std::popcount(group.mask));
        wanted[group.barrier] = group.arrivals ? group.arrivals : all;
      }
  bool released = false;
  for (uint32_t barrier = 0; barrier < barriers; ++barrier)
    if (waiting[barrier] && waiting[barrier] >= wanted[barrier]) {
      released = true;
      int holding = 0;
      Time last;
      for (const auto &warp : warps) {
        holding += std::popcount(warp->lanesThatHold(barrier));
        if (warp->isAt(barrier))
          last.wait(warp->scoreboard.now);
      }
      for (auto &warp : warps) {
        if (warp->isAt(barrier)) {
          warp->scoreboard.now.wait(last);
          warp->scoreboard.endLoop();
        }
        warp->release(barrier, waiting[barrier],
                      static_cast<uint32_t>(holding));
      }
    }
  return released;
}

void Block::reportDeadlock() const {
  int atBarrier = 0, gathering = 0;
  uint32_t line = 0;
  for (const auto &warp : warps)
    for (const Group &group : warp->groups) {
      if (group.state == Group::AtBarrier)
        atBarrier += std::popcount(group.mask);
      if (group.state == Group::Gathering) {
        gathering += std::popcount(group.mask);
        line = launch.program.code[group.pc].line;
      }
    }
  std::string what = "threads wait for each other; kernel '" +
                     launch.program.name + "', block " + text(index) + ": " +
                     std::to_string(atBarrier) + " of " +
                     std::to_string(liveThreads()) + " at a barrier";
  if (gathering)
    what += ", " + std::to_string(gathering) +
            " at a warp operation that other lanes of its mask do not come "
            "to, line " +
            std::to_string(line) + ": " +
            std::string(lineOf(launch.source, line));
  throw Fault{FaultKind::Deadlock, what};
}

void Block::reportEndlessSleep(const std::string &others) const {
  for (const auto &warp : warps)
    if (const Group *group = warp->sleeper()) {
      uint32_t line = launch.program.code[group->pc - 1].line;
      throw Fault{FaultKind::Deadlock,
                  "threads wait for memory that nothing changes; kernel '" +
                      launch.program.name + "', line " + std::to_string(line) +
                      ": " + std::string(lineOf(launch.source, line)) +
                      " block " + text(index) + "; " + others};
    }
  reportDeadlock();
}

/// Runs blocks that wait for each other in turns until they have ended.
static void runTogether(std::vector<Block *> blocks, std::mt19937_64 &random,
                        bool shuffled) {
  for (uint32_t idle = 0; !blocks.empty();) {
    if (shuffled)
      std::shuffle(blocks.begin(), blocks.end(), random);
    bool changed = false, asleep = true;
    std::erase_if(blocks, [&](Block *block) {
      Block::Turn turn = block->run();
      changed |= block->takeChange();
      asleep &= turn == Block::Turn::Asleep;
      return turn == Block::Turn::Ended;
    });
    idle = asleep && !changed ? idle + 1 : 0;
    if (idle < patience)
      continue;
    idle = 0;
    // Lanes may wait for those that sleep, which wait for them.
    bool separated = false;
    for (Block *block : blocks)
      separated |= block->separate();
    if (!separated)
      blocks[0]->reportEndlessSleep(std::to_string(blocks.size()) +
                                    " blocks sleep");
  }
}

namespace {

/// Runs blocks that are independent of each other, as a device does that has
/// room for some of them: each as far as the others. One that has not begun
/// needs no memory.
class BlockQueue {
public:
  BlockQueue(Launch &launch, std::vector<uint64_t> order, Workspace &workspace)
      : launch(launch), order(std::move(order)), workspace(workspace) {}
  void run();

private:
  struct Place {
    uint64_t clock; ///< Instructions that have been run there.
    uint64_t start; ///< When its block began.
    Time startTime; ///< The same in cycles.
    uint64_t number;
    Block *block; ///< Null: it has not begun.
    /// Whether the other one goes first.
    bool operator<(const Place &other) const {
      return std::tie(clock, number) > std::tie(other.clock, other.number);
    }
  };
  void begin(Place &place);
  Block::Turn runTurn(Block &block) const;

  Launch &launch;
  std::vector<uint64_t> order; ///< Of the blocks; empty: as numbered.
  Workspace &workspace;
  uint64_t ended = 0;
  std::vector<std::unique_ptr<Block>> blocks;
  std::vector<Block *> free;
};

} // namespace

static uint64_t countBlocks(const Launch &launch) {
  return uint64_t(launch.blocks[0]) * launch.blocks[1] * launch.blocks[2];
}

void BlockQueue::begin(Place &place) {
  if (free.empty())
    free.push_back(
        blocks.emplace_back(std::make_unique<Block>(launch, workspace)).get());
  place.block = free.back();
  free.pop_back();
  place.block->begin(order.empty() ? place.number : order[place.number]);
}

/// A block that sleeps waits for what no other one does meanwhile.
Block::Turn BlockQueue::runTurn(Block &block) const {
  for (uint32_t idle = 0;;) {
    Block::Turn turn = block.run();
    if (turn != Block::Turn::Asleep)
      return turn;
    idle = block.takeChange() ? 0 : idle + 1;
    if (idle < patience)
      continue;
    idle = 0;
    if (!block.separate())
      block.reportEndlessSleep(std::to_string(countBlocks(launch) - ended - 1) +
                               " blocks have not ended: the launch is not "
                               "cooperative");
  }
}

void BlockQueue::run() {
  const uint64_t count = countBlocks(launch);
  uint64_t next = 0;
  std::priority_queue<Place> places;
  for (; next < std::min(count, launch.resident); ++next)
    places.push({0, 0, {}, next, nullptr});
  while (!places.empty()) {
    Place place = places.top();
    places.pop();
    if (!place.block)
      begin(place);
    place.block->turnEnd =
        places.empty()
            ? ~uint64_t(0)
            : std::max(places.top().clock + slack, place.start) - place.start;
    Block::Turn turn = runTurn(*place.block);
    place.clock = place.start + place.block->ran();
    if (turn == Block::Turn::Ended) {
      ++ended;
      launch.lastBlock = std::max(launch.lastBlock, place.clock);
      place.startTime = place.startTime.after(place.block->time());
      launch.span.wait(place.startTime);
      free.push_back(std::exchange(place.block, nullptr));
      if (next == count)
        continue;
      place.start = place.clock;
      place.number = next++;
    }
    places.push(place);
  }
}

void piko::ptx::run(Launch &launch) {
  launch.sites.assign(launch.program.code.size(), Site());
  const uint64_t count = countBlocks(launch);
  std::mt19937_64 random(launch.seed);
  std::vector<uint64_t> order;
  if (launch.seed) {
    order.resize(count);
    std::iota(order.begin(), order.end(), uint64_t(0));
    std::shuffle(order.begin(), order.end(), random);
  }
  static thread_local Workspace workspace;
  workspace.reset(
      std::min(count, launch.cooperative ? count : launch.resident) *
      Block::bytesFor(launch));
  if (!launch.cooperative)
    return BlockQueue(launch, std::move(order), workspace).run();
  std::vector<std::unique_ptr<Block>> blocks;
  std::vector<Block *> running;
  for (uint64_t i = 0; i < count; ++i) {
    running.push_back(
        blocks.emplace_back(std::make_unique<Block>(launch, workspace)).get());
    running.back()->begin(launch.seed ? order[i] : i);
  }
  runTogether(running, random, launch.seed != 0);
  launch.lastBlock = launch.longestWarp;
}
