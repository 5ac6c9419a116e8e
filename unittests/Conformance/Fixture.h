//===- Fixture.h - Pipelines and what they are fed ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_CONFORMANCE_FIXTURE_H
#define PIKO_CONFORMANCE_FIXTURE_H

#include "Expected.h"

#include "pikort/pikort.hpp"

#include <gtest/gtest.h>
#include <random>
#include <string>

extern "C" {
// Of the objects that pikoc makes, for whichever target.
#define PIKO_CONFORMANCE_PIPELINE(NAME)                                        \
  extern const pikort_program conformance_##NAME##_program;
PIKO_CONFORMANCE_PIPELINE(Joins)
PIKO_CONFORMANCE_PIPELINE(Strips)
PIKO_CONFORMANCE_PIPELINE(Waves)
PIKO_CONFORMANCE_PIPELINE(Stacks)
PIKO_CONFORMANCE_PIPELINE(Meetings)
PIKO_CONFORMANCE_PIPELINE(Crossings)
PIKO_CONFORMANCE_PIPELINE(Rounds)
PIKO_CONFORMANCE_PIPELINE(Schedules)
PIKO_CONFORMANCE_PIPELINE(Policies)
PIKO_CONFORMANCE_PIPELINE(Frames)
PIKO_CONFORMANCE_PIPELINE(Fetches)
#undef PIKO_CONFORMANCE_PIPELINE
}

namespace conformance {

using piko::rt::Pipeline;
using piko::rt::Status;

/// Bins of 8 and 16 pixels are cut off at both edges.
inline constexpr int width = 45, height = 28;

/// Dots and walkers in the domain, the same for the same seed.
Dots makeDots(size_t count, unsigned seed);
Walkers makeWalkers(size_t count, int hops, unsigned seed);
/// Each index once, some outside of the domain.
Items makeItems(size_t count, unsigned seed);

/// A pipeline with its domain; the test fails if there is none.
Pipeline make(const pikort_program &program);

/// One with traces, whose constant is `bias`.
inline constexpr int bias = 2;
Pipeline makeTraced(const pikort_program &program);

/// The image of that name.
template <class T> Grid<T> read(Pipeline &pipe, const char *name) {
  auto view = pipe.view<T>(name);
  Grid<T> grid(static_cast<int>(view.extent[0]),
               static_cast<int>(view.extent[1]));
  grid.cells.assign(view.elements.begin(), view.elements.end());
  return grid;
}

/// Compares images, and names the first pixel that differs.
template <class T>
testing::AssertionResult isSame(const Grid<T> &got, const Grid<T> &expected) {
  if (got.width != expected.width || got.height != expected.height)
    return testing::AssertionFailure()
           << "an image of " << got.width << " x " << got.height << ", not of "
           << expected.width << " x " << expected.height;
  for (size_t i = 0; i < got.cells.size(); ++i)
    if (!(got.cells[i] == expected.cells[i]))
      return testing::AssertionFailure()
             << "pixel (" << int(i) % got.width << ", " << int(i) / got.width
             << ") differs, and perhaps others";
  return testing::AssertionSuccess();
}

#define EXPECT_RUNS(PIPE)                                                      \
  if (auto status = (PIPE).run(); !status)                                     \
  ADD_FAILURE() << status.message()

/// A status of this code whose message has all parts.
void expectError(const Status &status, int32_t code,
                 std::initializer_list<const char *> parts);

} // namespace conformance

#endif // PIKO_CONFORMANCE_FIXTURE_H
