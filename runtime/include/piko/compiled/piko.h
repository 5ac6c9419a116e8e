//===- piko/compiled/piko.h - The language, for the compiler --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The classes that piko/reference/pipe.h executes, here as calls of markers.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_PIKO_H
#define PIKO_COMPILED_PIKO_H

#include <piko/compiled/math.h>
#include <piko/contract.h>
#include <piko/stage.h>

namespace piko {
namespace detail {

/// Of nothing but a buffer.
template <class T> const void *addressOf(const Buffer<T> &buffer) {
  return &buffer;
}

template <class T, class Field, class Limit>
void expectNumbers(int source, const void *of, int64_t offset,
                   const Limit &below) {
  constexpr bool isSigned = expectIndexField<Field>();
  if constexpr (std::is_integral_v<Limit>)
    marker::expectIndex<T, isSigned>(source, of, offset, sizeof(Field), nullptr,
                                     static_cast<int64_t>(below));
  else
    marker::expectIndex<T, isSigned>(source, of, offset, sizeof(Field),
                                     addressOf(below), 0);
}

template <auto Field, class Limit>
void expectMember(int source, const void *of, const Limit &below) {
  using Member = decltype(memberOf(Field));
  // A pointer to member is how far the member is from the beginning.
  expectNumbers<typename Member::Record, typename Member::Type>(
      source, of, __builtin_bit_cast(int64_t, Field), below);
}

} // namespace detail

/// The base of pipelines. Stages are members; the constructor connects them.
template <class S = NoState> class Pipe {
  // As in the reference, which holds one: an instance of a template is made.
  static_assert(sizeof(S) > 0);

public:
  Pipe() = default;
  Pipe(const Pipe &) = delete;
  Pipe &operator=(const Pipe &) = delete;

  S &state() { return *marker::state<S>(); }

protected:
  template <class Stage> void source(Stage &stage) { marker::source(&stage); }
  template <class From, class To>
  void connect(From &producer, int port, To &consumer) {
    marker::connect(&producer, port, &consumer);
  }
  template <class T> void allocateForSource(Buffer<T> &buffer, int source) {
    marker::allocateForSource(&buffer, source);
  }
  template <auto Field, class Limit>
  void expectIndex(int source, const Limit &below) {
    detail::expectMember<Field>(source, nullptr, below);
  }
  template <class T, class Limit>
  void expectIndex(int source, const Limit &below) {
    detail::expectNumbers<T, T>(source, nullptr, 0, below);
  }
  template <auto Field, class T, class Limit>
  void expectIndex(Buffer<T> &of, const Limit &below) {
    using Record = typename decltype(detail::memberOf(Field))::Record;
    static_assert(detail::isSame<T, Record>,
                  "expected a field of the buffer's elements");
    detail::expectMember<Field>(-1, &of, below);
  }
  template <class T, class Limit>
  void expectIndex(Buffer<T> &of, const Limit &below) {
    detail::expectNumbers<T, T>(-1, &of, 0, below);
  }
};

namespace detail {
/// For the compiler: the state of a pipeline.
template <class S> Identity<S> stateOf(const Pipe<S> *);
} // namespace detail

} // namespace piko

#endif // PIKO_COMPILED_PIKO_H
