// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Arguments from numbers, and sums of the bits of results.
#include <piko.h>

#include <bit>
#include <concepts>

/// A mixing of bits in which no two numbers collide.
inline uint32_t mix(uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return x ^ (x >> 16);
}

/// A float of any size; between -8 and 8; near 1; or a special one.
inline float makeArgument(uint32_t x) {
  uint32_t bits = mix(x);
  float signedUnit = float(int32_t(bits)) * 0x1p-31f;
  switch (x % 4) {
  case 0:
    return std::bit_cast<float>(bits);
  case 1:
    return signedUnit * 8.0f;
  case 2:
    return 1.0f + signedUnit * signedUnit * signedUnit;
  }
  float sign = bits & 1 ? -1.0f : 1.0f;
  switch ((bits >> 1) % 12) {
  case 0:
    return sign * 0.0f;
  case 1:
    return sign;
  case 2:
    return sign * 0x1p-149f;
  case 3:
    return sign * 0x1.fffffep127f;
  case 4:
    return sign * std::bit_cast<float>(0x7f800000u);
  case 5:
    return std::bit_cast<float>(0x7fc00000u);
  case 6:
    return sign * 0x1p-126f;
  case 7:
    return sign * 0x1p23f;
  case 8:
    return sign * 2147483648.0f;
  case 9:
    return sign * 0.5f;
  case 10:
    return sign * float(bits >> 27);
  }
  return sign * 0x1.921fb6p+0f;
}

/// All NaNs are one.
inline uint32_t getBits(float x) {
  return x != x ? 0x7fc00000u : std::bit_cast<uint32_t>(x);
}
inline uint32_t getBits(double x) {
  uint64_t bits = x != x ? 0 : std::bit_cast<uint64_t>(x);
  return static_cast<uint32_t>(bits ^ (bits >> 32));
}
template <std::integral T> uint32_t getBits(T x) {
  uint64_t bits = static_cast<uint64_t>(x);
  return static_cast<uint32_t>(bits ^ (bits >> 32));
}

struct Item {
  int row;
};
struct Sums {
  int32_t of[96];
};
struct State {
  piko::Buffer<Sums> sums;
};

/// Calls `f(put, i, x, y, z)` with many arguments; put adds up the bits of
/// results, each at its place in the list.
template <class Function>
struct Call : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &item) {
    for (int k = 0; k < 128; ++k) {
      int i = item.row * 128 + k;
      uint32_t seed = static_cast<uint32_t>(i) * 3u;
      int place = 0;
      auto put = [&](auto... results) {
        ((piko::atomicAdd(state().sums[item.row].of[place++],
                          static_cast<int32_t>(mix(getBits(results))))),
         ...);
      };
      Function::call(put, i, makeArgument(seed), makeArgument(seed + 1),
                     makeArgument(seed + 2));
    }
  }
};
