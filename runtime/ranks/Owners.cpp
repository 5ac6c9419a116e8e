// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Owners.cpp - Which rank owns which bins ----------------------------===//
//
// Four ways:
//
//   pattern   Neighbours have different owners, in each dimension, so that what
//             fills a part of the domain is work for all.
//   blocks    Each rank has consecutive bins, row by row.
//   morton    The same along a Morton curve, so that blocks are compact.
//   load      The same, cut so that each rank has as many of the primitives
//             that came in the run before.
//
//===----------------------------------------------------------------------===//

#include "ranks/Owners.h"

#include "pikort/abi_ranks.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <string_view>

using namespace piko::rt;

int32_t Owners::wayOf(const Stage &stage) const {
  for (int32_t way : {p_.rankOwners, environment_, stage.owners})
    if (way != PIKORT_OWNERS_DEFAULT)
      return way;
  return PIKORT_OWNERS_PATTERN;
}

static int32_t ownersOfEnvironment() {
  const char *text = std::getenv("PIKO_RANK_OWNERS");
  std::string_view said = text ? text : "";
  if (said.empty())
    return PIKORT_OWNERS_DEFAULT;
  constexpr std::pair<std::string_view, int32_t> ways[] = {
      {"pattern", PIKORT_OWNERS_PATTERN},
      {"blocks", PIKORT_OWNERS_BLOCKS},
      {"morton", PIKORT_OWNERS_MORTON},
      {"load", PIKORT_OWNERS_LOAD}};
  for (auto [name, way] : ways)
    if (name == said)
      return way;
  throw Failure{
      PIKORT_INVALID_ARGUMENT,
      "PIKO_RANK_OWNERS: expected pattern, blocks, morton or load, but "
      "got '" +
          std::string(said) + "'"};
}

OwnedGrid &Owners::of(const Stage &stage) {
  int32_t way = wayOf(stage);
  for (OwnedGrid &grid : grids_)
    if (grid.way == way && grid.binSize == stage.binSize)
      return grid;
  OwnedGrid &grid = grids_.emplace_back();
  grid.binSize = stage.binSize;
  grid.grid = stage.grid;
  grid.way = way;
  assign(grid);
  return grid;
}

void Owners::beginRun() {
  environment_ = ownersOfEnvironment();
  for (const Stage &stage : p_.stages) {
    if (stage.partition != PIKOIR_BINS)
      continue;
    OwnedGrid &grid = of(stage);
    if (grid.grid != stage.grid) {
      grid.grid = stage.grid;
      assign(grid);
    }
  }
  for (OwnedGrid &grid : grids_) {
    std::fill(grid.ran.begin(), grid.ran.end(), false);
    std::fill(grid.load.begin(), grid.load.end(), 0);
  }
}

/// The bits of all coordinates, in turns.
static std::array<uint64_t, 4> mortonKey(const OwnedGrid &grid, int64_t bin) {
  std::array<uint64_t, 4> at{}, key{};
  for (size_t d = 0; d < at.size(); ++d) {
    at[d] = static_cast<uint64_t>(bin % grid.grid[d]);
    bin /= grid.grid[d];
  }
  for (unsigned bit = 0; bit < 64; ++bit)
    for (unsigned d = 0; d < 4; ++d) {
      unsigned place = 255 - (bit * 4 + d); // the highest bits come first
      key[place / 64] |= (at[d] >> bit & 1) << (63 - place % 64);
    }
  return key;
}

/// Cuts bins in their order where the sum of weights passes that of a share.
static void cut(OwnedGrid &grid, int32_t ranks, auto &&weightOf) {
  int64_t all = 0, before = 0;
  for (int32_t bin : grid.order)
    all += weightOf(bin);
  for (int32_t bin : grid.order) {
    int64_t weight = weightOf(bin);
    auto share = static_cast<__int128>(before + weight / 2) * ranks /
                 std::max<int64_t>(all, 1);
    grid.owners[static_cast<size_t>(bin)] = static_cast<int32_t>(
        std::min<__int128>(share, ranks - 1)); // one without weight may be last
    before += weight;
  }
}

void Owners::assign(OwnedGrid &grid) const {
  int64_t bins = 1;
  for (int64_t extent : grid.grid)
    bins *= extent;
  auto count = static_cast<size_t>(bins);
  grid.owners.assign(count, 0);
  grid.ran.assign(count, false);
  grid.load.assign(count, 0);
  grid.order.clear();
  if (grid.way == PIKORT_OWNERS_PATTERN) {
    for (int64_t bin = 0; bin < bins; ++bin) {
      int64_t sum = 0, rest = bin;
      for (int32_t d = 0, step = 1; d < p_.rank; ++d, step *= 3) {
        sum += rest % grid.grid[d] * step;
        rest /= grid.grid[d];
      }
      grid.owners[static_cast<size_t>(bin)] =
          static_cast<int32_t>(sum % ranks_);
    }
    return;
  }
  grid.order.resize(count);
  std::iota(grid.order.begin(), grid.order.end(), 0);
  if (grid.way != PIKORT_OWNERS_BLOCKS) {
    std::vector<std::array<uint64_t, 4>> keys(count);
    for (int64_t bin = 0; bin < bins; ++bin)
      keys[static_cast<size_t>(bin)] = mortonKey(grid, bin);
    std::sort(grid.order.begin(), grid.order.end(),
              [&](int32_t a, int32_t b) { return keys[a] < keys[b]; });
  }
  cut(grid, ranks_, [](int32_t) { return int64_t(1); });
}

void Owners::balance(OwnedGrid &grid, const std::vector<int64_t> &load) const {
  int64_t all = 0;
  std::vector<int64_t> shares(static_cast<size_t>(ranks_));
  // A bin is some work, too: pixels that are cleared and brought together.
  auto weightOf = [&](int32_t bin) {
    return load[static_cast<size_t>(bin)] + 16;
  };
  for (int32_t bin : grid.order) {
    all += weightOf(bin);
    shares[grid.owners[static_cast<size_t>(bin)]] += weightOf(bin);
  }
  // What moves is not in any cache of its new owner.
  int64_t most = *std::max_element(shares.begin(), shares.end());
  if (most * ranks_ <= all + all / 20)
    return;
  std::vector<int32_t> before = grid.owners;
  cut(grid, ranks_, weightOf);
  for (size_t bin = 0; bin < before.size(); ++bin)
    grid.moved += before[bin] != grid.owners[bin];
}
