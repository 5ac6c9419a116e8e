// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Defer.cpp - Emissions of iterations that meet barriers -------------===//
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
  int64_t cell;
  int32_t port;
};

} // namespace

struct piko::rt::Deferred {
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
  deferred.reset();
}

uint8_t *piko::rt::deferAppend(Lane &lane, int32_t port) {
  Deferred &deferred = *lane.deferred;
  PortLogs &logs = lane.logs[port];
  int64_t size = lane.ports[port].size;
  Memory &memory = lane.pipeline->memory;
  try {
    uint8_t *record = deferred.room(memory, size);
    if (logs.padded)
      std::memset(record, 0, static_cast<size_t>(size));
    int64_t number = deferred.operations.size();
    *deferred.operations.extend(memory, 1) = {deferred.iteration, number,
                                              record, 0, port};
    return record;
  } catch (const OutOfMemory &refused) {
    outOfMemory(lane, refused.bytes);
  } catch (...) {
    outOfMemory(lane, size);
  }
  return logs.scratchRecord;
}

void piko::rt::deferPlace(Lane &lane, int32_t port, int64_t cell) {
  Deferred &deferred = *lane.deferred;
  try {
    int64_t number = deferred.operations.size();
    *deferred.operations.extend(lane.pipeline->memory, 1) = {
        deferred.iteration, number, nullptr, cell, port};
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
  Growing<Operation> &operations = lane.deferred->operations;
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
      pikoir_place(&lane, now->port, now->cell);
}

extern "C" {

void pikoir_defer_begin(pikoir_writer *writer, int64_t iterations) {
  Lane &lane = *static_cast<Lane *>(writer);
  if (lane.flags & PIKOIR_PORT_DEFERRED)
    return badCall(lane, BadCall::Nested);
  try {
    if (!lane.deferred)
      lane.deferred = std::make_unique<Deferred>();
  } catch (...) {
    return outOfMemory(lane, sizeof(Deferred));
  }
  lane.deferred->iterations = iterations;
  lane.deferred->iteration = 0;
  toggle(lane);
}

void pikoir_defer_iteration(pikoir_writer *writer, int64_t iteration) {
  Lane &lane = *static_cast<Lane *>(writer);
  if (!(lane.flags & PIKOIR_PORT_DEFERRED))
    return badCall(lane, BadCall::NotDeferring);
  if (iteration < 0 || iteration >= lane.deferred->iterations)
    return badCall(lane, BadCall::Iteration);
  lane.deferred->iteration = iteration;
}

void pikoir_defer_end(pikoir_writer *writer) {
  Lane &lane = *static_cast<Lane *>(writer);
  if (!(lane.flags & PIKOIR_PORT_DEFERRED))
    return badCall(lane, BadCall::NotDeferring);
  toggle(lane);
  repeat(lane);
  Deferred &deferred = *lane.deferred;
  deferred.operations.shrink(0);
  if (deferred.blocks.size() > 1) // the largest serves the next time
    deferred.blocks.erase(deferred.blocks.begin(), deferred.blocks.end() - 1);
  deferred.used = 0;
}

} // extern "C"
