//===- Trace.h - What a pipeline under test did, in order -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_UNITTESTS_LANGUAGE_TRACE_H
#define PIKO_UNITTESTS_LANGUAGE_TRACE_H

#include <piko.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// The events of the pipeline that ran last: stages append to it.
std::vector<int> trace;

template <class Pipe, class Prims>
std::vector<int> run(Pipe &pipe, const Prims &primitives) {
  trace.clear();
  pipe.feed(0, std::data(primitives), std::size(primitives));
  pipe.run();
  return trace;
}
template <class Pipe>
std::vector<int> run(Pipe &pipe, std::initializer_list<int> primitives) {
  return run(pipe, std::vector<int>(primitives));
}

/// The message of the Error that f throws, with where it happened if it is
/// known.
template <class F> std::string reportOf(F f) {
  try {
    f();
  } catch (const piko::Error &error) {
    return error.what();
  }
  return "(no error)";
}
/// The message alone.
template <class F> std::string messageOf(F f) {
  std::string report = reportOf(f);
  return report.substr(0, report.find('\n'));
}

/// A stage with one bin over a two-dimensional domain.
template <class In, class... Out>
using Whole = piko::Stage<0, 0, 32, In, Out...>;

/// Notes each int that arrives.
struct Sink : Whole<int> {
  void process(const int &i) { trace.push_back(i); }
};

} // namespace

#endif // PIKO_UNITTESTS_LANGUAGE_TRACE_H
