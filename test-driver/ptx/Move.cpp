// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Move.cpp - Moves of PTX, packing, and addresses of spaces ----------===//

#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

using namespace piko::ptx;

namespace {

template <typename T> struct Copy {
  using Result = T;
  using A = T;
  static T apply(T a) { return a; }
};

void movePredicate(Warp &warp, const Instruction &it) {
  warp.setPredicate(it.result, warp.predicate(it.a));
}

/// From it.count registers, the first in the lowest bits.
void pack(Warp &warp, const Instruction &it) {
  const std::vector<Operand> &parts = warp.program->lists[it.extra];
  forEachLane(warp.active, [&](uint32_t lane) {
    uint64_t packed = 0;
    for (size_t i = 0; i < parts.size(); ++i)
      packed |= (readLane(warp, parts[i], lane) &
                 (~uint64_t(0) >> (64 - 8 * it.element)))
                << 8 * it.element * i;
    writeLane(warp, it.result, lane, packed);
  });
}

void unpack(Warp &warp, const Instruction &it) {
  const std::vector<Operand> &parts = warp.program->lists[it.extra];
  forEachLane(warp.active, [&](uint32_t lane) {
    uint64_t packed = readLane(warp, it.a, lane);
    for (size_t i = 0; i < parts.size(); ++i)
      writeLane(warp, parts[i], lane, packed >> 8 * it.element * i);
  });
}

Type partOf(Decoding &d, Type type, size_t parts) {
  if ((parts != 2 && parts != 4) || type.bits / parts < 8)
    d.fail("expected a vector of two or four");
  return {Kind::Bits, static_cast<uint8_t>(type.bits / parts)};
}

bool decodeVector(Decoding &d, Type type) {
  const bool packs = d.argument(1).kind == Argument::Vector;
  const Argument &vector = d.argument(packs ? 1 : 0);
  Type part = partOf(d, type, vector.parts.size());
  std::vector<Operand> parts;
  for (const Argument &argument : vector.parts)
    parts.push_back(packs ? d.value(argument, part) : d.result(argument, part));
  d.it.extra = d.scope.addList(std::move(parts));
  d.it.element = part.bits / 8;
  d.it.run = packs ? pack : unpack;
  if (packs)
    d.it.result = d.result(0, type);
  else
    d.it.a = d.value(1, type);
  return true;
}

bool decodeMov(Decoding &d) {
  Type type = d.takeType();
  d.finish(2);
  if (type.isPredicate()) {
    d.it.run = movePredicate;
    d.it.result = d.result(0, type);
    d.it.a = d.predicate(1);
    return true;
  }
  if (d.argument(0).kind == Argument::Vector ||
      d.argument(1).kind == Argument::Vector)
    return decodeVector(d, type);
  d.it.run = type.bits == 64   ? unary<Copy<uint64_t>>
             : type.bits == 32 ? unary<Copy<uint32_t>>
             : type.bits == 16 ? unary<Copy<uint16_t>>
                               : Handler(nullptr);
  if (!d.it.run)
    d.fail("expected a type of 16, 32 or 64 bits");
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  return true;
}

uint64_t windowOf(Space space) {
  switch (space) {
  case Space::Shared:
    return sharedWindow;
  case Space::Local:
    return localWindow;
  case Space::Param:
    return parameterWindow;
  default:
    return 0;
  }
}

/// it.offset is the window, negative from generic addresses.
void shiftAddress(Warp &warp, const Instruction &it) {
  auto *result = warp.lanes<uint64_t>(it.result);
  const auto *a = warp.lanes<uint64_t>(it.a);
  const auto window = static_cast<uint64_t>(it.offset);
  forLanes(warp.active,
           [=](uint32_t lane) { result[lane] = a[lane] + window; });
}

/// Whether a generic address is of it.space.
void isInSpace(Warp &warp, const Instruction &it) {
  const auto *a = warp.lanes<uint64_t>(it.a);
  warp.setPredicate(it.result, lanesWhere(warp.active, [&](uint32_t lane) {
                      uint64_t window = a[lane] & windowMask;
                      if (it.space == Space::Global)
                        return window != sharedWindow &&
                               window != localWindow &&
                               window != parameterWindow;
                      return window == windowOf(it.space);
                    }));
}

bool decodeAddress(Decoding &d) {
  constexpr Type address{Kind::Unsigned, 64};
  const bool toSpace = d.take("to");
  std::optional<Space> space = d.takeSpace();
  if (!space || d.takeType() != address)
    d.fail("expected a state space and .u64");
  d.finish(2);
  d.it.run = shiftAddress;
  uint64_t window = windowOf(*space);
  d.it.offset = static_cast<int64_t>(toSpace ? -window : window);
  d.it.result = d.result(0, address);
  d.it.a = d.value(1, address);
  return true;
}

bool decodeIsSpace(Decoding &d) {
  std::optional<Space> space = d.takeSpace();
  if (!space || *space == Space::Const)
    d.fail("expected a state space that is known");
  d.finish(2);
  d.it.run = isInSpace;
  d.it.space = *space;
  d.it.result = d.result(0, Type{Kind::Predicate, 1});
  d.it.a = d.value(1, Type{Kind::Unsigned, 64});
  return true;
}

} // namespace

bool piko::ptx::decodeMove(Decoding &d) {
  d.it.counted = Class::Move;
  if (d.base() == "mov")
    return decodeMov(d);
  if (d.base() == "cvta")
    return decodeAddress(d);
  return d.base() == "isspacep" && decodeIsSpace(d);
}
