//===- piko/status.h - What went wrong, for hosts -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The reference executor and compiled pipelines report with the same types.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_STATUS_H
#define PIKO_STATUS_H

#include <piko/macros_begin.h>

#include <cstdint>
#include <stdexcept>
#include <string>

#if defined(PIKO_CHECK) && defined(__has_feature)
#if __has_feature(memory_sanitizer)
#include <sanitizer/msan_interface.h>
#define PIKO_KNOWS_WRITTEN
#endif
#endif

namespace piko {

/// Success, or a code of `pikort_status` and its text.
class Status {
public:
  Status() = default;
  Status(int32_t code, const char *message)
      : code_(code), message_(code == 0 ? "" : message) {}
  explicit operator bool() const { return code_ == 0; }
  int32_t code() const { return code_; }
  const std::string &message() const { return message_; }
#ifdef __cpp_exceptions
  /// For hosts that use exceptions.
  void orThrow() const;
#endif

private:
  int32_t code_ = 0;
  std::string message_;
};

/// What a host or a pipeline did wrong. What the reference executor finds has
/// one code, PIKORT_BAD_PROGRAM.
class Error : public std::runtime_error {
public:
  explicit Error(const std::string &message, int32_t code = 7)
      : std::runtime_error(message), code_(code) {
#ifdef PIKO_KNOWS_WRITTEN
    __msan_unpoison_string(what()); // a library without the sanitizer wrote it
#endif
  }
  explicit Error(const Status &status)
      : Error(status.message(), status.code()) {}
  int32_t code() const { return code_; }

private:
  int32_t code_;
};

#ifdef __cpp_exceptions
inline void Status::orThrow() const {
  if (code_ != 0)
    throw Error(*this);
}
#endif

} // namespace piko

#include <piko/macros_end.h>

#endif // PIKO_STATUS_H
