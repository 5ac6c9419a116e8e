//===- piko/compiled/piko.h - The language, for the compiler --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The classes that piko/reference/pipe.h executes, here as calls of markers.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_PIKO_H
#define PIKO_COMPILED_PIKO_H

#include <piko/compiled/math.h>
#include <piko/stage.h>

namespace piko {

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
};

namespace detail {
/// For the compiler: the state of a pipeline.
template <class S> Identity<S> stateOf(const Pipe<S> *);
} // namespace detail

} // namespace piko

#endif // PIKO_COMPILED_PIKO_H
