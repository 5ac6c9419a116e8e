// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The remainder of a division of floats and of doubles is exact, on a GPU as
// anywhere: of numbers near each other and far apart, of subnormal ones, zeros of
// both signs, infinities and NaN.
// RUN: %compare_targets %s --pipe Remainders --count 2000 --runs 1 | FileCheck %s
// CHECK: {{^equal}}
#include "../Inputs/ports.h"

#include <bit>
#include <cmath>
#include <limits>

struct State {
  piko::Buffer<uint32_t> single;
  piko::Buffer<uint64_t> twice;
};

inline uint32_t mix(uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return x ^ x >> 16;
}

/// All kinds of numbers.
inline float toFloat(uint32_t seed) {
  uint32_t bits = mix(seed);
  switch (seed % 9) {
  case 0: // subnormal
    return std::bit_cast<float>(bits & 0x807fffffu);
  case 1: // near 1
    return std::bit_cast<float>((bits & 0x80ffffffu) | 0x3f000000u);
  case 2:
    return std::bit_cast<float>(bits & 0x80000000u); // a zero
  case 3:                                            // an infinity or a NaN
    return std::bit_cast<float>(bits & 0xff800001u) *
           std::numeric_limits<float>::infinity();
  case 4: // a small integer
    return float(int(bits % 41) - 20);
  default:
    return std::bit_cast<float>(bits);
  }
}
inline double toDouble(uint32_t seed) {
  uint64_t bits = uint64_t(mix(seed)) << 32 | mix(seed + 77);
  switch (seed % 7) {
  case 0:
    return std::bit_cast<double>(bits & 0x800fffffffffffffull);
  case 1:
    return std::bit_cast<double>((bits & 0x801fffffffffffffull) |
                                 0x3fe0000000000000ull);
  case 2:
    return double(int(bits % 41) - 20) / 4;
  case 3:
    return double(toFloat(seed));
  default:
    return std::bit_cast<double>(bits);
  }
}

struct Remainder : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    uint32_t seed = mix(uint32_t(p.tag) * 31u + uint32_t(p.x * 977 + p.y));
    for (int i = 0; i < 8; ++i) {
      uint32_t s = seed + uint32_t(i) * 977u;
      float single = std::fmod(toFloat(s), toFloat(s / 3 + 5));
      double twice = std::fmod(toDouble(s), toDouble(s / 5 + 11));
      if (single == single)
        piko::atomicXor(state().single[s & 63],
                        std::bit_cast<uint32_t>(single));
      if (twice == twice)
        piko::atomicAdd(state().twice[s & 63], std::bit_cast<uint64_t>(twice));
    }
  }
};
struct Remainders : piko::Pipe<State> {
  Remainder remainder;
  Remainders() { source(remainder); }
};
