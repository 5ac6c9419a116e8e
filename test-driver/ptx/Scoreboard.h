// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Scoreboard.h - When a warp's results are there ---------------------===//
//
// A warp issues its instructions in order, one a cycle, and each waits until
// the registers that it reads are there. With no other warp beside it this is
// how long it takes: its part of a launch's *span*, in the terms of work and
// span. There are two times of everything: of a device whose first-level cache
// has all that the launch has touched before, and of one where each block has
// its part alone. What is not there is in the second level. A fence empties
// both, as it does where first-level caches are not coherent.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_SCOREBOARD_H
#define PIKO_TEST_DRIVER_PTX_SCOREBOARD_H

#include "ptx/text/Program.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace piko::ptx {

/// Cycles from issue until a result is there: of arithmetic, and of loads by
/// where they find it.
struct Latencies {
  double arithmetic = 0, shared = 0, hit = 0, miss = 0;
  /// Of the first-level cache of a multiprocessor, with the shared memory that
  /// is in the same array; 0: a block has 8 KB.
  uint64_t cacheBytes = 0;
};

/// Cycles, at least and at most.
struct Time {
  double least = 0, most = 0;

  Time after(Time other) const {
    return {least + other.least, most + other.most};
  }
  void wait(Time other) {
    least = least < other.least ? other.least : least;
    most = most < other.most ? other.most : most;
  }
};

/// What a block has of a first-level cache: direct-mapped.
class SectorCache {
public:
  void reset(uint64_t bytes) {
    sectors.assign(std::max<uint64_t>(bytes / 32, 1), none);
  }
  void clear() { std::fill(sectors.begin(), sectors.end(), none); }
  /// Whether a sector is there, which it is then.
  bool access(uint64_t sector) {
    return std::exchange(sectors[sector % sectors.size()], sector) == sector;
  }

private:
  static constexpr uint64_t none = ~uint64_t(0);
  std::vector<uint64_t> sectors;
};

class Scoreboard {
public:
  /// Begins at 0, with all registers there.
  void reset(const Program &program);
  void issue(const Program &program, uint32_t pc, const Latencies &latencies);
  /// Where the load that was issued last found what it reads: in the cache that
  /// has all, in the block's part.
  void load(const Program &program, uint32_t pc, const Latencies &latencies,
            bool all, bool part);
  /// Takes the last instruction back, which has not been run.
  void takeBack() { now = before; }
  /// A loop that waits for memory to change sleeps: however often it does, it
  /// takes the time of its last iteration alone.
  void sleep(uint32_t pc);
  /// What sleeps next is another loop.
  void endLoop() { sleptAt = nowhere; }

  Time now;

private:
  Time before, issued, slept;
  uint32_t sleptAt = nowhere;
  std::vector<Time> ready; ///< By register.
};

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_SCOREBOARD_H
