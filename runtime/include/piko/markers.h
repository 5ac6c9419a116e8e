//===- piko/markers.h - What the compiler recognises ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Under __PIKO__ the language is written in terms of these functions. None has
// a body: the front end finds their calls in the LLVM IR of a pipeline and
// turns them into operations of the piko dialect. They are found by their
// declarations, so that names and template arguments, not mangled text, say
// what a call means. piko/markers.def has them all, here and for the front end.
//
// A marker that takes or returns a pointer to a record is a template over the
// record's type, whose layout the front end knows from Clang.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_MARKERS_H
#define PIKO_MARKERS_H

#include <stdint.h>

namespace piko::marker {

#define PIKO_MARKER(EFFECT, RESULT, NAME, PARAMETERS, ...)                     \
  __VA_ARGS__ RESULT NAME PARAMETERS;
#include <piko/markers.def>

/// The bin of positions of NaN, an error (PIKOIR_NAN_BOX).
constexpr int64_t nanPosition = -(int64_t(1) << 40);

} // namespace piko::marker

#endif // PIKO_MARKERS_H
