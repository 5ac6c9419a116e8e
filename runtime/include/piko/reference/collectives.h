//===- piko/reference/collectives.h - Reductions, scans, sorts ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The order of combination is a fixed binary tree over the index, so that
// floating-point results do not depend on how the work is spread.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_COLLECTIVES_H
#define PIKO_REFERENCE_COLLECTIVES_H

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <type_traits>
#include <vector>

namespace piko::reference {

/// Combines neighbours, then neighbouring pairs, and so on: at distance
/// s = 1, 2, 4, ..., v[i] becomes op(v[i], v[i + s]) for each i that is a
/// multiple of 2s with i + s < n. The result is v[0]; `empty` where n is 0.
template <class T, class Op> T reduceTree(std::vector<T> v, Op op, T empty) {
  int64_t n = static_cast<int64_t>(v.size());
  for (int64_t s = 1; s < n; s *= 2)
    for (int64_t i = 0; i + s < n; i += 2 * s)
      v[i] = op(v[i], v[i + s]);
  return n == 0 ? empty : v[0];
}

/// The exclusive scan: element i combines the elements before i, from the left
/// and in the largest aligned blocks of 2^k elements, each block reduced as by
/// reduceTree. Element 0 is `empty`.
template <class T, class Op>
std::vector<T> scanTree(const std::vector<T> &v, Op op, T empty) {
  int64_t n = static_cast<int64_t>(v.size());
  // blocks[k][j] reduces the elements [j * 2^k, (j + 1) * 2^k).
  std::vector<std::vector<T>> blocks{v};
  while (blocks.back().size() > 1) {
    const std::vector<T> &last = blocks.back();
    std::vector<T> next(last.size() / 2, empty);
    for (size_t j = 0; j < next.size(); ++j)
      next[j] = op(last[2 * j], last[2 * j + 1]);
    blocks.push_back(std::move(next));
  }
  std::vector<T> result(v.size(), empty);
  for (int64_t i = 1; i < n; ++i) {
    int64_t at = 0;
    for (int k = static_cast<int>(blocks.size()) - 1; k >= 0; --k) {
      if (!(i >> k & 1))
        continue;
      T block = blocks[k][at >> k];
      result[i] = at == 0 ? block : op(result[i], block);
      at += int64_t(1) << k;
    }
  }
  return result;
}

/// The indices of `keys` in ascending order of key, equal keys in order of
/// index, NaNs last.
template <class K>
std::vector<int64_t> sortedIndices(const std::vector<K> &keys) {
  std::vector<int64_t> indices(keys.size());
  std::iota(indices.begin(), indices.end(), int64_t(0));
  // NaNs are equal to each other and greater than all else.
  auto isLess = [](const K &a, const K &b) {
    if constexpr (std::is_floating_point_v<K>)
      if (b != b)
        return a == a;
    return a < b;
  };
  std::sort(indices.begin(), indices.end(), [&](int64_t a, int64_t b) {
    if (isLess(keys[a], keys[b]))
      return true;
    return !isLess(keys[b], keys[a]) && a < b;
  });
  return indices;
}

} // namespace piko::reference

#endif // PIKO_REFERENCE_COLLECTIVES_H
