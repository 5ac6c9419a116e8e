// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Float.cpp - Arithmetic of PTX on f32 and f64 -----------------------===//
//
// Rounds to the nearest, ties to even; single-precision NaNs are 0x7fffffff.
// The approximations (rcp.approx, sin.approx, ...), whose bits only a GPU
// knows, are here the exact functions rounded from double precision.
//
//===----------------------------------------------------------------------===//

#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

#include <bit>
#include <cmath>

using namespace piko::ptx;

namespace {

inline float flush(float value) {
  uint32_t bits = std::bit_cast<uint32_t>(value);
  return bits & 0x7f800000 ? value : std::bit_cast<float>(bits & 0x80000000);
}
// By its bits: clang 22 at -O1 with sanitizers takes a root for equal to
// itself.
inline float canonical(float value) {
  uint32_t bits = std::bit_cast<uint32_t>(value);
  return (bits & 0x7fffffff) > 0x7f800000 ? std::bit_cast<float>(0x7fffffffu)
                                          : value;
}
inline double canonical(double value) { return value; }

template <typename T> struct Uniform {
  using Result = T;
  using A = T;
  using B = T;
  using C = T;
};

template <typename T> struct Add : Uniform<T> {
  static T apply(T a, T b) { return canonical(a + b); }
};
template <typename T> struct Sub : Uniform<T> {
  static T apply(T a, T b) { return canonical(a - b); }
};
template <typename T> struct Mul : Uniform<T> {
  static T apply(T a, T b) { return canonical(a * b); }
};
template <typename T> struct Div : Uniform<T> {
  static T apply(T a, T b) { return canonical(a / b); }
};
template <typename T> struct MulAdd : Uniform<T> {
  static T apply(T a, T b, T c) { return canonical(std::fma(a, b, c)); }
};
template <typename T> struct Reciprocal : Uniform<T> {
  static T apply(T a) { return canonical(T(1) / a); }
};
template <typename T> struct Root : Uniform<T> {
  static T apply(T a) { return canonical(std::sqrt(a)); }
};

/// A number is less than none; -0 is less than 0.
template <typename T> struct Min : Uniform<T> {
  static T apply(T a, T b) {
    if (a != a || b != b)
      return canonical(a != a ? b : a);
    return a < b || (a == b && std::signbit(a)) ? a : b;
  }
};
template <typename T> struct Max : Uniform<T> {
  static T apply(T a, T b) {
    if (a != a || b != b)
      return canonical(a != a ? b : a);
    return a > b || (a == b && !std::signbit(a)) ? a : b;
  }
};
template <typename T> struct MinNaN : Uniform<T> {
  static T apply(T a, T b) {
    return a != a || b != b ? canonical(a + b) : Min<T>::apply(a, b);
  }
};
template <typename T> struct MaxNaN : Uniform<T> {
  static T apply(T a, T b) {
    return a != a || b != b ? canonical(a + b) : Max<T>::apply(a, b);
  }
};
template <typename T> struct Neg : Uniform<T> {
  static T apply(T a) { return -a; }
};
template <typename T> struct Abs : Uniform<T> {
  static T apply(T a) { return std::fabs(a); }
};
/// The second operand's value with the sign of the first.
template <typename T> struct CopySign : Uniform<T> {
  static T apply(T a, T b) { return std::copysign(b, a); }
};

template <double (*Function)(double)> struct Approximation : Uniform<float> {
  static float apply(float a) {
    return canonical(static_cast<float>(Function(a)));
  }
};
double inverseRoot(double a) { return 1 / std::sqrt(a); }
double inverse(double a) { return 1 / a; }
double root(double a) { return std::sqrt(a); }
double sine(double a) { return std::sin(a); }
double cosine(double a) { return std::cos(a); }
double power(double a) { return std::exp2(a); }
double logarithm(double a) { return std::log2(a); }
double hyperbolicTangent(double a) { return std::tanh(a); }

/// Denormals of single precision are zero: operands and results.
template <typename Op> struct Flushed : Uniform<float> {
  static float apply(float a) { return flush(Op::apply(flush(a))); }
  static float apply(float a, float b) {
    return flush(Op::apply(flush(a), flush(b)));
  }
  static float apply(float a, float b, float c) {
    return flush(Op::apply(flush(a), flush(b), flush(c)));
  }
};
/// Results are clamped to [0, 1]; a NaN becomes 0.
template <typename Op> struct Saturated : Uniform<float> {
  static float clamp(float value) {
    return value > 0 ? (value < 1 ? value : 1.0f) : 0.0f;
  }
  static float apply(float a, float b) { return clamp(Op::apply(a, b)); }
  static float apply(float a, float b, float c) {
    return clamp(Op::apply(a, b, c));
  }
};

struct Modifiers {
  Type type;
  bool flushes, saturates;
};

Modifiers takeModifiers(Decoding &d) {
  Modifiers modifiers{};
  modifiers.type = d.takeType();
  modifiers.flushes = d.take("ftz");
  modifiers.saturates = d.take("sat");
  if (modifiers.type.bits == 64 && (modifiers.flushes || modifiers.saturates))
    d.fail("expected neither .ftz nor .sat");
  d.it.counted = modifiers.type.bits == 64 ? Class::Double : Class::Single;
  return modifiers;
}

template <template <typename> class Op> Handler unaryFor(Modifiers m) {
  if (m.saturates)
    return nullptr;
  if (m.type.bits == 64)
    return unary<Op<double>>;
  return m.flushes ? unary<Flushed<Op<float>>> : unary<Op<float>>;
}
template <template <typename> class Op> Handler binaryFor(Modifiers m) {
  if (m.type.bits == 64)
    return binary<Op<double>>;
  if (m.saturates)
    return m.flushes ? binary<Saturated<Flushed<Op<float>>>>
                     : binary<Saturated<Op<float>>>;
  return m.flushes ? binary<Flushed<Op<float>>> : binary<Op<float>>;
}
Handler mulAddFor(Modifiers m) {
  if (m.type.bits == 64)
    return ternary<MulAdd<double>>;
  if (m.saturates)
    return m.flushes ? ternary<Saturated<Flushed<MulAdd<float>>>>
                     : ternary<Saturated<MulAdd<float>>>;
  return m.flushes ? ternary<Flushed<MulAdd<float>>> : ternary<MulAdd<float>>;
}
template <double (*Function)(double)> Handler approximation(bool flushes) {
  return flushes ? unary<Flushed<Approximation<Function>>>
                 : unary<Approximation<Function>>;
}

void finishOperands(Decoding &d, Type type, size_t operands) {
  d.finish(operands + 1);
  if (!d.it.run)
    d.fail("expected an instruction that is known");
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  if (operands > 1)
    d.it.b = d.value(2, type);
  if (operands > 2)
    d.it.c = d.value(3, type);
}

Handler approximationNamed(std::string_view base, bool flushes) {
  return base == "rcp"     ? approximation<inverse>(flushes)
         : base == "sqrt"  ? approximation<root>(flushes)
         : base == "rsqrt" ? approximation<inverseRoot>(flushes)
         : base == "sin"   ? approximation<sine>(flushes)
         : base == "cos"   ? approximation<cosine>(flushes)
         : base == "ex2"   ? approximation<power>(flushes)
         : base == "lg2"   ? approximation<logarithm>(flushes)
         : base == "tanh"  ? approximation<hyperbolicTangent>(flushes)
                           : nullptr;
}

/// rcp, sqrt and the functions that exist as approximations alone.
bool decodeFunction(Decoding &d) {
  std::string_view base = d.base();
  bool approximate = d.take("approx");
  if (!approximate && !d.take("rn"))
    d.fail("expected .rn or .approx");
  Modifiers m = takeModifiers(d);
  d.it.counted = approximate         ? Class::Special
                 : m.type.bits == 64 ? Class::DoubleDivision
                                     : Class::SingleDivision;
  if (approximate)
    d.it.run =
        m.type.bits == 32 ? approximationNamed(base, m.flushes) : nullptr;
  else if (base == "rcp")
    d.it.run = unaryFor<Reciprocal>(m);
  else if (base == "sqrt")
    d.it.run = unaryFor<Root>(m);
  finishOperands(d, m.type, 1);
  return true;
}

Handler extremeFor(std::string_view base, bool keepsNaN, Modifiers m) {
  if (m.saturates)
    return nullptr;
  if (base == "min")
    return keepsNaN ? binaryFor<MinNaN>(m) : binaryFor<Min>(m);
  return keepsNaN ? binaryFor<MaxNaN>(m) : binaryFor<Max>(m);
}

bool decodeBinary(Decoding &d) {
  std::string_view base = d.base();
  const bool isExtreme = base == "min" || base == "max";
  const bool keepsNaN = isExtreme && d.take("NaN");
  bool rounds = !isExtreme && base != "copysign" && d.take("rn");
  // Allowed to be two ulps off, which this is not.
  if (base == "div" && !rounds && d.takeOneOf({"full", "approx"}).empty())
    d.fail("expected .rn, .full or .approx");
  Modifiers m = takeModifiers(d);
  d.it.run = isExtreme       ? extremeFor(base, keepsNaN, m)
             : base == "add" ? binaryFor<Add>(m)
             : base == "sub" ? binaryFor<Sub>(m)
             : base == "mul" ? binaryFor<Mul>(m)
             : base == "div" ? binaryFor<Div>(m)
                             : binaryFor<CopySign>(m);
  if (base == "div")
    d.it.counted =
        m.type.bits == 64 ? Class::DoubleDivision : Class::SingleDivision;
  finishOperands(d, m.type, 2);
  return true;
}

enum Property : uint8_t {
  Finite,
  Infinite,
  Number,
  NotNumber,
  Normal,
  Denormal
};

template <typename T> void test(Warp &warp, const Instruction &it) {
  const T *a = warp.lanes<T>(it.a);
  warp.setPredicate(it.result, lanesWhere(warp.active, [&](uint32_t lane) {
                      switch (it.variant) {
                      case Finite:
                        return std::isfinite(a[lane]);
                      case Infinite:
                        return std::isinf(a[lane]);
                      case Number:
                        return !std::isnan(a[lane]);
                      case NotNumber:
                        return std::isnan(a[lane]);
                      case Normal:
                        return std::isnormal(a[lane]);
                      default:
                        return std::fpclassify(a[lane]) == FP_SUBNORMAL;
                      }
                    }));
}

bool decodeTest(Decoding &d) {
  static constexpr std::pair<std::string_view, Property> names[] = {
      {"finite", Finite}, {"infinite", Infinite},
      {"number", Number}, {"notanumber", NotNumber},
      {"normal", Normal}, {"subnormal", Denormal}};
  Type type = d.takeType();
  for (auto [name, property] : names)
    if (d.take(name)) {
      d.it.variant = property;
      d.it.run = type.bits == 64 ? test<double> : test<float>;
    }
  if (!d.it.run)
    d.fail("expected a property that is known");
  d.finish(2);
  d.it.counted = type.bits == 64 ? Class::Double : Class::Single;
  d.it.result = d.result(0, Type{Kind::Predicate, 1});
  d.it.a = d.value(1, type);
  return true;
}

} // namespace

bool piko::ptx::decodeFloat(Decoding &d) {
  std::string_view base = d.base();
  std::optional<Type> named = d.peekType();
  if (!named || !named->isFloat() || named->bits < 32)
    return false;
  if (base == "add" || base == "sub" || base == "mul" || base == "div" ||
      base == "min" || base == "max" || base == "copysign")
    return decodeBinary(d);
  if (base == "rcp" || base == "sqrt" || base == "rsqrt" || base == "sin" ||
      base == "cos" || base == "ex2" || base == "lg2" || base == "tanh")
    return decodeFunction(d);
  if (base == "testp")
    return decodeTest(d);
  if (base == "fma" || base == "mad") {
    if (!d.take("rn"))
      d.fail("expected .rn");
    Modifiers m = takeModifiers(d);
    d.it.run = mulAddFor(m);
    finishOperands(d, m.type, 3);
    return true;
  }
  if (base == "neg" || base == "abs") {
    Modifiers m = takeModifiers(d);
    d.it.run = base == "neg" ? unaryFor<Neg>(m) : unaryFor<Abs>(m);
    finishOperands(d, m.type, 1);
    return true;
  }
  return false;
}
