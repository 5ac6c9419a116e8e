// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Serial.h - Launches that are too small for threads -----------------===//
//
// A cycle may hold little for a long time. To spread that over threads, to
// count it in all bins and to join what they emitted would take longer than its
// work. A serial launch takes its input where it lies, on the calling thread,
// in the order of processing: buckets that hold something, and the items in
// each. One lane logs what is emitted, in that order and with its number, until
// the cycle has taken it. So a launch costs what is in it, however many bins
// and threads there are, and allocates nothing that the one before it has not.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_SERIAL_H
#define PIKO_RUNTIME_CPU_SERIAL_H

#include "cpu/Queue.h"

namespace piko::rt {

/// Pairs by bucket, for what is little in comparison with the number of
/// buckets.
class PairOrder {
public:
  /// The entries of one that is sorted: the bucket and the pair's number.
  static int64_t bucketOf(uint64_t entry) {
    return static_cast<int64_t>(entry >> 32);
  }
  static uint32_t pairOf(uint64_t entry) {
    return static_cast<uint32_t>(entry);
  }

  /// Takes the pairs as they come.
  void read(const Items &input);
  void sort();
  const std::vector<uint64_t> &entries() const { return entries_; }
  uint32_t itemOf(uint32_t pair) const {
    return items_.empty() ? pair : items_[pair];
  }
  /// They came in the order of processing.
  bool isSorted() const { return sorted_; }

private:
  std::vector<uint64_t> entries_;
  std::vector<uint32_t> items_; ///< Of each pair; none = one pair each.
  bool sorted_ = true;
};

/// Whether pairs are in the order of processing.
bool isSorted(const Items &input);

/// Cuts sorted pairs into runs of neighbouring buckets, and sets the first
/// position of each of these buckets and of the one after.
void cutRuns(const std::vector<uint64_t> &entries, int64_t *offsets,
             std::vector<pikoir_unit> &runs);

class Serial {
public:
  /// The most primitives, or pairs, of a launch.
  static constexpr int64_t most = int64_t(1) << 14;
  /// Up to here, threads cost more than they could bring.
  static constexpr int64_t fewest = 32;

  Serial(pikort_pipeline &p, Kernel &kernel);
  Serial(const Serial &) = delete;
  Serial &operator=(const Serial &) = delete;

  /// Whether it pays to run so many primitives, or pairs, like this.
  static bool takes(const pikort_pipeline &p, Kernel &kernel, int64_t count);
  /// Sets the kernel's input, which stays where it is until the end.
  void begin(const Items &input);
  /// Opens a unit.
  pikoir_writer *open(int64_t unit);
  /// Makes what was emitted ready to be taken.
  void end();

  // What was emitted, from the end of a launch to the begin of the next.

  /// What a port has: `numbers` counts, from 0, over all ports in the order of
  /// emission; primitives that went nowhere have a number as well.
  struct Emitted : Items {
    const uint32_t *numbers = nullptr;
  };
  const std::vector<Emitted> &ports() const { return ports_; }
  int64_t emitted() const { return lane_.ordinal; }
  /// Positions, or calls.
  int64_t slots() const;
  uint32_t itemAt(int64_t position) const {
    return order_.empty() ? static_cast<uint32_t>(position)
                          : order_[static_cast<size_t>(position)];
  }
  /// How much was emitted up to the end of a slot.
  uint32_t emittedUntil(int64_t slot) const {
    return slotEnds_[static_cast<size_t>(slot)];
  }

  /// The time of a launch that threads could have had, to judge the next by.
  void noteTicks(int64_t ticks);

private:
  /// Of a port: what is in several segments of a log, in one piece.
  struct Pieces {
    Growing<uint8_t> records, buckets, ordinals;
  };

  void binPairs(const Items &input);
  void binPair(int64_t bucket);
  void countPairs();
  void makeCalls();
  void rewind(size_t port);
  void collect(size_t port);

  pikort_pipeline &p_;
  Kernel &kernel_;
  const Stage &stage_;
  Lane &lane_;
  PairOrder pairs_;
  std::vector<uint32_t> order_;  ///< Position to item; none = identity.
  std::vector<uint32_t> places_; ///< The same, where the input has an index.
  std::vector<pikoir_call> calls_;
  std::vector<uint32_t> slotEnds_;
  Array<int64_t> offsets_;
  std::vector<Emitted> ports_;
  std::vector<Pieces> pieces_;
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_SERIAL_H
