// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Queue.h - Arrays that grow, and primitives that wait ---------------===//

#ifndef PIKO_RUNTIME_CPU_QUEUE_H
#define PIKO_RUNTIME_CPU_QUEUE_H

#include "cpu/Kernel.h"

#include <cstring>

namespace piko::rt {

/// An array that grows by doubling.
template <class T> class Growing {
public:
  Growing() = default;
  Growing(Growing &&other) noexcept
      : array_(std::move(other.array_)), size_(std::exchange(other.size_, 0)) {}
  Growing &operator=(Growing &&other) noexcept {
    array_ = std::move(other.array_);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }

  int64_t size() const { return size_; }
  T *data() const { return array_.data(); }
  T &operator[](int64_t i) const { return array_[i]; }

  /// Room for `count` more, not initialised. Throws OutOfMemory.
  T *extend(Memory &memory, int64_t count) {
    if (size_ + count > array_.capacity()) [[unlikely]]
      grow(memory, size_ + count);
    size_ += count;
    return array_.data() + size_ - count;
  }
  void append(Memory &memory, const T *from, int64_t count) {
    if (count > 0)
      std::memcpy(extend(memory, count), from,
                  static_cast<size_t>(count) * sizeof(T));
  }
  void shrink(int64_t size) { size_ = size; }
  /// Drops all elements, but no memory that is worth keeping.
  void reset() {
    constexpr int64_t kept = int64_t(64) << 10;
    if (array_.capacity() * static_cast<int64_t>(sizeof(T)) > kept)
      array_ = {};
    size_ = 0;
  }
  Array<T> take() {
    size_ = 0;
    return std::move(array_);
  }

private:
  [[gnu::noinline]] void grow(Memory &memory, int64_t size) {
    Array<T> larger(memory, std::max(size, 2 * size_));
    if (size_ > 0)
      std::memcpy(larger.data(), array_.data(),
                  static_cast<size_t>(size_) * sizeof(T));
    array_ = std::move(larger);
  }

  Array<T> array_;
  int64_t size_ = 0;
};

/// Primitives on their way to a stage, in the order in which they came.
struct Queue {
  int64_t count = 0;
  Growing<uint8_t> items;
  Growing<uint32_t> pairs;
  Growing<uint64_t> words; ///< Of keys.
  Growing<uint32_t> nodes; ///< In the tree of a loop, if there is one.
  /// In place of all but nodes, if it has items: what came alone.
  Stream whole;

  /// Takes what comes over if nothing is here and it is worth that; else
  /// appends it.
  void add(Memory &memory, Stream &&stream, int64_t size, int32_t keyWidth) {
    constexpr int64_t worth = int64_t(16) << 10;
    if (count > 0 || stream.count * size < worth ||
        (keyWidth > 0 && stream.keys.width != keyWidth))
      return append(memory, stream, size, keyWidth);
    count = stream.count;
    whole = std::move(stream);
  }

  /// Appends items of `size` bytes with keys of `keyWidth` words (0 = none).
  void append(Memory &memory, const Stream &stream, int64_t size,
              int32_t keyWidth) {
    if (whole.count > 0) {
      Stream first = std::exchange(whole, {});
      count = 0;
      append(memory, first, size, keyWidth);
    }
    append(memory, stream, size);
    if (keyWidth > 0) {
      uint64_t *to = words.extend(memory, stream.count * keyWidth);
      for (int64_t i = 0; i < stream.count; ++i)
        for (int32_t w = 0; w < keyWidth; ++w)
          *to++ = stream.keys.word(i, w);
    }
  }

  int64_t pairCount() const {
    return whole.count > 0 ? whole.pairCount : pairs.size();
  }
  int64_t bytes() const {
    return items.size() + 4 * pairs.size() + 8 * words.size();
  }
  /// What it held at some time, without nodes. It has taken nothing over.
  struct Mark {
    int64_t count = 0, bytes = 0, pairs = 0, words = 0;
  };
  Mark mark() const {
    return {count, items.size(), pairs.size(), words.size()};
  }
  /// Drops what came since.
  void rewind(const Mark &mark) {
    count = mark.count;
    items.shrink(mark.bytes);
    pairs.shrink(mark.pairs);
    words.shrink(mark.words);
  }

  void reset() {
    count = 0;
    whole = {};
    items.reset();
    pairs.reset();
    words.reset();
    nodes.reset();
  }

  /// All items, which stay here.
  Items view() const {
    if (whole.count > 0)
      return whole;
    return {items.data(), count, pairs.data(), pairs.size()};
  }

  /// All items, without their nodes; the queue is empty then.
  Stream take(int32_t keyWidth) {
    Stream stream;
    if (whole.count > 0) {
      count = 0;
      return std::exchange(whole, {});
    }
    stream.count = std::exchange(count, 0);
    stream.pairCount = pairs.size();
    stream.itemStorage = items.take();
    stream.pairStorage = pairs.take();
    stream.items = stream.itemStorage.data();
    stream.pairs = stream.pairStorage.data();
    stream.keys.width = keyWidth;
    stream.keys.words = words.take();
    return stream;
  }

private:
  void append(Memory &memory, const Items &added, int64_t size) {
    if (added.index) {
      uint8_t *to = items.extend(memory, added.count * size);
      for (int64_t i = 0; i < added.count; ++i)
        std::memcpy(to + i * size, added.item(i, size),
                    static_cast<size_t>(size));
    } else {
      items.append(memory, added.items, added.count * size);
    }
    pairs.append(memory, added.pairs, added.pairCount);
    count += added.count;
  }
};

/// Appends what came along an edge to its queue; throws.
void enqueue(pikort_pipeline &p, Edge &edge, const Stream &stream);
/// The same for what is its own: it may stay where it is.
void enqueue(pikort_pipeline &p, Edge &edge, Stream &&stream);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_QUEUE_H
