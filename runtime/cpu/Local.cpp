// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Local.cpp - Stages that run in the kernel of their producer --------===//
//
// The records of a local edge lie in one block of the lane, which grows as
// needed and serves bin after bin. The stage after the edge has lanes of its
// own, for what it emits: a unit is one of the host's, with a slot for each bin
// in it.
//
//===----------------------------------------------------------------------===//

#include "cpu/Kernel.h"
#include "pikort/abi_ranks.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

static constexpr int64_t leastBytes = int64_t(16) << 10;

static void beginLocal(pikort_pipeline &p, const Kernel &host, int32_t stage) {
  Kernel &kernel = kernelOf(p, stage);
  kernel.clear();
  int64_t slots = 0;
  for (const pikoir_unit &unit : host.units) {
    int64_t bins =
        unit.bucket_end - unit.bucket_begin; // or calls, which are more
    kernel.units.push_back({0, 0, slots, slots + bins, 0});
    slots += bins;
  }
  if (p.stages[stage].partition == PIKOIR_BINS)
    nameLocalSlots(p, host, kernel, slots);
  prepareOutputs(p, p.stages[stage], kernel);
  prepareLanes(p, kernel);
  kernel.open = true;
}

void piko::rt::beginLocals(pikort_pipeline &p, Kernel &host) {
  if (host.source >= 0 || !p.stages[host.stage].hosts)
    return;
  for (size_t s = 0; s < p.stages.size(); ++s)
    if (p.stages[s].host == host.stage)
      beginLocal(p, host, static_cast<int32_t>(s));
}

/// Frees what local edges from a kernel hold, and counts what they brought.
static void releaseLocals(pikort_pipeline &p, Kernel &kernel) {
  for (auto &lane : kernel.lanes)
    for (PortLogs &logs : lane->logs) {
      if (!logs.local)
        continue;
      StageStats &stats = p.stageStats[logs.consumer];
      stats.in += logs.local->received;
      stats.placed += logs.local->received;
      logs.local.reset();
      logs.clear();
    }
}

void piko::rt::endLocals(pikort_pipeline &p, Kernel &host, int32_t status) {
  if (host.source >= 0 || !p.stages[host.stage].hosts)
    return;
  releaseLocals(p, host);
  for (size_t s = 0; s < p.stages.size(); ++s) {
    if (p.stages[s].host != host.stage)
      continue;
    Kernel &kernel = kernelOf(p, static_cast<int32_t>(s));
    releaseLocals(p, kernel);
    for (auto &lane : kernel.lanes)
      p.stageStats[s].out += lane->emitted;
    kernel.open = false;
    if (kernel.pendingOutputs == 0 || status != PIKORT_OK)
      kernel.clear();
  }
}

bool piko::rt::growLocal(Lane &lane, int32_t port, int64_t count) {
  pikoir_port &out = lane.ports[port];
  PortLogs &logs = lane.logs[port];
  Log &log = logs.records;
  if (log.failed)
    return false;
  int64_t used = log.blocks.empty() ? 0 : out.cursor - log.blocks[0].data();
  int64_t bytes = std::max({2 * used, used + count * out.size, leastBytes});
  try {
    log.blocks.reserve(1);
    Array<uint8_t> block(lane.pipeline->memory, bytes);
    if (used)
      std::memcpy(block.data(), log.blocks[0].data(),
                  static_cast<size_t>(used));
    if (logs.padded)
      std::memset(block.data() + used, 0,
                  static_cast<size_t>(block.capacity() - used));
    out.cursor = block.data() + used;
    out.limit = block.data() + block.capacity() - out.size;
    log.blocks.clear();
    log.blocks.push_back(std::move(block));
    return true;
  } catch (const OutOfMemory &refused) {
    outOfMemory(lane, refused.bytes, logs.consumer);
  } catch (...) {
    outOfMemory(lane, bytes, logs.consumer);
  }
  log.failed = true;
  return false;
}

/// The calls of a list, in batches; an empty one is called only if the stage
/// runs for every bin.
static int64_t makeCalls(const Lane &lane, PortLogs &logs, int64_t count) {
  const Stage &stage = lane.pipeline->stages[logs.consumer];
  Array<pikoir_call> &list = logs.local->calls;
  int64_t batch = stage.schedule.batch ? stage.schedule.batch : count;
  batch = std::clamp<int64_t>(batch, 1, UINT32_MAX);
  int64_t calls = count > 0 ? (count + batch - 1) / batch
                            : static_cast<int64_t>(stage.schedule.everyBin);
  try {
    if (list.size() < calls)
      list = Array<pikoir_call>(lane.pipeline->memory,
                                std::max(calls, 2 * list.size()));
  } catch (const OutOfMemory &refused) {
    outOfMemory(lane, refused.bytes, logs.consumer);
    return 0;
  }
  for (int64_t i = 0; i < calls; ++i)
    list[i] = {0, i * batch, std::min(count, (i + 1) * batch)};
  return calls;
}

extern "C" {

const pikoir_input *pikoir_begin_local(pikoir_writer *writer, int32_t port) {
  Lane &lane = *static_cast<Lane *>(writer);
  PortLogs &logs = lane.logs[port];
  const Stage &to = lane.pipeline->stages[logs.consumer];
  LocalBin &bin = *logs.local;
  bool any = !logs.records.failed && !logs.records.blocks.empty();
  const uint8_t *items = any ? logs.records.blocks[0].data() : nullptr;
  int64_t count =
      any ? (lane.ports[port].cursor - items) / lane.ports[port].size : 0;
  bin.received += count;
  int64_t calls = to.takesList() ? makeCalls(lane, logs, count) : 0;
  bin.unit = {0, to.takesList() ? calls : 1, 0, count, 0};
  bin.offsets[1] = count;
  bin.input = {items,     count, nullptr, bin.offsets,
               &bin.unit, 1,     1,       bin.calls.data(),
               calls,     0,     nullptr};
  return &bin.input;
}

void pikoir_end_local(pikoir_writer *writer, int32_t port) {
  Lane &lane = *static_cast<Lane *>(writer);
  Log &log = lane.logs[port].records;
  if (!log.failed && !log.blocks.empty())
    lane.ports[port].cursor = log.blocks[0].data();
}

} // extern "C"
