// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Records.h - Copies records, by a thread or by a warp ---------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_RECORDS_H
#define PIKO_RUNTIME_CUDA_DEVICE_RECORDS_H

#include "cuda/device/Grid.h"

namespace piko::cuda {

/// Copies a record by one thread.
inline void copyRecord(uint8_t *to, const uint8_t *from, int64_t size) {
  if (((reinterpret_cast<uint64_t>(to) | reinterpret_cast<uint64_t>(from) |
        static_cast<uint64_t>(size)) &
       3) == 0) {
    for (int64_t i = 0; i < size / 4; ++i)
      reinterpret_cast<uint32_t *>(to)[i] =
          reinterpret_cast<const uint32_t *>(from)[i];
    return;
  }
  for (int64_t i = 0; i < size; ++i)
    to[i] = from[i];
}

/// Copies what all threads see, by all of them.
inline void copyBytes(const Grid &grid, uint8_t *to, const uint8_t *from,
                      int64_t bytes) {
  auto copy = [&]<class T>(T *words, const T *source, int64_t count) {
    grid.forEach(count, [&](int64_t i) { words[i] = source[i]; });
  };
  auto begins =
      reinterpret_cast<uint64_t>(to) | reinterpret_cast<uint64_t>(from);
  if ((begins | static_cast<uint64_t>(bytes)) % 4 == 0)
    copy(reinterpret_cast<uint32_t *>(to),
         reinterpret_cast<const uint32_t *>(from), bytes / 4);
  else
    copy(to, from, bytes);
}

/// What a lane of the warp has as `mine`, in all lanes that name it.
inline uint64_t shuffle(uint64_t mine, int32_t lane) {
  auto half = [&](int32_t shift) {
    return static_cast<uint64_t>(static_cast<uint32_t>(__nvvm_shfl_sync_idx_i32(
               ~0u, static_cast<int32_t>(mine >> shift), lane, 31)))
           << shift;
  };
  return half(0) | half(32);
}

/// Whether a warp shares records of a size: smaller ones have a sector or two
/// each, whoever copies them.
inline bool isCopiedByWarps(int64_t size) { return size > 16 && size % 4 == 0; }

/// Copies a record of each lane, all lanes together, so that a load or store
/// touches words that follow each other; where `from` is null, nothing. To be
/// called by whole warps. Records of whole words are aligned to words.
inline void copyRecords(uint8_t *to, const uint8_t *from, int64_t size) {
  if (!isCopiedByWarps(size)) {
    if (from)
      copyRecord(to, from, size);
    return;
  }
  auto words = static_cast<int32_t>(size / 4);
  // Lane by lane, the words of all records in a row: each lane has every 32nd.
  int32_t record = Grid::lane() / words, word = Grid::lane() % words;
  int32_t recordStep = warpSize / words, wordStep = warpSize % words;
  constexpr int32_t together = 4; ///< Loads that wait at the same time.
  for (int32_t k = 0; k < words; k += together) {
    uint32_t *targets[together];
    uint32_t values[together];
    for (int32_t n = 0; n < together; ++n) {
      int32_t lane = record & (warpSize - 1); // past the end, any
      auto *source = reinterpret_cast<const uint32_t *>(
          shuffle(reinterpret_cast<uint64_t>(from), lane));
      auto *target = reinterpret_cast<uint32_t *>(
          shuffle(reinterpret_cast<uint64_t>(to), lane));
      bool copies = source && record < warpSize;
      targets[n] = copies ? target + word : nullptr;
      if (copies)
        values[n] = source[word];
      record += recordStep;
      word += wordStep;
      if (word >= words) {
        word -= words;
        ++record;
      }
    }
    for (int32_t n = 0; n < together; ++n)
      if (targets[n])
        *targets[n] = values[n];
  }
}

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_RECORDS_H
