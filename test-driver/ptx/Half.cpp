// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Half.cpp - Arithmetic of PTX on f16 --------------------------------===//

#include "ptx/Half.h"
#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

using namespace piko::ptx;

namespace {

struct Halves {
  using Result = Half;
  using A = Half;
  using B = Half;
  using C = Half;
};
struct Add : Halves {
  static Half apply(Half a, Half b) { return toHalf(double(a) + double(b)); }
};
struct Sub : Halves {
  static Half apply(Half a, Half b) { return toHalf(double(a) - double(b)); }
};
struct Mul : Halves {
  static Half apply(Half a, Half b) { return toHalf(double(a) * double(b)); }
};
struct MulAdd : Halves {
  static Half apply(Half a, Half b, Half c) {
    return toHalf(double(a) * double(b) + double(c));
  }
};
struct Min : Halves {
  static Half apply(Half a, Half b) {
    double x = a, y = b;
    if (x != x || y != y)
      return x == x ? a : y == y ? b : Half{0x7fff};
    return x < y || (x == y && std::signbit(x)) ? a : b;
  }
};
struct Max : Halves {
  static Half apply(Half a, Half b) {
    double x = a, y = b;
    if (x != x || y != y)
      return x == x ? a : y == y ? b : Half{0x7fff};
    return x > y || (x == y && !std::signbit(x)) ? a : b;
  }
};
struct Neg : Halves {
  static Half apply(Half a) { return {static_cast<uint16_t>(a.bits ^ 0x8000)}; }
};
struct Abs : Halves {
  static Half apply(Half a) { return {static_cast<uint16_t>(a.bits & 0x7fff)}; }
};

struct Named {
  std::string_view name;
  Handler run;
  size_t operands;
};
constexpr Named operations[] = {
    {"add", binary<Add>, 2}, {"sub", binary<Sub>, 2},
    {"mul", binary<Mul>, 2}, {"min", binary<Min>, 2},
    {"max", binary<Max>, 2}, {"neg", unary<Neg>, 1},
    {"abs", unary<Abs>, 1},  {"fma", ternary<MulAdd>, 3}};

} // namespace

bool piko::ptx::decodeHalf(Decoding &d) {
  std::optional<Type> type = d.peekType();
  if (type != Type{Kind::Float, 16})
    return false;
  for (const Named &named : operations) {
    if (d.base() != named.name)
      continue;
    d.takeType();
    d.take("rn");
    d.finish(named.operands + 1);
    d.it.run = named.run;
    d.it.counted = Class::Single;
    d.it.result = d.result(0, *type);
    d.it.a = d.value(1, *type);
    if (named.operands > 1)
      d.it.b = d.value(2, *type);
    if (named.operands > 2)
      d.it.c = d.value(3, *type);
    return true;
  }
  return false;
}
