// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Memory.cpp - Memory that is kept from frame to frame ---------------===//

#include "common/Memory.h"
#include "common/Accelerator.h"
#include "common/Clock.h"

#include <algorithm>
#include <bit>
#include <fstream>
#include <string>
#include <sys/mman.h>

using namespace piko::rt;

namespace {

constexpr size_t page = 4096;
constexpr size_t hugePage = size_t(2) << 20;
/// A free block is unmapped when this many frames did not need it.
constexpr int64_t framesKept = 8;

/// Powers of two up to a huge page; above, eight sizes for each doubling. So
/// sizes that differ a little from frame to frame find the same block.
size_t roundUp(size_t bytes) {
  bytes = std::max(bytes, page);
  size_t below = std::bit_floor(bytes);
  size_t step = bytes <= hugePage ? below : std::max(below / 8, page);
  return (bytes + step - 1) / step * step;
}

/// A mapping that does not fit into memory is granted all the same, and the
/// process killed when it writes there. So large ones ask first.
bool isAvailable(size_t bytes) {
  if (bytes < (size_t(256) << 20))
    return true;
  auto fits = [&](const char *path, const char *key, size_t unit) {
    std::ifstream file(path);
    std::string word;
    size_t amount;
    while (*key && file >> word && word != key)
      ;
    return !(file >> amount) || bytes / unit <= amount;
  };
  return fits("/proc/meminfo", "MemAvailable:", 1024) &&
         fits("/sys/fs/cgroup/memory.max", "", 1);
}

/// What is mapped for a block, of which large ones begin at a huge page.
size_t mappedBytes(size_t bytes) {
  return bytes >= hugePage ? bytes + hugePage : bytes;
}

/// Maps memory, at `hint` if that is free; null if refused.
uint8_t *mapSystem(size_t bytes, uint8_t *hint) {
  if (!isAvailable(bytes))
    return nullptr;
  bool huge = bytes >= hugePage;
  size_t mapped = mappedBytes(bytes);
  void *raw = mmap(hint, mapped, PROT_READ | PROT_WRITE,
                   MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (raw == MAP_FAILED)
    return nullptr;
  auto *start = static_cast<uint8_t *>(raw);
  if (!huge)
    return start;
  auto address = reinterpret_cast<uintptr_t>(start);
  size_t before = (hugePage - address % hugePage) % hugePage;
  if (before)
    munmap(start, before);
  if (size_t after = hugePage - before)
    munmap(start + before + bytes, after);
  madvise(start + before, bytes, MADV_HUGEPAGE);
  return start + before;
}

} // namespace

Memory::~Memory() { unmapAllFree(); }

// --- What the system takes --------------------------------------------------

class Memory::MappingTimer {
public:
  explicit MappingTimer(Memory &memory)
      : ticks_(std::this_thread::get_id() == memory.counted_
                   ? &memory.mappingTicks_
                   : nullptr),
        start_(ticks()) {}
  ~MappingTimer() {
    if (ticks_)
      *ticks_ += ticks() - start_;
  }

private:
  int64_t *ticks_;
  int64_t start_;
};

int64_t Memory::countMapping() {
  std::lock_guard<std::mutex> lock(mutex_);
  counted_ = std::this_thread::get_id();
  return mappingTicks_;
}

uint8_t *Memory::findRoom(size_t bytes) {
  constexpr size_t least = size_t(1) << 30;
  if (room_ + bytes > roomEnd_) {
    size_t all = std::max(least, 4 * bytes);
    void *found = mmap(nullptr, all, PROT_NONE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (found == MAP_FAILED)
      return nullptr;
    munmap(found, all);
    room_ = reinterpret_cast<uintptr_t>(found);
    roomEnd_ = room_ + all;
  }
  return reinterpret_cast<uint8_t *>(std::exchange(room_, room_ + bytes));
}

uint8_t *Memory::map(size_t bytes) {
  MappingTimer timer(*this);
  if (accelerator_)
    return isAvailable(bytes) ? accelerator_->map(bytes) : nullptr;
  return mapSystem(bytes, findRoom(mappedBytes(bytes)));
}

void Memory::unmap(uint8_t *data, size_t bytes) {
  MappingTimer timer(*this);
  if (accelerator_)
    accelerator_->unmap(data);
  else
    munmap(data, bytes);
}

// --- Blocks -----------------------------------------------------------------

void Memory::unmapAllFree() {
  for (auto &[bytes, block] : free_) {
    unmap(block.data, bytes);
    reserved_ -= static_cast<int64_t>(bytes);
  }
  free_.clear();
}

Block Memory::acquire(size_t wanted, Use use) {
  if (wanted > size_t(INT64_MAX) / 4)
    throw OutOfMemory{INT64_MAX};
  size_t bytes = roundUp(wanted);
  auto signedBytes = static_cast<int64_t>(bytes);
  std::lock_guard<std::mutex> lock(mutex_);
  Block block;
  auto fitsBins = [&](size_t size) {
    return use != Use::Bins || binLimit_ == 0 ||
           binBytes_ + static_cast<int64_t>(size) <= binLimit_;
  };
  if (!fitsBins(bytes))
    throw OutOfMemory{signedBytes};
  // The smallest free block that fits, if it does not waste too much.
  auto found = free_.lower_bound(bytes);
  if (found != free_.end() && found->first <= bytes + bytes / 2 &&
      fitsBins(found->first)) {
    // Of equal ones the latest, which may still be in a cache.
    found = std::prev(free_.upper_bound(found->first));
    block = {found->second.data, found->first};
    free_.erase(found);
  } else {
    auto over = [&] { return limit_ > 0 && reserved_ + signedBytes > limit_; };
    if (over())
      unmapAllFree();
    if (!over())
      block = {map(bytes), bytes};
    if (!block.data)
      throw OutOfMemory{signedBytes};
    reserved_ += signedBytes;
  }
  if (use == Use::Bins) {
    binBytes_ += static_cast<int64_t>(block.bytes);
    peak_ = std::max(peak_, binBytes_);
    peakSinceMark_ = std::max(peakSinceMark_, binBytes_);
  }
  return block;
}

void Memory::release(Block block, Use use) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (use == Use::Bins)
    binBytes_ -= static_cast<int64_t>(block.bytes);
  try {
    free_.emplace(block.bytes, Free{block.data, frame_});
  } catch (...) { // no memory to remember it
    unmap(block.data, block.bytes);
    reserved_ -= static_cast<int64_t>(block.bytes);
  }
}

void Memory::endFrame() {
  std::lock_guard<std::mutex> lock(mutex_);
  ++frame_;
  for (auto it = free_.begin(); it != free_.end();) {
    if (it->second.frame + framesKept >= frame_) {
      ++it;
      continue;
    }
    unmap(it->second.data, it->first);
    reserved_ -= static_cast<int64_t>(it->first);
    it = free_.erase(it);
  }
}

void Memory::setLimit(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  limit_ = bytes;
  if (limit_ > 0 && reserved_ > limit_)
    unmapAllFree();
}

int64_t Memory::limit() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return limit_;
}

void Memory::setBudget(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  budget_ = bytes;
}

int64_t Memory::budget() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return budget_;
}

void Memory::limitBins(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  binLimit_ = bytes;
}

int64_t Memory::markBins() {
  std::lock_guard<std::mutex> lock(mutex_);
  return peakSinceMark_ = binBytes_;
}

int64_t Memory::peakSinceMark() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return peakSinceMark_;
}

int64_t Memory::reserved() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return reserved_;
}

int64_t Memory::peak() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return peak_;
}

void Memory::noteOthers(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  peak_ = std::max(peak_, binBytes_ + bytes);
}

void Memory::resetPeak() {
  std::lock_guard<std::mutex> lock(mutex_);
  peak_ = binBytes_;
}

// --- Memory of a device -----------------------------------------------------

bool DeviceBytes::resize(Accelerator &from, int64_t size) {
  if (data_ && size_ == size)
    return false;
  data_.reset();
  uint8_t *data =
      from.allocate(static_cast<size_t>(std::max<int64_t>(size, 1)));
  if (!data)
    throw OutOfMemory{size};
  data_ = {data, Release{&from}};
  size_ = size;
  return true;
}
