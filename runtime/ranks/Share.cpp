// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Share.cpp - Brings together what ranks have written of state -------===//
//
// Three ways: all that the first rank has; the pixels of the bins that each
// owns, if something has run there; or the elements that each has changed since
// all had the same (ShareChanges.cpp).

#include "cpu/Kernel.h"
#include "ranks/Ranks.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

void piko::rt::forBinRows(const pikort_pipeline &p, const Stage &stage,
                          int64_t bin,
                          const std::function<void(int64_t, int64_t)> &body) {
  int64_t lo[4], hi[4];
  for (int32_t d = 0; d < 4; ++d) {
    int64_t size = d < p.rank ? stage.binSize[d] : 0;
    int64_t domain = d < p.rank ? p.domain[d] : 1;
    lo[d] = size ? bin % stage.grid[d] * size : 0;
    hi[d] = size ? std::min(lo[d] + size, domain) : domain;
    bin /= stage.grid[d];
  }
  for (int64_t w = lo[3]; w < hi[3]; ++w)
    for (int64_t z = lo[2]; z < hi[2]; ++z)
      for (int64_t y = lo[1]; y < hi[1]; ++y)
        body(((w * p.domain[2] + z) * p.domain[1] + y) * p.domain[0] + lo[0],
             hi[0] - lo[0]);
}

void Ranks::count(State &state, const std::vector<Piece> &pieces) {
  Traffic &counted = trafficOf({}, state.name);
  for (size_t r = 0; r < pieces.size(); ++r)
    if (static_cast<int32_t>(r) != rank())
      counted.bytes += pieces[r].bytes;
}

void Ranks::shareFirst(State &state, int64_t bytes) {
  std::vector<Piece> pieces(static_cast<size_t>(size()), {nullptr, 0});
  if (rank() == 0)
    for (size_t r = 1; r < pieces.size(); ++r)
      pieces[r] = {state.view.data, bytes};
  count(state, pieces);
  std::vector<Landing> received = swap(pieces);
  if (rank() != 0 && bytes > 0)
    std::memcpy(state.view.data, received[0].data, static_cast<size_t>(bytes));
}

/// The bins that a rank sends, then their pixels, row by row.
void Ranks::shareOwned(int32_t id, const Stage &stage, bool toFirst) {
  State &state = p_.states[id];
  if (toFirst && commonMemory(state))
    return; // the run's end is a meeting
  int64_t record = p_.records[state.record].size;
  const OwnedGrid &grid = owners_.of(stage);
  std::vector<int64_t> bins;
  int64_t cells = 0;
  for (int64_t bin = 0; bin < stage.bins(); ++bin) {
    auto at = static_cast<size_t>(bin);
    if (grid.owners[at] != rank() || !grid.ran[at])
      continue;
    bins.push_back(bin);
    forBinRows(p_, stage, bin, [&](int64_t, int64_t inRow) { cells += inRow; });
  }
  bool sends = !bins.empty() && (!toFirst || rank() != 0);
  auto numbers = static_cast<int64_t>((bins.size() + 1) * sizeof(int64_t));
  Bytes own(p_.memory, sends ? numbers + cells * record : 0);
  if (sends) {
    auto count = static_cast<int64_t>(bins.size());
    std::memcpy(own.data(), &count, sizeof count);
    std::memcpy(own.data() + sizeof count, bins.data(),
                bins.size() * sizeof(int64_t));
    uint8_t *to = own.data() + numbers;
    for (int64_t bin : bins)
      forBinRows(p_, stage, bin, [&](int64_t first, int64_t inRow) {
        auto bytes = static_cast<size_t>(inRow * record);
        std::memcpy(to, state.view.data + first * record, bytes);
        to += bytes;
      });
  }
  std::vector<Piece> pieces(static_cast<size_t>(size()));
  for (size_t r = 0; r < pieces.size(); ++r)
    if (static_cast<int32_t>(r) != rank() && (r == 0 || !toFirst) && sends)
      pieces[r] = {own.data(), own.size()};
  count(state, pieces);
  std::vector<bool> isHere(static_cast<size_t>(stage.bins()));
  for (Landing &landing : swap(pieces)) {
    if (landing.bytes == 0)
      continue;
    int64_t count = 0;
    std::memcpy(&count, landing.data, sizeof count);
    const uint8_t *number = landing.data + sizeof count,
                  *from = number + sizeof(int64_t) * static_cast<size_t>(count);
    for (int64_t b = 0; b < count; ++b, number += sizeof(int64_t)) {
      int64_t bin = 0;
      std::memcpy(&bin, number, sizeof bin);
      isHere[static_cast<size_t>(bin)] = true;
      forBinRows(p_, stage, bin, [&](int64_t first, int64_t inRow) {
        auto bytes = static_cast<size_t>(inRow * record);
        std::memcpy(state.view.data + first * record, from, bytes);
        from += bytes;
      });
    }
  }
  if (toFirst || sparse_.erase(id) == 0)
    return;
  for (int64_t bin = 0; bin < stage.bins(); ++bin)
    if (grid.owners[static_cast<size_t>(bin)] != rank() &&
        !isHere[static_cast<size_t>(bin)])
      forBinRows(p_, stage, bin, [&](int64_t first, int64_t inRow) {
        fill(1, state.view.data + first * record, inRow * record, state.clear);
      });
}

static int64_t elementsOf(const State &state) {
  int64_t count = 1;
  for (int64_t extent : state.view.extent)
    count *= extent;
  return count;
}

void Ranks::keep(int32_t id, bool cleared) {
  const State &state = p_.states[id];
  int64_t bytes = elementsOf(state) * p_.records[state.record].size;
  Kept &kept = kept_[id];
  kept.cleared = cleared;
  if (cleared)
    return;
  kept.bytes = Bytes(p_.memory, bytes);
  if (bytes > 0)
    std::memcpy(kept.bytes.data(), state.view.data, static_cast<size_t>(bytes));
}

void Ranks::share(int32_t id, const Stage *stage, int32_t flags) {
  State &state = p_.states[id];
  bool toFirst = flags & PIKOIR_SHARE_TO_FIRST;
  bool toOwners = flags & PIKOIR_SHARE_TO_OWNERS;
  if (flags & PIKOIR_SHARE_FROM_FIRST) {
    shareFirst(state, elementsOf(state) * p_.records[state.record].size);
  } else if (stage && !toOwners) {
    shareOwned(id, *stage, toFirst);
  } else {
    auto kept = kept_.find(id);
    if (kept == kept_.end())
      throw Failure{PIKORT_BAD_PROGRAM,
                    "state " + quoted(state.name) +
                        ": expected it to be kept before it is shared"};
    shareChanges(state, kept->second, elementsOf(state),
                 toOwners ? stage : nullptr, toFirst);
    kept_.erase(kept);
  }
  fields_.clear();
}
