// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Convert.cpp - Conversions of PTX -----------------------------------===//

#include "ptx/Half.h"
#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

#include <cfenv>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

using namespace piko::ptx;

namespace {

/// Of it.variant. The first four round to a representable number, the others to
/// an integer.
enum Rounding : uint8_t {
  Nearest,
  Zero,
  Down,
  Up,
  NearestInteger,
  ZeroInteger,
  DownInteger,
  UpInteger,
  Roundings
};
constexpr uint8_t saturates = 8, flushes = 16;
constexpr std::string_view roundingNames[] = {"rn",  "rz",  "rm",  "rp",
                                              "rni", "rzi", "rmi", "rpi"};

template <typename T>
constexpr bool isFloat = std::is_floating_point_v<T> || std::is_same_v<T, Half>;

double roundToInteger(double value, uint8_t rounding) {
  switch (rounding & 3) {
  case Zero:
    return std::trunc(value);
  case Down:
    return std::floor(value);
  case Up:
    return std::ceil(value);
  default:
    return std::nearbyint(value);
  }
}

/// A NaN becomes 0, or the highest bit where a type has 64 bits.
template <typename To> To toInteger(double value, bool isNarrow) {
  using Limits = std::numeric_limits<To>;
  if (value != value)
    return isNarrow && sizeof(To) < 8
               ? To(0)
               : static_cast<To>(uint64_t(1) << (8 * sizeof(To) - 1));
  // One above the greatest, which a double has.
  const double above = std::ldexp(1, 8 * sizeof(To) - std::is_signed_v<To>);
  if (value >= above)
    return Limits::max();
  return value <= static_cast<double>(Limits::min()) ? Limits::min()
                                                     : static_cast<To>(value);
}

template <typename To, typename From> To inMode(From value, uint8_t rounding) {
  static constexpr int modes[] = {FE_TONEAREST, FE_TOWARDZERO, FE_DOWNWARD,
                                  FE_UPWARD};
  if (rounding == Nearest || rounding >= Roundings)
    return static_cast<To>(value);
  // Not evaluated outside of the mode.
  volatile From from = value;
  std::fesetround(modes[rounding]);
  volatile To to = static_cast<To>(from);
  std::fesetround(FE_TONEAREST);
  return to;
}

template <typename To, typename From> To clampedInteger(From value) {
  using Limits = std::numeric_limits<To>;
  if (std::cmp_less(value, Limits::min()))
    return Limits::min();
  if (std::cmp_greater(value, Limits::max()))
    return Limits::max();
  return static_cast<To>(value);
}

template <typename T> T flushed(T value) {
  return std::fabs(value) < T(0x1p-126) ? std::copysign(T(0), value) : value;
}

/// To f16, f32 or f64.
template <typename To, typename From> To toFloat(From given, uint8_t variant) {
  const uint8_t rounding = variant & 7;
  if constexpr (std::is_integral_v<From>) {
    if constexpr (std::is_same_v<To, Half>)
      return toHalf(static_cast<double>(given));
    else
      return inMode<To>(given, rounding);
  } else {
    double value = static_cast<double>(given);
    if ((variant & flushes) && std::is_same_v<From, float>)
      value = flushed(value);
    if (rounding >= NearestInteger)
      value = roundToInteger(value, rounding);
    if (variant & saturates)
      value = value > 0 ? (value < 1 ? value : 1) : 0;
    if constexpr (std::is_same_v<To, Half>) {
      return toHalf(value);
    } else if constexpr (std::is_same_v<To, float>) {
      if (value != value)
        return std::bit_cast<float>(0x7fffffffu);
      auto narrow =
          inMode<float>(value, rounding < NearestInteger ? rounding : Nearest);
      return variant & flushes ? flushed(narrow) : narrow;
    } else {
      return value;
    }
  }
}

template <typename To, typename From>
To convertOne(From value, uint8_t variant) {
  if constexpr (isFloat<To>) {
    return toFloat<To>(value, variant);
  } else if constexpr (isFloat<From>) {
    double exact = static_cast<double>(value);
    if ((variant & flushes) && std::is_same_v<From, float>)
      exact = flushed(exact);
    return toInteger<To>(roundToInteger(exact, variant), sizeof(From) < 8);
  } else {
    return variant & saturates ? clampedInteger<To>(value)
                               : static_cast<To>(value);
  }
}

/// Registers have the types' widths.
template <typename To, typename From>
void convertExact(Warp &warp, const Instruction &it) {
  auto *result = warp.lanes<To>(it.result);
  const auto *a = warp.lanes<From>(it.a);
  const uint8_t variant = it.variant;
  if constexpr (std::is_integral_v<To> && std::is_integral_v<From>) {
    if (!variant)
      return forLanes(warp.active, [=](uint32_t lane) {
        result[lane] = static_cast<To>(a[lane]);
      });
  }
  forEachLane(warp.active, [=](uint32_t lane) {
    result[lane] = convertOne<To>(a[lane], variant);
  });
}

template <typename To, typename From>
void convertWide(Warp &warp, const Instruction &it) {
  forEachLane(warp.active, [&](uint32_t lane) {
    uint64_t bits = readLane(warp, it.a, lane);
    From value;
    std::memcpy(&value, &bits, sizeof(From));
    To result = convertOne<To>(value, it.variant);
    uint64_t extended = 0;
    if constexpr (std::is_integral_v<To>)
      extended = static_cast<uint64_t>(result);
    else
      std::memcpy(&extended, &result, sizeof(To));
    writeLane(warp, it.result, lane, extended);
  });
}

template <typename T> struct Tag {};

template <typename F> Handler forType(Type type, F function) {
  if (type.isFloat())
    return type.bits == 16   ? function(Tag<Half>())
           : type.bits == 32 ? function(Tag<float>())
                             : function(Tag<double>());
  switch (type.bits) {
  case 8:
    return type.isSigned() ? function(Tag<int8_t>()) : function(Tag<uint8_t>());
  case 16:
    return type.isSigned() ? function(Tag<int16_t>())
                           : function(Tag<uint16_t>());
  case 32:
    return type.isSigned() ? function(Tag<int32_t>())
                           : function(Tag<uint32_t>());
  default:
    return type.isSigned() ? function(Tag<int64_t>())
                           : function(Tag<uint64_t>());
  }
}

void takeRounding(Decoding &d, Type to, Type from) {
  const bool toInteger = !to.isFloat() && from.isFloat();
  const bool narrows = to.isFloat() && (!from.isFloat() || to.bits < from.bits);
  for (uint8_t rounding = 0; rounding < Roundings; ++rounding) {
    if (!d.take(roundingNames[rounding]))
      continue;
    const bool fits = rounding >= NearestInteger
                          ? toInteger || (to.isFloat() && to == from)
                          : narrows;
    if (!fits || (to.isFloat() && to.bits == 16 && rounding != Nearest))
      d.fail("expected another rounding");
    d.it.variant |= rounding;
    return;
  }
  if (toInteger || narrows)
    d.fail("expected a rounding");
}

} // namespace

bool piko::ptx::decodeConvert(Decoding &d) {
  if (d.base() != "cvt")
    return false;
  Type from = d.takeType(), to = d.takeType();
  if (from.isPredicate() || to.isPredicate())
    d.fail("expected no predicate");
  takeRounding(d, to, from);
  if (d.take("ftz"))
    d.it.variant |= flushes;
  if (d.take("sat"))
    d.it.variant |= saturates;
  d.finish(2);
  // Between integers it is at most a move.
  d.it.counted = from.isFloat() || to.isFloat() ? Class::Convert : Class::Move;
  d.it.result = d.wideResult(d.argument(0), to);
  d.it.a = d.wideValue(d.argument(1), from);
  const bool exact =
      d.it.result.bytes == to.bits / 8 && d.it.a.bytes == from.bits / 8;
  d.it.run = forType(to, [&]<typename To>(Tag<To>) {
    return forType(from, [&]<typename From>(Tag<From>) -> Handler {
      return exact ? convertExact<To, From> : convertWide<To, From>;
    });
  });
  return true;
}
