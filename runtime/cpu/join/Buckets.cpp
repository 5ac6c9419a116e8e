// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Buckets.cpp - Bins items by count, scan and scatter
//------------------===//
//
// Chunks of pairs, in order:
//   1. count   each chunk counts its pairs for each bucket;
//   2. scan    gives each (bucket, chunk) its first position;
//   3. scatter each chunk writes its pairs' items to their positions.
// Stable, and without atomics. With owner tiles in a stage that collects, the
// same is done for bins, which yields the emission order across tiles.
//
//===----------------------------------------------------------------------===//

#include "cpu/Kernel.h"
#include "cpu/Parallel.h"

using namespace piko::rt;

namespace {

constexpr uint32_t bucketMask = ~PIKOIR_FIRST_BUCKET;

class Binning {
public:
  Binning(pikort_pipeline &p, const Stage &stage, Kernel &kernel,
          bool rankNeeded)
      : p_(p), stage_(stage), kernel_(kernel), pairs_(kernel.stream.pairs),
        pairCount_(kernel.stream.pairCount), buckets_(stage.buckets),
        rankNeeded_(rankNeeded) {
    // Counters of all chunks should not cost more than the pairs do.
    int64_t most =
        std::max<int64_t>(1, pairCount_ / std::max<int64_t>(buckets_, 4096));
    chunks_ = std::min<int64_t>(most, int64_t(p.threads) * 4);
  }

  void run() {
    counts_ = zeroed(chunks_ * buckets_);
    pieces_.resize(static_cast<size_t>(chunks_));
    forChunks([&](int64_t c) { count(c); });
    summarise();
    scan();
    bool identity = sorted_ && kernel_.positions == kernel_.stream.count &&
                    kernel_.stream.onePairEach();
    const uint32_t *index = kernel_.stream.index;
    bool numbers = !index || stage_.keyWidth > 0 || stage_.loop >= 0;
    if (!identity && numbers)
      kernel_.order = Array<uint32_t>(p_.memory, kernel_.positions);
    if (!identity && index)
      kernel_.places = Array<uint32_t>(p_.memory, kernel_.positions);
    bool byBin = stage_.collects() && stage_.tiles > 1;
    bool ranked = rankNeeded_ && !sorted_ && (byBin || !stage_.collects());
    if (ranked) {
      kernel_.rank = Array<uint32_t>(p_.memory, kernel_.positions);
      kernel_.rankSize = byBin ? kernel_.positions : pairCount_;
      if (byBin)
        scanBins();
    }
    if (!identity)
      forChunks([&](int64_t c) { scatter(c, ranked, byBin); });
  }

private:
  struct Piece {
    int64_t items = 0; ///< That begin before the piece, after summarise().
    int64_t holes = 0;
    bool sorted = true;
    uint32_t first = noBucket, last = noBucket; ///< Buckets, if there are any.
  };

  Array<uint32_t> zeroed(int64_t n) {
    Array<uint32_t> result(p_.memory, n);
    parallelChunks(p_.threads, n, 1 << 20, [&](int64_t begin, int64_t end) {
      std::memset(result.data() + begin, 0,
                  static_cast<size_t>(end - begin) * 4);
    });
    return result;
  }

  void forChunks(auto &&body) { parallelFor(p_.threads, chunks_, body); }
  int64_t firstPair(int64_t chunk) const {
    return static_cast<int64_t>(static_cast<__int128>(pairCount_) * chunk /
                                chunks_);
  }

  /// Calls body(pair, count) for pairs, one by one, or some in a row that are
  /// the first of their items and in the same bucket: neighbours often are, and
  /// to count them one by one takes a store and a load each.
  template <class Body>
  void forRuns(int64_t begin, int64_t end, const Body &body) const {
    constexpr int64_t most = 8;
    for (int64_t k = begin; k < end; k += most) {
      const uint32_t *pairs = pairs_ + k;
      uint32_t first = pairs[0], others = 0;
      if (end - k >= most)
        for (int64_t i = 1; i < most; ++i)
          others |= pairs[i] ^ first;
      if (others == 0 && end - k >= most && (first & PIKOIR_FIRST_BUCKET) &&
          first != noBucket) {
        body(k, most);
        continue;
      }
      for (int64_t i = k; i < std::min(end, k + most); ++i)
        body(i, 1);
    }
  }

  void count(int64_t chunk) {
    uint32_t *counts = counts_.data() + chunk * buckets_;
    int64_t begin = firstPair(chunk), end = firstPair(chunk + 1);
    Piece &piece = pieces_[static_cast<size_t>(chunk)];
    uint32_t last = 0;
    forRuns(begin, end, [&](int64_t k, uint32_t run) {
      uint32_t entry = pairs_[k];
      piece.items += (entry >> 31) * run;
      if (entry == noBucket) {
        ++piece.holes;
        return;
      }
      uint32_t bucket = entry & bucketMask;
      if (piece.first == noBucket)
        piece.first = bucket;
      piece.sorted &= bucket >= last;
      last = bucket;
      counts[bucket] += run;
    });
    if (piece.first != noBucket)
      piece.last = last;
  }

  void summarise() {
    int64_t items = 0, holes = 0;
    uint32_t last = 0;
    for (Piece &piece : pieces_) {
      items += std::exchange(piece.items, items);
      holes += piece.holes;
      sorted_ &= piece.sorted;
      if (piece.first == noBucket)
        continue;
      sorted_ &= piece.first >= last;
      last = piece.last;
    }
    kernel_.positions = pairCount_ - holes;
  }

  /// Counts become first positions.
  void scan() {
    kernel_.offsets = Array<int64_t>(p_.memory, buckets_ + 1);
    int64_t position = 0;
    for (int64_t bucket = 0; bucket < buckets_; ++bucket) {
      kernel_.offsets[bucket] = position;
      for (int64_t c = 0; c < chunks_; ++c)
        position += std::exchange(counts_[c * buckets_ + bucket],
                                  static_cast<uint32_t>(position));
    }
    kernel_.offsets[buckets_] = position;
  }

  /// The same for bins: how many pairs of each chunk are in each bin follows
  /// from the first positions of its buckets.
  void scanBins() {
    int64_t bins = buckets_ / stage_.tiles;
    binCounts_ = Array<uint32_t>(p_.memory, chunks_ * bins);
    for (int64_t bin = 0; bin < bins; ++bin) {
      int64_t position = kernel_.offsets[bin * stage_.tiles];
      for (int64_t c = 0; c < chunks_; ++c) {
        binCounts_[c * bins + bin] = static_cast<uint32_t>(position);
        for (int64_t t = 0; t < stage_.tiles; ++t) {
          int64_t bucket = bin * stage_.tiles + t;
          int64_t end = c + 1 < chunks_ ? counts_[(c + 1) * buckets_ + bucket]
                                        : kernel_.offsets[bucket + 1];
          position += end - counts_[c * buckets_ + bucket];
        }
      }
    }
  }

  void scatter(int64_t chunk, bool ranked, bool byBin) {
    uint32_t *next = counts_.data() + chunk * buckets_;
    int64_t bins = buckets_ / stage_.tiles;
    uint32_t *nextInBin =
        byBin && ranked ? binCounts_.data() + chunk * bins : nullptr;
    uint32_t *order = kernel_.order.data(), *rank = kernel_.rank.data();
    uint32_t *places = kernel_.places.data();
    const uint32_t *index = kernel_.stream.index;
    auto item =
        static_cast<uint32_t>(pieces_[static_cast<size_t>(chunk)].items - 1);
    forRuns(firstPair(chunk), firstPair(chunk + 1),
            [&](int64_t k, uint32_t run) {
              uint32_t entry = pairs_[k];
              uint32_t first = item + (entry >> 31); // of the run
              item = first + run - 1;
              if (entry == noBucket)
                return;
              uint32_t bucket = entry & bucketMask;
              uint32_t position = next[bucket];
              next[bucket] += run;
              if (order)
                for (uint32_t i = 0; i < run; ++i)
                  order[position + i] = first + i;
              if (places)
                for (uint32_t i = 0; i < run; ++i)
                  places[position + i] = index[first + i];
              uint32_t at = static_cast<uint32_t>(k);
              if (nextInBin)
                at = std::exchange(nextInBin[bucket / stage_.tiles],
                                   nextInBin[bucket / stage_.tiles] + run);
              if (ranked)
                for (uint32_t i = 0; i < run; ++i)
                  rank[position + i] = at + i;
            });
  }

  pikort_pipeline &p_;
  const Stage &stage_;
  Kernel &kernel_;
  const uint32_t *pairs_;
  int64_t pairCount_;
  int64_t buckets_;
  bool rankNeeded_;
  int64_t chunks_ = 1;
  bool sorted_ = true; ///< Positions and pairs are in the same order.
  std::vector<Piece> pieces_;
  Array<uint32_t> counts_, binCounts_;
};

} // namespace

void piko::rt::binItems(pikort_pipeline &p, const Stage &stage, Kernel &kernel,
                        bool rankNeeded) {
  if (stage.placed()) {
    Binning(p, stage, kernel, rankNeeded).run();
    return;
  }
  kernel.positions = kernel.stream.count;
  kernel.offsets = Array<int64_t>(p.memory, stage.buckets + 1);
  kernel.offsets[0] = 0;
  for (int64_t bucket = 1; bucket <= stage.buckets; ++bucket)
    kernel.offsets[bucket] = kernel.positions;
}
