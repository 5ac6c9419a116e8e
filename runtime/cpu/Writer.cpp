// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Writer.cpp - Logs what a unit emits --------------------------------===//
//
// A lane continues its blocks from unit to unit, so that small units cost no
// memory of their own; segments tell afterwards which bytes are whose. When
// memory is refused, the port goes on in a scratch whose contents are lost,
// and the kernel ends with an error.
//
//===----------------------------------------------------------------------===//

#include "cpu/Serial.h"

#include <algorithm>
#include <cstring>
#include <thread>

using namespace piko::rt;

static constexpr int64_t smallestBlock = int64_t(64) << 10;
static constexpr int64_t largestBlock = int64_t(2) << 20;
static constexpr int64_t noRecord = INT64_MAX; // as last_bucket

static Lane *laneOf(pikoir_writer *writer) {
  return static_cast<Lane *>(writer);
}

/// How many local edges lie before the stage that a lane is of.
static int32_t depthOf(const Lane &lane) {
  return lane.pipeline->stages[lane.stage].depth;
}

void piko::rt::outOfMemory(const Lane &lane, int64_t bytes, int32_t stage) {
  lane.pipeline->report({lane.unit, PIKORT_OUT_OF_MEMORY,
                         stage < 0 ? lane.stage : stage, bytes, 0,
                         depthOf(lane)});
}

void piko::rt::badCall(const Lane &lane, BadCall which) {
  lane.pipeline->report({lane.unit, PIKORT_BAD_PROGRAM, lane.stage,
                         static_cast<int64_t>(which), 0, depthOf(lane)});
}

/// Ends the segment at `cursor`.
static void endSegment(Lane *lane, Log &log, uint8_t *cursor) {
  if (!log.failed && cursor != log.start)
    log.segments.push_back({lane->unit, log.start, cursor - log.start});
  log.start = cursor;
}

/// Replaces the log's block by one with room for `need` bytes, into which the
/// last `keep` bytes before `cursor` move. False if memory is refused.
static bool grow(Lane *lane, Log &log, uint8_t *&cursor, uint8_t *&end,
                 int64_t keep, int64_t need) {
  if (log.failed)
    return false;
  int64_t bytes = std::max(need + 2 * keep, smallestBlock);
  try {
    if (!log.blocks.empty())
      bytes = std::max(
          bytes, std::min(2 * log.blocks.back().capacity(), largestBlock));
    log.blocks.reserve(log.blocks.size() + 1);
    Array<uint8_t> block(lane->pipeline->memory, bytes);
    endSegment(lane, log, cursor - keep);
    if (keep)
      std::memcpy(block.data(), cursor - keep, static_cast<size_t>(keep));
    log.start = block.data();
    cursor = block.data() + keep;
    end = block.data() + block.capacity();
    log.blocks.push_back(std::move(block));
    return true;
  } catch (const OutOfMemory &refused) {
    outOfMemory(*lane, refused.bytes);
  } catch (...) {
    outOfMemory(*lane, bytes);
  }
  log.failed = true;
  return false;
}

// --- Records ----------------------------------------------------------------

/// Makes room for so many more records.
[[gnu::noinline]] static void growRecords(Lane *lane, int32_t port,
                                          int64_t count) {
  pikoir_port &out = lane->ports[port];
  PortLogs &logs = lane->logs[port];
  uint8_t *end = nullptr;
  bool room = logs.local ? growLocal(*lane, port, count)
                         : grow(lane, logs.records, out.cursor, end, 0,
                                (count + 1) * out.size);
  if (!room)
    out.cursor = out.limit = logs.scratchRecord;
  if (!room || logs.local)
    return;
  // A record lies at a multiple of its size, so that a number says where.
  auto over = static_cast<int64_t>(reinterpret_cast<uintptr_t>(out.cursor) %
                                   static_cast<uintptr_t>(out.size));
  if (over > 0)
    logs.records.start = out.cursor += out.size - over;
  out.limit = end - out.size;
  if (logs.padded)
    std::memset(out.cursor, 0, static_cast<size_t>(end - out.cursor));
}

/// Notes the ordinal of the latest record.
static void noteOrdinal(Lane *lane, int32_t port) {
  pikoir_port &out = lane->ports[port];
  Log &log = lane->logs[port].ordinals;
  if (out.ordinal_cursor == out.ordinal_end) {
    auto *cursor = reinterpret_cast<uint8_t *>(out.ordinal_cursor);
    auto *end = cursor;
    if (!grow(lane, log, cursor, end, 0, 4))
      return;
    out.ordinal_cursor = reinterpret_cast<uint32_t *>(cursor);
    out.ordinal_end = out.ordinal_cursor + (end - cursor) / 4;
  }
  *out.ordinal_cursor++ = out.ordinal;
}

uint8_t *pikoir_append(pikoir_writer *writer, int32_t port) {
  pikoir_port &out = writer->ports[port];
  if (out.flags & PIKOIR_PORT_DEFERRED) [[unlikely]]
    return reorderAppend(*laneOf(writer), port);
  if (out.cursor > out.limit) [[unlikely]]
    growRecords(laneOf(writer), port, 1);
  uint8_t *record = out.cursor;
  ++out.emitted;
  if (out.flags & PIKOIR_PORT_ORDINALS)
    out.ordinal = writer->ordinal++;
  if (out.buckets != 0) { // kept by its first place
    out.last_bucket = -1;
    return record;
  }
  out.cursor = record + out.size;
  if (out.flags & PIKOIR_PORT_ORDINALS)
    noteOrdinal(laneOf(writer), port);
  return record;
}

void pikoir_reserve(pikoir_writer *writer, int32_t port, int64_t count) {
  const pikoir_port &out = writer->ports[port];
  if (out.cursor > out.limit || out.limit - out.cursor < (count - 1) * out.size)
    growRecords(laneOf(writer), port, count);
}

// --- Buckets
// ------------------------------------------------------------------

/// Makes room for one more bucket; a record's buckets stay together.
static bool growBuckets(Lane *lane, int32_t port) {
  pikoir_port &out = lane->ports[port];
  Log &log = lane->logs[port].buckets;
  auto *cursor = reinterpret_cast<uint8_t *>(out.bucket_cursor);
  uint8_t *end = nullptr;
  int64_t keep = out.last_bucket >= 0 ? (out.bucket_cursor - out.run) * 4 : 0;
  if (!grow(lane, log, cursor, end, keep, 4)) {
    out.bucket_cursor = out.bucket_end = out.run = nullptr;
    return false;
  }
  out.bucket_cursor = reinterpret_cast<uint32_t *>(cursor);
  out.bucket_end = reinterpret_cast<uint32_t *>(end);
  out.run = out.bucket_cursor - keep / 4;
  return true;
}

/// A bucket that is not above the record's buckets so far: into its place.
static void insertBucket(pikoir_port &out, uint32_t bucket) {
  *out.run &= ~PIKOIR_FIRST_BUCKET;
  uint32_t *at = std::lower_bound(out.run, out.bucket_cursor, bucket);
  if (*at != bucket) {
    std::memmove(at + 1, at,
                 static_cast<size_t>(out.bucket_cursor - at) * sizeof(bucket));
    *at = bucket;
    ++out.bucket_cursor;
  }
  *out.run |= PIKOIR_FIRST_BUCKET;
}

[[gnu::noinline]] static void badPlace(Lane *lane, int32_t port,
                                       int64_t bucket) {
  pikoir_port &out = lane->ports[port];
  if (out.last_bucket == noRecord)
    return badCall(*lane, BadCall::PlaceFirst);
  const Stage &to = lane->pipeline->stages[lane->logs[port].consumer];
  int64_t bin = bucket / to.tiles - (bucket % to.tiles < 0);
  lane->pipeline->report(
      {lane->unit,
       bin == PIKOIR_NAN_BOX ? PIKORT_NOT_A_NUMBER : PIKORT_BIN_OUTSIDE,
       lane->logs[port].consumer, bin, to.buckets / to.tiles, depthOf(*lane)});
}

void pikoir_place(pikoir_writer *writer, int32_t port, int64_t bucket) {
  pikoir_port &out = writer->ports[port];
  if (out.flags & PIKOIR_PORT_DEFERRED) [[unlikely]]
    return reorderPlace(*laneOf(writer), port, bucket);
  if (static_cast<uint64_t>(bucket) >= static_cast<uint64_t>(out.buckets) ||
      out.last_bucket == noRecord) [[unlikely]]
    return badPlace(laneOf(writer), port, bucket);
  if (bucket == out.last_bucket)
    return;
  if (out.flags & PIKOIR_PORT_LOCAL) { // the only bucket is known
    if (out.last_bucket < 0)
      out.cursor += out.size;
    out.last_bucket = bucket;
    return;
  }
  if (out.bucket_cursor == out.bucket_end) [[unlikely]]
    if (!growBuckets(laneOf(writer), port)) {
      if (out.last_bucket < 0 && out.cursor <= out.limit)
        out.cursor += out.size;
      out.last_bucket = bucket;
      return;
    }
  auto entry = static_cast<uint32_t>(bucket);
  if (out.last_bucket < 0) {
    entry |= PIKOIR_FIRST_BUCKET;
    out.cursor += out.size;
    out.run = out.bucket_cursor;
    ++out.kept;
    if (out.flags & PIKOIR_PORT_ORDINALS)
      noteOrdinal(laneOf(writer), port);
  } else if (bucket < out.last_bucket) [[unlikely]] {
    insertBucket(out, entry);
    return; // last_bucket stays the highest
  }
  *out.bucket_cursor++ = entry;
  out.last_bucket = bucket;
}

void pikoir_place_source(pikoir_writer *writer, int64_t bucket) {
  pikoir_place(writer, 0, bucket);
}

// --- Positions and units ----------------------------------------------------

void pikoir_next(pikoir_writer *writer) {
  if (writer->flags == 0)
    return;
  if (writer->flags & PIKOIR_PORT_DEFERRED) [[unlikely]] {
    badCall(*laneOf(writer), BadCall::StillReordering);
    pikoir_reorder_end(writer);
  }
  if (writer->flags & PIKOIR_PORT_SERIAL) {
    Lane &lane = *laneOf(writer);
    if (lane.slotEnd == lane.slotLimit) [[unlikely]]
      return badCall(lane, BadCall::Next);
    *lane.slotEnd++ = lane.ordinal;
    return;
  }
  writer->ordinal = 0;
  for (int32_t i = 0; i < writer->port_count; ++i) {
    pikoir_port &out = writer->ports[i];
    if (out.flags & PIKOIR_PORT_COUNTS) {
      int64_t now = out.buckets ? out.kept : out.emitted;
      if (out.counts == laneOf(writer)->logs[i].countsEnd) [[unlikely]]
        return badCall(*laneOf(writer), BadCall::Next);
      *out.counts++ = static_cast<uint32_t>(now - out.mark);
      out.mark = now;
    }
    if (out.flags & PIKOIR_PORT_SOURCE) {
      if (out.last_bucket < 0 && (out.bucket_cursor != out.bucket_end ||
                                  growBuckets(laneOf(writer), i)))
        *out.bucket_cursor++ = noBucket;
      out.last_bucket = -1;
    }
  }
}

/// The lane that this thread had before, if it is free: what it wrote to is in
/// the thread's cache.
static Lane *takeLane(Kernel &kernel) {
  auto thread = static_cast<size_t>(pikoir_thread());
  for (size_t i = 0; i < kernel.activeLanes; ++i) {
    Lane &lane = *kernel.lanes[(thread + i) % kernel.activeLanes];
    if (!lane.taken.test_and_set(std::memory_order_acquire))
      return &lane;
  }
  return nullptr;
}

static pikoir_writer *openUnit(Kernel &kernel, int64_t unit) {
  if (kernel.runsSerially)
    return kernel.serial->open(unit);
  // There is a lane for each thread: waiting happens only if a program opens
  // units from more threads than the pipeline has.
  Lane *lane = takeLane(kernel);
  while (!lane) {
    std::this_thread::yield();
    lane = takeLane(kernel);
  }
  lane->unit = unit;
  if (kernel.tuner)
    lane->mappings = kernel.tuner->begin(unit, lane->tuning);
  lane->opened = ticks();
  lane->ordinal = 0;
  for (int32_t i = 0; i < lane->port_count; ++i) {
    pikoir_port &out = lane->ports[i];
    out.emitted = out.kept = out.mark = 0;
    out.last_bucket = out.flags & PIKOIR_PORT_SOURCE ? -1 : noRecord;
    if (out.flags & PIKOIR_PORT_COUNTS) {
      uint32_t *counts = kernel.counts[i].data();
      out.counts = counts + kernel.slotBegin(unit);
      lane->logs[i].countsEnd = counts + kernel.slotBegin(unit + 1);
    }
  }
  return lane;
}

pikoir_writer *pikoir_open(pikort_pipeline *p, int32_t stage, int64_t unit) {
  return openUnit(kernelOf(*p, stage), unit);
}

pikoir_writer *pikoir_open_source(pikort_pipeline *p, int32_t source,
                                  int64_t unit) {
  return openUnit(*cpuOf(*p).sourceKernels[source], unit);
}

/// Tells the host which bins a thread has run.
[[gnu::cold, gnu::noinline]] static void reportUnit(const Lane &lane,
                                                    int64_t closed) {
  const pikort_pipeline &p = *lane.pipeline;
  const Kernel &kernel = *lane.kernel;
  const Stage &stage = p.stages[kernel.stage];
  const pikoir_unit &unit = kernel.units[static_cast<size_t>(lane.unit)];
  auto time = [&](int64_t at) {
    return static_cast<double>(at - p.profile.runStart()) /
           p.ticksPerMillisecond;
  };
  pikort_unit_run run{p.kernelStats[kernel.statsIndex].name.c_str(),
                      unit.bucket_begin,
                      unit.bucket_end,
                      unit.end - unit.begin,
                      static_cast<int32_t>(pikoir_thread()),
                      time(lane.opened),
                      time(closed)};
  if (kernel.calls) {
    run.bin_begin = kernel.calls[unit.bucket_begin].bin;
    run.bin_end = kernel.calls[unit.bucket_end - 1].bin + 1;
  } else if (kernel.source < 0) {
    run.bin_begin /= stage.tiles;
    run.bin_end = (run.bin_end + stage.tiles - 1) / stage.tiles;
  }
  p.unitReport(p.unitReportData, &run);
}

void pikoir_close(pikoir_writer *writer) {
  Lane *lane = laneOf(writer);
  if (lane->flags & PIKOIR_PORT_DEFERRED) [[unlikely]] {
    badCall(*lane, BadCall::StillReordering);
    pikoir_reorder_end(writer);
  }
  pikoir_scratch_release(writer, 0);
  if (lane->flags & PIKOIR_PORT_SERIAL) {
    lane->slotEnd = std::fill_n(lane->slotEnd, lane->slotLimit - lane->slotEnd,
                                lane->ordinal);
    return;
  }
  try {
    for (int32_t i = 0; i < lane->port_count; ++i) {
      pikoir_port &out = lane->ports[i];
      PortLogs &logs = lane->logs[i];
      lane->emitted += out.emitted;
      if (logs.local)
        continue;
      if (out.flags & PIKOIR_PORT_COUNTS)
        std::fill(out.counts, logs.countsEnd, 0u);
      endSegment(lane, logs.records, out.cursor);
      endSegment(lane, logs.buckets,
                 reinterpret_cast<uint8_t *>(out.bucket_cursor));
      endSegment(lane, logs.ordinals,
                 reinterpret_cast<uint8_t *>(out.ordinal_cursor));
    }
  } catch (...) { // no memory for the list of segments
    outOfMemory(*lane, sizeof(Segment));
  }
  int64_t closed = ticks();
  lane->busy += closed - lane->opened;
  if (Kernel &kernel = *lane->kernel; kernel.tuner)
    kernel.tuner->end(kernel.units[static_cast<size_t>(lane->unit)],
                      lane->tuning, closed - lane->opened);
  if (lane->pipeline->unitReport) [[unlikely]]
    reportUnit(*lane, closed);
  lane->taken.clear(std::memory_order_release);
}

// --- Lanes ------------------------------------------------------------------

static std::unique_ptr<Lane> makeLane(pikort_pipeline &p, Kernel &kernel) {
  auto lane = std::make_unique<Lane>();
  bool ofSource = kernel.source >= 0;
  size_t ports = ofSource ? 1 : p.stages[kernel.stage].outputs.size();
  lane->pipeline = &p;
  lane->kernel = &kernel;
  lane->stage = kernel.stage;
  lane->portStorage.resize(ports);
  lane->logs.resize(ports);
  lane->ports = lane->portStorage.data();
  lane->port_count = static_cast<int32_t>(ports);
  return lane;
}

/// Whether what a port emits must be numbered, over all ports: for keys, and in
/// a loop, where the records of different ports may be of one position.
static bool needsOrdinals(const pikort_pipeline &p, const Kernel &kernel,
                          size_t port) {
  if (kernel.source >= 0)
    return false;
  const Stage &stage = p.stages[kernel.stage];
  if (stage.loop < 0)
    return stage.outputs[port] >= 0 && p.edges[stage.outputs[port]].keyed();
  return std::count_if(stage.outputs.begin(), stage.outputs.end(),
                       [](int32_t e) { return e >= 0; }) > 1;
}

/// Sets up a port for this run.
static void preparePort(pikort_pipeline &p, const Kernel &kernel, Lane &lane,
                        size_t port, bool numbered) {
  PortLogs &logs = lane.logs[port];
  pikoir_port &out = lane.portStorage[port];
  logs.clear();
  out = {};
  logs.consumer = kernel.stage;
  if (kernel.source >= 0) {
    out.flags = PIKOIR_PORT_SOURCE;
  } else {
    int32_t e = p.stages[kernel.stage].outputs[port];
    logs.consumer = e < 0 ? kernel.stage : p.edges[e].consumer;
    if (e >= 0 && numbered)
      out.flags |= PIKOIR_PORT_ORDINALS;
    if (kernel.counts[port])
      out.flags |= PIKOIR_PORT_COUNTS;
    logs.local.reset();
    if (e >= 0 && p.edges[e].local) {
      out.flags |= PIKOIR_PORT_LOCAL;
      logs.local = std::make_unique<LocalBin>();
    }
  }
  const Stage &to = p.stages[logs.consumer];
  const Record &record = p.records[to.record];
  if (kernel.source < 0)
    out.size = record.size;
  out.buckets = to.placed() ? to.buckets : 0;
  logs.padded = record.padded;
  logs.scratch.resize(
      static_cast<size_t>(PIKOIR_MOST_RESERVED * record.size + record.align));
  auto address = reinterpret_cast<uintptr_t>(logs.scratch.data());
  auto align = static_cast<uintptr_t>(record.align);
  logs.scratchRecord = logs.scratch.data() + (align - address % align) % align;
  // No block yet and no room: the first record makes one.
  out.limit = logs.scratchRecord;
  out.cursor = logs.records.start = out.limit + 1;
}

Lane &piko::rt::prepareSerialLane(pikort_pipeline &p, Kernel &kernel) {
  if (kernel.lanes.empty())
    kernel.lanes.push_back(makeLane(p, kernel));
  Lane &lane = *kernel.lanes.front();
  kernel.counts.clear();
  kernel.counts.resize(lane.logs.size()); // none are needed
  lane.flags = PIKOIR_PORT_SERIAL;
  for (size_t port = 0; port < lane.logs.size(); ++port) {
    bool inLoop = p.stages[kernel.stage].loop >= 0;
    preparePort(p, kernel, lane, port,
                inLoop || needsOrdinals(p, kernel, port));
    lane.flags |= lane.ports[port].flags;
  }
  return lane;
}

void piko::rt::prepareLanes(pikort_pipeline &p, Kernel &kernel) {
  kernel.activeLanes =
      std::min(static_cast<size_t>(p.threads), kernel.units.size());
  while (kernel.lanes.size() < kernel.activeLanes)
    kernel.lanes.push_back(makeLane(p, kernel));
  for (size_t i = 0; i < kernel.activeLanes; ++i) {
    auto &lane = kernel.lanes[i];
    lane->taken.clear();
    lane->flags = 0;
    for (size_t port = 0; port < lane->logs.size(); ++port) {
      preparePort(p, kernel, *lane, port, needsOrdinals(p, kernel, port));
      // pikoir_next has nothing to do for local edges.
      lane->flags |= lane->ports[port].flags & ~PIKOIR_PORT_LOCAL;
    }
  }
}
