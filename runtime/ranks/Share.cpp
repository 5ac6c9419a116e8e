// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Share.cpp - Brings together what ranks have written of state -------===//
//
// Three ways: all that the first rank has; the pixels of the bins that each
// owns; or the elements that each has changed since all had the same. Changes
// are applied to what was kept, in the order of ranks.

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

static int64_t elementsOf(const State &state) {
  int64_t count = 1;
  for (int64_t extent : state.view.extent)
    count *= extent;
  return count;
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
  std::vector<Bytes> received = swap(pieces);
  if (rank() != 0 && bytes > 0)
    std::memcpy(state.view.data, received[0].data(),
                static_cast<size_t>(bytes));
}

void Ranks::shareOwned(State &state, const Stage &stage, bool toFirst) {
  int64_t record = p_.records[state.record].size;
  // Calls body(row's first byte, bytes) for all rows that a rank owns.
  auto forOwned = [&](int32_t owner, auto &&body) {
    for (int64_t bin = 0; bin < stage.bins(); ++bin)
      if (ownerOf(stage, bin) == owner)
        forBinRows(p_, stage, bin, [&](int64_t first, int64_t cells) {
          body(state.view.data + first * record, cells * record);
        });
  };
  int64_t bytes = 0;
  forOwned(rank(), [&](uint8_t *, int64_t row) { bytes += row; });
  Bytes own(p_.memory, bytes);
  uint8_t *to = own.data();
  forOwned(rank(), [&](uint8_t *pixels, int64_t row) {
    std::memcpy(to, pixels, static_cast<size_t>(row));
    to += row;
  });
  std::vector<Piece> pieces(static_cast<size_t>(size()), {nullptr, 0});
  for (size_t r = 0; r < pieces.size(); ++r)
    if (static_cast<int32_t>(r) != rank() && (r == 0 || !toFirst))
      pieces[r] = {own.data(), bytes};
  count(state, pieces);
  std::vector<Bytes> received = swap(pieces);
  for (size_t r = 0; r < pieces.size(); ++r) {
    const uint8_t *from = received[r].data();
    if (received[r].size() > 0)
      forOwned(static_cast<int32_t>(r), [&](uint8_t *pixels, int64_t row) {
        std::memcpy(pixels, from, static_cast<size_t>(row));
        from += row;
      });
  }
}

// --- Changes ----------------------------------------------------------------

template <class T> static T combine(int32_t kind, T now, T changed, T kept) {
  switch (kind) {
  case PIKOIR_SHARE_ADD:
    return now + (changed - kept); // modulo
  case PIKOIR_SHARE_UMIN:
    return std::min(now, changed);
  case PIKOIR_SHARE_UMAX:
    return std::max(now, changed);
  case PIKOIR_SHARE_AND:
    return now & changed;
  case PIKOIR_SHARE_OR:
    return now | changed;
  case PIKOIR_SHARE_XOR:
    return now ^ changed ^ kept;
  default: {
    using Signed = std::make_signed_t<T>;
    auto a = static_cast<Signed>(now), b = static_cast<Signed>(changed);
    return static_cast<T>(kind == PIKOIR_SHARE_MIN ? std::min(a, b)
                                                   : std::max(a, b));
  }
  }
}

template <class T>
static void combine(int32_t kind, uint8_t *now, const uint8_t *changed,
                    const uint8_t *kept) {
  T a, b, c;
  std::memcpy(&a, now, sizeof(T));
  std::memcpy(&b, changed, sizeof(T));
  std::memcpy(&c, kept, sizeof(T));
  a = combine(kind, a, b, c);
  std::memcpy(now, &a, sizeof(T));
}

void Ranks::shareChanges(State &state, Bytes &kept, bool toFirst) {
  int64_t record = p_.records[state.record].size;
  auto length = static_cast<size_t>(record);
  int64_t elements = elementsOf(state);
  uint8_t *data = state.view.data;
  std::vector<uint8_t> changes; // index and record of each that has changed
  for (int64_t i = 0; i < elements; ++i) {
    const uint8_t *now = data + i * record;
    if (std::memcmp(now, kept.data() + i * record, length) == 0)
      continue;
    size_t at = changes.size();
    changes.resize(at + 8 + length);
    std::memcpy(&changes[at], &i, 8);
    std::memcpy(&changes[at + 8], now, length);
  }
  Piece all{changes.data(), static_cast<int64_t>(changes.size())};
  std::vector<Piece> pieces(static_cast<size_t>(size()), {nullptr, 0});
  for (size_t r = 0; r < pieces.size(); ++r)
    if (r == 0 || !toFirst || static_cast<int32_t>(r) == rank())
      pieces[r] = all;
  count(state, pieces);
  std::vector<Bytes> received = swap(pieces);
  if (toFirst && rank() != 0)
    return;
  std::vector<bool> isReduced(length);
  for (const SharedField &field : fields_)
    for (int64_t e = 0; e < field.elements; ++e)
      for (int64_t b = 0; b < field.bytes; ++b)
        isReduced[static_cast<size_t>(field.offset + e * field.stride + b)] =
            true;
  // What this rank has changed is one of the lists.
  for (size_t at = 0; at < changes.size(); at += 8 + length) {
    int64_t i;
    std::memcpy(&i, &changes[at], 8);
    std::memcpy(data + i * record, kept.data() + i * record, length);
  }
  for (const Bytes &list : received)
    for (const uint8_t *at = list.data(), *end = at + list.size(); at < end;
         at += 8 + length) {
      int64_t i;
      std::memcpy(&i, at, 8);
      const uint8_t *changed = at + 8, *before = kept.data() + i * record;
      uint8_t *now = data + i * record;
      if (fields_.empty()) { // no other rank has changed it
        std::memcpy(now, changed, length);
        continue;
      }
      for (size_t b = 0; b < length; ++b)
        if (!isReduced[b] && changed[b] != before[b])
          now[b] = changed[b];
      for (const SharedField &field : fields_)
        for (int64_t e = 0; e < field.elements; ++e) {
          int64_t o = field.offset + e * field.stride;
          if (field.bytes == 8)
            combine<uint64_t>(field.kind, now + o, changed + o, before + o);
          else
            combine<uint32_t>(field.kind, now + o, changed + o, before + o);
        }
    }
}

void Ranks::keep(int32_t id) {
  const State &state = p_.states[id];
  int64_t bytes = elementsOf(state) * p_.records[state.record].size;
  Bytes &kept = kept_[id];
  kept = Bytes(p_.memory, bytes);
  if (bytes > 0)
    std::memcpy(kept.data(), state.view.data, static_cast<size_t>(bytes));
}

void Ranks::share(int32_t id, const Stage *stage, int32_t flags) {
  State &state = p_.states[id];
  bool toFirst = flags & PIKOIR_SHARE_TO_FIRST;
  if (flags & PIKOIR_SHARE_FROM_FIRST) {
    shareFirst(state, elementsOf(state) * p_.records[state.record].size);
  } else if (stage) {
    shareOwned(state, *stage, toFirst);
  } else {
    auto kept = kept_.find(id);
    if (kept == kept_.end())
      throw Failure{PIKORT_BAD_PROGRAM,
                    "state " + quoted(state.name) +
                        ": expected it to be kept before it is shared"};
    shareChanges(state, kept->second, toFirst);
    kept_.erase(kept);
  }
  fields_.clear();
}
