// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Serial.cpp - Launches that are too small for threads ---------------===//

#include "cpu/Serial.h"

#include <algorithm>

using namespace piko::rt;

/// Who runs all units.
static constexpr int64_t thread = 0;

// --- Few pairs in many buckets
// ------------------------------------------------

void PairOrder::read(const Items &input) {
  entries_.clear();
  items_.clear();
  sorted_ = true;
  uint32_t item = UINT32_MAX;
  uint64_t last = 0;
  bool several = !input.onePairEach();
  for (int64_t k = 0; k < input.pairCount; ++k) {
    uint32_t pair = input.pairs[k];
    if (several) {
      item += pair >> 31;
      items_.push_back(item);
    }
    if (pair == noBucket)
      continue;
    uint64_t entry =
        uint64_t(pair & ~PIKOIR_FIRST_BUCKET) << 32 | static_cast<uint32_t>(k);
    sorted_ &= entry > last || entries_.empty();
    last = entry;
    entries_.push_back(entry);
  }
}

void PairOrder::sort() {
  if (!sorted_)
    std::sort(entries_.begin(), entries_.end());
}

bool piko::rt::isSorted(const Items &input) {
  uint32_t last = 0;
  for (int64_t k = 0; k < input.pairCount; ++k) {
    uint32_t pair = input.pairs[k];
    uint32_t bucket = pair == noBucket ? last : pair & ~PIKOIR_FIRST_BUCKET;
    if (bucket < last)
      return false;
    last = bucket;
  }
  return true;
}

void piko::rt::cutRuns(const std::vector<uint64_t> &entries, int64_t *offsets,
                       std::vector<pikoir_unit> &runs) {
  // To pass by a bucket takes less than to open another unit.
  constexpr int64_t near = 16;
  auto count = static_cast<int64_t>(entries.size());
  for (int64_t i = 0; i < count; ++i) {
    int64_t bucket = PairOrder::bucketOf(entries[static_cast<size_t>(i)]);
    int64_t end = runs.empty() ? -near : runs.back().bucket_end;
    if (bucket >= end + near)
      runs.push_back({bucket, bucket, i, i, thread});
    pikoir_unit &run = runs.back();
    for (; run.bucket_end <= bucket; ++run.bucket_end)
      offsets[run.bucket_end] = i;
    offsets[run.bucket_end] = run.end = i + 1;
  }
}

// --- The launch -------------------------------------------------------------

Serial::Serial(pikort_pipeline &p, Kernel &kernel)
    : p_(p), kernel_(kernel), stage_(p.stages[kernel.stage]),
      lane_(prepareSerialLane(p, kernel)),
      offsets_(p.memory, stage_.buckets + 1), ports_(stage_.outputs.size()),
      pieces_(stage_.outputs.size()) {}

bool Serial::takes(const pikort_pipeline &p, Kernel &kernel, int64_t count) {
  constexpr double worthThreads = 0.2; // milliseconds
  if (count > most)
    return false;
  if (count <= fewest || p.threads == 1 ||
      kernel.positionTicks * static_cast<double>(count) <=
          worthThreads * p.ticksPerMillisecond)
    return true;
  // It may have become less: try again some day.
  kernel.positionTicks *= 31.0 / 32;
  return false;
}

void Serial::noteTicks(int64_t ticks) {
  double now =
      static_cast<double>(ticks) / static_cast<double>(kernel_.positions);
  double &mean = kernel_.positionTicks;
  // An interrupt is not the kernel's time.
  mean = mean == 0 ? now : mean + (std::min(now, 4 * mean) - mean) / 8;
}

void Serial::begin(const Items &input) {
  for (size_t port = 0; port < ports_.size(); ++port)
    if (lane_.portStorage[port].emitted > 0)
      rewind(port);
  kernel_.units.clear();
  order_.clear();
  calls_.clear();
  if (stage_.placed()) {
    binPairs(input);
  } else {
    kernel_.positions = input.count;
    offsets_[0] = 0;
    offsets_[1] = input.count;
    if (input.count > 0)
      kernel_.units.push_back({0, 1, 0, input.count, thread});
  }
  if (stage_.takesList())
    makeCalls();
  if (auto needed = static_cast<size_t>(slots()); needed > slotEnds_.size())
    slotEnds_.resize(needed);
  lane_.slotEnd = slotEnds_.data();
  lane_.ordinal = 0;
  places_.clear();
  for (int64_t i = 0; i < kernel_.positions && input.index; ++i)
    places_.push_back(input.index[itemAt(i)]);
  const std::vector<uint32_t> &order = places_.empty() ? order_ : places_;
  kernel_.input = {input.items,
                   kernel_.positions,
                   order.empty() ? nullptr : order.data(),
                   offsets_.data(),
                   kernel_.units.data(),
                   static_cast<int64_t>(kernel_.units.size()),
                   stage_.tiles,
                   stage_.takesList() ? calls_.data() : nullptr,
                   static_cast<int64_t>(calls_.size()),
                   /*clears=*/0,
                   /*cursors=*/nullptr,
                   /*homes=*/0};
  cpuOf(p_).showSerial(kernel_, input);
}

void Serial::binPairs(const Items &input) {
  if (input.pairCount == 1 && *input.pairs != noBucket)
    return binPair(*input.pairs & ~PIKOIR_FIRST_BUCKET);
  pairs_.read(input);
  const std::vector<uint64_t> &entries = pairs_.entries();
  auto count = static_cast<int64_t>(entries.size());
  kernel_.positions = count;
  if (pairs_.isSorted() || stage_.buckets > 8 * count) {
    pairs_.sort();
    bool identity =
        pairs_.isSorted() && input.onePairEach() && count == input.count;
    for (size_t i = 0; i < entries.size() && !identity; ++i)
      order_.push_back(pairs_.itemOf(PairOrder::pairOf(entries[i])));
    cutRuns(entries, offsets_.data(), kernel_.units);
    return;
  }
  countPairs();
  kernel_.units.push_back({0, stage_.buckets, 0, count, thread});
}

/// The order of many pairs in few buckets.
void Serial::countPairs() {
  int64_t *next = offsets_.data() + 1; // of each bucket, in the end its end
  std::fill_n(offsets_.data(), stage_.buckets + 1, 0);
  for (uint64_t entry : pairs_.entries())
    ++next[PairOrder::bucketOf(entry)];
  int64_t sum = 0;
  for (int64_t bucket = 0; bucket < stage_.buckets; ++bucket)
    sum += std::exchange(next[bucket], sum);
  order_.resize(pairs_.entries().size());
  for (uint64_t entry : pairs_.entries())
    order_[static_cast<size_t>(next[PairOrder::bucketOf(entry)]++)] =
        pairs_.itemOf(PairOrder::pairOf(entry));
}

/// The same for a single pair.
void Serial::binPair(int64_t bucket) {
  kernel_.positions = 1;
  offsets_[bucket] = 0;
  offsets_[bucket + 1] = 1;
  kernel_.units.push_back({bucket, bucket + 1, 0, 1, thread});
}

/// One unit of all calls takes the place of runs of buckets.
void Serial::makeCalls() {
  for (const pikoir_unit &run : kernel_.units)
    for (int64_t bucket = run.bucket_begin; bucket < run.bucket_end; ++bucket) {
      int64_t batch = stage_.scheduleOf(bucket).batch;
      int64_t end = offsets_[bucket + 1];
      for (int64_t i = offsets_[bucket]; i < end;) {
        int64_t next = batch > 0 ? std::min(i + batch, end) : end;
        calls_.push_back({bucket, i, next});
        i = next;
      }
    }
  kernel_.units.clear();
  if (!calls_.empty())
    kernel_.units.push_back(
        {0, static_cast<int64_t>(calls_.size()), 0, kernel_.positions, thread});
}

int64_t Serial::slots() const {
  return stage_.takesList() ? static_cast<int64_t>(calls_.size())
                            : kernel_.positions;
}

pikoir_writer *Serial::open(int64_t unit) {
  const pikoir_unit &opened = kernel_.units[static_cast<size_t>(unit)];
  lane_.unit = unit;
  if (kernel_.tuner)
    lane_.mappings = kernel_.tuner->getCurrent();
  lane_.slotLimit =
      slotEnds_.data() + (stage_.takesList() ? opened.bucket_end : opened.end);
  for (pikoir_port &port : lane_.portStorage)
    port.last_bucket = INT64_MAX;
  return &lane_;
}

// --- What it emitted --------------------------------------------------------

static bool isInOnePiece(const PortLogs &logs) {
  return logs.records.segments.empty() && logs.buckets.segments.empty() &&
         logs.ordinals.segments.empty();
}

/// The latest block of a log, which is the largest, serves again.
static void dropPieces(Log &log) {
  if (log.blocks.size() > 1)
    log.blocks.erase(log.blocks.begin(), log.blocks.end() - 1);
  log.segments.clear();
}

void Serial::rewind(size_t port) {
  PortLogs &logs = lane_.logs[port];
  pikoir_port &out = lane_.portStorage[port];
  if (!isInOnePiece(logs)) [[unlikely]]
    for (Log *log : {&logs.records, &logs.buckets, &logs.ordinals})
      dropPieces(*log);
  out.cursor = logs.records.start;
  out.bucket_cursor = reinterpret_cast<uint32_t *>(logs.buckets.start);
  out.ordinal_cursor = reinterpret_cast<uint32_t *>(logs.ordinals.start);
  out.emitted = out.kept = 0;
}

/// What a log holds up to its cursor, in one piece.
static const uint8_t *join(Memory &memory, const Log &log, const void *cursor,
                           Growing<uint8_t> &piece) {
  piece.shrink(0);
  for (const Segment &segment : log.segments)
    piece.append(memory, segment.data, segment.bytes);
  piece.append(memory, log.start,
               static_cast<const uint8_t *>(cursor) - log.start);
  return piece.data();
}

void Serial::collect(size_t port) {
  const PortLogs &logs = lane_.logs[port];
  const pikoir_port &out = lane_.portStorage[port];
  Emitted &emitted = ports_[port];
  emitted.count = out.buckets != 0 ? out.kept : out.emitted;
  const uint8_t *pairs = logs.buckets.start, *numbers = logs.ordinals.start;
  emitted.items = logs.records.start;
  emitted.pairCount =
      out.bucket_cursor - reinterpret_cast<const uint32_t *>(pairs);
  if (!isInOnePiece(logs)) [[unlikely]] {
    Pieces &pieces = pieces_[port];
    emitted.items = join(p_.memory, logs.records, out.cursor, pieces.records);
    pairs = join(p_.memory, logs.buckets, out.bucket_cursor, pieces.buckets);
    emitted.pairCount = pieces.buckets.size() / 4;
    numbers =
        join(p_.memory, logs.ordinals, out.ordinal_cursor, pieces.ordinals);
  }
  emitted.pairs = reinterpret_cast<const uint32_t *>(pairs);
  emitted.numbers = reinterpret_cast<const uint32_t *>(numbers);
}

void Serial::end() {
  StageStats &stats = p_.stageStats[kernel_.stage];
  for (size_t port = 0; port < ports_.size(); ++port) {
    int64_t emitted = lane_.portStorage[port].emitted;
    stats.out += emitted;
    if (emitted > 0 && stage_.outputs[port] >= 0)
      collect(port);
    else
      ports_[port].count = 0;
  }
}
