//===- piko/compiled/math.h - Transcendentals for the compiler ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The front end replaces calls of the C library's functions by these.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_MATH_H
#define PIKO_COMPILED_MATH_H

#include <piko/math.h>

#endif // PIKO_COMPILED_MATH_H
