// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Memory.h - Memory that is kept from frame to frame -----------------===//
//
// A pipeline's memory. Blocks are mapped from the system once and go back to a
// free list when released, so that a frame like the one before maps nothing
// and faults no page. Invariant: reserved() = bytes in use + bytes free, and
// reserved() never exceeds the limit, nor what bins hold theirs.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_MEMORY_H
#define PIKO_RUNTIME_COMMON_MEMORY_H

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace piko::rt {

class Accelerator;

/// Thrown inside the runtime, and caught at its boundary.
struct OutOfMemory {
  int64_t bytes; ///< What was asked for.
};

struct Block {
  uint8_t *data = nullptr;
  size_t bytes = 0; ///< Capacity: at least what was asked for.
};

/// What memory is for: only bins count towards the peak.
enum class Use { Bins, State };

/// Thread safe.
class Memory {
public:
  Memory() = default;
  Memory(const Memory &) = delete;
  Memory &operator=(const Memory &) = delete;
  ~Memory();

  /// A block of at least `bytes`, aligned to a page; throws OutOfMemory.
  Block acquire(size_t bytes, Use use);
  /// Gives a block back to the free list.
  void release(Block block, Use use);
  /// Unmaps blocks that no recent frame used.
  void endFrame();

  /// Before the first block: where all memory comes from in place of the
  /// system. It outlives the memory.
  void setAccelerator(Accelerator *from) { accelerator_ = from; }

  /// From here on what this thread takes to map and unmap is counted.
  int64_t countMapping();
  /// Ticks so far; for that thread.
  int64_t mappingTicks() const { return mappingTicks_; }

  void setLimit(int64_t bytes);
  int64_t limit() const;
  /// The host's budget for bins; what enforces it is limitBins().
  void setBudget(int64_t bytes);
  int64_t budget() const;
  /// Refuses what would make bins larger; 0 = no limit.
  void limitBins(int64_t bytes);
  /// Bytes of bins now; from here on peakSinceMark() counts.
  int64_t markBins();
  int64_t peakSinceMark() const;
  int64_t reserved() const;
  int64_t peak() const;
  /// Counts bins that lie elsewhere, at the same time as those here.
  void noteOthers(int64_t bytes);
  void resetPeak();

private:
  struct Free {
    uint8_t *data;
    int64_t frame; ///< When it was last in use.
  };
  class MappingTimer;
  /// Where to map next: after the block before, so that an index can reach
  /// from one to the other. Small blocks would go into any gap.
  uint8_t *findRoom(size_t bytes);
  uint8_t *map(size_t bytes);
  void unmap(uint8_t *data, size_t bytes);
  void unmapAllFree();

  Accelerator *accelerator_ = nullptr;
  mutable std::mutex mutex_;
  std::multimap<size_t, Free> free_;
  uintptr_t room_ = 0, roomEnd_ = 0; ///< Address space that was free.
  int64_t limit_ = 0;
  int64_t reserved_ = 0;
  int64_t binBytes_ = 0;
  int64_t peak_ = 0;
  int64_t peakSinceMark_ = 0;
  int64_t budget_ = 0;
  int64_t binLimit_ = 0;
  int64_t frame_ = 0;
  std::thread::id counted_; ///< Whose mapping is counted.
  int64_t mappingTicks_ = 0;
};

/// An array of trivial elements in a block. Uninitialised when made.
template <class T> class Array {
public:
  Array() = default;
  Array(Memory &memory, int64_t size, Use use = Use::Bins)
      : memory_(&memory), use_(use), size_(size) {
    size_t bytes;
    if (size < 0 ||
        __builtin_mul_overflow(static_cast<size_t>(size), sizeof(T), &bytes))
      throw OutOfMemory{INT64_MAX};
    block_ = memory.acquire(bytes, use);
  }
  /// Of memory that is another's.
  static Array borrow(T *data, int64_t size) {
    Array array;
    array.block_ = {reinterpret_cast<uint8_t *>(data),
                    static_cast<size_t>(size) * sizeof(T)};
    array.size_ = size;
    return array;
  }
  Array(Array &&other) noexcept { swap(other); }
  Array &operator=(Array &&other) noexcept {
    Array taken(std::move(other));
    swap(taken);
    return *this;
  }
  ~Array() {
    if (block_.data && memory_)
      memory_->release(block_, use_);
  }

  T *data() const { return reinterpret_cast<T *>(block_.data); }
  int64_t size() const { return size_; }
  int64_t capacity() const {
    return static_cast<int64_t>(block_.bytes / sizeof(T));
  }
  T &operator[](int64_t i) const { return data()[i]; }
  explicit operator bool() const { return block_.data != nullptr; }
  bool isBorrowed() const { return block_.data && !memory_; }

private:
  void swap(Array &other) {
    std::swap(memory_, other.memory_);
    std::swap(block_, other.block_);
    std::swap(use_, other.use_);
    std::swap(size_, other.size_);
  }

  Memory *memory_ = nullptr;
  Block block_;
  Use use_ = Use::Bins;
  int64_t size_ = 0;
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_MEMORY_H
