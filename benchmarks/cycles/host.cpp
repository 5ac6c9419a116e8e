// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- host.cpp - Times one pipeline of cycles.piko.cpp -------------------===//
//
// Built twice by cycles.py: with a header of pikoc, and as the reference.
// Prints the best run in nanoseconds for each hop, and a hash of the result.
//
//===----------------------------------------------------------------------===//

#include HEADER

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

int main(int argc, char **argv) {
  if (argc != 5)
    return 2; // WALKERS HOPS THREADS SECONDS
  int walkers = std::atoi(argv[1]), hops = std::atoi(argv[2]);
  std::vector<WALKER> source(walkers);
  for (int i = 0; i < walkers; ++i) {
    source[i] = {};
    source[i].index = i;
    source[i].left = hops;
    source[i].x = i * 37 % 1024;
    source[i].y = i * 11 % 768;
  }
  std::vector<float> sums(walkers);
  PIPE pipe;
#ifdef REFERENCE
  pipe.state().sums.bind(sums.data(), walkers);
#else
  pipe.setThreads(std::atoi(argv[3]));
  pipe.state().sums.bind(sums);
#endif
  pipe.setDomain({1024, 768});
  pipe.feed(pipe.hop, source);

  using Clock = std::chrono::steady_clock;
  double best = 1e30, spent = 0;
  for (int run = 0; run < 3 || spent < 1e9 * std::atof(argv[4]); ++run) {
    auto start = Clock::now();
#ifdef REFERENCE
    pipe.run();
#else
    pipe.run().orThrow();
#endif
    double now =
        std::chrono::duration<double, std::nano>(Clock::now() - start).count();
    best = std::min(best, now);
    spent += now;
  }
  uint64_t hash = 0;
  for (float sum : sums) {
    uint32_t bits;
    std::memcpy(&bits, &sum, sizeof bits);
    hash = hash * 1000003 + bits;
  }
  std::printf("%.2f %llx\n", best / (double(walkers) * hops),
              static_cast<unsigned long long>(hash));
}
