// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Integer.cpp - Integer arithmetic of PTX ----------------------------===//
//
// What PTX leaves open: a quotient by zero has all bits set, the remainder then
// is the dividend; the most negative number by -1 gives itself, and no
// remainder.
//
//===----------------------------------------------------------------------===//

#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

#include <algorithm>
#include <limits>
#include <type_traits>

using namespace piko::ptx;

namespace {

/// Without undefined overflow, and not promoted to int.
template <typename T>
using Wrapping =
    std::conditional_t<sizeof(T) < 4, uint32_t, std::make_unsigned_t<T>>;
template <typename T> T wrap(Wrapping<T> value) {
  return static_cast<T>(value);
}

template <typename T> struct Uniform {
  using Result = T;
  using A = T;
  using B = T;
  using C = T;
};

template <typename T> struct Add : Uniform<T> {
  static T apply(T a, T b) { return wrap<T>(Wrapping<T>(a) + Wrapping<T>(b)); }
};
template <typename T> struct Sub : Uniform<T> {
  static T apply(T a, T b) { return wrap<T>(Wrapping<T>(a) - Wrapping<T>(b)); }
};
template <typename T> struct MulLow : Uniform<T> {
  static T apply(T a, T b) { return wrap<T>(Wrapping<T>(a) * Wrapping<T>(b)); }
};
template <typename T> struct MulAddLow : Uniform<T> {
  static T apply(T a, T b, T c) {
    return wrap<T>(Wrapping<T>(a) * Wrapping<T>(b) + Wrapping<T>(c));
  }
};

template <typename T> struct WiderOf;
template <> struct WiderOf<uint16_t> {
  using type = uint32_t;
};
template <> struct WiderOf<int16_t> {
  using type = int32_t;
};
template <> struct WiderOf<uint32_t> {
  using type = uint64_t;
};
template <> struct WiderOf<int32_t> {
  using type = int64_t;
};
__extension__ template <> struct WiderOf<uint64_t> {
  using type = unsigned __int128;
};
__extension__ template <> struct WiderOf<int64_t> {
  using type = __int128;
};
template <typename T> using Wider = typename WiderOf<T>::type;

template <typename T> struct MulHigh : Uniform<T> {
  static T apply(T a, T b) {
    return static_cast<T>((Wider<T>(a) * Wider<T>(b)) >> (8 * sizeof(T)));
  }
};
template <typename T> struct MulAddHigh : Uniform<T> {
  static T apply(T a, T b, T c) {
    return Add<T>::apply(MulHigh<T>::apply(a, b), c);
  }
};
template <typename T> struct MulWide {
  using Result = Wider<T>;
  using A = T;
  using B = T;
  static Result apply(T a, T b) { return Result(a) * Result(b); }
};
template <typename T> struct MulAddWide {
  using Result = Wider<T>;
  using A = T;
  using B = T;
  using C = Result;
  static Result apply(T a, T b, Result c) {
    return Add<Result>::apply(Result(a) * Result(b), c);
  }
};

template <typename T> struct Div : Uniform<T> {
  static T apply(T a, T b) {
    if (!b)
      return static_cast<T>(-1);
    if (std::is_signed_v<T> && b == static_cast<T>(-1))
      return Sub<T>::apply(0, a);
    return static_cast<T>(a / b);
  }
};
template <typename T> struct Rem : Uniform<T> {
  static T apply(T a, T b) {
    if (!b)
      return a;
    if (std::is_signed_v<T> && b == static_cast<T>(-1))
      return 0;
    return static_cast<T>(a % b);
  }
};
template <typename T> struct Min : Uniform<T> {
  static T apply(T a, T b) { return a < b ? a : b; }
};
template <typename T> struct Max : Uniform<T> {
  static T apply(T a, T b) { return a > b ? a : b; }
};
template <typename T> struct Neg : Uniform<T> {
  static T apply(T a) { return Sub<T>::apply(0, a); }
};
template <typename T> struct Abs : Uniform<T> {
  static T apply(T a) { return a < 0 ? Sub<T>::apply(0, a) : a; }
};
template <typename T> struct AddSaturated : Uniform<T> {
  static T apply(T a, T b) {
    return static_cast<T>(std::clamp<int64_t>(int64_t(a) + b,
                                              std::numeric_limits<T>::min(),
                                              std::numeric_limits<T>::max()));
  }
};
template <typename T> struct SubSaturated : Uniform<T> {
  static T apply(T a, T b) {
    return static_cast<T>(std::clamp<int64_t>(int64_t(a) - b,
                                              std::numeric_limits<T>::min(),
                                              std::numeric_limits<T>::max()));
  }
};
template <typename T> struct AbsoluteDifference : Uniform<T> {
  static T apply(T a, T b, T c) {
    return Add<T>::apply(c, a < b ? Sub<T>::apply(b, a) : Sub<T>::apply(a, b));
  }
};

template <typename T> struct Tag {};

/// Calls \p function with a tag of the C++ type of 16 bits or more.
template <typename F> Handler forType(Type type, F function) {
  switch (type.bits) {
  case 16:
    return type.isSigned() ? function(Tag<int16_t>())
                           : function(Tag<uint16_t>());
  case 32:
    return type.isSigned() ? function(Tag<int32_t>())
                           : function(Tag<uint32_t>());
  case 64:
    return type.isSigned() ? function(Tag<int64_t>())
                           : function(Tag<uint64_t>());
  default:
    return nullptr;
  }
}

template <template <typename> class Op> Handler binaryFor(Type type) {
  return forType(type,
                 []<typename T>(Tag<T>) -> Handler { return binary<Op<T>>; });
}
template <template <typename> class Op> Handler ternaryFor(Type type) {
  return forType(type,
                 []<typename T>(Tag<T>) -> Handler { return ternary<Op<T>>; });
}
template <template <typename> class Op> Handler unaryFor(Type type) {
  return forType(type,
                 []<typename T>(Tag<T>) -> Handler { return unary<Op<T>>; });
}

/// The carry of add.cc is a predicate that no text names.
template <typename T, bool Subtract>
void addWithCarry(Warp &warp, const Instruction &it) {
  auto *result = warp.lanes<T>(it.result);
  const auto *a = warp.lanes<T>(it.a), *b = warp.lanes<T>(it.b);
  uint32_t carries = warp.predicate(it.c);
  const bool reads = it.variant & 1, writes = it.variant & 2;
  forEachLane(warp.active, [&](uint32_t lane) {
    const T carry = reads && (carries >> lane & 1), x = a[lane], y = b[lane];
    bool overflows;
    if constexpr (Subtract) {
      overflows = x < y || (x == y && carry);
      result[lane] = x - y - carry;
    } else {
      T sum = x + y;
      overflows = sum < x || static_cast<T>(sum + carry) < sum;
      result[lane] = sum + carry;
    }
    if (writes)
      carries = (carries & ~(1u << lane)) | uint32_t(overflows) << lane;
  });
  warp.predicate(it.c) = carries;
}

Type widened(Type type) {
  type.bits *= 2;
  return type;
}

bool decodeCarry(Decoding &d, bool subtract, bool reads) {
  d.it.variant = static_cast<uint8_t>(reads) | (d.take("cc") ? 2 : 0);
  Type type = d.takeType();
  d.finish(3);
  if (type.bits < 32)
    d.fail("expected 32 or 64 bits");
  d.it.run = type.bits == 64 ? (subtract ? addWithCarry<uint64_t, true>
                                         : addWithCarry<uint64_t, false>)
                             : (subtract ? addWithCarry<uint32_t, true>
                                         : addWithCarry<uint32_t, false>);
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, type);
  Type carry;
  d.it.c = d.scope.registerOf("%carry", &carry);
  return true;
}

bool decodeMultiply(Decoding &d, bool adds) {
  std::string_view part = d.takeOneOf({"lo", "hi", "wide"});
  Type type = d.takeType();
  d.finish(adds ? 4 : 3);
  Type resultType = part == "wide" ? widened(type) : type;
  if (part == "lo") {
    d.it.run = adds ? ternaryFor<MulAddLow>(type) : binaryFor<MulLow>(type);
  } else if (part == "hi") {
    d.it.run = adds ? ternaryFor<MulAddHigh>(type) : binaryFor<MulHigh>(type);
  } else if (part == "wide" && type.bits < 64) {
    auto wide = [&]<typename T>(Tag<T>) -> Handler {
      if constexpr (sizeof(T) == 8)
        return nullptr;
      else
        return adds ? Handler(ternary<MulAddWide<T>>)
                    : Handler(binary<MulWide<T>>);
    };
    d.it.run = forType(type, wide);
  }
  if (!d.it.run)
    d.fail("expected .lo, .hi or .wide and a type of 16 bits or more");
  d.it.result = d.result(0, resultType);
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, type);
  if (adds)
    d.it.c = d.value(3, resultType);
  return true;
}

/// The handlers of an operation by its name; null if it is none of these.
Handler binaryNamed(Decoding &d, Type type, bool saturates) {
  std::string_view base = d.base();
  if (saturates && type == Type{Kind::Signed, 32})
    return base == "add"   ? Handler(binary<AddSaturated<int32_t>>)
           : base == "sub" ? Handler(binary<SubSaturated<int32_t>>)
                           : nullptr;
  if (saturates)
    return nullptr;
  if (base == "add")
    return binaryFor<Add>(type);
  if (base == "sub")
    return binaryFor<Sub>(type);
  if (base == "div")
    return binaryFor<Div>(type);
  if (base == "rem")
    return binaryFor<Rem>(type);
  if (base == "min")
    return binaryFor<Min>(type);
  return base == "max" ? binaryFor<Max>(type) : nullptr;
}

} // namespace

bool piko::ptx::decodeInteger(Decoding &d) {
  std::string_view base = d.base();
  std::optional<Type> named = d.peekType();
  if (!named || named->isFloat() || named->isPredicate())
    return false;
  const bool isDivision = base == "div" || base == "rem";
  d.it.counted = isDivision          ? Class::IntegerDivision
                 : named->bits == 64 ? Class::Integer64
                                     : Class::Integer;
  if (base == "mul" || base == "mad")
    return decodeMultiply(d, base == "mad");
  if (base == "addc" || base == "subc")
    return decodeCarry(d, base == "subc", true);
  const bool isUnary = base == "neg" || base == "abs";
  const bool isBinary = base == "add" || base == "sub" || base == "min" ||
                        base == "max" || isDivision;
  if (!isUnary && !isBinary && base != "sad")
    return false;

  Type type = d.takeType();
  if (d.take("cc")) {
    d.it.variant = 2;
    d.finish(3);
    if (type.bits < 32 || (base != "add" && base != "sub"))
      d.fail("expected add or sub of 32 or 64 bits");
    d.it.run = type.bits == 64
                   ? (base == "sub" ? addWithCarry<uint64_t, true>
                                    : addWithCarry<uint64_t, false>)
                   : (base == "sub" ? addWithCarry<uint32_t, true>
                                    : addWithCarry<uint32_t, false>);
    Type carry;
    d.it.c = d.scope.registerOf("%carry", &carry);
  } else if (isUnary) {
    d.it.run = base == "neg" ? unaryFor<Neg>(type) : unaryFor<Abs>(type);
    d.finish(2);
  } else if (isBinary) {
    d.it.run = binaryNamed(d, type, d.take("sat"));
    d.finish(3);
  } else {
    d.it.run = ternaryFor<AbsoluteDifference>(type);
    d.finish(4);
    d.it.c = d.value(3, type);
  }
  if (!d.it.run)
    d.fail("expected a type that is known");
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  if (!isUnary)
    d.it.b = d.value(2, type);
  return true;
}
