//===- piko/arithmetic.h - The thread's floating-point environment --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_ARITHMETIC_H
#define PIKO_ARITHMETIC_H

#include <cfenv>

namespace piko::detail {

/// The floating-point environment that the language assumes: round to nearest,
/// subnormal numbers, no traps. The thread's own is as it was, its flags too,
/// when the object goes.
class ArithmeticScope {
public:
  ArithmeticScope() noexcept {
    std::fegetenv(&before);
    std::fesetenv(FE_DFL_ENV);
  }
  ArithmeticScope(const ArithmeticScope &) = delete;
  ArithmeticScope &operator=(const ArithmeticScope &) = delete;
  ~ArithmeticScope() { std::fesetenv(&before); }

private:
  std::fenv_t before;
};

} // namespace piko::detail

#endif // PIKO_ARITHMETIC_H
