// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Reorder.cpp - Emissions of iterations that meet barriers
//-------------===//
//
// Between barriers iterations take turns, but what they emit is ordered by
// iteration. Appends and places are noted, with records in blocks that do not
// move, and at the end sorted by iteration and repeated. The port flag keeps
// the inline fast paths away.
//
//===----------------------------------------------------------------------===//

#include "cpu/Queue.h"

#include <algorithm>
#include <tuple>

using namespace piko::rt;

static constexpr int64_t firstBlock = int64_t(16) << 10;

namespace {

/// An append, or a place.
struct Operation {
  int64_t iteration;
  int64_t number;        ///< Of the calls, in order.
  const uint8_t *record; ///< Null for a place.
  int64_t bucket;
  int32_t port;
};

} // namespace

struct piko::rt::Reordered {
  int64_t iterations = 0, iteration = 0;
  Growing<Operation> operations;
  std::vector<Array<uint8_t>> blocks;
  int64_t used = 0; ///< Of the last block.

  /// Room for a record; throws OutOfMemory.
  uint8_t *room(Memory &memory, int64_t bytes) {
    int64_t aligned = (bytes + 63) / 64 * 64;
    if (blocks.empty() || used + aligned > blocks.back().capacity()) {
      int64_t last = blocks.empty() ? 0 : blocks.back().capacity();
      blocks.reserve(blocks.size() + 1);
      blocks.emplace_back(memory, std::max({aligned, 2 * last, firstBlock}));
      used = 0;
    }
    used += aligned;
    return blocks.back().data() + used - aligned;
  }
};

Lane::Lane() : pikoir_writer{} {}
Lane::~Lane() = default;

void Lane::clear() {
  for (PortLogs &log : logs)
    log.clear();
  emitted = busy = 0;
  scratch = {};
  tiles.clear();
  reordered.reset();
}

uint8_t *piko::rt::reorderAppend(Lane &lane, int32_t port) {
  Reordered &reordered = *lane.reordered;
  PortLogs &logs = lane.logs[port];
  int64_t size = lane.ports[port].size;
  Memory &memory = lane.pipeline->memory;
  try {
    uint8_t *record = reordered.room(memory, size);
    if (logs.padded)
      std::memset(record, 0, static_cast<size_t>(size));
    int64_t number = reordered.operations.size();
    *reordered.operations.extend(memory, 1) = {reordered.iteration, number,
                                               record, 0, port};
    return record;
  } catch (const OutOfMemory &refused) {
    outOfMemory(lane, refused.bytes);
  } catch (...) {
    outOfMemory(lane, size);
  }
  return logs.scratchRecord;
}

void piko::rt::reorderPlace(Lane &lane, int32_t port, int64_t bucket) {
  Reordered &reordered = *lane.reordered;
  try {
    int64_t number = reordered.operations.size();
    *reordered.operations.extend(lane.pipeline->memory, 1) = {
        reordered.iteration, number, nullptr, bucket, port};
  } catch (const OutOfMemory &refused) {
    outOfMemory(lane, refused.bytes);
  }
}

static void toggle(Lane &lane) {
  lane.flags ^= PIKOIR_PORT_DEFERRED;
  for (pikoir_port &port : lane.portStorage)
    port.flags ^= PIKOIR_PORT_DEFERRED;
}

static void repeat(Lane &lane) {
  Growing<Operation> &operations = lane.reordered->operations;
  Operation *begin = operations.data(), *end = begin + operations.size();
  auto before = [](const Operation &a, const Operation &b) {
    return std::tie(a.iteration, a.number) < std::tie(b.iteration, b.number);
  };
  if (!std::is_sorted(begin, end, before))
    std::sort(begin, end, before);
  for (const Operation *now = begin; now != end; ++now)
    if (now->record)
      std::memcpy(pikoir_append(&lane, now->port), now->record,
                  static_cast<size_t>(lane.ports[now->port].size));
    else
      pikoir_place(&lane, now->port, now->bucket);
}

extern "C" {

void pikoir_reorder_begin(pikoir_writer *writer, int64_t iterations) {
  Lane &lane = *static_cast<Lane *>(writer);
  if (lane.flags & PIKOIR_PORT_DEFERRED)
    return badCall(lane, BadCall::Nested);
  try {
    if (!lane.reordered)
      lane.reordered = std::make_unique<Reordered>();
  } catch (...) {
    return outOfMemory(lane, sizeof(Reordered));
  }
  lane.reordered->iterations = iterations;
  lane.reordered->iteration = 0;
  toggle(lane);
}

void pikoir_reorder_iteration(pikoir_writer *writer, int64_t iteration) {
  Lane &lane = *static_cast<Lane *>(writer);
  if (!(lane.flags & PIKOIR_PORT_DEFERRED))
    return badCall(lane, BadCall::NotReordering);
  if (iteration < 0 || iteration >= lane.reordered->iterations)
    return badCall(lane, BadCall::Iteration);
  lane.reordered->iteration = iteration;
}

void pikoir_reorder_end(pikoir_writer *writer) {
  Lane &lane = *static_cast<Lane *>(writer);
  if (!(lane.flags & PIKOIR_PORT_DEFERRED))
    return badCall(lane, BadCall::NotReordering);
  toggle(lane);
  repeat(lane);
  Reordered &reordered = *lane.reordered;
  reordered.operations.shrink(0);
  if (reordered.blocks.size() > 1) // the largest serves the next time
    reordered.blocks.erase(reordered.blocks.begin(),
                           reordered.blocks.end() - 1);
  reordered.used = 0;
}

} // extern "C"
