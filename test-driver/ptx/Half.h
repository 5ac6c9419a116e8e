// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Half.h - Numbers of half precision ---------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_HALF_H
#define PIKO_TEST_DRIVER_PTX_HALF_H

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace piko::ptx {

/// Half precision as its bits.
struct Half {
  uint16_t bits = 0;

  operator double() const {
    double sign = bits & 0x8000 ? -1 : 1;
    int exponent = bits >> 10 & 31, fraction = bits & 1023;
    if (exponent == 31)
      return fraction ? std::bit_cast<double>(uint64_t(0x7ff8) << 48)
                      : sign * HUGE_VAL;
    if (!exponent)
      return sign * std::ldexp(fraction, -24);
    return sign * std::ldexp(fraction + 1024, exponent - 25);
  }
};

/// Rounds to the nearest, ties to even. Sums, products, quotients and roots of
/// halves, made in double precision, are so rounded once in effect.
inline Half toHalf(double value) {
  auto sign = static_cast<uint16_t>(std::signbit(value) ? 0x8000 : 0);
  double magnitude = std::fabs(value);
  if (value != value)
    return {0x7fff};
  if (magnitude >= 65520)
    return {static_cast<uint16_t>(sign | 0x7c00)};
  // The number of the last place: 2^-24 of denormals.
  int exponent =
      magnitude == 0 ? -24 : std::max(std::ilogb(magnitude), -14) - 10;
  double units = std::nearbyint(std::ldexp(magnitude, -exponent));
  // A carry out of the fraction is right in the exponent.
  auto fraction = static_cast<uint32_t>(units);
  uint32_t biased =
      magnitude < std::ldexp(1, -14)
          ? fraction
          : ((static_cast<uint32_t>(exponent + 25) << 10) + fraction - 1024);
  return {static_cast<uint16_t>(sign | biased)};
}

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_HALF_H
