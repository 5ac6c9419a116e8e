// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MemoryAccess.cpp - Loads and stores of PTX -------------------------===//

#include "ptx/Machine.h"
#include "ptx/memory/Access.h"
#include "ptx/text/Decoder.h"

#include <cstdio>
#include <cstring>
#include <type_traits>

using namespace piko::ptx;

void piko::ptx::faultAt(const Warp &warp, FaultKind kind, Space space,
                        uint32_t lane, uint64_t address, uint32_t bytes) {
  std::array<char, 32> number;
  std::snprintf(number.data(), number.size(), "0x%llx",
                static_cast<unsigned long long>(address));
  std::string what =
      std::string(kind == FaultKind::MisalignedAddress ? "misaligned"
                                                       : "illegal") +
      " address " + number.data() + " of " + std::to_string(bytes) +
      " bytes in " + nameOf(space) + " memory";
  if (space == Space::Global && kind == FaultKind::IllegalAddress) {
    std::string more = warp.block.launch.memory.describe(address);
    if (!more.empty())
      what += ", " + more;
  }
  warp.fault(kind, what, lane);
}

void piko::ptx::findRange(const Warp &warp, const Instruction &it,
                          uint32_t lane, uint64_t address, uint32_t bytes) {
  Memory::Range range = warp.block.launch.memory.find(address);
  if (address < range.begin || address >= range.end ||
      range.end - address < bytes)
    faultAt(warp, FaultKind::IllegalAddress, Space::Global, lane, address,
            bytes);
  warp.site->begin = range.begin;
  warp.site->end = range.end;
  warp.site->distance = range.distance;
}

void piko::ptx::countAccess(Warp &warp, uint64_t bytes,
                            const Sectors &sectors) {
  if (!sectors.size())
    return;
  warp.site->sectors += sectors.size();
  warp.site->bytes += bytes * static_cast<uint32_t>(std::popcount(warp.active));
  Launch &launch = warp.block.launch;
  bool isInAll = true, isInPart = true;
  for (uint64_t sector : sectors) {
    launch.footprint.add(sector);
    if (!launch.latencies)
      continue;
    isInAll &= launch.touches.touch(sector, warp.block.fences, launch.fences);
    isInPart &= warp.block.cache.access(sector);
  }
  const Instruction &it = warp.program->code[warp.pc];
  if (launch.latencies && it.counted != Class::Atomic &&
      it.order == Order::Weak)
    warp.scoreboard.load(*warp.program, warp.pc, *launch.latencies, isInAll,
                         isInPart);
}

namespace {

void count(Warp &warp, const Instruction &it, const Sectors &sectors) {
  countAccess(warp, uint64_t(it.element) * it.count, sectors);
}

/// One element of type M into a register of type R.
template <Space space, typename M, typename R>
void load(Warp &warp, const Instruction &it) {
  Sectors sectors;
  R *result = warp.lanes<R>(it.result);
  forEachLane(warp.active, [&](uint32_t lane) {
    M value;
    const uint64_t address = addressOf(warp, it, lane);
    read<space>(warp,
                locate<space>(warp, it, lane, address, sizeof(M), sectors),
                address, &value, sizeof(M));
    if (it.order == Order::Strong && warp.block.launch.latencies &&
        std::has_single_bit(warp.active) && isGlobal<space>(address))
      value = static_cast<M>(warp.see(address, static_cast<uint64_t>(value)));
    result[lane] = static_cast<R>(value);
  });
  count(warp, it, sectors);
}

template <Space space, typename M, typename R>
void store(Warp &warp, const Instruction &it) {
  Sectors sectors;
  const R *from = warp.lanes<R>(it.b);
  forEachLane(warp.active, [&](uint32_t lane) {
    const auto value = static_cast<M>(from[lane]);
    const uint64_t address = addressOf(warp, it, lane);
    uint8_t *to = locate<space>(warp, it, lane, address, sizeof(M), sectors);
    write<space>(warp, to, address, &value, sizeof(M), it.order);
  });
  count(warp, it, sectors);
}

/// it.variant says whether elements are signed.
template <Space space> void loadVector(Warp &warp, const Instruction &it) {
  Sectors sectors;
  const std::vector<Operand> &list = warp.program->lists[it.extra];
  forEachLane(warp.active, [&](uint32_t lane) {
    const uint64_t address = addressOf(warp, it, lane);
    const uint8_t *from = locate<space>(
        warp, it, lane, address, uint32_t(it.element) * it.count, sectors);
    // Registers that are written may be those of the address.
    std::array<uint64_t, 8> values{};
    for (uint32_t i = 0; i < it.count; ++i) {
      read<space>(warp, from + i * it.element, address, &values[i], it.element);
      uint32_t unused = 64 - 8 * it.element;
      if (it.variant)
        values[i] = static_cast<uint64_t>(
            static_cast<int64_t>(values[i] << unused) >> unused);
    }
    for (uint32_t i = 0; i < it.count; ++i)
      writeLane(warp, list[i], lane, values[i]);
  });
  count(warp, it, sectors);
}

template <Space space> void storeVector(Warp &warp, const Instruction &it) {
  Sectors sectors;
  const std::vector<Operand> &list = warp.program->lists[it.extra];
  forEachLane(warp.active, [&](uint32_t lane) {
    const uint64_t address = addressOf(warp, it, lane);
    uint8_t *to = locate<space>(warp, it, lane, address,
                                uint32_t(it.element) * it.count, sectors);
    for (uint32_t i = 0; i < it.count; ++i) {
      uint64_t value = readLane(warp, list[i], lane);
      write<space>(warp, to + i * it.element, address, &value, it.element,
                   it.order);
    }
  });
  count(warp, it, sectors);
}

template <typename T> struct Tag {};

/// Calls \p function with the types of an element and of its register.
template <typename F>
Handler forElement(Type type, uint8_t registerBytes, F function) {
  auto into = [&]<typename M>(Tag<M> element) -> Handler {
    switch (registerBytes) {
    case 2:
      if constexpr (sizeof(M) <= 2)
        return function(element, Tag<uint16_t>());
      return nullptr;
    case 4:
      if constexpr (sizeof(M) <= 4)
        return function(element, Tag<uint32_t>());
      return nullptr;
    default:
      return function(element, Tag<uint64_t>());
    }
  };
  switch (type.bits) {
  case 8:
    return type.isSigned() ? into(Tag<int8_t>()) : into(Tag<uint8_t>());
  case 16:
    return type.isSigned() ? into(Tag<int16_t>()) : into(Tag<uint16_t>());
  case 32:
    return type.isSigned() ? into(Tag<int32_t>()) : into(Tag<uint32_t>());
  default:
    return into(Tag<uint64_t>());
  }
}

template <Space space>
Handler single(bool isStore, Type type, uint8_t registerBytes) {
  return forElement(type, registerBytes,
                    [&]<typename M, typename R>(Tag<M>, Tag<R>) -> Handler {
                      if (isStore)
                        return store<space, std::make_unsigned_t<M>, R>;
                      return load<space, M, R>;
                    });
}

template <Space space>
Handler accessFor(const Instruction &it, bool isStore, Type type) {
  if (it.count > 1)
    return isStore ? storeVector<space> : loadVector<space>;
  return single<space>(isStore, type, isStore ? it.b.bytes : it.result.bytes);
}

Handler accessIn(Space space, const Instruction &it, bool isStore, Type type) {
  switch (space) {
  case Space::Global:
  case Space::Const:
    return accessFor<Space::Global>(it, isStore, type);
  case Space::Shared:
    return accessFor<Space::Shared>(it, isStore, type);
  case Space::Local:
    return accessFor<Space::Local>(it, isStore, type);
  case Space::Param:
    return accessFor<Space::Param>(it, isStore, type);
  case Space::Generic:
    break;
  }
  return accessFor<Space::Generic>(it, isStore, type);
}

Class classOf(Space space, bool isStore) {
  switch (space) {
  case Space::Global:
    return isStore ? Class::StoreGlobal : Class::LoadGlobal;
  case Space::Shared:
    return isStore ? Class::StoreShared : Class::LoadShared;
  case Space::Local:
    return isStore ? Class::StoreLocal : Class::LoadLocal;
  case Space::Generic:
    return isStore ? Class::StoreGeneric : Class::LoadGeneric;
  default:
    return Class::Parameter;
  }
}

/// Loads are all ordered: one thread runs at a time.
void takeOrder(Decoding &d) {
  std::string_view order =
      d.takeOneOf({"weak", "volatile", "relaxed", "acquire", "release"});
  d.it.order = order.empty() || order == "weak" ? Order::Weak
               : order == "release"             ? Order::Release
                                                : Order::Strong;
  d.takeOneOf({"cta", "cluster", "gpu", "sys"});
  d.takeOneOf({"ca", "cg", "cs", "lu", "cv", "wb", "wt"});
  d.take("nc");
  while (!d.takeOneOf({"L1::evict_normal", "L1::evict_unchanged",
                       "L1::evict_first", "L1::evict_last", "L1::no_allocate",
                       "L2::64B", "L2::128B", "L2::256B"})
              .empty())
    ;
}

} // namespace

bool piko::ptx::decodeMemory(Decoding &d) {
  if (d.base() != "ld" && d.base() != "st" && d.base() != "ldu")
    return false;
  const bool isStore = d.base() == "st";
  std::optional<Space> named = d.takeSpace();
  if (isStore && named == Space::Const)
    d.fail("expected no store to constant memory");
  Space space = named.value_or(Space::Generic);
  takeOrder(d);
  std::string_view vector = d.takeOneOf({"v2", "v4"});
  Type type = d.takeType();
  d.finish(2);
  if (type.isPredicate())
    d.fail("expected no predicate");
  d.it.space = space;
  d.it.element = type.bits / 8;
  d.it.count = vector.empty() ? 1 : static_cast<uint8_t>(vector[1] - '0');
  d.it.variant = type.isSigned();
  d.it.counted = classOf(space, isStore);
  d.address(isStore ? 0 : 1);
  const Argument &data = d.argument(isStore ? 1 : 0);
  if (d.it.count > 1) {
    if (data.kind != Argument::Vector || data.parts.size() != d.it.count)
      d.fail("expected a vector of " + std::to_string(d.it.count));
    std::vector<Operand> list;
    for (const Argument &part : data.parts)
      list.push_back(isStore ? d.wideValue(part, type)
                             : d.wideResult(part, type));
    d.it.extra = d.scope.addList(std::move(list));
  } else if (isStore) {
    d.it.b = d.wideValue(data, type);
  } else {
    d.it.result = d.wideResult(data, type);
  }
  d.it.run = accessIn(space, d.it, isStore, type);
  return true;
}
