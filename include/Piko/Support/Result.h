//===- Result.h - A value or why there is none ------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SUPPORT_RESULT_H
#define PIKO_SUPPORT_RESULT_H

#include <string>
#include <utility>
#include <variant>

namespace piko::support {

/// Why something could not be done, as a user is told: lowercase, no final
/// stop, naming the file.
struct Error {
  std::string message;
};

/// A T, or an Error.
template <class T> class [[nodiscard]] Result {
public:
  Result(T value) : content(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : content(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const { return content.index() == 0; }
  T &operator*() { return std::get<0>(content); }
  const T &operator*() const { return std::get<0>(content); }
  T *operator->() { return &std::get<0>(content); }
  const T *operator->() const { return &std::get<0>(content); }
  const Error &error() const { return std::get<1>(content); }

private:
  std::variant<T, Error> content;
};

/// Of what has no value.
struct Done {};

} // namespace piko::support

#endif // PIKO_SUPPORT_RESULT_H
