// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Counters.h - What a program counts ---------------------------------===//
//
// A program that was compiled for counting says how much it does of what.
// Threads add to shards of a counter, which are summed when somebody asks. Of
// the elements of a piece of state a counter also keeps which of their bytes
// were accessed: a bit for each byte of a small record, for each four of a
// larger one.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_COUNTERS_H
#define PIKO_RUNTIME_COMMON_COUNTERS_H

#include "common/Memory.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

namespace piko::rt {

struct Counter {
  int32_t kind = -1;
  std::string stage;
  int32_t part = -1;   ///< A port or a piece of state.
  int32_t around = -1; ///< The counter of what it lies in.
  std::string place;

  void add(int64_t amount, int64_t bytes) noexcept;
  int64_t count() const;
  int64_t bytes() const;
  void reset();

  /// Forgets which bytes were accessed, unless as many elements are expected
  /// as before; throws OutOfMemory.
  void expect(Memory &memory, int64_t elements, int64_t recordSize);
  void touch(int64_t element, int64_t first, int64_t size) noexcept;
  int64_t distinct() const;
  int64_t distinctBytes() const;

private:
  static constexpr size_t shardCount = 16;
  struct alignas(64) Shard {
    std::atomic<int64_t> count{0}, bytes{0};
  };
  std::array<Shard, shardCount> shards;
  Array<uint64_t> touched; ///< The words of each element.
  int64_t elements = 0, recordSize = 1;
  /// Bytes that a bit stands for.
  int64_t share() const { return recordSize <= 64 ? 1 : 4; }
  int64_t words() const { return (recordSize / share() + 63) / 64; }
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_COUNTERS_H
