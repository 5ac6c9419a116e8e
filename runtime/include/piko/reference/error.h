//===- piko/reference/error.h - Errors and names of types -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A pipeline that breaks a rule throws piko::Error. Messages name the stage
// and, where there is one, the bin.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_ERROR_H
#define PIKO_REFERENCE_ERROR_H

#include <piko/status.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace piko {
namespace reference {

/// The name of T as the compiler writes it.
template <class T> std::string_view typeName() {
  std::string_view text = __PRETTY_FUNCTION__;
  // "... typeName() [T = X]" by Clang, "... [with T = X; ...]" by GCC.
  size_t begin = text.find("T = ") + 4;
  size_t end = text.find(';', begin);
  if (end == std::string_view::npos)
    end = text.rfind(']');
  return text.substr(begin, end - begin);
}

/// Identifies a type at run time, and names it.
struct TypeInfo {
  std::string_view name;
};
template <class T> const TypeInfo *typeOf() {
  static const TypeInfo info{typeName<T>()};
  return &info;
}

/// An error whose message already says where it happened, in further lines.
class LocatedError final : public Error {
public:
  using Error::Error;
};

/// Throws an Error for a stage and, unless it is -1, a bin. `context` says
/// where it happened, if that is known.
[[noreturn]] inline void fail(std::string_view stage, int64_t bin,
                              const std::string &message,
                              const std::string &context = "") {
  std::string text = "stage '" + std::string(stage) + "'";
  if (bin >= 0)
    text += ", bin " + std::to_string(bin);
  text += ": " + message + context;
  if (context.empty())
    throw Error(text);
  throw LocatedError(text);
}

} // namespace reference
} // namespace piko

#endif // PIKO_REFERENCE_ERROR_H
