// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- checked.hpp - A status that is not lost ----------------------------===//
//
// What a call of a compiled pipeline's class returns. A host looks at it, or
// gets an exception:
//
//   if (auto status = pipe.run(); !status) report(status.message());
//   pipe.run(); // throws piko::Error if it failed
//
// Without exceptions nothing is thrown.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_CHECKED_HPP
#define PIKORT_CHECKED_HPP

#include <piko/macros_begin.h>

#include "piko/status.h"

#include <exception>
#include <utility>

namespace piko::rt {

#ifdef __cpp_exceptions
/// A Status that throws when it goes and nobody has looked at it.
class CheckedStatus {
public:
  CheckedStatus(Status from)
      : status(std::move(from)), isOpen(!status),
        unwinding(std::uncaught_exceptions()) {}
  CheckedStatus(CheckedStatus &&other) noexcept
      : status(std::move(other.status)),
        isOpen(std::exchange(other.isOpen, false)), unwinding(other.unwinding) {
  }
  CheckedStatus &operator=(CheckedStatus &&) = delete;
  ~CheckedStatus() noexcept(false) {
    if (isOpen && std::uncaught_exceptions() == unwinding)
      status.orThrow();
  }

  explicit operator bool() const { return bool(look()); }
  operator const Status &() const & { return look(); }
  operator Status() && {
    look();
    return std::move(status);
  }
  int32_t code() const { return look().code(); }
  const std::string &message() const { return look().message(); }
  void orThrow() const { look().orThrow(); }

private:
  const Status &look() const {
    isOpen = false;
    return status;
  }

  Status status;
  mutable bool isOpen;
  int unwinding;
};
#else
using CheckedStatus = Status;
#endif

} // namespace piko::rt

#include <piko/macros_end.h>

#endif // PIKORT_CHECKED_HPP
