// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Profile.h - Where the time of a run goes ---------------------------===//
//
// The thread that runs a pipeline is in one part at a time, and every tick from
// the begin to the end of a run belongs to one: the parts sum to the run's
// time.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_PROFILE_H
#define PIKO_RUNTIME_COMMON_PROFILE_H

#include "common/Clock.h"
#include "common/Memory.h"

#include <algorithm>
#include <array>
#include <utility>

namespace piko::rt {

enum class Part {
  State,      ///< Allocates and clears images and buffers.
  Program,    ///< Generated code outside of kernels, begins and ends runs.
  Join,       ///< Orders and bins what kernels take, and what they emitted.
  Kernel,     ///< Units of work, and waiting for those of other threads.
  Cycle,      ///< Decides what runs next in a cycle, and keeps its order.
  Allocation, ///< Gets memory from the system, and gives it back.
  Device,     ///< Waits for all of a run on a device.
};
constexpr size_t partCount = 7;

class Profile {
public:
  explicit Profile(Memory &memory) : memory_(memory) {}

  void begin() {
    started_ = std::chrono::steady_clock::now();
    first_ = last_ = ticks();
    mapped_ = memory_.countMapping();
    part_ = Part::State;
    now_ = {};
    skipped_ = toSkip_ = 0;
  }
  /// What follows belongs to `part`; returns the time.
  int64_t enter(Part part) {
    int64_t now = ticks(), mapped = memory_.mappingTicks();
    of(part_) += now - last_ - (mapped - mapped_);
    of(Part::Allocation) += mapped - mapped_;
    last_ = now;
    mapped_ = mapped;
    part_ = part;
    return now;
  }
  Part part() const { return part_; }
  int64_t runStart() const { return first_; }
  /// The thread goes on with a run that it has left.
  void resume() {
    last_ = ticks();
    mapped_ = memory_.countMapping();
  }

  /// A kernel that takes next to nothing begins in a cycle. To look at the
  /// clock would take longer, so only some are measured, and stand for those
  /// since.
  bool beginSmall() {
    if (skipped_ < toSkip_) {
      ++skipped_;
      return false;
    }
    int64_t before = last_;
    cycleTicks_ = enter(Part::Kernel) - before;
    return true;
  }
  /// The measured one ends; returns the ticks of all that it stands for.
  int64_t endSmall() {
    int64_t before = last_;
    int64_t took = enter(Part::Cycle) - before;
    int64_t others = std::min(took * std::exchange(skipped_, 0), cycleTicks_);
    of(Part::Kernel) += others;
    of(Part::Cycle) -= others;
    // No rhythm of a cycle's kernels should be met.
    random_ = random_ * 1664525 + 1013904223;
    toSkip_ = took < 2048 ? 4 + static_cast<int64_t>(random_ >> 30) : 0;
    return took + others;
  }
  /// Adds the run to the sums; returns how many ticks a millisecond had.
  double end() {
    enter(Part::Program);
    double milliseconds = std::chrono::duration<double, std::milli>(
                              std::chrono::steady_clock::now() - started_)
                              .count();
    double rate = static_cast<double>(last_ - first_) / milliseconds;
    if (!(rate > 0))
      rate = defaultTickRate;
    for (size_t part = 0; part < partCount; ++part)
      sums_[part] += static_cast<double>(now_[part]) / rate;
    return rate;
  }
  /// Since the latest reset.
  double milliseconds(Part part) const {
    return sums_[static_cast<size_t>(part)];
  }
  void reset() { sums_ = {}; }

private:
  int64_t &of(Part part) { return now_[static_cast<size_t>(part)]; }

  Memory &memory_;
  std::chrono::steady_clock::time_point started_;
  int64_t first_ = 0, last_ = 0, mapped_ = 0;
  Part part_ = Part::Program;
  std::array<int64_t, partCount> now_{}; ///< Ticks of this run.
  int64_t skipped_ = 0, toSkip_ = 0; ///< Small kernels, since a measured one.
  int64_t cycleTicks_ = 0;           ///< Of the cycle, with those.
  uint32_t random_ = 1;
  std::array<double, partCount> sums_{};
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_PROFILE_H
