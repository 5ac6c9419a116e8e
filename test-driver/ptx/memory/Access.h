// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Access.h - Checked accesses to memory ------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_ACCESS_H
#define PIKO_TEST_DRIVER_PTX_ACCESS_H

#include "ptx/Lanes.h"
#include "ptx/memory/StoreBuffer.h"

#include <cstring>

namespace piko::ptx {

/// Looks a global address up that is not in the range that the instruction used
/// last. Faults if it is in no memory.
void findRange(const Warp &warp, const Instruction &it, uint32_t lane,
               uint64_t address, uint32_t bytes);

/// Faults: an address beyond its memory, or not a multiple of its size.
[[noreturn]] void faultAt(const Warp &warp, FaultKind kind, Space space,
                          uint32_t lane, uint64_t address, uint32_t bytes);

/// The sectors of 32 bytes that a warp touches with one instruction.
class Sectors {
public:
  void add(uint64_t address) {
    uint64_t sector = address >> 5;
    if (count && sector <= greatest) {
      for (uint32_t i = count; i-- > 0;)
        if (seen[i] == sector)
          return;
    } else {
      greatest = sector;
    }
    seen[count++] = sector;
  }
  uint32_t size() const { return count; }
  const uint64_t *begin() const { return seen.data(); }
  const uint64_t *end() const { return seen.data() + count; }

private:
  std::array<uint64_t, warpSize> seen;
  uint64_t greatest = 0;
  uint32_t count = 0;
};

/// Counts an access of the active lanes, each of so many bytes, to global
/// memory.
void countAccess(Warp &warp, uint64_t bytes, const Sectors &sectors);

inline uint8_t *inRegion(const Warp &warp, Space space, uint32_t lane,
                         uint64_t address, uint32_t bytes, uint8_t *region,
                         uint64_t start, uint64_t size) {
  uint64_t offset = address - start;
  if (size < bytes || offset > size - bytes)
    faultAt(warp, FaultKind::IllegalAddress, space, lane, address, bytes);
  return region + offset;
}

/// Where an address lies in the host's memory. \p sectors counts global ones.
template <Space space>
inline uint8_t *locate(const Warp &warp, const Instruction &it, uint32_t lane,
                       uint64_t address, uint32_t bytes, Sectors &sectors) {
  if (address & (bytes - 1))
    faultAt(warp, FaultKind::MisalignedAddress, space, lane, address, bytes);
  if constexpr (space == Space::Global || space == Space::Const) {
    const Site &site = *warp.site;
    if (address < site.begin || address > site.end - bytes)
      findRange(warp, it, lane, address, bytes);
    sectors.add(address);
    return reinterpret_cast<uint8_t *>(address + site.distance);
  } else if constexpr (space == Space::Shared) {
    return inRegion(warp, space, lane, address, bytes, warp.shared, sharedStart,
                    warp.sharedBytes);
  } else if constexpr (space == Space::Local) {
    // A function's parameters are on its stack where their address is taken.
    if (address >= callStart)
      return inRegion(warp, space, lane, address, bytes,
                      warp.calls + uint64_t(lane) * warp.program->callBytes,
                      callStart, warp.program->callBytes);
    return inRegion(warp, space, lane, address, bytes,
                    warp.local + uint64_t(lane) * warp.program->localBytes,
                    localStart, warp.program->localBytes);
  } else if constexpr (space == Space::Param) {
    if (address < callStart)
      return inRegion(warp, space, lane, address, bytes,
                      const_cast<uint8_t *>(warp.parameters), 0,
                      warp.program->parameterBytes);
    return inRegion(warp, space, lane, address, bytes,
                    warp.calls + uint64_t(lane) * warp.program->callBytes,
                    callStart, warp.program->callBytes);
  } else {
    switch (address & windowMask) {
    case sharedWindow:
      return locate<Space::Shared>(warp, it, lane, address & ~windowMask, bytes,
                                   sectors);
    case localWindow:
      return locate<Space::Local>(warp, it, lane, address & ~windowMask, bytes,
                                  sectors);
    case parameterWindow:
      return locate<Space::Param>(warp, it, lane, address & ~windowMask, bytes,
                                  sectors);
    default:
      return locate<Space::Global>(warp, it, lane, address, bytes, sectors);
    }
  }
}

template <Space space> inline bool isGlobal(uint64_t address) {
  if constexpr (space != Space::Generic)
    return space == Space::Global;
  uint64_t window = address & windowMask;
  return window != sharedWindow && window != localWindow &&
         window != parameterWindow;
}

/// Reads from where `locate` says, as this block sees it.
template <Space space>
inline void read(const Warp &warp, const uint8_t *place, uint64_t address,
                 void *value, uint32_t bytes) {
  std::memcpy(value, place, bytes);
  if (warp.buffer && isGlobal<space>(address))
    warp.buffer->overlay(place, value, bytes);
}

/// Writes to where `locate` says, and notes whether others may see a change.
template <Space space>
inline void write(Warp &warp, uint8_t *place, uint64_t address,
                  const void *value, uint32_t bytes,
                  Order order = Order::Strong) {
  if (warp.buffer && isGlobal<space>(address)) {
    if (order == Order::Weak)
      return warp.buffer->put(place, value, bytes);
    warp.changed |= order == Order::Release ? warp.buffer->flush()
                                            : warp.buffer->flush(place);
  }
  const bool isOwn =
      space == Space::Local || space == Space::Param ||
      (space == Space::Generic && (address & windowMask) == localWindow);
  if (!isOwn)
    warp.changed |= std::memcmp(place, value, bytes) != 0;
  std::memcpy(place, value, bytes);
}

inline uint64_t addressOf(const Warp &warp, const Instruction &it,
                          uint32_t lane) {
  uint64_t base = it.a.bytes == 8 ? warp.lanes<uint64_t>(it.a)[lane]
                                  : warp.lanes<uint32_t>(it.a)[lane];
  return base + static_cast<uint64_t>(it.offset);
}

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_ACCESS_H
