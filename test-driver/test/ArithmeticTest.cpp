// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ArithmeticTest.cpp - Instructions without memory -------------------===//
//
// Each is run on all pairs of some numbers, and compared with C++.
//
//===----------------------------------------------------------------------===//

#include "test/DriverFixture.h"

#include <bit>
#include <cmath>
#include <functional>
#include <limits>

using namespace piko::testdriver;

namespace {

constexpr uint32_t canonicalNaN = 0x7fffffff;

const std::vector<uint32_t> integers = {
    0,          1,          2,          3,          5,         7,
    31,         32,         33,         255,        0x1234567, 0x7fffffff,
    0x80000000, 0x80000001, 0xfffffff0, 0xffffffff, 0xdeadbeef};
const std::vector<uint32_t> floats = {
    0x00000000, 0x80000000, 0x3f800000, 0xbf800000, 0x40490fdb, 0x3f000000,
    0x7f800000, 0xff800000, 0x7fc00000, 0xffc12345, 0x00000001, 0x80000123,
    0x007fffff, 0x7f7fffff, 0x4b000001, 0x33800000, 0xc0a00000, 0x3fc00000,
    0x40200000, 0x4f000000, 0xcf000001, 0x5f000000, 0xdf800000};
const std::vector<uint64_t> longs = {0,
                                     1,
                                     3,
                                     63,
                                     64,
                                     65,
                                     0xffffffff,
                                     0x100000000,
                                     0x123456789abcdef,
                                     0x7fffffffffffffff,
                                     0x8000000000000000,
                                     0xffffffffffffffff,
                                     0xfffffffffffffff5};
const std::vector<uint64_t> doubles = {0,
                                       0x8000000000000000,
                                       0x3ff0000000000000,
                                       0xbff8000000000000,
                                       0x400921fb54442d18,
                                       0x7ff0000000000000,
                                       0xfff0000000000000,
                                       0x0000000000000001,
                                       0x41dfffffffc00000,
                                       0xc1e0000000200000,
                                       0x43e0000000000000,
                                       0x36a0000000000000};

float asFloat(uint32_t bits) { return std::bit_cast<float>(bits); }
double asDouble(uint64_t bits) { return std::bit_cast<double>(bits); }
uint32_t bitsOf(float value) {
  return value != value ? canonicalNaN : std::bit_cast<uint32_t>(value);
}
uint64_t bitsOf(double value) { return std::bit_cast<uint64_t>(value); }
int32_t toSigned(uint32_t value) { return static_cast<int32_t>(value); }
int64_t toSigned(uint64_t value) { return static_cast<int64_t>(value); }
uint32_t bits(int32_t value) { return static_cast<uint32_t>(value); }

class ArithmeticTest : public DriverTest {
protected:
  /// Runs \p code on each pair: %rd6 and %rd7, whose low halves are %r5 and
  /// %r6, and as floats %f1, %f2 and %fd1, %fd2. \p result is a register.
  std::vector<uint64_t>
  runPairs(const std::string &code, const std::string &result,
           const std::vector<std::pair<uint64_t, uint64_t>> &pairs) {
    std::vector<uint64_t> in;
    for (auto [a, b] : pairs)
      in.insert(in.end(), {a, b});
    std::string store = "st.global.b32 [%rd4], " + result + ";";
    if (result.starts_with("%rd") || result.starts_with("%fd"))
      store = "st.global.b64 [%rd4], " + result + ";";
    if (result.starts_with("%rs"))
      store = "st.global.b16 [%rd4], " + result + ";";
    if (result.starts_with("%p"))
      store =
          "selp.b32 %r39, 1, 0, " + result + "; st.global.b32 [%rd4], %r39;";
    auto blocks = static_cast<unsigned>((in.size() + 31) / 32);
    return run(R"(
      mul.wide.u32 %rd5, %r4, 16;
      add.s64 %rd5, %rd1, %rd5;
      setp.ge.u32 %p10, %r4, )" +
                   std::to_string(pairs.size()) + R"(;
      @%p10 bra END;
      ld.global.v2.b64 {%rd6, %rd7}, [%rd5];
      cvt.u32.u64 %r5, %rd6;
      cvt.u32.u64 %r6, %rd7;
      mov.b32 %f1, %r5;
      mov.b32 %f2, %r6;
      mov.b64 %fd1, %rd6;
      mov.b64 %fd2, %rd7;
      )" + code + store +
                   "\nEND:",
               in, 32, blocks);
  }

  template <typename T>
  void check(const std::string &code, const std::string &result,
             const std::vector<T> &values,
             const std::function<uint64_t(T, T)> &expected) {
    std::vector<std::pair<uint64_t, uint64_t>> pairs;
    for (T a : values)
      for (T b : values)
        pairs.emplace_back(a, b);
    auto out = runPairs(code, result, pairs);
    for (size_t i = 0; i < pairs.size(); ++i) {
      auto a = static_cast<T>(pairs[i].first),
           b = static_cast<T>(pairs[i].second);
      ASSERT_EQ(out[i], expected(a, b))
          << code << std::hex << " of 0x" << a << ", 0x" << b;
    }
  }
  void check32(const std::string &code,
               const std::function<uint32_t(uint32_t, uint32_t)> &expected) {
    check<uint32_t>(code + " %r7, %r5, %r6;", "%r7", integers, expected);
  }
  void check64(const std::string &code,
               const std::function<uint64_t(uint64_t, uint64_t)> &expected) {
    check<uint64_t>(code + " %rd8, %rd6, %rd7;", "%rd8", longs, expected);
  }
  void checkFloat(const std::string &code,
                  const std::function<float(float, float)> &expected) {
    check<uint32_t>(code + " %f3, %f1, %f2;", "%f3", floats,
                    [&](uint32_t a, uint32_t b) {
                      return bitsOf(expected(asFloat(a), asFloat(b)));
                    });
  }
  void checkUnary(const std::string &code, const std::string &result,
                  const std::vector<uint32_t> &values,
                  const std::function<uint64_t(uint32_t)> &expected) {
    check<uint32_t>(code, result, values,
                    [&](uint32_t a, uint32_t) { return expected(a); });
  }
};

using U = uint32_t;
using L = uint64_t;

TEST_F(ArithmeticTest, Integers) {
  check32("add.s32", [](U a, U b) { return a + b; });
  check32("sub.s32", [](U a, U b) { return a - b; });
  check32("mul.lo.s32", [](U a, U b) { return a * b; });
  check32("mul.hi.u32", [](U a, U b) { return U(L(a) * b >> 32); });
  check32("mul.hi.s32",
          [](U a, U b) { return U(int64_t(toSigned(a)) * toSigned(b) >> 32); });
  check32("div.u32", [](U a, U b) { return b ? a / b : ~0u; });
  check32("rem.u32", [](U a, U b) { return b ? a % b : a; });
  check32("div.s32", [](U a, U b) {
    return b == 0 ? ~0u : b == ~0u ? -a : bits(toSigned(a) / toSigned(b));
  });
  check32("rem.s32", [](U a, U b) {
    return b == 0 ? a : b == ~0u ? 0 : bits(toSigned(a) % toSigned(b));
  });
  check32("min.s32",
          [](U a, U b) { return toSigned(a) < toSigned(b) ? a : b; });
  check32("max.u32", [](U a, U b) { return a > b ? a : b; });
  check32("add.sat.s32", [](U a, U b) {
    int64_t sum = int64_t(toSigned(a)) + toSigned(b);
    return sum > INT32_MAX ? U(INT32_MAX) : sum < INT32_MIN ? 1u << 31 : U(sum);
  });
  check<U>("mul.wide.s32 %rd8, %r5, %r6;", "%rd8", integers,
           [](U a, U b) { return L(int64_t(toSigned(a)) * toSigned(b)); });
  check<U>("mad.wide.u32 %rd8, %r5, %r6, %rd6;", "%rd8", integers,
           [](U a, U b) { return L(a) * b + a; });
  check<U>("mad.lo.s32 %r7, %r5, %r6, %r5;", "%r7", integers,
           [](U a, U b) { return a * b + a; });
  check<U>("sad.u32 %r7, %r5, %r6, %r6;", "%r7", integers,
           [](U a, U b) { return b + (a > b ? a - b : b - a); });
  checkUnary("neg.s32 %r7, %r5;", "%r7", integers, [](U a) { return -a; });
  checkUnary("abs.s32 %r7, %r5;", "%r7", integers,
             [](U a) { return toSigned(a) < 0 ? -a : a; });
}

TEST_F(ArithmeticTest, LongIntegers) {
  check64("add.s64", [](L a, L b) { return a + b; });
  check64("mul.lo.s64", [](L a, L b) { return a * b; });
  check64("mul.hi.u64", [](L a, L b) {
    return L((__extension__ static_cast<unsigned __int128>(a)) * b >> 64);
  });
  check64("div.s64", [](L a, L b) {
    return b == 0 ? ~L(0) : b == ~L(0) ? -a : L(toSigned(a) / toSigned(b));
  });
  check64("rem.u64", [](L a, L b) { return b ? a % b : a; });
  check64("max.s64",
          [](L a, L b) { return toSigned(a) > toSigned(b) ? a : b; });
  check<L>("mad.lo.s64 %rd8, %rd6, %rd7, %rd7;", "%rd8", longs,
           [](L a, L b) { return a * b + b; });
  // The upper half of a sum of 128 bits, and of a difference.
  check<L>("add.cc.s64 %rd8, %rd6, %rd7; addc.s64 %rd8, 5, 0;", "%rd8", longs,
           [](L a, L b) { return L(5) + (a + b < a); });
  check<L>("sub.cc.s64 %rd8, %rd6, %rd7; subc.s64 %rd8, 5, 0;", "%rd8", longs,
           [](L a, L b) { return L(5) - (a < b); });
}

TEST_F(ArithmeticTest, ShortIntegers) {
  checkUnary("cvt.u16.u32 %rs1, %r5; max.s16 %rs2, %rs1, 5;", "%rs2", integers,
             [](U a) {
               return static_cast<uint16_t>(
                   std::max<int16_t>(static_cast<int16_t>(a), 5));
             });
  checkUnary("cvt.u16.u32 %rs1, %r5; mul.wide.u16 %r7, %rs1, %rs1;", "%r7",
             integers, [](U a) { return (a & 0xffff) * (a & 0xffff); });
  checkUnary(
      "cvt.u16.u32 %rs1, %r5; shr.s16 %rs2, %rs1, 3;", "%rs2", integers,
      [](U a) { return static_cast<uint16_t>(static_cast<int16_t>(a) >> 3); });
}

TEST_F(ArithmeticTest, Bits) {
  check32("and.b32", [](U a, U b) { return a & b; });
  check32("or.b32", [](U a, U b) { return a | b; });
  check32("xor.b32", [](U a, U b) { return a ^ b; });
  check32("shl.b32", [](U a, U b) { return b < 32 ? a << b : 0; });
  check32("shr.u32", [](U a, U b) { return b < 32 ? a >> b : 0; });
  check32("shr.s32",
          [](U a, U b) { return bits(toSigned(a) >> std::min(b, 31u)); });
  check<L>("cvt.u32.u64 %r8, %rd7; shl.b64 %rd8, %rd6, %r8;", "%rd8", longs,
           [](L a, L b) { return U(b) < 64 ? a << U(b) : 0; });
  check<U>("shf.l.wrap.b32 %r7, %r5, 0xabcdef, %r6;", "%r7", integers,
           [](U a, U b) {
             L both = L(0xabcdef) << 32 | a;
             return U(both << (b & 31) >> 32);
           });
  check<U>("shf.r.clamp.b32 %r7, %r5, 0xabcdef, %r6;", "%r7", integers,
           [](U a, U b) {
             L both = L(0xabcdef) << 32 | a;
             return U(both >> std::min(b, 32u));
           });
  checkUnary("not.b32 %r7, %r5;", "%r7", integers, [](U a) { return ~a; });
  checkUnary("popc.b32 %r7, %r5;", "%r7", integers,
             [](U a) { return std::popcount(a); });
  checkUnary("clz.b32 %r7, %r5;", "%r7", integers,
             [](U a) { return std::countl_zero(a); });
  checkUnary("bfind.u32 %r7, %r5;", "%r7", integers,
             [](U a) { return a ? 31 - U(std::countl_zero(a)) : ~0u; });
  checkUnary("brev.b32 %r7, %r5;", "%r7", integers, [](U a) {
    U reversed = 0;
    for (int i = 0; i < 32; ++i)
      reversed |= (a >> i & 1) << (31 - i);
    return reversed;
  });
  checkUnary("bfe.u32 %r7, %r5, 4, 9;", "%r7", integers,
             [](U a) { return a >> 4 & 511; });
  checkUnary("bfe.s32 %r7, %r5, 27, 9;", "%r7", integers,
             [](U a) { return bits(toSigned(a) >> 27); });
  check<U>("bfi.b32 %r7, %r5, %r6, 8, 12;", "%r7", integers,
           [](U a, U b) { return (b & ~0xfff00u) | (a & 0xfff) << 8; });
  check<U>("prmt.b32 %r7, %r5, %r6, 0x5410;", "%r7", integers,
           [](U a, U b) { return (a & 0xffff) | b << 16; });
  checkUnary("prmt.b32 %r7, %r5, 0, 0xba98;", "%r7", integers, [](U a) {
    U signs = 0;
    for (U byte = 0; byte < 4; ++byte)
      signs |= (a >> (8 * byte + 7) & 1 ? 255u : 0u) << 8 * byte;
    return signs;
  });
  check<U>("lop3.b32 %r7, %r5, %r6, 0xff00ff, 0xe4;", "%r7", integers,
           [](U a, U b) { return (a & 0xff00ff) | (b & ~0xff00ffu); });
}

TEST_F(ArithmeticTest, Predicates) {
  check<U>("setp.lt.s32 %p1, %r5, %r6;", "%p1", integers,
           [](U a, U b) { return toSigned(a) < toSigned(b); });
  check<U>("setp.hi.u32 %p1|%p2, %r5, %r6;", "%p2", integers,
           [](U a, U b) { return a <= b; });
  check<U>("setp.eq.s32 %p2, %r5, 5; setp.lt.and.u32 %p1, %r5, %r6, !%p2;",
           "%p1", integers, [](U a, U b) { return a < b && a != 5; });
  check<U>("setp.eq.s32 %p2, %r5, 5; setp.lt.u32 %p3, %r5, %r6;"
           "xor.pred %p4, %p2, %p3; not.pred %p1, %p4;",
           "%p1", integers, [](U a, U b) { return (a == 5) == (a < b); });
  check<U>("mov.pred %p1, -1; setp.lt.u32 %p2, %r5, %r6; @%p2 mov.pred %p1, 0;",
           "%p1", integers, [](U a, U b) { return a >= b; });
  check<U>("setp.lt.u32 %p1, %r5, %r6; selp.b32 %r7, %r5, 17, %p1;", "%r7",
           integers, [](U a, U b) { return a < b ? a : 17; });
}

TEST_F(ArithmeticTest, ComparisonsOfFloats) {
  struct Named {
    const char *name;
    bool (*holds)(float, float);
    bool unordered;
  };
  static constexpr Named named[] = {
      {"eq", [](float a, float b) { return a == b; }, false},
      {"ne", [](float a, float b) { return a != b; }, false},
      {"lt", [](float a, float b) { return a < b; }, false},
      {"le", [](float a, float b) { return a <= b; }, false},
      {"gt", [](float a, float b) { return a > b; }, false},
      {"ge", [](float a, float b) { return a >= b; }, false},
      {"equ", [](float a, float b) { return a == b; }, true},
      {"neu", [](float a, float b) { return a != b; }, true},
      {"ltu", [](float a, float b) { return a < b; }, true},
      {"leu", [](float a, float b) { return a <= b; }, true},
      {"gtu", [](float a, float b) { return a > b; }, true},
      {"geu", [](float a, float b) { return a >= b; }, true},
      {"num", [](float, float) { return true; }, false},
      {"nan", [](float, float) { return false; }, true}};
  for (const Named &it : named)
    check<U>(std::string("setp.") + it.name + ".f32 %p1, %f1, %f2;", "%p1",
             floats, [&](U first, U second) {
               float a = asFloat(first), b = asFloat(second);
               return a != a || b != b ? it.unordered : it.holds(a, b);
             });
  check<L>("setp.gtu.f64 %p1, %fd1, %fd2;", "%p1", doubles,
           [](L a, L b) { return !(asDouble(a) <= asDouble(b)); });
}

TEST_F(ArithmeticTest, Floats) {
  checkFloat("add.rn.f32", [](float a, float b) { return a + b; });
  checkFloat("sub.rn.f32", [](float a, float b) { return a - b; });
  checkFloat("mul.rn.f32", [](float a, float b) { return a * b; });
  checkFloat("div.rn.f32", [](float a, float b) { return a / b; });
  check<U>("fma.rn.f32 %f3, %f1, %f2, %f1;", "%f3", floats, [](U a, U b) {
    return bitsOf(std::fma(asFloat(a), asFloat(b), asFloat(a)));
  });
  checkUnary("rcp.rn.f32 %f3, %f1;", "%f3", floats,
             [](U a) { return bitsOf(1 / asFloat(a)); });
  checkUnary("sqrt.rn.f32 %f3, %f1;", "%f3", floats,
             [](U a) { return bitsOf(std::sqrt(asFloat(a))); });
  checkUnary("neg.f32 %f3, %f1;", "%f3", floats,
             [](U a) { return a ^ 0x80000000; });
  checkUnary("abs.f32 %f3, %f1;", "%f3", floats,
             [](U a) { return a & 0x7fffffff; });
  check<U>("copysign.f32 %f3, %f1, %f2;", "%f3", floats,
           [](U a, U b) { return (a & 0x80000000) | (b & 0x7fffffff); });
  // A number is taken in place of a NaN, and -0 is less than 0.
  checkFloat("min.f32", [](float a, float b) {
    if (a == 0 && b == 0)
      return std::signbit(a) ? a : b;
    return std::fmin(a, b);
  });
  checkFloat("max.NaN.f32", [](float a, float b) {
    if (a == 0 && b == 0)
      return std::signbit(a) ? b : a;
    return a != a || b != b ? NAN : std::fmax(a, b);
  });
  checkFloat("add.sat.f32", [](float a, float b) {
    float sum = a + b;
    return sum > 0 ? std::fmin(sum, 1.0f) : 0.0f;
  });
  auto flush = [](float a) {
    return std::fabs(a) < 0x1p-126f ? std::copysign(0.0f, a) : a;
  };
  checkFloat("mul.rn.ftz.f32",
             [&](float a, float b) { return flush(flush(a) * flush(b)); });
  checkUnary("testp.normal.f32 %p1, %f1;", "%p1", floats,
             [](U a) { return std::isnormal(asFloat(a)); });
}

TEST_F(ArithmeticTest, Doubles) {
  check<L>("add.rn.f64 %fd3, %fd1, %fd2;", "%fd3", {0x3ff0000000000000, 1},
           [](L a, L b) { return bitsOf(asDouble(a) + asDouble(b)); });
  check<L>("fma.rn.f64 %fd3, %fd1, %fd2, %fd2;", "%fd3",
           {0x3ff0000000000001, 0x400921fb54442d18}, [](L a, L b) {
             return bitsOf(std::fma(asDouble(a), asDouble(b), asDouble(b)));
           });
  check<L>("sqrt.rn.f64 %fd3, %fd1;", "%fd3", {0x4000000000000000},
           [](L a, L) { return bitsOf(std::sqrt(asDouble(a))); });
}

TEST_F(ArithmeticTest, Halves) {
  // 1 + 2^-11 is a tie, which goes to the even 1.
  checkUnary("cvt.rn.f16.f32 %rs1, %f1;", "%rs1",
             {0x3f800000, 0x3f801000, 0x3f803000, 0x477ff000, 0x33800000,
              0x33000000, 0x38800000, 0x387fc000, 0x7f800000, 0x80000000},
             [](U a) {
               switch (a) {
               case 0x3f803000:
                 return 0x3c02;
               case 0x477ff000:
               case 0x7f800000:
                 return 0x7c00;
               case 0x33800000:
                 return 1;
               case 0x33000000:
                 return 0;
               case 0x38800000:
                 return 0x400;
               case 0x387fc000:
                 return 0x3ff;
               case 0x80000000:
                 return 0x8000;
               default:
                 return 0x3c00;
               }
             });
  checkUnary("cvt.u16.u32 %rs1, %r5; cvt.f32.f16 %f3, %rs1;", "%f3",
             {0x3c00, 0xc000, 0x0001, 0x7c00, 0x0400}, [](U a) {
               return a == 0x3c00   ? 0x3f800000u
                      : a == 0xc000 ? 0xc0000000u
                      : a == 1      ? 0x33800000u
                      : a == 0x400  ? 0x38800000u
                                    : 0x7f800000u;
             });
  checkUnary("cvt.u16.u32 %rs1, %r5; fma.rn.f16 %rs2, %rs1, %rs1, %rs1;",
             "%rs2", {0x3c00, 0x4000},
             [](U a) { return a == 0x3c00 ? 0x4000 : 0x4600; });
}

TEST_F(ArithmeticTest, Conversions) {
  checkUnary("cvt.s64.s32 %rd8, %r5;", "%rd8", integers,
             [](U a) { return L(int64_t(toSigned(a))); });
  checkUnary("cvt.u64.u32 %rd8, %r5;", "%rd8", integers, [](U a) { return a; });
  checkUnary("cvt.s32.s8 %r7, %r5;", "%r7", integers,
             [](U a) { return bits(static_cast<int8_t>(a)); });
  checkUnary("cvt.u16.u32 %rs1, %r5; cvt.s64.s16 %rd8, %rs1;", "%rd8", integers,
             [](U a) { return L(int64_t(static_cast<int16_t>(a))); });
  checkUnary("cvt.sat.u16.s32 %rs1, %r5;", "%rs1", integers,
             [](U a) { return toSigned(a) < 0 ? 0 : std::min(a, 0xffffu); });
  checkUnary("cvt.rn.f32.s32 %f3, %r5;", "%f3", integers,
             [](U a) { return bitsOf(static_cast<float>(toSigned(a))); });
  checkUnary("cvt.rn.f32.u32 %f3, %r5;", "%f3", integers,
             [](U a) { return bitsOf(static_cast<float>(a)); });
  checkUnary("cvt.rz.f32.u32 %f3, %r5;", "%f3", {0xffffffff, 0x1000003},
             [](U a) { return a == 0x1000003 ? 0x4b800001 : 0x4f7fffff; });
  check<L>("cvt.rn.f32.u64 %f3, %rd6;", "%f3", longs,
           [](L a, L) { return bitsOf(static_cast<float>(a)); });
  check<L>("cvt.rn.f64.s64 %fd3, %rd6;", "%fd3", longs,
           [](L a, L) { return bitsOf(static_cast<double>(toSigned(a))); });
  check<L>("cvt.rn.f32.f64 %f3, %fd1;", "%f3", doubles,
           [](L a, L) { return bitsOf(static_cast<float>(asDouble(a))); });
  checkUnary("cvt.f64.f32 %fd3, %f1;", "%fd3", {0x3fc00000, 1, 0xff800000},
             [](U a) { return bitsOf(double(asFloat(a))); });
}

TEST_F(ArithmeticTest, FloatsToIntegers) {
  auto clamp = [](double value, double least, double above) {
    return value != value ? 0 : std::fmax(least, std::fmin(value, above));
  };
  checkUnary("cvt.rzi.s32.f32 %r7, %f1;", "%r7", floats, [&](U a) {
    return bits(static_cast<int32_t>(
        clamp(std::trunc(asFloat(a)), INT32_MIN, INT32_MAX)));
  });
  checkUnary("cvt.rni.u32.f32 %r7, %f1;", "%r7", floats, [&](U a) {
    return static_cast<U>(clamp(std::nearbyint(asFloat(a)), 0, UINT32_MAX));
  });
  checkUnary("cvt.rmi.f32.f32 %f3, %f1;", "%f3", floats,
             [](U a) { return bitsOf(std::floor(asFloat(a))); });
  checkUnary("cvt.rpi.f32.f32 %f3, %f1;", "%f3", floats,
             [](U a) { return bitsOf(std::ceil(asFloat(a))); });
  checkUnary("cvt.rni.f32.f32 %f3, %f1;", "%f3", floats,
             [](U a) { return bitsOf(std::nearbyint(asFloat(a))); });
  checkUnary("cvt.rzi.s64.f32 %rd8, %f1;", "%rd8", floats, [](U a) {
    float value = asFloat(a);
    if (value != value || value < -0x1p63f)
      return L(1) << 63;
    return value >= 0x1p63f ? L(INT64_MAX) : L(static_cast<int64_t>(value));
  });
}

TEST_F(ArithmeticTest, Packing) {
  check<U>("mov.b64 %rd8, {%r5, %r6};", "%rd8", integers,
           [](U a, U b) { return L(b) << 32 | a; });
  check<U>("mov.b64 %rd9, {%r5, %r6}; mov.b64 {_, %r7}, %rd9;", "%r7", integers,
           [](U, U b) { return b; });
  checkUnary("mov.b32 {%rs1, %rs2}, %r5; mov.b32 %r7, {%rs2, %rs1};", "%r7",
             integers, [](U a) { return std::rotl(a, 16); });
  checkUnary("{ .reg .b16 part; mov.b32 {part, %rs1}, %r5; }"
             "{ .reg .b32 part; mov.b32 part, 3; cvt.u32.u16 %r7, %rs1;"
             "  add.s32 %r7, %r7, part; }",
             "%r7", integers, [](U a) { return (a >> 16) + 3; });
}

TEST_F(ArithmeticTest, Approximations) {
  checkUnary(
      "rcp.approx.ftz.f32 %f3, %f1;", "%f3", {0x40000000, 0x40400000, 1},
      [](U a) { return a == 1 ? 0x7f800000 : bitsOf(1.0f / asFloat(a)); });
  checkUnary("rsqrt.approx.ftz.f32 %f3, %f1;", "%f3", {0x40800000},
             [](U) { return bitsOf(0.5f); });
}

TEST_F(ArithmeticTest, SpecialRegisters) {
  auto out = run(R"(
    mov.u32 %r5, %laneid;
    mov.u32 %r6, %lanemask_lt;
    mov.u32 %r7, %nctaid.x;
    mov.u32 %r8, %tid.y;
    mov.u32 %r9, %lanemask_ge;
    popc.b32 %r6, %r6;
    popc.b32 %r9, %r9;
    mad.lo.s32 %r5, %r5, 100, %r6;
    mad.lo.s32 %r5, %r5, 100, %r7;
    mad.lo.s32 %r5, %r5, 10, %r8;
    mad.lo.s32 %r5, %r5, 100, %r9;
    cvt.u64.u32 %rd6, %r5;
    st.global.b64 [%rd4], %rd6;)",
                 {}, 48, 3);
  for (uint64_t thread = 0; thread < 48; ++thread) {
    uint64_t lane = thread % 32;
    EXPECT_EQ(out[thread],
              (((lane * 100 + lane) * 100 + 3) * 10) * 100 + 32 - lane);
  }
}

} // namespace
