// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ShareChanges.cpp - Combines what ranks have changed of state -------===//
//
// Elements that differ from what all ranks had go to others, in runs. No two
// ranks have changed one element, but for fields that atomic operations of one
// kind have changed, which commute: so each rank applies what has come to what
// it has, in any order.
//
//===----------------------------------------------------------------------===//

#include "ranks/Ranks.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

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

/// What state has been, as far as it is compared at once.
class Before {
public:
  /// Null: each element was as `clear` is, or zeros.
  Before(const uint8_t *kept, const std::vector<uint8_t> &clear, int64_t record)
      : record_(record), step_(std::max<int64_t>(1, 4096 / record)),
        kept_(kept) {
    if (kept)
      return;
    pattern_.resize(static_cast<size_t>(step_ * record));
    for (size_t b = 0; !clear.empty() && b < pattern_.size(); ++b)
      pattern_[b] = clear[b % static_cast<size_t>(record)];
  }
  int64_t step() const { return step_; }
  /// At least step() elements, or all that follow.
  const uint8_t *at(int64_t element) const {
    return kept_ ? kept_ + element * record_ : pattern_.data();
  }

private:
  int64_t record_, step_;
  const uint8_t *kept_;
  std::vector<uint8_t> pattern_;
};

} // namespace

/// Appends runs of what has changed among some elements.
static void findChanges(const uint8_t *now, const Before &before,
                        int64_t record, int64_t first, int64_t last,
                        std::vector<Run> &runs) {
  for (int64_t begin = first; begin < last; begin += before.step()) {
    int64_t end = std::min(last, begin + before.step());
    const uint8_t *a = now + begin * record, *b = before.at(begin);
    if (std::memcmp(a, b, static_cast<size_t>((end - begin) * record)) == 0)
      continue;
    for (int64_t i = begin; i < end; ++i, a += record, b += record) {
      if (std::memcmp(a, b, static_cast<size_t>(record)) == 0)
        continue;
      if (!runs.empty() && runs.back().first + runs.back().count == i)
        ++runs.back().count;
      else
        runs.push_back({i, 1});
    }
  }
}

/// The bin of a pixel, and the first one in its row that is in the next bin.
static std::pair<int64_t, int64_t> findBin(const pikort_pipeline &p,
                                           const Stage &stage, int64_t pixel) {
  int64_t bin = 0, factor = 1, rest = pixel, next = pixel + 1;
  for (int32_t d = 0; d < p.rank; ++d) {
    int64_t at = rest % p.domain[d], size = stage.binSize[d];
    rest /= p.domain[d];
    bin += (size ? at / size : 0) * factor;
    factor *= stage.grid[d];
    if (d == 0)
      next =
          pixel - at +
          (size ? std::min(p.domain[0], (at / size + 1) * size) : p.domain[0]);
  }
  return {bin, next};
}

void Ranks::shareChanges(State &state, const Kept &kept, int64_t elements,
                         const Stage *owners, bool toFirst) {
  int64_t record = p_.records[state.record].size;
  auto n = static_cast<size_t>(size());
  auto self = static_cast<size_t>(rank());
  uint8_t *data = state.view.data;
  Before before(kept.cleared ? nullptr : kept.bytes.data(),
                state.kind == PIKORT_IMAGE ? state.clear
                                           : std::vector<uint8_t>(),
                record);
  // To all others, or only to owners.
  std::vector<std::vector<Run>> runs(owners ? n : 1);
  OwnedGrid *grid = owners ? &owners_.of(*owners) : nullptr;
  if (!owners)
    findChanges(data, before, record, 0, elements, runs[0]);
  for (int64_t bin = 0; owners && bin < owners->bins(); ++bin) {
    auto owner = static_cast<size_t>(grid->owners[static_cast<size_t>(bin)]);
    size_t count = runs[owner].size();
    forBinRows(p_, *owners, bin, [&](int64_t first, int64_t cells) {
      findChanges(data, before, record, first, first + cells, runs[owner]);
    });
    if (owner == self && runs[owner].size() > count)
      grid->ran[static_cast<size_t>(bin)] = true;
  }
  std::vector<Bytes> packed(runs.size());
  auto bytesOf = [&](const Run &run) {
    return static_cast<size_t>(run.count * record);
  };
  for (size_t r = 0; r < runs.size(); ++r) {
    if (owners && r == self)
      continue;
    size_t bytes = 0;
    for (const Run &run : runs[r])
      bytes += sizeof run + bytesOf(run);
    packed[r] = Bytes(p_.memory, static_cast<int64_t>(bytes));
    uint8_t *to = packed[r].data();
    for (const Run &run : runs[r]) {
      std::memcpy(to, &run, sizeof run);
      std::memcpy(to + sizeof run, data + run.first * record, bytesOf(run));
      to += sizeof run + bytesOf(run);
    }
  }
  std::vector<Piece> pieces(n);
  for (size_t r = 0; r < n; ++r)
    if (const Bytes &own = packed[owners ? r : 0];
        r != self && (r == 0 || !toFirst))
      pieces[r] = {own.data(), own.size()};
  count(state, pieces);
  std::vector<Landing> received = swap(pieces);
  if (toFirst && rank() != 0)
    return;
  bool combines = !fields_.empty();
  std::vector<bool> isReduced(static_cast<size_t>(record));
  for (const SharedField &field : fields_)
    for (int64_t e = 0; e < field.elements; ++e)
      for (int64_t b = 0; b < field.bytes; ++b)
        isReduced[static_cast<size_t>(field.offset + e * field.stride + b)] =
            true;
  auto apply = [&](int64_t i, const uint8_t *changed) {
    const uint8_t *was = before.at(i);
    uint8_t *now = data + i * record;
    for (size_t b = 0; b < isReduced.size(); ++b)
      if (!isReduced[b] && changed[b] != was[b])
        now[b] = changed[b];
    for (const SharedField &field : fields_)
      for (int64_t e = 0; e < field.elements; ++e) {
        int64_t o = field.offset + e * field.stride;
        if (field.bytes == 8)
          combine<uint64_t>(field.kind, now + o, changed + o, was + o);
        else
          combine<uint32_t>(field.kind, now + o, changed + o, was + o);
      }
  };
  for (const Landing &list : received)
    for (const uint8_t *at = list.data, *end = at + list.bytes; at < end;) {
      Run run;
      std::memcpy(&run, at, sizeof run);
      at += sizeof run;
      if (!combines)
        std::memcpy(data + run.first * record, at, bytesOf(run));
      for (int64_t i = 0; combines && i < run.count; ++i)
        apply(run.first + i, at + i * record);
      at += bytesOf(run);
      for (int64_t i = run.first; owners && i < run.first + run.count;) {
        auto [bin, next] = findBin(p_, *owners, i);
        grid->ran[static_cast<size_t>(bin)] = true;
        i = next;
      }
    }
}
