// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Exchange.cpp - Brings primitives to who runs what takes them -------===//
//
//   1. split   each primitive is listed for each rank that owns one of its
//              bins, with these bins;
//   2. pack    what others get is copied: counts, keys, records, bins;
//   3. swap    all ranks meet, and bytes go;
//   4. join    what this rank has kept, which has stayed where it was, and what
//              has come are merged by key, or follow each other in the order of
//              ranks.
//
//===----------------------------------------------------------------------===//

#include "cpu/CPUExecutor.h"
#include "cpu/Queue.h"
#include "cpu/loops/Strips.h"
#include "ranks/Ranks.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

namespace {

/// What one rank gets of a stream.
struct Share {
  int64_t count = 0, pairs = 0;
  Array<uint32_t> items;   ///< Numbers in the stream.
  Array<uint32_t> buckets; ///< Of each, the first with PIKOIR_FIRST_BUCKET.
};

/// Where the parts of a message are: counts, records, keys, buckets.
struct Message {
  int64_t count = 0, pairs = 0, size, width;
  uint8_t *data = nullptr;

  static constexpr int64_t header = 16;
  int64_t recordBytes() const { return (count * size + 7) / 8 * 8; }
  int64_t keyBytes() const { return count * width * 8; }
  int64_t bytes() const {
    return count == 0 ? 0 : header + recordBytes() + keyBytes() + pairs * 4;
  }
  uint8_t *records() const { return data + header; }
  uint8_t *keys() const { return records() + recordBytes(); }
  uint8_t *buckets() const { return keys() + keyBytes(); }

  void writeHeader() const {
    std::memcpy(data, &count, 8);
    std::memcpy(data + 8, &pairs, 8);
  }
  void readHeader() {
    std::memcpy(&count, data, 8);
    std::memcpy(&pairs, data + 8, 8);
  }
};

} // namespace

/// The owner of each bucket.
static std::vector<int32_t> ownersOfBuckets(Ranks &ranks, const Stage &stage) {
  const std::vector<int32_t> &owners = ranks.ownersOf(stage);
  if (stage.tiles == 1)
    return owners;
  std::vector<int32_t> result(static_cast<size_t>(stage.buckets));
  for (size_t b = 0; b < result.size(); ++b)
    result[b] = owners[b / static_cast<size_t>(stage.tiles)];
  return result;
}

/// Calls body(rank, item, bucket, whether it is the item's first there) for all
/// pairs of a stream.
static void forPairs(const Items &stream, const std::vector<int32_t> &owners,
                     size_t ranks, auto &&body) {
  std::vector<int64_t> latest(ranks, -1); // item that each rank has got
  int64_t item = -1;
  for (int64_t k = 0; k < stream.pairCount; ++k) {
    uint32_t entry = stream.pairs[k];
    item += entry >> 31;
    uint32_t bucket = entry & ~PIKOIR_FIRST_BUCKET;
    auto rank = static_cast<size_t>(owners[bucket]);
    bool isFirst = latest[rank] != item;
    latest[rank] = item;
    body(rank, item, bucket, isFirst);
  }
}
static_assert(PIKOIR_FIRST_BUCKET == 0x80000000u);

/// By the owners of bins, or all to the first rank.
static std::vector<Share> split(pikort_pipeline &p, const Stage &to,
                                const Stream &stream) {
  auto n = static_cast<size_t>(p.ranks->size());
  std::vector<Share> shares(n);
  if (to.partition != PIKOIR_BINS) {
    shares[0].count = stream.count;
    shares[0].pairs = to.placed() ? stream.pairCount : 0;
    return shares;
  }
  std::vector<int32_t> owners = ownersOfBuckets(*p.ranks, to);
  forPairs(stream, owners, n,
           [&](size_t rank, int64_t, uint32_t, bool isFirst) {
             shares[rank].count += isFirst;
             ++shares[rank].pairs;
           });
  struct Cursor {
    uint32_t *item, *bucket;
  };
  std::vector<Cursor> at(n);
  for (size_t r = 0; r < n; ++r) {
    shares[r].items = Array<uint32_t>(p.memory, shares[r].count);
    shares[r].buckets = Array<uint32_t>(p.memory, shares[r].pairs);
    at[r] = {shares[r].items.data(), shares[r].buckets.data()};
  }
  forPairs(stream, owners, n,
           [&](size_t rank, int64_t item, uint32_t bucket, bool isFirst) {
             Cursor &next = at[rank];
             if (isFirst)
               *next.item++ = static_cast<uint32_t>(item);
             *next.bucket++ = bucket | (isFirst ? PIKOIR_FIRST_BUCKET : 0u);
           });
  return shares;
}

/// Copies records of a size that is known, as most are.
template <int64_t Size>
static void copyRecords(const Stream &stream, const Share &share, int64_t size,
                        uint8_t *to) {
  const int64_t bytes = Size > 0 ? Size : size;
  for (int64_t i = 0; i < share.count; ++i, to += bytes)
    std::memcpy(to, stream.item(share.items ? share.items[i] : i, bytes),
                static_cast<size_t>(bytes));
}

static void copyRecords(const Stream &stream, const Share &share, int64_t size,
                        uint8_t *to) {
  switch (size) {
  case 16:
    return copyRecords<16>(stream, share, size, to);
  case 20:
    return copyRecords<20>(stream, share, size, to);
  case 24:
    return copyRecords<24>(stream, share, size, to);
  case 32:
    return copyRecords<32>(stream, share, size, to);
  case 48:
    return copyRecords<48>(stream, share, size, to);
  default:
    return copyRecords<0>(stream, share, size, to);
  }
}

static void pack(const Stream &stream, const Share &share,
                 const Message &message) {
  message.writeHeader();
  auto *key = reinterpret_cast<uint64_t *>(message.keys());
  for (int64_t i = 0; i < share.count && message.width > 0; ++i)
    for (int32_t w = 0; w < message.width; ++w)
      *key++ = stream.keys.word(share.items ? share.items[i] : i, w);
  const uint32_t *buckets = share.buckets ? share.buckets.data() : stream.pairs;
  if (share.pairs > 0)
    std::memcpy(message.buckets(), buckets,
                static_cast<size_t>(share.pairs) * 4);
  copyRecords(stream, share, message.size, message.records());
}

/// What has come from another rank, at `data` in `memory`.
static Stream unpack(pikort_pipeline &p, Message message, uint8_t *data,
                     Array<uint8_t> memory) {
  message.data = data;
  message.readHeader();
  Stream stream;
  stream.count = message.count;
  stream.pairCount = message.pairs;
  stream.items = message.records();
  stream.pairs = reinterpret_cast<const uint32_t *>(message.buckets());
  stream.keys.width = static_cast<int32_t>(message.width);
  if (message.width > 0) {
    stream.keys.words =
        Array<uint64_t>(p.memory, message.count * message.width);
    std::memcpy(stream.keys.words.data(), message.keys(),
                static_cast<size_t>(message.keyBytes()));
  }
  stream.blocks.push_back(std::move(memory));
  return stream;
}

/// What this rank keeps, which stays where it lies.
static Stream keepShare(pikort_pipeline &p, Stream stream, Share &share) {
  if (share.count == 0)
    return {};
  if (!share.items)
    return stream;
  Keys keys;
  keys.width = stream.keys.width;
  if (keys.width > 0) {
    keys.words = Array<uint64_t>(p.memory, share.count * keys.width);
    for (int64_t i = 0; i < share.count; ++i)
      for (int32_t w = 0; w < keys.width; ++w)
        keys.words[i * keys.width + w] = stream.keys.word(share.items[i], w);
  }
  stream.extent = stream.reach();
  if (stream.index)
    for (int64_t i = 0; i < share.count; ++i)
      share.items[i] = stream.index[share.items[i]];
  stream.keys = std::move(keys);
  stream.indexStorage = std::move(share.items);
  stream.index = stream.indexStorage.data();
  stream.pairStorage = std::move(share.buckets);
  stream.pairs = stream.pairStorage.data();
  stream.count = share.count;
  stream.pairCount = share.pairs;
  return stream;
}

// --- What has come ----------------------------------------------------------

/// Whether all of a stream is before all of the next one, by their keys.
static bool followEachOther(const std::vector<Stream> &streams) {
  for (size_t s = 1; s < streams.size(); ++s) {
    const Keys &before = streams[s - 1].keys, &after = streams[s].keys;
    int64_t last = streams[s - 1].count - 1;
    for (int32_t w = 0; w < before.width; ++w) {
      uint64_t a = before.word(last, w), b = after.word(0, w);
      if (a > b)
        return false;
      if (a < b)
        break;
    }
  }
  return true;
}

/// One stream after the other. Records that are not small stay where they lie,
/// if an index reaches them.
static Stream concatenate(pikort_pipeline &p, std::vector<Stream> &streams,
                          int64_t size) {
  if (streams.size() == 1)
    return std::move(streams.front());
  Stream all;
  const uint8_t *first = streams[0].items, *end = first;
  bool isIndexed = size > 16;
  for (const Stream &stream : streams) {
    all.count += stream.count;
    all.pairCount += stream.pairCount;
    all.keys.width = stream.keys.width;
    first = std::min(first, stream.items);
    end = std::max(end, stream.items + stream.reach() * size);
    isIndexed &= (stream.items - streams[0].items) % size == 0;
  }
  all.extent = (end - first) / size;
  isIndexed &= all.extent <= UINT32_MAX;
  all.pairStorage = Array<uint32_t>(p.memory, all.pairCount);
  all.keys.words = Array<uint64_t>(p.memory, all.count * all.keys.width);
  if (isIndexed) {
    all.indexStorage = Array<uint32_t>(p.memory, all.count);
    all.index = all.indexStorage.data();
    all.items = first;
  } else {
    all.itemStorage = Array<uint8_t>(p.memory, all.count * size);
    all.items = all.itemStorage.data();
  }
  uint32_t *index = all.indexStorage.data(), *pair = all.pairStorage.data();
  uint64_t *word = all.keys.words.data();
  uint8_t *record = all.itemStorage.data();
  for (Stream &stream : streams) {
    auto place = static_cast<uint32_t>((stream.items - first) / size);
    for (int64_t i = 0; isIndexed && i < stream.count; ++i)
      *index++ =
          place + (stream.index ? stream.index[i] : static_cast<uint32_t>(i));
    if (!isIndexed) {
      Share whole;
      whole.count = stream.count;
      copyRecords(stream, whole, size, record);
      record += stream.count * size;
    }
    if (stream.pairCount > 0)
      std::memcpy(pair, stream.pairs,
                  static_cast<size_t>(stream.pairCount) * 4);
    pair += stream.pairCount;
    for (int64_t i = 0; i < stream.count; ++i)
      for (int32_t w = 0; w < all.keys.width; ++w)
        *word++ = stream.keys.word(i, w);
    for (Array<uint8_t> &block : stream.blocks)
      all.blocks.push_back(std::move(block));
    all.blocks.push_back(std::move(stream.itemStorage));
  }
  all.pairs = all.pairStorage.data();
  return all;
}

/// What has come of an edge so far.
static Stream takeEdge(pikort_pipeline &p, Edge &edge) {
  const Stage &from = p.stages[edge.producer];
  Strips *strips = edge.leavesStrips ? stripsOf(p, from) : nullptr;
  if (cycleOf(p, from) || (strips && strips->isDivided()))
    return queueOf(p, edge).take(edge.keyWidth);
  return gatherEdge(p, edge);
}

void Ranks::exchange(Edge &edge) {
  const Stage &to = p_.stages[edge.consumer];
  Message form{0, 0, p_.records[to.record].size, edge.keyWidth};
  auto n = static_cast<size_t>(size());
  auto self = static_cast<size_t>(rank());
  Stream stream = takeEdge(p_, edge);
  std::vector<Share> shares = split(p_, to, stream);
  Traffic &counted = trafficOf(p_.stages[edge.producer].name, to.name);
  counted.kept += shares[self].count;
  std::vector<Bytes> memory(n);
  std::vector<Piece> pieces(n);
  for (size_t r = 0; r < n; ++r) {
    if (r == self || shares[r].count == 0)
      continue;
    Message message = form;
    message.count = shares[r].count;
    message.pairs = shares[r].pairs;
    memory[r] = Bytes(p_.memory, message.bytes());
    message.data = memory[r].data();
    pack(stream, shares[r], message);
    pieces[r] = {message.data, message.bytes()};
    counted.records += message.count;
    counted.bytes += message.bytes();
    shares[r] = {};
  }
  Stream own = keepShare(p_, std::move(stream), shares[self]);
  // Records are at multiples of their size from this rank's own, where they
  // can.
  std::vector<Landing> received = swap(
      pieces, {.like = own.items, .after = Message::header, .size = form.size});
  memory.clear();
  std::vector<Stream> streams;
  for (size_t r = 0; r < n; ++r)
    if (r == self && own.count > 0)
      streams.push_back(std::move(own));
    else if (received[r].bytes > 0)
      streams.push_back(
          unpack(p_, form, received[r].data, std::move(received[r].memory)));
  if (streams.empty())
    return;
  if (streams.size() > 1 && form.width > 0 && !followEachOther(streams)) {
    Stage like;
    like.name = to.name;
    like.record = to.record;
    like.flags = to.flags;
    like.keyWidth = static_cast<int32_t>(form.width);
    enqueue(p_, edge, mergeStreams(p_, streams, like));
    return;
  }
  enqueue(p_, edge, concatenate(p_, streams, form.size));
}

// --- Sources ----------------------------------------------------------------

/// A list of the buckets of some primitives, with an entry for those that have
/// none: only those that one rank owns. `to` has room for all.
static int64_t filterBuckets(const Items &items,
                             const std::vector<int32_t> &owners, int32_t rank,
                             uint32_t *to) {
  int64_t count = 0, first = 0; // of the pairs of an item
  for (int64_t k = 0; k < items.pairCount; ++k) {
    uint32_t entry = items.pairs[k];
    if (entry & PIKOIR_FIRST_BUCKET) {
      first = count;
      to[count++] = noBucket;
    }
    if (entry == noBucket)
      continue;
    uint32_t bucket = entry & ~PIKOIR_FIRST_BUCKET;
    if (owners[bucket] != rank)
      continue;
    if (to[first] == noBucket)
      to[first] = bucket | PIKOIR_FIRST_BUCKET;
    else
      to[count++] = bucket;
  }
  return count;
}

void Ranks::filter(const Stage &stage, Items &items, Array<uint32_t> &storage) {
  if (stage.partition != PIKOIR_BINS)
    return;
  Array<uint32_t> owned(p_.memory, items.pairCount);
  items.pairCount =
      filterBuckets(items, ownersOfBuckets(*this, stage), rank(), owned.data());
  storage = std::move(owned);
  items.pairs = storage.data();
}

bool Ranks::isDivided(const Source &source) const {
  // A meeting takes as long as some thousands of primitives.
  constexpr int64_t few = 4096;
  return source.exchanged && size() > 1 &&
         source.stripEnd - source.stripBegin >= few;
}

void Ranks::exchangeSource(int32_t index) {
  Source &source = p_.sources[index];
  if (!isDivided(source))
    return;
  const Stage &stage = p_.stages[source.stage];
  auto n = static_cast<size_t>(size());
  Stream part = gatherBuckets(p_, index);
  std::vector<int32_t> owners = ownersOfBuckets(*this, stage);
  std::vector<Array<uint32_t>> lists(n);
  std::vector<Piece> pieces(n);
  Traffic &counted = trafficOf("source " + std::to_string(index), stage.name);
  for (size_t r = 0; r < n; ++r) {
    lists[r] = Array<uint32_t>(p_.memory, part.pairCount);
    int64_t count =
        filterBuckets(part, owners, static_cast<int32_t>(r), lists[r].data());
    pieces[r] = {lists[r].data(), count * 4};
    if (static_cast<int32_t>(r) != rank())
      counted.bytes += count * 4;
  }
  std::vector<Landing> received = swap(pieces);
  int64_t bytes = 0;
  for (const Landing &list : received)
    bytes += list.bytes;
  checkCount(stage, bytes / 4);
  Array<uint32_t> &all = sourceBuckets_[index] =
      Array<uint32_t>(p_.memory, bytes / 4);
  auto *to = reinterpret_cast<uint8_t *>(all.data());
  for (const Landing &list : received) {
    if (list.bytes > 0)
      std::memcpy(to, list.data, static_cast<size_t>(list.bytes));
    to += list.bytes;
  }
  source.takeStrip(source.stripBegin, source.stripEnd);
}

bool Ranks::takeBuckets(int32_t source, Array<uint32_t> &buckets) {
  auto known = sourceBuckets_.find(source);
  if (known == sourceBuckets_.end())
    return false;
  buckets = std::move(known->second);
  sourceBuckets_.erase(known);
  return true;
}
