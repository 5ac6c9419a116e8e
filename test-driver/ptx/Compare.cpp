// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Compare.cpp - Comparisons and selections of PTX --------------------===//

#include "ptx/Half.h"
#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

#include <cmath>
#include <type_traits>
#include <utility>

using namespace piko::ptx;

namespace {

enum Comparison : uint8_t {
  Equal,
  NotEqual,
  Less,
  LessEqual,
  Greater,
  GreaterEqual,
  // Of floats: true where an operand is NaN.
  UnorderedEqual,
  UnorderedNotEqual,
  UnorderedLess,
  UnorderedLessEqual,
  UnorderedGreater,
  UnorderedGreaterEqual,
  Ordered,
  Unordered
};

constexpr std::pair<std::string_view, Comparison> floatNames[] = {
    {"eq", Equal},
    {"ne", NotEqual},
    {"lt", Less},
    {"le", LessEqual},
    {"gt", Greater},
    {"ge", GreaterEqual},
    {"equ", UnorderedEqual},
    {"neu", UnorderedNotEqual},
    {"ltu", UnorderedLess},
    {"leu", UnorderedLessEqual},
    {"gtu", UnorderedGreater},
    {"geu", UnorderedGreaterEqual},
    {"num", Ordered},
    {"nan", Unordered}};
constexpr std::pair<std::string_view, Comparison> integerNames[] = {
    {"eq", Equal},   {"ne", NotEqual},     {"lt", Less}, {"le", LessEqual},
    {"gt", Greater}, {"ge", GreaterEqual}, {"lo", Less}, {"ls", LessEqual},
    {"hi", Greater}, {"hs", GreaterEqual}};

template <Comparison C, typename T> bool holds(T a, T b) {
  const bool unordered = a != a || b != b;
  switch (C) {
  case Equal:
    return a == b;
  case NotEqual:
    return !unordered && a != b;
  case Less:
    return a < b;
  case LessEqual:
    return a <= b;
  case Greater:
    return a > b;
  case GreaterEqual:
    return a >= b;
  case UnorderedEqual:
    return unordered || a == b;
  case UnorderedNotEqual:
    return unordered || a != b;
  case UnorderedLess:
    return unordered || a < b;
  case UnorderedLessEqual:
    return unordered || a <= b;
  case UnorderedGreater:
    return unordered || a > b;
  case UnorderedGreaterEqual:
    return unordered || a >= b;
  case Ordered:
    return !unordered;
  case Unordered:
    return unordered;
  }
}

enum Combination : uint8_t { None, And, Or, Xor };

/// it.second: for the opposite; it.c: to combine both with.
void store(Warp &warp, const Instruction &it, uint32_t found) {
  uint32_t opposite = ~found;
  if (it.variant != None) {
    uint32_t other = warp.predicate(it.c);
    if (it.negated)
      other = ~other;
    auto combine = [&](uint32_t mask) {
      return it.variant == And  ? mask & other
             : it.variant == Or ? mask | other
                                : mask ^ other;
    };
    found = combine(found);
    opposite = combine(opposite);
  }
  warp.setPredicate(it.result, found);
  if (it.count == 2)
    warp.setPredicate(it.second, opposite);
}

template <Comparison C, typename T, bool Flushes = false>
void compare(Warp &warp, const Instruction &it) {
  const T *a = warp.lanes<T>(it.a), *b = warp.lanes<T>(it.b);
  auto flush = [](T value) {
    if constexpr (Flushes)
      return std::fabs(value) < 0x1p-126f ? T(0) : value;
    else
      return value;
  };
  store(warp, it, lanesWhere(warp.active, [&](uint32_t lane) {
          if constexpr (std::is_same_v<T, Half>)
            return holds<C>(double(a[lane]), double(b[lane]));
          else
            return holds<C>(flush(a[lane]), flush(b[lane]));
        }));
}

template <Comparison C> Handler handlerFor(Type type, bool flushes) {
  if (type.isFloat())
    return type.bits == 64   ? compare<C, double>
           : type.bits == 16 ? compare<C, Half>
           : flushes         ? compare<C, float, true>
                             : compare<C, float>;
  if constexpr (C >= UnorderedEqual)
    return nullptr;
  else if (type.isSigned())
    return type.bits == 64   ? compare<C, int64_t>
           : type.bits == 32 ? compare<C, int32_t>
           : type.bits == 16 ? compare<C, int16_t>
                             : Handler(nullptr);
  else
    return type.bits == 64   ? compare<C, uint64_t>
           : type.bits == 32 ? compare<C, uint32_t>
           : type.bits == 16 ? compare<C, uint16_t>
                             : Handler(nullptr);
}

template <size_t... I>
Handler find(Comparison comparison, Type type, bool flushes,
             std::index_sequence<I...>) {
  Handler found = nullptr;
  ((I == comparison
        ? void(found = handlerFor<static_cast<Comparison>(I)>(type, flushes))
        : void()),
   ...);
  return found;
}

void takePredicates(Decoding &d) {
  constexpr Type predicate{Kind::Predicate, 1};
  const Argument &given = d.argument(0);
  d.it.count = 1;
  if (given.kind != Argument::Pair) {
    d.it.result = d.result(0, predicate);
    return;
  }
  d.it.count = 2;
  d.it.result = d.result(given.parts[0], predicate);
  d.it.second = d.result(given.parts[1], predicate);
}

bool decodeSet(Decoding &d) {
  Type type = d.takeType();
  bool flushes = d.take("ftz");
  auto named = [&](const auto &names) -> std::optional<Comparison> {
    for (auto [name, comparison] : names)
      if (d.take(name))
        return comparison;
    return std::nullopt;
  };
  auto comparison = type.isFloat() ? named(floatNames) : named(integerNames);
  if (!comparison)
    d.fail("expected a comparison that is known");
  std::string_view combination = d.takeOneOf({"and", "or", "xor"});
  d.it.variant = combination == "and"   ? And
                 : combination == "or"  ? Or
                 : combination == "xor" ? Xor
                                        : None;
  d.finish(d.it.variant == None ? 3 : 4);
  d.it.run = find(*comparison, type, flushes, std::make_index_sequence<14>());
  if (!d.it.run)
    d.fail("expected a comparison of this type");
  d.it.counted = type.isFloat()
                     ? (type.bits == 64 ? Class::Double : Class::Single)
                 : type.bits == 64 ? Class::Integer64
                                   : Class::Integer;
  takePredicates(d);
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, type);
  if (d.it.variant != None)
    d.it.c = d.predicate(3, &d.it.negated);
  return true;
}

template <typename T> void select(Warp &warp, const Instruction &it) {
  T *result = warp.lanes<T>(it.result);
  const T *a = warp.lanes<T>(it.a), *b = warp.lanes<T>(it.b);
  const uint32_t mask = warp.predicate(it.c);
  if (warp.active != allLanes) {
    forEachLane(warp.active, [=](uint32_t lane) {
      result[lane] = mask >> lane & 1 ? a[lane] : b[lane];
    });
    return;
  }
  for (uint32_t lane = 0; lane < warpSize; ++lane)
    result[lane] = mask >> lane & 1 ? a[lane] : b[lane];
}

bool decodeSelect(Decoding &d) {
  Type type = d.takeType();
  d.finish(4);
  d.it.counted = Class::Move;
  d.it.run = type.bits == 64   ? select<uint64_t>
             : type.bits == 32 ? select<uint32_t>
             : type.bits == 16 ? select<uint16_t>
                               : Handler(nullptr);
  if (!d.it.run)
    d.fail("expected a type of 16, 32 or 64 bits");
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, type);
  d.it.c = d.predicate(3);
  return true;
}

} // namespace

bool piko::ptx::decodeCompare(Decoding &d) {
  if (d.base() == "setp")
    return decodeSet(d);
  return d.base() == "selp" && decodeSelect(d);
}
