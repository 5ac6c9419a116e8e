// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StoreBuffer.h - Stores that other blocks do not see yet --*- C++ -*-===//

#ifndef PIKO_TEST_DRIVER_PTX_STOREBUFFER_H
#define PIKO_TEST_DRIVER_PTX_STOREBUFFER_H

#include <array>
#include <cstdint>
#include <cstring>
#include <unordered_map>

namespace piko::ptx {

/// What a block has stored to global memory and no fence has shown to others.
/// Accesses are of up to eight bytes, aligned to their size.
class StoreBuffer {
public:
  void put(uint8_t *place, const void *value, uint32_t bytes) {
    Word &word = words[keyOf(place)];
    std::memcpy(&word.bytes[offsetOf(place)], value, bytes);
    word.written |= maskOf(place, bytes);
  }

  /// Puts what is here over what was loaded.
  void overlay(const uint8_t *place, void *value, uint32_t bytes) const {
    auto found = words.find(keyOf(place));
    if (found == words.end())
      return;
    const Word &word = found->second;
    for (uint32_t i = 0; i < bytes; ++i)
      if (word.written >> (offsetOf(place) + i) & 1)
        static_cast<uint8_t *>(value)[i] = word.bytes[offsetOf(place) + i];
  }

  /// Shows all to others; whether memory has changed.
  bool flush() {
    bool changed = false;
    for (const auto &[key, word] : words)
      changed |= show(key, word);
    words.clear();
    return changed;
  }

  /// The same of what lies in one word.
  bool flush(const uint8_t *place) {
    auto found = words.find(keyOf(place));
    if (found == words.end())
      return false;
    bool changed = show(found->first, found->second);
    words.erase(found);
    return changed;
  }

private:
  struct Word {
    std::array<uint8_t, 8> bytes{};
    uint32_t written = 0; ///< A bit a byte.
  };

  static uintptr_t keyOf(const uint8_t *place) {
    return reinterpret_cast<uintptr_t>(place) & ~uintptr_t(7);
  }
  static uint32_t offsetOf(const uint8_t *place) {
    return static_cast<uint32_t>(reinterpret_cast<uintptr_t>(place) & 7);
  }
  static uint32_t maskOf(const uint8_t *place, uint32_t bytes) {
    return ((1u << bytes) - 1) << offsetOf(place);
  }
  static bool show(uintptr_t key, const Word &word) {
    auto *to = reinterpret_cast<uint8_t *>(key);
    bool changed = false;
    for (uint32_t i = 0; i < word.bytes.size(); ++i)
      if (word.written >> i & 1) {
        changed |= to[i] != word.bytes[i];
        to[i] = word.bytes[i];
      }
    return changed;
  }

  std::unordered_map<uintptr_t, Word> words;
};

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_STOREBUFFER_H
