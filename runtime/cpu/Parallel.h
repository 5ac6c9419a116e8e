// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Parallel.h - Loops and scans over threads --------------------------===//
//
// The runtime's own parallelism. Bodies must not throw. Results never depend
// on the number of threads.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_PARALLEL_H
#define PIKO_RUNTIME_CPU_PARALLEL_H

#include "common/Memory.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <vector>

namespace piko::rt {

/// Calls body(i) for i in [0, n), in any order.
template <class Body>
void parallelFor(int32_t threads, int64_t n, const Body &body) {
  int count = static_cast<int>(std::min<int64_t>(threads, n));
  if (count <= 1) {
    for (int64_t i = 0; i < n; ++i)
      body(i);
    return;
  }
  // A dynamic loop of Debian's libomp takes a microsecond for each iteration.
  std::atomic<int64_t> next = 0;
#pragma omp parallel num_threads(count)
  for (int64_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < n;)
    body(i);
}

/// Calls body(begin, end) for pieces of [0, n).
template <class Body>
void parallelChunks(int32_t threads, int64_t n, int64_t chunk,
                    const Body &body) {
  parallelFor(threads, (n + chunk - 1) / chunk, [&](int64_t c) {
    body(c * chunk, std::min(n, (c + 1) * chunk));
  });
}

/// sums[i] = counts[0] + ... + counts[i - 1]; in place is allowed. Returns the
/// total, which may exceed 32 bits: then the sums are wrong.
inline uint64_t exclusiveScan(int32_t threads, const uint32_t *counts,
                              uint32_t *sums, int64_t n) {
  constexpr int64_t chunk = 1 << 16;
  int64_t chunks = (n + chunk - 1) / chunk;
  std::vector<uint64_t> base(static_cast<size_t>(chunks));
  if (chunks > 1)
    parallelChunks(threads, n, chunk, [&](int64_t begin, int64_t end) {
      uint64_t sum = 0;
      for (int64_t i = begin; i < end; ++i)
        sum += counts[i];
      base[static_cast<size_t>(begin / chunk)] = sum;
    });
  uint64_t total = 0;
  for (uint64_t &sum : base)
    total += std::exchange(sum, total);
  std::vector<uint64_t> last(base.size());
  parallelChunks(threads, n, chunk, [&](int64_t begin, int64_t end) {
    uint64_t sum = base[static_cast<size_t>(begin / chunk)];
    for (int64_t i = begin; i < end; ++i) {
      uint32_t count = counts[i];
      sums[i] = static_cast<uint32_t>(sum);
      sum += count;
    }
    last[static_cast<size_t>(begin / chunk)] = sum;
  });
  return last.empty() ? 0 : last.back();
}

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_PARALLEL_H
