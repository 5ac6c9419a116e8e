// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Logic.cpp - Bits and shifts of PTX ---------------------------------===//

#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

#include <algorithm>
#include <type_traits>

using namespace piko::ptx;

namespace {

template <typename T> struct Uniform {
  using Result = T;
  using A = T;
  using B = T;
  using C = T;
};
template <typename T> struct And : Uniform<T> {
  static T apply(T a, T b) { return a & b; }
};
template <typename T> struct Or : Uniform<T> {
  static T apply(T a, T b) { return a | b; }
};
template <typename T> struct Xor : Uniform<T> {
  static T apply(T a, T b) { return a ^ b; }
};
template <typename T> struct Not : Uniform<T> {
  static T apply(T a) { return static_cast<T>(~a); }
};
template <typename T> struct LogicalNot : Uniform<T> {
  static T apply(T a) { return !a; }
};

/// Counts of shifts are of 32 bits, and as large as it takes to shift all out.
template <typename T> struct ShiftLeft : Uniform<T> {
  using B = uint32_t;
  static T apply(T a, uint32_t b) {
    return b < 8 * sizeof(T) ? static_cast<T>(a << b) : T(0);
  }
};
template <typename T> struct ShiftRight : Uniform<T> {
  using B = uint32_t;
  static T apply(T a, uint32_t b) {
    constexpr uint32_t most = 8 * sizeof(T) - 1;
    if (std::is_signed_v<T>)
      return static_cast<T>(a >> (b < most ? b : most));
    return b <= most ? static_cast<T>(a >> b) : T(0);
  }
};
template <bool Wrap, bool Left> struct Funnel : Uniform<uint32_t> {
  static uint32_t apply(uint32_t low, uint32_t high, uint32_t count) {
    count = Wrap ? count & 31 : std::min(count, 32u);
    uint64_t both = uint64_t(high) << 32 | low;
    return static_cast<uint32_t>(Left ? (both << count) >> 32 : both >> count);
  }
};

template <typename T> struct Count {
  using Result = uint32_t;
  using A = T;
};
template <typename T> struct Population : Count<T> {
  static uint32_t apply(T a) { return static_cast<uint32_t>(std::popcount(a)); }
};
template <typename T> struct LeadingZeros : Count<T> {
  static uint32_t apply(T a) {
    return static_cast<uint32_t>(std::countl_zero(a));
  }
};
template <typename T> struct Reverse : Uniform<T> {
  static T apply(T a) {
    T reversed = 0;
    for (size_t bit = 0; bit < 8 * sizeof(T); ++bit)
      reversed |= (a >> bit & 1) << (8 * sizeof(T) - 1 - bit);
    return reversed;
  }
};
/// The highest bit that is not the sign, or how far to shift it up.
template <typename T, bool ShiftAmount> struct FindHighest : Count<T> {
  static uint32_t apply(T a) {
    using Bits = std::make_unsigned_t<T>;
    auto bits = static_cast<Bits>(a < 0 ? ~a : a);
    auto zeros = static_cast<uint32_t>(std::countl_zero(bits));
    if (!bits)
      return ~0u;
    return ShiftAmount ? zeros : 8 * sizeof(T) - 1 - zeros;
  }
};

template <typename T> struct Extract : Uniform<T> {
  using B = uint32_t;
  using C = uint32_t;
  static T apply(T a, uint32_t start, uint32_t length) {
    using Bits = std::make_unsigned_t<T>;
    constexpr uint32_t width = 8 * sizeof(T);
    start &= 255;
    length &= 255;
    if (!length)
      return 0;
    auto bits = static_cast<Bits>(a);
    uint32_t last = std::min(start + length - 1, width - 1);
    bool sign = std::is_signed_v<T> && (bits >> last & 1);
    Bits fill = sign ? ~Bits(0) : Bits(0);
    Bits field = start < width ? bits >> start : fill;
    // Beyond the number all bits are as its sign.
    uint32_t inside = start < width ? std::min(length, width - start) : 0;
    Bits mask = inside < width ? (Bits(1) << inside) - 1 : ~Bits(0);
    return static_cast<T>((field & mask) | (fill & ~mask));
  }
};

template <typename T> void insert(Warp &warp, const Instruction &it) {
  constexpr uint32_t width = 8 * sizeof(T);
  const Operand lengths = warp.program->lists[it.extra][0];
  forEachLane(warp.active, [&](uint32_t lane) {
    T from = warp.lanes<T>(it.a)[lane], into = warp.lanes<T>(it.b)[lane];
    uint32_t start = warp.lanes<uint32_t>(it.c)[lane] & 255;
    uint32_t length = warp.lanes<uint32_t>(lengths)[lane] & 255;
    T mask = length < width ? (T(1) << length) - 1 : ~T(0);
    if (start < width)
      into = (into & ~(mask << start)) | (from & mask) << start;
    warp.lanes<T>(it.result)[lane] = into;
  });
}

void permuteBytes(Warp &warp, const Instruction &it) {
  const auto *a = warp.lanes<uint32_t>(it.a), *b = warp.lanes<uint32_t>(it.b);
  const auto *selectors = warp.lanes<uint32_t>(it.c);
  forEachLane(warp.active, [&](uint32_t lane) {
    uint64_t both = uint64_t(b[lane]) << 32 | a[lane];
    uint32_t permuted = 0;
    for (uint32_t byte = 0; byte < 4; ++byte) {
      uint32_t selector = selectors[lane] >> 4 * byte & 15;
      auto value = static_cast<uint8_t>(both >> 8 * (selector & 7));
      if (selector & 8)
        value = value & 128 ? 255 : 0;
      permuted |= uint32_t(value) << 8 * byte;
    }
    warp.lanes<uint32_t>(it.result)[lane] = permuted;
  });
}

/// it.variant has a bit of the result for each of the eight combinations.
void lookUp(Warp &warp, const Instruction &it) {
  const auto *a = warp.lanes<uint32_t>(it.a), *b = warp.lanes<uint32_t>(it.b);
  const auto *c = warp.lanes<uint32_t>(it.c);
  forEachLane(warp.active, [&](uint32_t lane) {
    uint32_t value = 0;
    for (uint32_t row = 0; row < 8; ++row)
      if (it.variant >> row & 1)
        value |= (row & 4 ? a[lane] : ~a[lane]) &
                 (row & 2 ? b[lane] : ~b[lane]) &
                 (row & 1 ? c[lane] : ~c[lane]);
    warp.lanes<uint32_t>(it.result)[lane] = value;
  });
}

enum PredicateOperation : uint8_t { AndPredicate, OrPredicate, XorPredicate };

void combinePredicates(Warp &warp, const Instruction &it) {
  uint32_t a = warp.predicate(it.a), b = warp.predicate(it.b);
  warp.setPredicate(it.result, it.variant == AndPredicate  ? a & b
                               : it.variant == OrPredicate ? a | b
                                                           : a ^ b);
}
void notPredicate(Warp &warp, const Instruction &it) {
  warp.setPredicate(it.result, ~warp.predicate(it.a));
}

template <template <typename> class Op> Handler binaryFor(Type type) {
  return type.bits == 16   ? Handler(binary<Op<uint16_t>>)
         : type.bits == 32 ? Handler(binary<Op<uint32_t>>)
         : type.bits == 64 ? Handler(binary<Op<uint64_t>>)
                           : nullptr;
}
template <template <typename> class Op> Handler unaryFor(Type type) {
  return type.bits == 16   ? Handler(unary<Op<uint16_t>>)
         : type.bits == 32 ? Handler(unary<Op<uint32_t>>)
         : type.bits == 64 ? Handler(unary<Op<uint64_t>>)
                           : nullptr;
}
/// Of 32 and of 64 bits.
template <template <typename> class Op> Handler wideFor(Type type) {
  return type.bits == 32   ? Handler(unary<Op<uint32_t>>)
         : type.bits == 64 ? Handler(unary<Op<uint64_t>>)
                           : nullptr;
}

constexpr Type bits32{Kind::Bits, 32};

bool decodePredicates(Decoding &d) {
  d.takeType();
  d.it.result = d.result(0, Type{Kind::Predicate, 1});
  d.it.a = d.predicate(1);
  if (d.base() == "not") {
    d.finish(2);
    d.it.run = notPredicate;
    return true;
  }
  d.finish(3);
  d.it.b = d.predicate(2);
  d.it.variant = d.base() == "and"  ? AndPredicate
                 : d.base() == "or" ? OrPredicate
                                    : XorPredicate;
  d.it.run = combinePredicates;
  return true;
}

bool decodeBitwise(Decoding &d) {
  std::string_view base = d.base();
  Type type = d.takeType();
  const bool isUnary = base == "not" || base == "cnot";
  d.finish(isUnary ? 2 : 3);
  d.it.run = base == "and"   ? binaryFor<And>(type)
             : base == "or"  ? binaryFor<Or>(type)
             : base == "xor" ? binaryFor<Xor>(type)
             : base == "not" ? unaryFor<Not>(type)
                             : unaryFor<LogicalNot>(type);
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  if (!isUnary)
    d.it.b = d.value(2, type);
  return true;
}

bool decodeShift(Decoding &d) {
  Type type = d.takeType();
  d.finish(3);
  if (d.base() == "shl")
    d.it.run = binaryFor<ShiftLeft>(type);
  else if (!type.isSigned())
    d.it.run = binaryFor<ShiftRight>(type);
  else
    d.it.run = type.bits == 16   ? binary<ShiftRight<int16_t>>
               : type.bits == 32 ? binary<ShiftRight<int32_t>>
                                 : binary<ShiftRight<int64_t>>;
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, bits32);
  return true;
}

bool decodeFunnel(Decoding &d) {
  bool left = d.take("l");
  if (!left && !d.take("r"))
    d.fail("expected .l or .r");
  bool wraps = d.take("wrap");
  if (!wraps && !d.take("clamp"))
    d.fail("expected .wrap or .clamp");
  Type type = d.takeType();
  d.finish(4);
  d.it.run =
      left
          ? (wraps ? ternary<Funnel<true, true>> : ternary<Funnel<false, true>>)
          : (wraps ? ternary<Funnel<true, false>>
                   : ternary<Funnel<false, false>>);
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, type);
  d.it.c = d.value(3, bits32);
  return true;
}

bool decodeCount(Decoding &d) {
  std::string_view base = d.base();
  Type type = d.takeType();
  bool amount = base == "bfind" && d.take("shiftamt");
  d.finish(2);
  if (base == "popc")
    d.it.run = wideFor<Population>(type);
  else if (base == "clz")
    d.it.run = wideFor<LeadingZeros>(type);
  else if (base == "brev")
    d.it.run = wideFor<Reverse>(type);
  else if (type.bits == 32)
    d.it.run = type.isSigned() ? (amount ? unary<FindHighest<int32_t, true>>
                                         : unary<FindHighest<int32_t, false>>)
                               : (amount ? unary<FindHighest<uint32_t, true>>
                                         : unary<FindHighest<uint32_t, false>>);
  else
    d.it.run = type.isSigned() ? (amount ? unary<FindHighest<int64_t, true>>
                                         : unary<FindHighest<int64_t, false>>)
                               : (amount ? unary<FindHighest<uint64_t, true>>
                                         : unary<FindHighest<uint64_t, false>>);
  d.it.result = d.result(0, base == "brev" ? type : bits32);
  d.it.a = d.value(1, type);
  return true;
}

bool decodeField(Decoding &d) {
  Type type = d.takeType();
  bool isInsert = d.base() == "bfi";
  d.finish(isInsert ? 5 : 4);
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  if (isInsert) {
    d.it.run = type.bits == 64 ? insert<uint64_t> : insert<uint32_t>;
    d.it.b = d.value(2, type);
    d.it.c = d.value(3, bits32);
    d.it.extra = d.scope.addList({d.value(4, bits32)});
    return true;
  }
  d.it.run = type.bits == 64 ? (type.isSigned() ? ternary<Extract<int64_t>>
                                                : ternary<Extract<uint64_t>>)
                             : (type.isSigned() ? ternary<Extract<int32_t>>
                                                : ternary<Extract<uint32_t>>);
  d.it.b = d.value(2, bits32);
  d.it.c = d.value(3, bits32);
  return true;
}

bool decodeOfThree(Decoding &d) {
  Type type = d.takeType();
  const bool isTable = d.base() == "lop3";
  d.finish(isTable ? 5 : 4);
  d.it.run = isTable ? lookUp : permuteBytes;
  if (isTable)
    d.it.variant = static_cast<uint8_t>(d.immediate(4));
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, type);
  d.it.c = d.value(3, type);
  return true;
}

bool decodeByName(Decoding &d) {
  std::string_view base = d.base();
  if (base == "and" || base == "or" || base == "xor" || base == "not" ||
      base == "cnot")
    return d.peekType()->isPredicate() ? decodePredicates(d) : decodeBitwise(d);
  if (base == "shl" || base == "shr")
    return decodeShift(d);
  if (base == "shf")
    return decodeFunnel(d);
  if (base == "popc" || base == "clz" || base == "brev" || base == "bfind")
    return decodeCount(d);
  if (base == "bfe" || base == "bfi")
    return decodeField(d);
  return (base == "prmt" || base == "lop3") && decodeOfThree(d);
}

} // namespace

bool piko::ptx::decodeLogic(Decoding &d) {
  if (!d.peekType())
    return false;
  d.it.counted = d.peekType()->bits == 64 ? Class::Integer64 : Class::Integer;
  if (!decodeByName(d))
    return false;
  if (!d.it.run)
    d.fail("expected a type that is known");
  return true;
}
