// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Atomic.cpp - Atomic operations and fences of PTX -------------------===//
//
// Lanes make theirs one after the other, from the warp's firstLane on.
//
//===----------------------------------------------------------------------===//

#include "ptx/Machine.h"
#include "ptx/memory/Access.h"
#include "ptx/text/Decoder.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

using namespace piko::ptx;

namespace {

enum Operation : uint8_t {
  Add,
  Min,
  Max,
  And,
  Or,
  Xor,
  Exchange,
  CompareAndSwap,
  Increment,
  Decrement,
  Operations
};
constexpr std::string_view names[] = {"add", "min",  "max", "and", "or",
                                      "xor", "exch", "cas", "inc", "dec"};

template <typename T> T changed(Operation operation, T old, T b, T c) {
  switch (operation) {
  case Add:
    if constexpr (std::is_integral_v<T>)
      return static_cast<T>(std::make_unsigned_t<T>(old) +
                            std::make_unsigned_t<T>(b));
    else
      return old + b;
  case Min:
    return std::min(old, b);
  case Max:
    return std::max(old, b);
  case Exchange:
    return b;
  case CompareAndSwap:
    return old == b ? c : old;
  case Increment:
    return old >= b ? T(0) : old + 1;
  case Decrement:
    return old == 0 || old > b ? b : old - 1;
  default:
    break;
  }
  if constexpr (std::is_integral_v<T>)
    return operation == And ? old & b : operation == Or ? old | b : old ^ b;
  return old;
}

/// it.variant is the operation; it.negated says that there is no result.
template <Space space, typename T>
void change(Warp &warp, const Instruction &it) {
  Sectors sectors;
  const auto operation = static_cast<Operation>(it.variant);
  if (space == Space::Global && operation == Add && !it.negated && warp.yield())
    return;
  const T *b = warp.lanes<T>(it.b), *c = warp.lanes<T>(it.c);
  auto one = [&](uint32_t lane) {
    const uint64_t address = addressOf(warp, it, lane);
    uint8_t *place = locate<space>(warp, it, lane, address, sizeof(T), sectors);
    T old;
    read<space>(warp, place, address, &old, sizeof(T));
    T value = changed(operation, old, b[lane], c[lane]);
    if constexpr (std::is_same_v<T, float>)
      if (value != value)
        value = std::bit_cast<float>(0x7fffffffu);
    write<space>(warp, place, address, &value, sizeof(T), it.order);
    if constexpr (std::is_unsigned_v<T> && space != Space::Shared)
      if (isGlobal<space>(address))
        warp.noteChange(address, value);
    if (!it.negated)
      warp.lanes<T>(it.result)[lane] = old;
  };
  const uint32_t from = allLanes << warp.firstLane;
  forEachLane(warp.active & from, one);
  forEachLane(warp.active & ~from, one);
  countAccess(warp, sizeof(T), sectors);
}

template <Space space> Handler handlerFor(Type type) {
  if (type.isFloat())
    return type.bits == 64 ? change<space, double> : change<space, float>;
  if (type.isSigned())
    return type.bits == 64 ? change<space, int64_t> : change<space, int32_t>;
  return type.bits == 64   ? change<space, uint64_t>
         : type.bits == 32 ? change<space, uint32_t>
                           : change<space, uint16_t>;
}

bool fits(Operation operation, Type type) {
  switch (operation) {
  case Add:
    return type.kind != Kind::Bits && type.bits >= 32;
  case Min:
  case Max:
    return (type.kind == Kind::Unsigned || type.isSigned()) && type.bits >= 32;
  case Increment:
  case Decrement:
    return type == Type{Kind::Unsigned, 32};
  case CompareAndSwap:
    return type.kind == Kind::Bits && type.bits >= 16;
  default:
    return type.kind == Kind::Bits && type.bits >= 32;
  }
}

Operation takeOperation(Decoding &d) {
  for (uint8_t operation = 0; operation < Operations; ++operation)
    if (d.take(names[operation]))
      return static_cast<Operation>(operation);
  d.fail("expected an operation that is known");
}

bool decodeChange(Decoding &d) {
  const bool hasResult = d.base() == "atom";
  Space space = d.takeSpace().value_or(Space::Generic);
  std::string_view order =
      d.takeOneOf({"relaxed", "acquire", "release", "acq_rel"});
  d.it.order =
      order == "release" || order == "acq_rel" ? Order::Release : Order::Strong;
  d.takeOneOf({"cta", "cluster", "gpu", "sys"});
  const Operation operation = takeOperation(d);
  Type type = d.takeType();
  if (!fits(operation, type))
    d.fail("expected another type");
  const size_t first = hasResult ? 1 : 0;
  d.finish(first + (operation == CompareAndSwap ? 3 : 2));
  d.it.counted = Class::Atomic;
  d.it.space = space;
  d.it.variant = operation;
  d.it.negated = !hasResult;
  if (hasResult)
    d.it.result = d.result(0, type);
  d.address(first);
  d.it.b = d.it.c = d.value(first + 1, type);
  if (operation == CompareAndSwap)
    d.it.c = d.value(first + 2, type);
  if (space == Space::Global)
    d.it.run = handlerFor<Space::Global>(type);
  else if (space == Space::Shared)
    d.it.run = handlerFor<Space::Shared>(type);
  else if (space == Space::Generic)
    d.it.run = handlerFor<Space::Generic>(type);
  else
    d.fail("expected global or shared memory");
  return true;
}

/// it.variant: whether it is for other blocks.
void fence(Warp &warp, const Instruction &it) {
  if (warp.buffer && it.variant)
    warp.changed |= warp.buffer->flush();
  if (it.variant && warp.block.launch.latencies)
    warp.block.emptyCaches();
}

bool decodeFence(Decoding &d) {
  d.takeOneOf({"sc", "acq_rel", "acquire", "release"});
  std::string_view scope = d.takeOneOf({"cta", "cluster", "gl", "gpu", "sys"});
  d.it.variant = scope == "gl" || scope == "gpu" || scope == "sys";
  d.finish(0);
  d.it.counted = Class::Barrier;
  d.it.run = fence;
  return true;
}

} // namespace

bool piko::ptx::decodeAtomic(Decoding &d) {
  if (d.base() == "membar" || d.base() == "fence")
    return decodeFence(d);
  return (d.base() == "atom" || d.base() == "red") && decodeChange(d);
}
