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

namespace {
/// Elements side by side that have changed.
struct Run {
  int64_t first, count;
};
} // namespace

static std::vector<Run> findChanges(const uint8_t *now, const uint8_t *before,
                                    int64_t elements, int64_t record) {
  auto differ = [&](int64_t begin, int64_t end) {
    return std::memcmp(now + begin * record, before + begin * record,
                       static_cast<size_t>((end - begin) * record)) != 0;
  };
  constexpr int64_t bytesAtOnce = 4096;
  int64_t step = std::max<int64_t>(1, bytesAtOnce / record);
  std::vector<Run> runs;
  for (int64_t begin = 0; begin < elements; begin += step) {
    int64_t end = std::min(elements, begin + step);
    if (!differ(begin, end))
      continue;
    for (int64_t i = begin; i < end; ++i) {
      if (!differ(i, i + 1))
        continue;
      if (!runs.empty() && runs.back().first + runs.back().count == i)
        ++runs.back().count;
      else
        runs.push_back({i, 1});
    }
  }
  return runs;
}

void Ranks::shareChanges(State &state, Bytes &kept, bool toFirst) {
  int64_t record = p_.records[state.record].size;
  auto length = static_cast<size_t>(record);
  auto bytesOf = [&](const Run &run) {
    return static_cast<size_t>(run.count * record);
  };
  uint8_t *data = state.view.data;
  std::vector<Run> runs =
      findChanges(data, kept.data(), elementsOf(state), record);
  size_t bytes = 0;
  for (const Run &run : runs)
    bytes += sizeof run + bytesOf(run);
  Bytes own(p_.memory, static_cast<int64_t>(bytes));
  uint8_t *to = own.data();
  for (const Run &run : runs) {
    std::memcpy(to, &run, sizeof run);
    std::memcpy(to + sizeof run, data + run.first * record, bytesOf(run));
    to += sizeof run + bytesOf(run);
  }
  std::vector<Piece> pieces(static_cast<size_t>(size()), {nullptr, 0});
  for (size_t r = 0; r < pieces.size(); ++r)
    if (static_cast<int32_t>(r) != rank() && (r == 0 || !toFirst))
      pieces[r] = {own.data(), static_cast<int64_t>(bytes)};
  count(state, pieces);
  std::vector<Bytes> received = swap(pieces);
  if (toFirst && rank() != 0)
    return;
  bool combines = !fields_.empty(); // else no two ranks have changed an element
  if (combines) {
    // What this rank has changed has its turn, too.
    for (const Run &run : runs)
      std::memcpy(data + run.first * record, kept.data() + run.first * record,
                  bytesOf(run));
    received[static_cast<size_t>(rank())] = std::move(own);
  }
  std::vector<bool> isReduced(length);
  for (const SharedField &field : fields_)
    for (int64_t e = 0; e < field.elements; ++e)
      for (int64_t b = 0; b < field.bytes; ++b)
        isReduced[static_cast<size_t>(field.offset + e * field.stride + b)] =
            true;
  auto apply = [&](int64_t i, const uint8_t *changed) {
    const uint8_t *before = kept.data() + i * record;
    uint8_t *now = data + i * record;
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
  };
  for (const Bytes &list : received)
    for (const uint8_t *at = list.data(), *end = at + list.size(); at < end;) {
      Run run;
      std::memcpy(&run, at, sizeof run);
      at += sizeof run;
      if (!combines)
        std::memcpy(data + run.first * record, at, bytesOf(run));
      for (int64_t i = 0; combines && i < run.count; ++i)
        apply(run.first + i, at + i * record);
      at += bytesOf(run);
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
