// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Join.cpp - Puts what producers emitted into lineage order ----------===//
//
// For each input edge, one of two ways:
//
//   concatenate   The producer's units ran its items in emission order: the
//                 units' segments follow each other.
//   by position   A slot's records go to the place that its position's rank
//                 gives: scan the counts in rank order, then walk the slots.
//                 The same walk writes lineage keys where they are needed.
//
// Records stay where they were written, and an index says where each lies: the
// number of records from the first one in memory, for all begin at multiples of
// their size (Writer.cpp). Only small ones are copied, and those that lie too
// far from each other for an index.
//
// Several edges and sources are merged by key (Merge.cpp).
//
//===----------------------------------------------------------------------===//

#include "cpu/Parallel.h"
#include "cpu/loops/Cycle.h"
#include "cpu/loops/Strips.h"
#include "ranks/Ranks.h"

#include <algorithm>
#include <cstring>
#include <utility>

using namespace piko::rt;

namespace {

/// A port's segments of one kind, in unit order.
struct Segments {
  std::vector<Segment> list;
  int64_t bytes = 0;
};

/// Walks the segments of a log, from the first of a unit's.
const Segment *firstOf(const Segments &all, int64_t unit) {
  return std::lower_bound(
      all.list.data(), all.list.data() + all.list.size(), unit,
      [](const Segment &s, int64_t u) { return s.unit < u; });
}

/// Where records lie that stay there.
struct Region {
  const uint8_t *base = nullptr; ///< Null: they must be copied.
  int64_t extent = 0;            ///< In records.

  Region(const Segments &records, int64_t size) {
    constexpr int64_t small = 16; // as good as an index
    if (size <= small || records.list.empty())
      return;
    const uint8_t *first = records.list[0].data, *end = first;
    for (const Segment &segment : records.list) {
      first = std::min(first, segment.data);
      end = std::max(end, segment.data + segment.bytes);
    }
    extent = (end - first) / size;
    base = extent <= UINT32_MAX ? first : nullptr;
  }
};

/// Reads where a unit's records lie, across its segments.
class IndexReader {
public:
  IndexReader(const Segments &all, int64_t unit, const Region &region,
              int64_t size)
      : next_(firstOf(all, unit)), base_(region.base), size_(size) {}

  void read(uint32_t *to, int64_t count) {
    while (count > 0) {
      if (left_ == 0) {
        place_ = (next_->data - base_) / size_;
        left_ = next_->bytes / size_;
        ++next_;
      }
      int64_t now = std::min(count, left_);
      for (int64_t i = 0; i < now; ++i)
        to[i] = static_cast<uint32_t>(place_ + i);
      to += now;
      place_ += now;
      left_ -= now;
      count -= now;
    }
  }

private:
  const Segment *next_;
  const uint8_t *base_;
  int64_t size_, place_ = 0, left_ = 0;
};

/// Reads a unit's bytes across its segments.
class Reader {
public:
  Reader(const Segments &all, int64_t unit) : next_(firstOf(all, unit)) {}

  void read(uint8_t *to, int64_t bytes) {
    while (bytes > 0) {
      if (left_ == 0) {
        data_ = next_->data;
        left_ = next_->bytes;
        ++next_;
      }
      int64_t now = std::min(bytes, left_);
      std::memcpy(to, data_, static_cast<size_t>(now));
      to += now;
      data_ += now;
      left_ -= now;
      bytes -= now;
    }
  }
  /// The next entry of a log of uint32.
  uint32_t read() {
    uint32_t entry;
    read(reinterpret_cast<uint8_t *>(&entry), 4);
    return entry;
  }

private:
  const Segment *next_;
  const uint8_t *data_ = nullptr;
  int64_t left_ = 0;
};

} // namespace

static Segments collect(Kernel &kernel, size_t port, Log PortLogs::*which) {
  // A unit's segments are all of one lane, and in order there.
  std::vector<size_t> at;
  for (auto &lane : kernel.lanes)
    for (const Segment &segment : (lane->logs[port].*which).segments) {
      auto unit = static_cast<size_t>(segment.unit);
      at.resize(std::max(at.size(), unit + 1));
      ++at[unit];
    }
  size_t count = 0;
  for (size_t &next : at)
    count += std::exchange(next, count);
  Segments result;
  result.list.resize(count);
  for (auto &lane : kernel.lanes)
    for (const Segment &segment : (lane->logs[port].*which).segments) {
      result.list[at[static_cast<size_t>(segment.unit)]++] = segment;
      result.bytes += segment.bytes;
    }
  return result;
}

/// Calls body(from, bytes, at) for pieces of segments, which lie `at` bytes
/// after the first in their order.
static void forPieces(int32_t threads, const Segments &from, int64_t unit,
                      auto &&body) {
  std::vector<int64_t> at(from.list.size());
  int64_t bytes = 0;
  for (size_t i = 0; i < at.size(); ++i) {
    at[i] = bytes;
    bytes += from.list[i].bytes;
  }
  // Small segments travel together.
  int64_t chunk = (int64_t(256) << 10) / unit * unit;
  parallelChunks(threads, bytes, chunk, [&](int64_t begin, int64_t end) {
    auto i = static_cast<size_t>(std::upper_bound(at.begin(), at.end(), begin) -
                                 at.begin() - 1);
    while (begin < end) {
      int64_t skip = begin - at[i];
      int64_t now = std::min(end - begin, from.list[i].bytes - skip);
      body(from.list[i].data + skip, now, begin);
      begin += now;
      ++i;
    }
  });
}

static void concatenate(int32_t threads, const Segments &from, uint8_t *to) {
  forPieces(threads, from, 1,
            [&](const uint8_t *data, int64_t bytes, int64_t at) {
              std::memcpy(to + at, data, static_cast<size_t>(bytes));
            });
}

void piko::rt::failCount(const Stage &stage, int64_t count) {
  throw Failure{PIKORT_TOO_MANY,
                "stage " + quoted(stage.name) +
                    ": expected at most 4294967295 primitives, but got " +
                    std::to_string(count)};
}

Array<uint32_t> piko::rt::pairStarts(Memory &memory, const Items &items) {
  Array<uint32_t> starts(memory, items.count + 1);
  int64_t item = 0;
  for (int64_t k = 0; k < items.pairCount; ++k)
    if (items.pairs[k] & PIKOIR_FIRST_BUCKET)
      starts[item++] = static_cast<uint32_t>(k);
  // Of a stream without any pair, all begin and end at 0.
  std::fill(starts.data() + item, starts.data() + items.count + 1,
            static_cast<uint32_t>(items.pairCount));
  return starts;
}

/// True if the edge must be gathered position by position. The waves of a loop
/// take what comes as it comes.
static bool byPosition(const pikort_pipeline &p, const Edge &edge) {
  return p.stages[edge.producer].loop < 0 &&
         (edge.keyed() ||
          (edge.gather == PIKOIR_PERMUTE && kernelOf(p, edge.producer).rank));
}

bool piko::rt::needsCounts(const pikort_pipeline &p, const Edge &edge) {
  return p.stages[edge.producer].loop >= 0 || byPosition(p, edge);
}

/// What is used where it lies: the stream takes its blocks.
static void keepBlocks(Kernel &kernel, size_t port, Log PortLogs::*which,
                       Stream &stream) {
  for (auto &lane : kernel.lanes)
    for (auto &block : (lane->logs[port].*which).blocks)
      stream.blocks.push_back(std::move(block));
}

// --- By position ------------------------------------------------------------

namespace {

/// Gathers one edge position by position.
class PositionGather {
public:
  PositionGather(pikort_pipeline &p, const Edge &edge, Stream &stream)
      : p_(p), from_(p.stages[edge.producer]),
        kernel_(kernelOf(p, edge.producer)),
        port_(static_cast<size_t>(edge.port)), edge_(edge), stream_(stream),
        size_(p.records[p.stages[edge.consumer].record].size),
        records_(collect(kernel_, port_, &PortLogs::records)),
        region_(records_, size_),
        buckets_(collect(kernel_, port_, &PortLogs::buckets)),
        ordinals_(collect(kernel_, port_, &PortLogs::ordinals)) {}

  void run() {
    makeRoom();
    if (edge_.keyed()) {
      isShared_ = from_.collects() && from_.partition != PIKOIR_FIRST_RANK;
      if (isShared_ && !kernel_.slotNames)
        nameSlots(p_, from_, kernel_);
      stream_.keys.width =
          from_.collects() ? 2 + isShared_ : kernel_.keys.width + 1;
      stream_.keys.words =
          Array<uint64_t>(p_.memory, stream_.count * stream_.keys.width);
    }
    bool placed = p_.stages[edge_.consumer].placed();
    if (placed) {
      stream_.pairStorage = Array<uint32_t>(p_.memory, stream_.pairCount);
      stream_.pairs = stream_.pairStorage.data();
    }
    starts_ = startsByRank(kernel_.counts[port_]);
    if (placed && !stream_.onePairEach())
      pairStarts_ = startsByRank(countPairs());
    forUnits([&](int64_t begin, int64_t end) { gatherUnits(begin, end); });
    if (region_.base)
      keepBlocks(kernel_, port_, &PortLogs::records, stream_);
  }

private:
  void makeRoom() {
    if (region_.base) {
      stream_.indexStorage = Array<uint32_t>(p_.memory, stream_.count);
      stream_.index = stream_.indexStorage.data();
      stream_.items = region_.base;
      stream_.extent = region_.extent;
    } else {
      stream_.itemStorage = Array<uint8_t>(p_.memory, stream_.count * size_);
      stream_.items = stream_.itemStorage.data();
    }
  }

  int64_t rankOf(int64_t slot) const {
    return kernel_.rank ? kernel_.rank[slot] : slot;
  }

  /// For each rank, the sum of the counts at smaller ranks.
  Array<uint32_t> startsByRank(const Array<uint32_t> &counts) {
    int64_t n = kernel_.rank ? kernel_.rankSize : kernel_.slots();
    Array<uint32_t> starts(p_.memory, n);
    if (kernel_.rank) {
      if (n != kernel_.positions)
        std::memset(starts.data(), 0, static_cast<size_t>(n) * 4);
      parallelChunks(p_.threads, kernel_.positions, 1 << 16,
                     [&](int64_t begin, int64_t end) {
                       for (int64_t i = begin; i < end; ++i)
                         starts[kernel_.rank[i]] = counts[i];
                     });
    }
    exclusiveScan(p_.threads, kernel_.rank ? starts.data() : counts.data(),
                  starts.data(), n);
    return starts;
  }

  /// Calls body(begin, end) for ranges of units; small ones travel together.
  template <class Body> void forUnits(const Body &body) {
    auto units = static_cast<int64_t>(kernel_.units.size());
    parallelChunks(p_.threads, units, units / (int64_t(p_.threads) * 16) + 1,
                   body);
  }

  /// For each slot, the buckets of all its records.
  Array<uint32_t> countPairs() {
    Array<uint32_t> result(p_.memory, kernel_.slots());
    std::vector<int64_t> entries(kernel_.units.size());
    for (const Segment &segment : buckets_.list)
      entries[static_cast<size_t>(segment.unit)] += segment.bytes / 4;
    forUnits([&](int64_t begin, int64_t end) {
      for (int64_t u = begin; u < end; ++u)
        countPairs(u, entries[static_cast<size_t>(u)], result);
    });
    return result;
  }

  /// Of a unit that logged `left` entries.
  void countPairs(int64_t u, int64_t left, Array<uint32_t> &result) const {
    Reader reader(buckets_, u);
    uint32_t entry = left > 0 ? reader.read() : 0;
    int64_t end = kernel_.slotBegin(u + 1);
    for (int64_t i = kernel_.slotBegin(u); i < end; ++i) {
      uint32_t pairs = 0;
      for (uint32_t r = kernel_.counts[port_][i]; r > 0; --r)
        do {
          ++pairs;
          entry = --left > 0 ? reader.read() : PIKOIR_FIRST_BUCKET;
        } while (!(entry & PIKOIR_FIRST_BUCKET));
      result[i] = pairs;
    }
  }

  void gatherUnits(int64_t begin, int64_t end) {
    Readers from{{records_, begin},
                 {records_, begin, region_, size_},
                 {buckets_, begin},
                 {ordinals_, begin}};
    for (int64_t u = begin; u < end; ++u) {
      int64_t bucket = kernel_.units[u].bucket_begin;
      int64_t unitEnd = kernel_.slotBegin(u + 1);
      for (int64_t i = kernel_.slotBegin(u); i < unitEnd; ++i)
        if (kernel_.counts[port_][i] > 0)
          gatherSlot(i, bucket, from);
    }
  }

  struct Readers {
    Reader records;
    IndexReader places;
    Reader buckets, ordinals;
  };

  /// `bucket` is the slot's, or one before it.
  void gatherSlot(int64_t i, int64_t &bucket, Readers &from) {
    uint32_t count = kernel_.counts[port_][i];
    int64_t rank = rankOf(i);
    int64_t at = starts_[rank];
    if (region_.base)
      from.places.read(stream_.indexStorage.data() + at, count);
    else
      from.records.read(stream_.itemStorage.data() + at * size_, count * size_);
    if (pairStarts_) {
      int64_t begin = pairStarts_[rank];
      int64_t end = rank + 1 < pairStarts_.size() ? pairStarts_[rank + 1]
                                                  : stream_.pairCount;
      from.buckets.read(
          reinterpret_cast<uint8_t *>(stream_.pairStorage.data() + begin),
          (end - begin) * 4);
    } else if (stream_.pairStorage) {
      from.buckets.read(
          reinterpret_cast<uint8_t *>(stream_.pairStorage.data() + at),
          int64_t(count) * 4);
    }
    if (!edge_.keyed())
      return;
    while (!from_.collects() && kernel_.offsets[bucket + 1] <= i)
      ++bucket;
    for (uint32_t r = 0; r < count; ++r)
      writeKey(at + r, i, bucket, from.ordinals.read());
  }

  void writeKey(int64_t to, int64_t slot, int64_t bucket, uint32_t ordinal) {
    uint64_t *key = &stream_.keys.words[to * stream_.keys.width];
    if (from_.collects()) { // a new lineage
      key[0] = uint64_t(from_.root) << 32 | kernel_.launch;
      if (isShared_) {
        key[1] = kernel_.slotNames[slot];
        key[2] = ordinal;
        return;
      }
      key[1] = static_cast<uint64_t>(rankOf(slot)) << 32 | ordinal;
      return;
    }
    int64_t item = kernel_.order ? kernel_.order[slot] : slot;
    for (int32_t w = 0; w < kernel_.keys.width; ++w)
      key[w] = kernel_.keys.word(item, w);
    key[kernel_.keys.width] = static_cast<uint64_t>(bucket) << 32 | ordinal;
  }

  pikort_pipeline &p_;
  const Stage &from_;
  Kernel &kernel_;
  size_t port_;
  const Edge &edge_;
  Stream &stream_;
  int64_t size_;
  Segments records_;
  Region region_;
  Segments buckets_, ordinals_;
  Array<uint32_t> starts_, pairStarts_;
  bool isShared_ = false; ///< By ranks; it collects.
};

} // namespace

// --- One input --------------------------------------------------------------

/// What was gathered is no longer needed where it was.
static void releasePort(Kernel &kernel, size_t port) {
  for (auto &lane : kernel.lanes)
    lane->logs[port].clear();
  if (port < kernel.counts.size())
    kernel.counts[port] = {};
  if (--kernel.pendingOutputs <= 0)
    kernel.clear();
}

/// The buckets that a kernel's port logged, in unit order.
static void concatenateBuckets(pikort_pipeline &p, Kernel &kernel, size_t port,
                               Stream &stream) {
  Segments buckets = collect(kernel, port, &PortLogs::buckets);
  stream.pairCount = buckets.bytes / 4;
  checkCount(p.stages[kernel.stage], stream.pairCount);
  if (buckets.list.size() == 1) {
    stream.pairs = reinterpret_cast<const uint32_t *>(buckets.list[0].data);
    keepBlocks(kernel, port, &PortLogs::buckets, stream);
    return;
  }
  stream.pairStorage = Array<uint32_t>(p.memory, stream.pairCount);
  stream.pairs = stream.pairStorage.data();
  concatenate(p.threads, buckets,
              reinterpret_cast<uint8_t *>(stream.pairStorage.data()));
}

Stream piko::rt::gatherBuckets(pikort_pipeline &p, int32_t index) {
  Stream stream;
  Kernel &kernel = *cpuOf(p).sourceKernels[index];
  if (kernel.open || kernel.pendingOutputs == 0)
    throw Failure{PIKORT_BAD_PROGRAM,
                  "stage " + quoted(p.stages[kernel.stage].name) +
                      ": expected the bins of source " + std::to_string(index) +
                      " to be assigned before"};
  concatenateBuckets(p, kernel, 0, stream);
  releasePort(kernel, 0);
  return stream;
}

static Stream gatherSource(pikort_pipeline &p, const Stage &stage,
                           int32_t index) {
  Source &source = p.sources[index];
  Stream stream;
  stream.items = source.data + source.begin * p.records[stage.record].size;
  stream.count = source.end - source.begin;
  stream.keys.width = 1;
  stream.keys.base = (static_cast<uint64_t>(index) << 32) +
                     static_cast<uint64_t>(source.begin);
  if (!stage.placed())
    return stream;
  if (p.ranks && p.ranks->takeBuckets(index, stream.pairStorage)) {
    stream.pairs = stream.pairStorage.data();
    stream.pairCount = stream.pairStorage.size();
    return stream;
  }
  Stream found = gatherBuckets(p, index);
  stream.pairs = found.pairs;
  stream.pairCount = found.pairCount;
  stream.pairStorage = std::move(found.pairStorage);
  stream.blocks = std::move(found.blocks);
  if (p.ranks)
    p.ranks->filter(stage, stream, stream.pairStorage);
  return stream;
}

[[noreturn]] static void failOrder(const Stage &stage, const Stage &producer) {
  throw Failure{PIKORT_BAD_PROGRAM,
                "stage " + quoted(stage.name) + ": expected stage " +
                    quoted(producer.name) + " to run before it"};
}

/// Checks that a kernel has run, and counts what it emitted to an edge.
static Stream countRecords(pikort_pipeline &p, const Edge &edge) {
  Kernel &kernel = kernelOf(p, edge.producer);
  const Stage &to = p.stages[edge.consumer];
  auto port = static_cast<size_t>(edge.port);
  Stream stream;
  if (kernel.open || kernel.pendingOutputs == 0)
    failOrder(to, p.stages[edge.producer]);
  stream.count = collect(kernel, port, &PortLogs::records).bytes /
                 p.records[to.record].size;
  checkCount(to, stream.count);
  if (byPosition(p, edge) && to.placed())
    stream.pairCount = collect(kernel, port, &PortLogs::buckets).bytes / 4;
  checkCount(to, stream.pairCount);
  return stream;
}

/// The records that a kernel's port logged, in unit order.
static void concatenateRecords(pikort_pipeline &p, Kernel &kernel, size_t port,
                               int64_t size, Stream &stream) {
  Segments records = collect(kernel, port, &PortLogs::records);
  Region region(records, size);
  if (records.list.size() == 1) {
    stream.items = records.list[0].data;
  } else if (region.base) {
    stream.items = region.base;
    stream.extent = region.extent;
    stream.indexStorage = Array<uint32_t>(p.memory, stream.count);
    stream.index = stream.indexStorage.data();
    forPieces(p.threads, records, size,
              [&](const uint8_t *data, int64_t bytes, int64_t at) {
                auto place = (data - region.base) / size;
                uint32_t *to = stream.indexStorage.data() + at / size;
                for (int64_t i = 0; i < bytes / size; ++i)
                  to[i] = static_cast<uint32_t>(place + i);
              });
  } else {
    stream.itemStorage = Array<uint8_t>(p.memory, records.bytes);
    stream.items = stream.itemStorage.data();
    concatenate(p.threads, records, stream.itemStorage.data());
    return;
  }
  keepBlocks(kernel, port, &PortLogs::records, stream);
}

Stream piko::rt::gatherEdge(pikort_pipeline &p, const Edge &edge) {
  Kernel &kernel = kernelOf(p, edge.producer);
  const Stage &to = p.stages[edge.consumer];
  auto port = static_cast<size_t>(edge.port);
  Stream stream = countRecords(p, edge);
  if (byPosition(p, edge)) {
    PositionGather(p, edge, stream).run();
  } else {
    if (to.placed())
      concatenateBuckets(p, kernel, port, stream);
    concatenateRecords(p, kernel, port, p.records[to.record].size, stream);
  }
  releasePort(kernel, port);
  return stream;
}

PortRecords piko::rt::takePort(pikort_pipeline &p, const Edge &edge) {
  Kernel &kernel = kernelOf(p, edge.producer);
  const Stage &to = p.stages[edge.consumer];
  auto port = static_cast<size_t>(edge.port);
  PortRecords result{countRecords(p, edge), {}, {}};
  if (to.placed())
    concatenateBuckets(p, kernel, port, result.stream);
  concatenateRecords(p, kernel, port, p.records[to.record].size, result.stream);
  Segments ordinals = collect(kernel, port, &PortLogs::ordinals);
  result.ordinals = Array<uint32_t>(p.memory, ordinals.bytes / 4);
  concatenate(p.threads, ordinals,
              reinterpret_cast<uint8_t *>(result.ordinals.data()));
  result.counts = std::move(kernel.counts[port]);
  return result;
}

// --- Several inputs ---------------------------------------------------------

Stream piko::rt::gatherInputs(pikort_pipeline &p, const Stage &stage,
                              bool fromOutside) {
  std::vector<Stream> streams;
  streams.reserve(stage.sources.size() + stage.inputs.size());
  auto add = [&](Stream stream) {
    if (stream.count > 0)
      streams.push_back(std::move(stream));
  };
  if (fromOutside)
    for (int32_t source : stage.sources)
      add(gatherSource(p, stage, source));
  for (int32_t e : stage.inputs) {
    Edge &edge = p.edges[e];
    const Stage &from = p.stages[edge.producer];
    Cycle *cycle = cycleOf(p, from);
    if (edge.insideLoop)
      continue; // the loop itself keeps these
    if (cycle && from.cycle != stage.cycle && !cycle->isFinished())
      failOrder(stage, from);
    Strips *strips = edge.leavesStrips ? stripsOf(p, from) : nullptr;
    if (strips && !strips->isFinished())
      failOrder(stage, from);
    bool waits = cycle || (strips && strips->isDivided());
    if (waits || (fromOutside && edge.exchanged && p.ranks))
      add(queueOf(p, edge).take(edge.keyWidth));
    else if (fromOutside)
      add(gatherEdge(p, edge));
  }
  if (streams.empty())
    return {};
  if (streams.size() == 1)
    return std::move(streams.front());
  return mergeStreams(p, streams, stage);
}
