// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bits and bounds as people write them, of which LLVM makes intrinsics: bytes
// swapped and bits reversed by shifts and masks, sums that saturate, rotations,
// counts of bits.
// RUN: %compare_targets %s --count 3000 --runs 1 --wide | FileCheck %s
// RUN: %if all %{ piko-compare %s --count 500 --runs 1 --without vectorize | FileCheck %s %}
// RUN: piko-compare %s --count 300 --runs 1 --wide --threads 2 --target gpu-on-cpu --gpu-threads 32 | FileCheck %s
// CHECK: {{^equal}}
//
// They are what they were: no call, and no loop.
// RUN: pikoc %s --emit=authored | FileCheck %s --check-prefix=IR
// IR-NOT: bswap
// IR: arith.constant 16711935 : i32
// IR-NOT: scf.for
// RUN: pikoc %s --emit=assembly --cpu x86-64 --without vectorize | FileCheck %s --check-prefix=CODE
// CODE: bswapl
#include "../Inputs/ports.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>

struct State {
  piko::Buffer<uint64_t> out;
};

template <class T> T saturate(int64_t x) {
  using L = std::numeric_limits<T>;
  return T(std::clamp<int64_t>(x, L::min(), L::max()));
}

inline uint32_t swapBytes(uint32_t x) {
  return x >> 24 | (x >> 8 & 0xff00) | (x << 8 & 0xff0000) | x << 24;
}
inline uint16_t swapBytes(uint16_t x) { return uint16_t(x >> 8 | x << 8); }
inline uint64_t swapBytes(uint64_t x) {
  return uint64_t(swapBytes(uint32_t(x))) << 32 | swapBytes(uint32_t(x >> 32));
}
inline uint32_t swapBytesBySteps(uint32_t x) {
  x = (x & 0x00ff00ff) << 8 | (x >> 8 & 0x00ff00ff);
  return x << 16 | x >> 16;
}
inline uint32_t reverseBits(uint32_t x) {
  x = (x >> 1 & 0x55555555) | (x & 0x55555555) << 1;
  x = (x >> 2 & 0x33333333) | (x & 0x33333333) << 2;
  x = (x >> 4 & 0x0f0f0f0f) | (x & 0x0f0f0f0f) << 4;
  x = (x >> 8 & 0x00ff00ff) | (x & 0x00ff00ff) << 8;
  return x >> 16 | x << 16;
}
inline uint8_t reverseBits(uint8_t x) {
  x = uint8_t((x & 0xf0) >> 4 | (x & 0x0f) << 4);
  x = uint8_t((x & 0xcc) >> 2 | (x & 0x33) << 2);
  return uint8_t((x & 0xaa) >> 1 | (x & 0x55) << 1);
}
inline uint32_t reverseBitsInLoop(uint32_t x) {
  uint32_t result = 0;
  for (int i = 0; i < 32; ++i, x >>= 1)
    result = result << 1 | (x & 1);
  return result;
}
inline int countBits(uint32_t x) {
  x -= x >> 1 & 0x55555555;
  x = (x & 0x33333333) + (x >> 2 & 0x33333333);
  return int(((x + (x >> 4) & 0x0f0f0f0f) * 0x01010101) >> 24);
}

struct Bits : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    auto x = uint32_t(p.x) * 2654435761u ^ uint32_t(p.tag);
    auto y = uint32_t(p.y) * 40503u ^ x << 7;
    uint64_t wide = uint64_t(x) << 32 | y;
    auto i = int32_t(x), j = int32_t(y);
    uint64_t sum = 0;
    auto add = [&](auto value) {
      sum = std::rotl(sum, 5) * 31 + uint64_t(value);
    };
    add(swapBytes(x));
    add(swapBytes(uint16_t(y)));
    add(swapBytes(wide));
    add(swapBytesBySteps(y));
    add(reverseBits(x));
    add(reverseBits(uint8_t(y)));
    add(reverseBitsInLoop(y));
    add(float(reverseBits(y)) * 0x1p-32f * 100); // Van der Corput
    add(countBits(x));
    add(std::popcount(wide));
    add(std::countl_zero(x) + std::countr_zero(y) * 64);
    add(std::bit_width(x >> 9) + std::bit_ceil(y >> 3));
    add(saturate<int32_t>(int64_t(i) + j));
    add(saturate<int32_t>(int64_t(i) - j));
    add(saturate<int8_t>(int8_t(x) + int8_t(y)));
    add(saturate<int16_t>(int16_t(x) - int16_t(y)));
    add(saturate<uint8_t>(uint8_t(x) + uint8_t(y)));
    add(saturate<uint8_t>(int(uint8_t(x)) - uint8_t(y)));
    add(std::min<uint64_t>(uint64_t(x) + y, 0xffffffffu));
    add(x > y ? x - y : 0);
    add(x + y < x ? ~0u : x + y);
    add(std::midpoint(i, j));
    add((x & y) + ((x ^ y) >> 1));
    add(std::rotr(x, int(y & 31)) ^ (x << 13 | x >> 19));
    add(i < 0 ? -int64_t(i) : int64_t(i));
    add((x > y) - (x < y) + 2 * (i < j ? -1 : i > j));
    add(x ^ x >> 1);
    add(std::gcd(x & 1023, y & 255));
    add(__builtin_bswap32(y) ^ __builtin_bswap64(wide));
    add(int64_t(i) * j >> 32);
    piko::atomicAdd(state().out[x >> 26], sum);
  }
};
struct BitsPipe : piko::Pipe<State> {
  Bits bits;
  BitsPipe() { source(bits); }
};
