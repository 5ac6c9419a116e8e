// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CallStack.h - Stack enough for a run -------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_CALLSTACK_H
#define PIKO_RUNTIME_COMMON_CALLSTACK_H

#include <memory>
#include <type_traits>

namespace piko::rt {

/// Calls `body` where there is a mebibyte of stack at least: on the caller's,
/// or, if that is a small one of a thread or a fiber, on one of our own, which
/// the thread keeps. Returns false, without a call, where the system refuses
/// it. `body` must not throw.
bool callWithStack(void (*body)(void *), void *data) noexcept;

template <class Body> bool callWithStack(Body &&body) noexcept {
  using Called = std::remove_reference_t<Body>;
  return callWithStack([](void *called) { (*static_cast<Called *>(called))(); },
                       std::addressof(body));
}

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_CALLSTACK_H
