//===- piko/reference/atomics.h - Atomics on buffers and images -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The integer atomics return nothing, so that their order cannot be seen.
// Those that return the old value, and those on floats, are for stages that
// are Unordered.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_ATOMICS_H
#define PIKO_REFERENCE_ATOMICS_H

#include <piko/reference/state.h>

namespace piko {
namespace reference {

inline void expectUnordered(const char *what, const SourcePlace &at) {
  Executor *executor = Executor::current();
  if (!executor || !executor->frame)
    throw Error(std::string(what) + " outside a running pipeline");
  CallFrame &call = *executor->frame;
  call.at = at;
  if (!call.node->unordered)
    call.node->fail(call.bin, std::string("expected the stage to be unordered, "
                                          "because ") +
                                  what + " shows the order of its primitives");
}

template <class T>
concept AtomicInteger =
    std::is_same_v<T, int32_t> || std::is_same_v<T, uint32_t> ||
    std::is_same_v<T, int64_t> || std::is_same_v<T, uint64_t> ||
    std::is_same_v<T, long long> || std::is_same_v<T, unsigned long long>;

template <class T>
concept AtomicFloat = std::is_same_v<T, float> || std::is_same_v<T, double>;

/// Replaces a place in a buffer or an image by f of it; returns the old value.
/// Pixels are read through const references, but their storage is not const.
template <class T, class F>
T exchange(const T &place, const SourcePlace &at, F f) {
  auto change = [&] {
    T old = place;
    const_cast<T &>(place) = f(old);
    return old;
  };
  if (Checker *checker = activeChecker())
    if (Element *element = checker->find(&place))
      return checker->access(*element, AccessKind::Atomic, at, change);
  return change();
}

template <class T> T wrappingAdd(T a, T b) {
  if constexpr (std::is_integral_v<T>) {
    using U = std::make_unsigned_t<T>;
    return static_cast<T>(static_cast<U>(a) + static_cast<U>(b));
  } else {
    return a + b;
  }
}

} // namespace reference

#define PIKO_ATOMIC(NAME, EXPRESSION)                                          \
  template <reference::AtomicInteger T>                                        \
  void NAME(const T &place, std::type_identity_t<T> value,                     \
            reference::SourcePlace at = reference::SourcePlace::current()) {   \
    reference::exchange(place, at, [&](T old) -> T { return EXPRESSION; });    \
  }                                                                            \
  template <reference::AtomicInteger T>                                        \
  T NAME##Fetch(const T &place, std::type_identity_t<T> value,                 \
                reference::SourcePlace at =                                    \
                    reference::SourcePlace::current()) {                       \
    reference::expectUnordered("the result of an atomic", at);                 \
    return reference::exchange(place, at,                                      \
                               [&](T old) -> T { return EXPRESSION; });        \
  }                                                                            \
  template <class T>                                                           \
  void NAME(const T &&place, std::type_identity_t<T> value) = delete;          \
  template <class T>                                                           \
  T NAME##Fetch(const T &&place, std::type_identity_t<T> value) = delete;

PIKO_ATOMIC(atomicAdd, reference::wrappingAdd(old, value))
PIKO_ATOMIC(atomicMin, value < old ? value : old)
PIKO_ATOMIC(atomicMax, old < value ? value : old)
PIKO_ATOMIC(atomicAnd, old &value)
PIKO_ATOMIC(atomicOr, old | value)
PIKO_ATOMIC(atomicXor, old ^ value)
#undef PIKO_ATOMIC

/// Adds to a float; only in a stage that is Unordered.
template <reference::AtomicFloat T>
void atomicAdd(const T &place, std::type_identity_t<T> value,
               reference::SourcePlace at = reference::SourcePlace::current()) {
  reference::expectUnordered("a float atomic", at);
  reference::exchange(place, at, [&](T old) { return old + value; });
}

} // namespace piko

#endif // PIKO_REFERENCE_ATOMICS_H
