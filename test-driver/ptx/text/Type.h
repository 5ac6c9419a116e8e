// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Type.h - Types of PTX ----------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_TYPE_H
#define PIKO_TEST_DRIVER_PTX_TYPE_H

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace piko::ptx {

enum class Kind : uint8_t { Bits, Unsigned, Signed, Float, Predicate };

/// A fundamental type, such as .s32.
struct Type {
  Kind kind = Kind::Bits;
  uint8_t bits = 0; ///< 1 for a predicate.

  bool operator==(const Type &) const = default;
  uint32_t bytes() const { return bits < 8 ? 4 : bits / 8; }
  bool isFloat() const { return kind == Kind::Float; }
  bool isSigned() const { return kind == Kind::Signed; }
  bool isPredicate() const { return kind == Kind::Predicate; }
};

/// The type that a modifier without its dot names; none if it names none.
std::optional<Type> parseType(std::string_view name);

/// A state space. Generic addresses are those of ld and st without one.
enum class Space : uint8_t { Generic, Global, Const, Shared, Local, Param };

std::optional<Space> parseSpace(std::string_view name);
const char *nameOf(Space space);

/// A module that is not valid PTX, or not of the PTX that is known here.
class ParseError : public std::runtime_error {
public:
  ParseError(uint32_t line, const std::string &text)
      : std::runtime_error("line " + std::to_string(line) + ": " + text) {}
};

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_TYPE_H
