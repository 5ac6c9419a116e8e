// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Ranks.cpp - Meetings of ranks, and who owns what -------------------===//

#include "ranks/Ranks.h"

#include "cpu/CPUExecutor.h"
#include "cpu/Kernel.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

// --- Who owns what ----------------------------------------------------------

/// Neighbours have different owners, in each dimension, so that what fills a
/// part of the domain is work for all.
int32_t Ranks::ownerOf(const Stage &stage, int64_t bin) const {
  int64_t sum = 0;
  for (int32_t d = 0, step = 1; d < p_.rank; ++d, step *= 3) {
    sum += bin % stage.grid[d] * step;
    bin /= stage.grid[d];
  }
  return static_cast<int32_t>(sum % size());
}

std::vector<int32_t> Ranks::findOwners(const Stage &stage) const {
  std::vector<int32_t> owners(static_cast<size_t>(stage.bins()));
  for (size_t bin = 0; bin < owners.size(); ++bin)
    owners[bin] = ownerOf(stage, static_cast<int64_t>(bin));
  return owners;
}

void Ranks::beginRun() {
  for (Source &source : p_.sources) {
    const Stage &stage = p_.stages[source.stage];
    if (stage.partition == PIKOIR_PARTS) {
      auto part = [&](int64_t number) {
        return static_cast<int64_t>(static_cast<__int128>(source.count) *
                                    number / size());
      };
      source.begin = part(rank());
      source.end = part(rank() + 1);
    } else if (stage.partition == PIKOIR_FIRST_RANK && rank() != 0) {
      source.begin = source.end = 0;
    }
  }
}

void Ranks::filter(const Stage &stage, Items &items,
                   Array<uint32_t> &storage) const {
  if (stage.partition != PIKOIR_BINS)
    return;
  Array<uint32_t> owned(p_.memory, items.pairCount);
  std::vector<int32_t> owners = findOwners(stage);
  int64_t count = 0, first = 0; // of the pairs of an item
  for (int64_t k = 0; k < items.pairCount; ++k) {
    uint32_t entry = items.pairs[k];
    if (entry & PIKOIR_FIRST_BUCKET) {
      first = count;
      owned[count++] = noBucket;
    }
    if (entry == noBucket)
      continue;
    uint32_t bucket = entry & ~PIKOIR_FIRST_BUCKET;
    if (owners[static_cast<size_t>(bucket / stage.tiles)] != rank())
      continue;
    if (owned[first] == noBucket)
      owned[first] = bucket | PIKOIR_FIRST_BUCKET;
    else
      owned[count++] = bucket;
  }
  storage = std::move(owned);
  items.pairs = storage.data();
  items.pairCount = count;
}

// --- Meetings ---------------------------------------------------------------

void Ranks::callTransport(const std::vector<const void *> &send,
                          const std::vector<int64_t> &sendBytes,
                          const std::vector<void *> &receive,
                          const std::vector<int64_t> &receiveBytes) {
  if (broken_.empty() &&
      transport_.exchange(transport_.context, send.data(), sendBytes.data(),
                          receive.data(), receiveBytes.data()) == 0)
    return;
  if (broken_.empty())
    broken_ = "rank " + std::to_string(rank()) + " of " +
              std::to_string(size()) + ": " +
              transport_.message(transport_.context);
  throw Failure{PIKORT_RANK_FAILED,
                "pipeline " + quoted(p_.name) + ": " + broken_};
}

/// What a rank says first: how many meetings there have been, how it goes on,
/// and how many bytes follow, or at the end what it has done.
std::vector<int64_t> Ranks::meet(Going going, const std::vector<int64_t> &bytes,
                                 pikort_rank_totals own) {
  using Header = std::array<int64_t, 5>;
  auto n = static_cast<size_t>(size());
  std::vector<Header> out(n), in(n);
  std::vector<const void *> send(n);
  std::vector<void *> receive(n);
  std::vector<int64_t> sizes(n, sizeof(Header));
  ++meetings_;
  for (size_t r = 0; r < n; ++r) {
    out[r] = {meetings_, static_cast<int64_t>(going), bytes[r], own.bytes,
              own.peak};
    send[r] = &out[r];
    receive[r] = &in[r];
  }
  auto self = static_cast<size_t>(rank());
  in[self] = out[self];
  sizes[self] = 0;
  callTransport(send, sizes, receive, sizes);
  bool failed = false, same = true;
  std::vector<int64_t> result(n);
  for (size_t r = 0; r < n; ++r) {
    failed |= in[r][1] == static_cast<int64_t>(Going::Failed);
    same &= in[r][0] == meetings_ &&
            (in[r][1] == out[self][1] || failed || going == Going::Failed);
    result[r] = in[r][2];
  }
  if (failed)
    agreeOnError();
  if (!same) {
    broken_ = "rank " + std::to_string(rank()) +
              ": expected all ranks to run the same program with the same "
              "number of runs, but they do not";
    throw Failure{PIKORT_RANK_FAILED,
                  "pipeline " + quoted(p_.name) + ": " + broken_};
  }
  if (going == Going::Finished) {
    totals.resize(n);
    for (size_t r = 0; r < n; ++r)
      totals[r] = {in[r][3], in[r][4]};
  }
  return result;
}

/// Brings a piece to each rank; gives what each has for this one. Where memory
/// for that is refused, all hear of it before any bytes go.
std::vector<Ranks::Bytes> Ranks::swap(const std::vector<Piece> &pieces) {
  auto n = static_cast<size_t>(size());
  std::vector<int64_t> sendBytes(n);
  for (size_t r = 0; r < n; ++r)
    sendBytes[r] = pieces[r].bytes;
  std::vector<int64_t> receiveBytes = meet(Going::On, sendBytes);
  std::vector<Bytes> result(n);
  std::vector<const void *> send(n);
  std::vector<void *> receive(n);
  int32_t status = guarded(&p_, "pipeline", [&] {
    for (size_t r = 0; r < n; ++r) {
      result[r] = Bytes(p_.memory, receiveBytes[r]);
      send[r] = pieces[r].data;
      receive[r] = result[r].data();
    }
  });
  meet(status == PIKORT_OK ? Going::On : Going::Failed,
       std::vector<int64_t>(n));
  auto self = static_cast<size_t>(rank());
  if (sendBytes[self] > 0)
    std::memcpy(receive[self], send[self],
                static_cast<size_t>(sendBytes[self]));
  sendBytes[self] = receiveBytes[self] = 0;
  callTransport(send, sendBytes, receive, receiveBytes);
  return result;
}

// --- Errors -----------------------------------------------------------------

namespace {

/// An error of a rank, but for its texts.
struct Told {
  int64_t failed;
  ErrorPlace place;
  int64_t code;
  int64_t textBytes, nameBytes, barrierBytes;
};

struct Error {
  Told told;
  std::string text, name, barrier;
  auto key() const {
    const ErrorPlace &at = told.place;
    return std::make_tuple(at.kernel, at.depth, at.unit, told.code, at.stage,
                           name, at.bin, at.state, at.a, at.b, barrier);
  }
};

} // namespace

void Ranks::agreeOnError() {
  agreed_ = true;
  auto n = static_cast<size_t>(size());
  auto self = static_cast<size_t>(rank());
  p_.settle();
  Error mine{};
  mine.told.failed = p_.status != PIKORT_OK;
  if (mine.told.failed) {
    mine.told.place = p_.errorPlace;
    mine.told.code = p_.status;
    mine.text = p_.message;
    mine.name = p_.errorName;
    mine.barrier = p_.errorBarrier;
    if (mine.told.code == PIKORT_OUT_OF_MEMORY)
      mine.text = "rank " + std::to_string(rank()) + ": " + mine.text;
    mine.told.textBytes = static_cast<int64_t>(mine.text.size());
    mine.told.nameBytes = static_cast<int64_t>(mine.name.size());
    mine.told.barrierBytes = static_cast<int64_t>(mine.barrier.size());
  }
  std::vector<Error> all(n);
  std::vector<const void *> send(n, &mine.told);
  std::vector<void *> receive(n);
  std::vector<int64_t> sizes(n, sizeof(Told));
  for (size_t r = 0; r < n; ++r)
    receive[r] = &all[r].told;
  sizes[self] = 0;
  callTransport(send, sizes, receive, sizes);
  all[self] = mine;
  std::string texts = mine.text + mine.name + mine.barrier;
  std::vector<std::string> received(n);
  std::vector<int64_t> bytes(n);
  for (size_t r = 0; r < n; ++r) {
    const Told &told = all[r].told;
    bytes[r] = told.textBytes + told.nameBytes + told.barrierBytes;
    received[r].resize(static_cast<size_t>(bytes[r]));
    send[r] = texts.data();
    receive[r] = received[r].data();
    sizes[r] = static_cast<int64_t>(texts.size());
  }
  sizes[self] = bytes[self] = 0;
  callTransport(send, sizes, receive, bytes);
  const Error *first = nullptr;
  for (size_t r = 0; r < n; ++r) {
    Error &error = all[r];
    if (!error.told.failed)
      continue;
    if (r != self) {
      auto text = static_cast<size_t>(error.told.textBytes);
      auto name = static_cast<size_t>(error.told.nameBytes);
      error.text = received[r].substr(0, text);
      error.name = received[r].substr(text, name);
      error.barrier = received[r].substr(text + name);
    }
    if (!first || error.key() < first->key())
      first = &error;
  }
  p_.clearStatus();
  throw Failure{first ? static_cast<int32_t>(first->told.code)
                      : int32_t(PIKORT_RANK_FAILED),
                first ? first->text : "a rank failed and did not say why"};
}

void Ranks::finish() noexcept {
  p_.settle();
  if (!std::exchange(agreed_, false) && broken_.empty()) {
    bool failed = p_.status != PIKORT_OK;
    pikort_rank_totals own{0, p_.memory.peak()};
    for (const Traffic &edge : traffic)
      own.bytes += edge.bytes;
    guarded(&p_, "pipeline", [&] {
      meet(failed ? Going::Failed : Going::Finished,
           std::vector<int64_t>(static_cast<size_t>(size())), own);
    });
    agreed_ = false;
  } else if (!broken_.empty()) {
    guarded(&p_, "pipeline", [&] {
      throw Failure{PIKORT_RANK_FAILED,
                    "pipeline " + quoted(p_.name) + ": " + broken_};
    });
  }
  kept_.clear();
  fields_.clear();
}

Ranks::Traffic &Ranks::trafficOf(const std::string &from,
                                 const std::string &to) {
  for (Traffic &known : traffic)
    if (known.from == from && known.to == to)
      return known;
  return traffic.emplace_back(Traffic{from, to});
}

// --- Exchanges --------------------------------------------------------------

namespace {

/// What one rank sends another of an edge: counts, keys, records, buckets.
struct Parcel {
  int64_t count = 0, pairs = 0;
  uint8_t *keys = nullptr, *records = nullptr, *buckets = nullptr;

  static int64_t align(int64_t bytes) { return (bytes + 63) / 64 * 64; }
  int64_t bytes(int64_t size, int64_t width) const {
    return count == 0 ? 0
                      : 64 + align(count * width * 8) + align(count * size) +
                            pairs * 4;
  }
  /// Finds its parts in memory.
  void lay(uint8_t *data, int64_t size, int64_t width) {
    keys = data + 64;
    records = keys + align(count * width * 8);
    buckets = records + align(count * size);
  }
};

} // namespace

/// What has come of an edge so far.
static Stream takeEdge(pikort_pipeline &p, Edge &edge) {
  if (cycleOf(p, p.stages[edge.producer]))
    return queueOf(p, edge).take(edge.keyWidth);
  return gatherEdge(p, edge);
}

void Ranks::exchange(Edge &edge) {
  const Stage &to = p_.stages[edge.consumer];
  int64_t size = p_.records[to.record].size, width = edge.keyWidth;
  auto n = static_cast<size_t>(this->size());
  Stream stream = takeEdge(p_, edge);
  bool placed = to.placed(), byBin = to.partition == PIKOIR_BINS;
  std::vector<int32_t> owners = byBin ? findOwners(to) : std::vector<int32_t>();
  // Calls body(item, rank, bucket or -1, whether it is the rank's first).
  auto forTargets = [&](auto &&body) {
    std::vector<int64_t> latest(n, -1); // item that each rank has got
    int64_t k = 0;
    for (int64_t i = 0; i < stream.count; ++i) {
      if (!placed) {
        body(i, size_t(0), int64_t(-1), true);
        continue;
      }
      do {
        uint32_t bucket = stream.pairs[k++] & ~PIKOIR_FIRST_BUCKET;
        auto target = byBin
                          ? static_cast<size_t>(
                                owners[static_cast<size_t>(bucket / to.tiles)])
                          : size_t(0);
        body(i, target, int64_t(bucket), latest[target] != i);
        latest[target] = i;
      } while (k < stream.pairCount &&
               !(stream.pairs[k] & PIKOIR_FIRST_BUCKET));
    }
  };
  std::vector<Parcel> parcels(n);
  forTargets([&](int64_t, size_t r, int64_t bucket, bool first) {
    parcels[r].count += first;
    parcels[r].pairs += bucket >= 0;
  });
  std::vector<Bytes> memory(n);
  std::vector<Piece> pieces(n);
  std::vector<Parcel> next(n);
  for (size_t r = 0; r < n; ++r) {
    Parcel &parcel = parcels[r];
    memory[r] = Bytes(p_.memory, parcel.bytes(size, width));
    pieces[r] = {memory[r].data(), parcel.bytes(size, width)};
    if (parcel.count == 0)
      continue;
    std::memset(memory[r].data(), 0, static_cast<size_t>(pieces[r].bytes));
    std::memcpy(memory[r].data(), &parcel.count, 8);
    std::memcpy(memory[r].data() + 8, &parcel.pairs, 8);
    parcel.lay(memory[r].data(), size, width);
    next[r] = parcel;
  }
  forTargets([&](int64_t i, size_t r, int64_t bucket, bool first) {
    Parcel &at = next[r];
    if (first) {
      std::memcpy(at.records, stream.item(i, size), static_cast<size_t>(size));
      at.records += size;
      for (int64_t w = 0; w < width; ++w, at.keys += 8) {
        uint64_t word = stream.keys.word(i, static_cast<int32_t>(w));
        std::memcpy(at.keys, &word, 8);
      }
    }
    if (bucket < 0)
      return;
    auto entry =
        static_cast<uint32_t>(bucket) | (first ? PIKOIR_FIRST_BUCKET : 0u);
    std::memcpy(at.buckets, &entry, 4);
    at.buckets += 4;
  });
  stream = {};
  Traffic &counted = trafficOf(p_.stages[edge.producer].name, to.name);
  for (size_t r = 0; r < n; ++r)
    if (static_cast<int32_t>(r) == rank()) {
      counted.kept += parcels[r].count;
    } else {
      counted.records += parcels[r].count;
      counted.bytes += pieces[r].bytes;
    }
  std::vector<Bytes> received = swap(pieces);
  memory.clear();

  std::vector<Stream> streams;
  for (Bytes &bytes : received) {
    if (bytes.size() == 0)
      continue;
    Parcel parcel;
    std::memcpy(&parcel.count, bytes.data(), 8);
    std::memcpy(&parcel.pairs, bytes.data() + 8, 8);
    parcel.lay(bytes.data(), size, width);
    Stream &one = streams.emplace_back();
    one.count = parcel.count;
    one.pairCount = parcel.pairs;
    one.items = parcel.records;
    one.pairs = reinterpret_cast<const uint32_t *>(parcel.buckets);
    one.keys.width = static_cast<int32_t>(width);
    if (width > 0) {
      one.keys.words = Array<uint64_t>(p_.memory, parcel.count * width);
      std::memcpy(one.keys.words.data(), parcel.keys,
                  static_cast<size_t>(parcel.count * width) * 8);
    }
    one.blocks.push_back(std::move(bytes));
  }
  if (streams.size() > 1 && width > 0) {
    Stage like;
    like.name = to.name;
    like.record = to.record;
    like.flags = to.flags;
    like.keyWidth = static_cast<int32_t>(width);
    enqueue(p_, edge, mergeStreams(p_, streams, like));
    return;
  }
  for (Stream &one : streams)
    enqueue(p_, edge, std::move(one));
}
