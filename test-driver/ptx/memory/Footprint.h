// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Footprint.h - Which sectors of memory a launch touches -------------===//

#ifndef PIKO_TEST_DRIVER_PTX_FOOTPRINT_H
#define PIKO_TEST_DRIVER_PTX_FOOTPRINT_H

#include <array>
#include <bit>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace piko::ptx {

/// The sectors of 32 bytes that a launch touches at least once: what it must
/// move, however large its caches are. A bit for each, by groups of 64.
class Footprint {
public:
  /// Returns whether it is a new one.
  bool add(uint64_t sector) {
    uint64_t group = sector / 64;
    if (!last || group != lastGroup) {
      last = &groups[group];
      lastGroup = group;
    }
    const uint64_t bit = uint64_t(1) << sector % 64;
    const bool isNew = !(*last & bit);
    *last |= bit;
    return isNew;
  }
  void add(const Footprint &other) {
    for (const auto &[group, bits] : other.groups)
      groups[group] |= bits;
  }
  uint64_t sectors() const {
    uint64_t sum = 0;
    for (const auto &[group, bits] : groups)
      sum += static_cast<uint64_t>(std::popcount(bits));
    return sum;
  }

private:
  std::unordered_map<uint64_t, uint64_t> groups; // Nodes keep their places.
  uint64_t lastGroup = 0;
  uint64_t *last = nullptr;
};

/// After how many of a launch's fences each sector was touched last.
class Touches {
public:
  /// Returns whether it has been touched since there were `since` fences, and
  /// notes that it is now, after `fences` of them. The first is 1.
  bool touch(uint64_t sector, uint32_t since, uint32_t fences) {
    constexpr uint64_t inGroup = std::tuple_size_v<Group>;
    uint64_t group = sector / inGroup;
    if (!last || group != lastGroup) {
      last = &groups[group];
      lastGroup = group;
    }
    return std::exchange((*last)[sector % inGroup], fences) >= since;
  }

private:
  using Group = std::array<uint32_t, 16>;
  std::unordered_map<uint64_t, Group> groups; // Nodes keep their places.
  uint64_t lastGroup = 0;
  Group *last = nullptr;
};

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_FOOTPRINT_H
