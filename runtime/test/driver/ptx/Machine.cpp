// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Machine.cpp - Launches of kernels ----------------------------------===//

#include "ptx/Machine.h"

#include <algorithm>
#include <cstring>
#include <numeric>

using namespace piko::ptx;

/// Instructions that a warp runs before the next one's turn.
static constexpr uint32_t turn = 4096;

static std::string text(const std::array<uint32_t, 3> &index) {
  return "(" + std::to_string(index[0]) + ", " + std::to_string(index[1]) +
         ", " + std::to_string(index[2]) + ")";
}

static std::string_view lineOf(std::string_view source, uint32_t line) {
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

Block::Block(Launch &launch) : launch(launch) {
  threadCount = launch.threads[0] * launch.threads[1] * launch.threads[2];
  sharedSize = uint64_t(launch.program.sharedBytes) + launch.dynamicSharedBytes;
  // In units that keep the strictest alignment of an access.
  sharedMemory.resize((sharedSize + 15) / 16 * 2 + 2);
  auto start = reinterpret_cast<uintptr_t>(sharedMemory.data());
  auto *shared = reinterpret_cast<uint8_t *>((start + 15) & ~uintptr_t(15));
  for (uint32_t first = 0; first < threadCount; first += warpSize) {
    warps.push_back(std::make_unique<Warp>(
        *this, first / warpSize, std::min(warpSize, threadCount - first)));
    warps.back()->shared = shared;
    warps.back()->sharedBytes = sharedSize;
  }
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

void Block::run(uint64_t number) {
  index = {static_cast<uint32_t>(number % launch.blocks[0]),
           static_cast<uint32_t>(number / launch.blocks[0] % launch.blocks[1]),
           static_cast<uint32_t>(number / launch.blocks[0] / launch.blocks[1])};
  std::memset(sharedMemory.data(), unwritten,
              sharedMemory.size() * sizeof(uint64_t));
  for (auto &warp : warps)
    warp->reset();
  random.seed(launch.seed + number);
  arrived = false;
  while (true) {
    bool ran = runWarps();
    if (arrived)
      ran |= releaseBarriers();
    if (!liveThreads())
      return;
    if (!ran && std::none_of(warps.begin(), warps.end(),
                             [](auto &warp) { return warp->separate(); }))
      reportDeadlock();
  }
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
      for (auto &warp : warps)
        warp->release(barrier);
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

void piko::ptx::run(Launch &launch) {
  launch.sites.assign(launch.program.code.size(), Site());
  uint64_t count =
      uint64_t(launch.blocks[0]) * launch.blocks[1] * launch.blocks[2];
  Block block(launch);
  if (!launch.seed) {
    for (uint64_t number = 0; number < count; ++number)
      block.run(number);
    return;
  }
  std::vector<uint64_t> order(count);
  std::iota(order.begin(), order.end(), uint64_t(0));
  std::shuffle(order.begin(), order.end(), std::mt19937_64(launch.seed));
  for (uint64_t number : order)
    block.run(number);
}
