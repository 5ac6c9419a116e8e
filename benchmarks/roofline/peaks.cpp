// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- peaks.cpp - What one core can do at most ---------------------------===//
//
// Prints the GB/s of a triad, a[i] = b[i] + s * c[i], over arrays that no cache
// holds, and the GFLOP/s of independent chains of fused multiply-adds: the best
// of many passes, in so many seconds for each.
//
//   peaks SECONDS MEGABYTES    of each of the three arrays
//
//===----------------------------------------------------------------------===//

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

#ifdef __AVX512F__
constexpr int vectorBytes = 64;
#elif defined(__AVX__)
constexpr int vectorBytes = 32;
#else
constexpr int vectorBytes = 16;
#endif
using Vector [[gnu::vector_size(vectorBytes)]] = float;
constexpr int lanes = vectorBytes / 4;

/// As many chains as hide the latency of two units, and fit in 16 registers.
constexpr int chains = 10;
constexpr long steps = 100000;

/// The shortest pass, in seconds.
template <class Pass> double measure(double seconds, Pass &&pass) {
  double best = 1e30;
  auto begin = Clock::now();
  do {
    auto start = Clock::now();
    pass();
    best = std::min(
        best, std::chrono::duration<double>(Clock::now() - start).count());
  } while (std::chrono::duration<double>(Clock::now() - begin).count() <
           seconds);
  return best;
}

[[gnu::noinline]] void triad(float *__restrict a, const float *b,
                             const float *c, float s, size_t n) {
  for (size_t i = 0; i < n; ++i)
    a[i] = b[i] + s * c[i];
}

[[gnu::noinline]] Vector multiplyAdd(Vector x, Vector y) {
  Vector sums[chains];
  for (int k = 0; k < chains; ++k)
    sums[k] = x + float(k);
  for (long i = 0; i < steps; ++i)
    for (int k = 0; k < chains; ++k)
      sums[k] = sums[k] * x + y;
  for (int k = 1; k < chains; ++k)
    sums[0] += sums[k];
  return sums[0];
}

} // namespace

int main(int argc, char **argv) {
  double seconds = argc > 1 ? std::atof(argv[1]) : 1;
  size_t megabytes = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 256;
  size_t n = megabytes * 1000000 / sizeof(float);
  if (n == 0) {
    std::fprintf(stderr, "usage: %s [SECONDS [MEGABYTES]]\n", argv[0]);
    return 1;
  }
  std::vector<float> a(n), b(n, 1.0f), c(n, 2.0f);
  double time =
      measure(seconds, [&] { triad(a.data(), b.data(), c.data(), 0.5f, n); });
  std::printf("GB/s %.2f\n", double(3 * n * sizeof(float)) / time * 1e-9);
  Vector x = Vector{} + 0.999f, y = Vector{} + 0.001f;
  time = measure(seconds, [&] { y = multiplyAdd(x, y * 0.5f); });
  std::printf("GFLOP/s %.2f\n",
              2.0 * lanes * chains * double(steps) / time * 1e-9);
  return a[n / 2] + y[0] > 0 ? 0 : 1; // what was computed is needed
}
