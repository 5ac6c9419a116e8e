// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Merge.cpp - Merges streams by lineage key --------------------------===//
//
// Each record's place is its own index plus, for each other stream, the number
// of records before it there. Where the records of all streams lie at multiples
// of their size, they stay there, and are indexed.
//
//===----------------------------------------------------------------------===//

#include "common/JoinRules.h"
#include "cpu/Kernel.h"
#include "cpu/Parallel.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

static constexpr int64_t mergeChunk = 4096;

namespace {

/// Merges streams by lineage key.
class Merge {
public:
  Merge(pikort_pipeline &p, std::vector<Stream> &from) : p_(p), from_(from) {}

  /// Finds the place of each record, and puts it there if there is room.
  void findPlaces() {
    for (const Stream &stream : from_)
      places_.emplace_back(p_.memory, stream.count);
    forChunks([&](const Chunk &chunk) {
      Array<uint32_t> &places = places_[chunk.stream];
      for (int64_t i = chunk.begin; i < chunk.end; ++i)
        places[i] = static_cast<uint32_t>(i);
      for (size_t other = 0; other < from_.size(); ++other)
        if (other != chunk.stream)
          addBefore(chunk, other, places);
      for (int64_t i = chunk.begin; i < chunk.end && out_.items; ++i)
        putItem(chunk.stream, i, places[i]);
    });
  }
  Places takePlaces() { return std::move(places_); }

  Stream run(const Stage &stage) {
    prepare(stage);
    findPlaces();
    return finish(stage);
  }

  /// The same where all places are known.
  Stream run(const Stage &stage, Places places) {
    prepare(stage);
    places_ = std::move(places);
    forChunks([&](const Chunk &chunk) {
      for (int64_t i = chunk.begin; i < chunk.end; ++i)
        putItem(chunk.stream, i, places_[chunk.stream][i]);
    });
    return finish(stage);
  }

private:
  void prepare(const Stage &stage) {
    size_ = p_.records[stage.record].size;
    for (const Stream &stream : from_) {
      out_.count += stream.count;
      out_.pairCount += stream.pairCount;
      out_.keys.width = std::max(out_.keys.width, stream.keys.width);
    }
    checkCount(stage, out_.count);
    checkCount(stage, out_.pairCount);
    makeRoom();
    if (stage.keyWidth > 0 || stage.loop >= 0)
      out_.keys.words =
          Array<uint64_t>(p_.memory, out_.count * out_.keys.width);
    else
      out_.keys.width = 0;
  }

  Stream finish(const Stage &stage) {
    if (stage.placed())
      mergePairs();
    if (out_.index)
      keepRecords();
    return std::move(out_);
  }

  struct Chunk {
    size_t stream;
    int64_t begin, end;
  };

  void makeRoom() {
    const uint8_t *first = from_[0].items, *end = first;
    bool staggered = false;
    for (const Stream &stream : from_) {
      staggered |= (stream.items - from_[0].items) % size_ != 0;
      first = std::min(first, stream.items);
      end = std::max(end, stream.items + stream.reach() * size_);
    }
    out_.extent = (end - first) / size_;
    if (staggered || out_.extent > UINT32_MAX) {
      out_.itemStorage = Array<uint8_t>(p_.memory, out_.count * size_);
      out_.items = out_.itemStorage.data();
      return;
    }
    out_.indexStorage = Array<uint32_t>(p_.memory, out_.count);
    out_.index = out_.indexStorage.data();
    out_.items = first;
  }

  /// The result owns what it points into.
  void keepRecords() {
    for (Stream &stream : from_) {
      std::move(stream.blocks.begin(), stream.blocks.end(),
                std::back_inserter(out_.blocks));
      out_.blocks.push_back(std::move(stream.itemStorage));
    }
  }

  /// True if record i of stream a comes before record j of stream b.
  bool before(size_t a, int64_t i, size_t b, int64_t j) const {
    return piko::join::comesBefore(from_[a].keys, i, from_[b].keys, j, a < b);
  }

  void forChunks(auto &&body) {
    if (chunks_.empty())
      for (size_t s = 0; s < from_.size(); ++s)
        for (int64_t i = 0; i < from_[s].count; i += mergeChunk)
          chunks_.push_back({s, i, std::min(from_[s].count, i + mergeChunk)});
    parallelFor(p_.threads, static_cast<int64_t>(chunks_.size()),
                [&](int64_t c) { body(chunks_[static_cast<size_t>(c)]); });
  }

  /// Adds to each record's place the records of `other` that precede it.
  void addBefore(const Chunk &chunk, size_t other, Array<uint32_t> &places) {
    int64_t low = 0, high = from_[other].count;
    while (low < high) {
      int64_t middle = (low + high) / 2;
      if (before(other, middle, chunk.stream, chunk.begin))
        low = middle + 1;
      else
        high = middle;
    }
    for (int64_t i = chunk.begin; i < chunk.end; ++i) {
      while (low < from_[other].count && before(other, low, chunk.stream, i))
        ++low;
      places[i] += static_cast<uint32_t>(low);
    }
  }

  void putItem(size_t s, int64_t i, int64_t to) {
    const uint8_t *item = from_[s].item(i, size_);
    if (out_.index)
      out_.indexStorage[to] =
          static_cast<uint32_t>((item - out_.items) / size_);
    else
      std::memcpy(out_.itemStorage.data() + to * size_, item,
                  static_cast<size_t>(size_));
    for (int32_t w = 0; w < out_.keys.width; ++w)
      out_.keys.words[to * out_.keys.width + w] = from_[s].keys.word(i, w);
  }

  void mergePairs() {
    out_.pairStorage = Array<uint32_t>(p_.memory, out_.pairCount);
    out_.pairs = out_.pairStorage.data();
    if (out_.onePairEach()) {
      forChunks([&](const Chunk &chunk) {
        for (int64_t i = chunk.begin; i < chunk.end; ++i)
          out_.pairStorage[places_[chunk.stream][i]] =
              from_[chunk.stream].pairs[i];
      });
      return;
    }
    std::vector<Array<uint32_t>> starts;
    starts.reserve(from_.size());
    for (const Stream &stream : from_)
      starts.push_back(pairStarts(p_.memory, stream));
    Array<uint32_t> to(p_.memory, out_.count);
    forChunks([&](const Chunk &c) {
      for (int64_t i = c.begin; i < c.end; ++i)
        to[places_[c.stream][i]] =
            starts[c.stream][i + 1] - starts[c.stream][i];
    });
    exclusiveScan(p_.threads, to.data(), to.data(), out_.count);
    forChunks([&](const Chunk &c) {
      for (int64_t i = c.begin; i < c.end; ++i)
        std::copy(from_[c.stream].pairs + starts[c.stream][i],
                  from_[c.stream].pairs + starts[c.stream][i + 1],
                  out_.pairStorage.data() + to[places_[c.stream][i]]);
    });
  }

  pikort_pipeline &p_;
  std::vector<Stream> &from_;
  int64_t size_ = 0;
  Stream out_;
  std::vector<Chunk> chunks_;
  Places places_;
};

} // namespace

Places piko::rt::mergePlaces(pikort_pipeline &p, std::vector<Stream> &streams) {
  Merge merge(p, streams);
  merge.findPlaces();
  return merge.takePlaces();
}

Stream piko::rt::mergeStreams(pikort_pipeline &p, std::vector<Stream> &streams,
                              const Stage &stage) {
  return Merge(p, streams).run(stage);
}

Stream piko::rt::placeStreams(pikort_pipeline &p, std::vector<Stream> &streams,
                              Places places, const Stage &stage) {
  return Merge(p, streams).run(stage, std::move(places));
}
