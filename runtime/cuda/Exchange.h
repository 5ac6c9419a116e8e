// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Exchange.h - What host and device say to each other in a frame -----===//
//
// Memory of which both have a copy. The host takes it piece by piece while it
// records a frame, and writes its copy, with the device's addresses in it; one
// copy brings it to the device before the frame, and another one brings what
// the device says back. The same requests get the same pieces, so that a frame
// like the one before is the same graph.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_EXCHANGE_H
#define PIKO_RUNTIME_CUDA_EXCHANGE_H

#include "common/Accelerator.h"
#include "common/Memory.h"

#include <algorithm>
#include <new>
#include <type_traits>
#include <vector>

namespace piko::cuda {

class Exchange {
public:
  explicit Exchange(rt::Accelerator &device) : device_(device) {}
  Exchange(const Exchange &) = delete;
  Exchange &operator=(const Exchange &) = delete;
  ~Exchange();

  /// Begins again with the first piece.
  void reset();
  /// So many elements, zero; throws OutOfMemory.
  template <class T> T *take(int64_t count = 1) {
    static_assert(std::is_trivially_destructible_v<T>);
    auto *taken = reinterpret_cast<T *>(
        takeBytes(static_cast<size_t>(count) * sizeof(T)));
    return std::launder(taken);
  }
  /// One that is zero, and after it copies of elements.
  template <class T, class... Elements>
  T &takeWith(const std::vector<Elements> &...elements) {
    size_t bytes =
        sizeof(T) + (size_t(0) + ... + (elements.size() * sizeof(Elements)));
    uint8_t *room = takeBytes(bytes);
    T &taken = *new (room) T{};
    room += sizeof(T);
    (..., put(room, elements));
    return taken;
  }
  /// Copies alone.
  template <class T> const T *copy(const std::vector<T> &elements) {
    uint8_t *room = takeBytes(elements.size() * sizeof(T)), *first = room;
    put(room, elements);
    return reinterpret_cast<const T *>(first);
  }

  /// Where the device has what the host has, and the other way round; null
  /// stays null.
  template <class T> T *onDevice(T *data) const {
    return move(data, &Chunk::host, &Chunk::device);
  }
  template <class T> T *onHost(T *data) const {
    return move(data, &Chunk::device, &Chunk::host);
  }

  /// Calls copy(device, host, bytes) for all pieces.
  template <class Copy> void forAll(Copy copy) const {
    for (const Chunk &chunk : chunks_)
      if (chunk.used > 0)
        copy(chunk.device, chunk.host, chunk.used);
  }
  /// The same for those up to an address of the host's.
  template <class Copy> void forFirst(const void *end, Copy copy) const {
    auto last = reinterpret_cast<uintptr_t>(end);
    for (const Chunk &chunk : chunks_) {
      uintptr_t offset = last - reinterpret_cast<uintptr_t>(chunk.host);
      bool isLast = offset < chunk.size;
      copy(chunk.device, chunk.host, isLast ? offset : chunk.used);
      if (isLast)
        break;
    }
  }

private:
  struct Chunk {
    uint8_t *host, *device;
    size_t size, used;
  };

  uint8_t *takeBytes(size_t bytes);
  void addChunk(size_t bytes);
  template <class T>
  static void put(uint8_t *&room, const std::vector<T> &all) {
    static_assert(alignof(T) <= 8 && std::is_trivially_copyable_v<T>);
    std::copy(all.begin(), all.end(), reinterpret_cast<T *>(room));
    room += all.size() * sizeof(T);
  }
  template <class T>
  T *move(T *data, uint8_t *Chunk::*from, uint8_t *Chunk::*to) const {
    if (!data)
      return nullptr;
    auto address = reinterpret_cast<uintptr_t>(data);
    for (const Chunk &chunk : chunks_)
      if (uintptr_t offset = address - reinterpret_cast<uintptr_t>(chunk.*from);
          offset < chunk.size)
        return reinterpret_cast<T *>(chunk.*to + offset);
    return data; // of neither
  }

  rt::Accelerator &device_;
  std::vector<Chunk> chunks_;
  size_t chunk_ = 0; ///< That is taken from.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_EXCHANGE_H
