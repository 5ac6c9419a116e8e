// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- PrivateCopies.cpp - Reductions without locks -----------------------===//

#include "cpu/state/PrivateCopies.h"

#include "cpu/Parallel.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

// What copies may take.
static constexpr int64_t mostCopyBytes = int64_t(64) << 20;
static constexpr size_t mostLanes = 8;

/// How many numbers a launch is expected to change: what a primitive does is
/// not known, nor what a call does that takes a list, which may be empty.
static int64_t expectedChanges(const Kernel &kernel,
                               const Reduction &reduction) {
  constexpr int64_t perCall = 256, often = 16;
  int64_t work = kernel.positions + kernel.calls.size() * perCall;
  return reduction.often ? work * often : work;
}

/// Whether locked instructions take longer than it takes to combine copies: to
/// combine a run takes about as long as four of them, and longer where it is
/// not in a cache.
static bool pays(const pikort_pipeline &p, const Kernel &kernel,
                 const Reduction &reduction, size_t lanes,
                 const PrivateCopies &copies) {
  constexpr int64_t cached = int64_t(16) << 20;
  auto size = static_cast<int64_t>(reduction.identity.size());
  int64_t changesPerRun = copies.records > cached / size ? 16 : 4;
  return lanes <= mostLanes && copies.records <= mostCopyBytes / size &&
         p.memory.limit() == 0 &&
         expectedChanges(kernel, reduction) / changesPerRun >= copies.runs;
}

static void measure(const State &state, const Reduction &reduction,
                    PrivateCopies &copies) {
  int64_t records = 1;
  for (int64_t extent : state.view.extent)
    records *= extent;
  if (records == copies.records)
    return;
  copies.ofLanes.clear();
  copies.records = records;
  copies.runs =
      (records + (int64_t(1) << reduction.runShift) - 1) >> reduction.runShift;
}

/// Makes what is not there yet. False if memory is refused.
static bool allocate(pikort_pipeline &p, const Reduction &reduction,
                     size_t lanes, PrivateCopies &copies) {
  auto size = static_cast<int64_t>(reduction.identity.size());
  try {
    while (copies.ofLanes.size() < lanes) {
      PrivateCopies::Copy copy;
      copy.dirty = Array<uint8_t>(p.memory, copies.runs, Use::State);
      fill(p.threads, copy.dirty.data(), copies.runs, {});
      if (!copies.ofLanes.empty()) {
        int64_t bytes = copies.records * size;
        copy.data = Array<uint8_t>(p.memory, bytes, Use::State);
        fill(p.threads, copy.data.data(), bytes, reduction.identity);
      }
      copies.ofLanes.push_back(std::move(copy));
    }
    return true;
  } catch (const OutOfMemory &) {
    return false;
  }
}

void piko::rt::beginReductions(pikort_pipeline &p, Kernel &kernel) {
  const std::vector<Reduction> &reductions = p.stages[kernel.stage].reductions;
  if (reductions.empty())
    return;
  size_t lanes = kernel.runsSerially ? 1 : kernel.activeLanes;
  while (kernel.copies.size() < reductions.size())
    kernel.copies.push_back(std::make_unique<PrivateCopies>());
  for (size_t i = 0; i < lanes; ++i) {
    kernel.lanes[i]->privates.resize(reductions.size());
    kernel.lanes[i]->reduces = false;
  }
  for (size_t r = 0; r < reductions.size(); ++r) {
    const State &state = p.states[reductions[r].state];
    PrivateCopies &copies = *kernel.copies[r];
    measure(state, reductions[r], copies);
    bool given =
        copies.runs > 0 &&
        (lanes <= 1 || pays(p, kernel, reductions[r], lanes, copies)) &&
        allocate(p, reductions[r], lanes, copies);
    for (size_t i = 0; i < lanes; ++i)
      kernel.lanes[i]->privates[r] =
          given ? pikoir_private{i == 0 ? state.view.data
                                        : copies.ofLanes[i].data.data(),
                                 copies.ofLanes[i].dirty.data()}
                : pikoir_private{nullptr, nullptr};
    if (!given && p.memory.limit() > 0)
      copies.ofLanes.clear(); // there is other use for it
  }
}

/// The first entry from `run` on, below `end`, that is dirty.
static int64_t findDirty(const uint8_t *dirty, int64_t run, int64_t end) {
  uint64_t eight = 0;
  for (; run + 8 <= end; run += 8) {
    std::memcpy(&eight, dirty + run, 8);
    if (eight != 0)
      break;
  }
  while (run < end && dirty[run] == 0)
    ++run;
  return run;
}

/// Combines a copy with the state in some runs.
static void combine(const State &state, const Reduction &reduction,
                    const PrivateCopies &copies, const pikoir_private &copy,
                    int64_t run, int64_t end) {
  auto size = static_cast<int64_t>(reduction.identity.size());
  while ((run = findDirty(copy.dirty, run, end)) < end) {
    int64_t first = run;
    while (run < end && copy.dirty[run] != 0)
      copy.dirty[run++] = 0;
    int64_t begin = first << reduction.runShift;
    int64_t after = std::min(run << reduction.runShift, copies.records);
    reduction.combine(state.view.data + begin * size, copy.data + begin * size,
                      after - begin);
  }
}

void piko::rt::endReductions(pikort_pipeline &p, Kernel &kernel) {
  const std::vector<Reduction> &reductions = p.stages[kernel.stage].reductions;
  if (kernel.source >= 0 || reductions.empty())
    return;
  std::vector<const Lane *> lanes;
  for (size_t i = 1; i < kernel.activeLanes; ++i)
    if (kernel.lanes[i]->reduces)
      lanes.push_back(kernel.lanes[i].get());
  for (size_t r = 0; r < reductions.size() && !lanes.empty(); ++r) {
    if (!lanes.front()->privates[r].data)
      continue;
    // Threads share the runs, not the copies, of which several may have one.
    constexpr int64_t chunk = 1024;
    parallelChunks(p.threads, kernel.copies[r]->runs, chunk,
                   [&](int64_t begin, int64_t end) {
                     for (const Lane *lane : lanes)
                       combine(p.states[reductions[r].state], reductions[r],
                               *kernel.copies[r], lane->privates[r], begin,
                               end);
                   });
  }
}

const pikoir_private *pikoir_get_private(pikoir_writer *writer, int32_t copy) {
  Lane *lane = static_cast<Lane *>(writer);
  lane->reduces = true;
  return &lane->privates[copy];
}
