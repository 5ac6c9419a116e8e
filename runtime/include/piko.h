//===- piko.h - The Piko language -----------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A pipeline is ordinary C++20 that includes this header. Compiled by any C++
// compiler, the header is the reference executor: slow, sequential, easy to
// step through, and the definition of what a pipeline means. Compiled by Piko
// (`__PIKO__` is defined), the same names stand for the operations of the
// piko dialect.
//
// The language is described in docs/Language.md.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_H
#define PIKO_H

// Would make nothing of emissions, without a word.
#ifdef emit
#error "a macro called 'emit' hides a function of Piko: with Qt, define \
QT_NO_KEYWORDS; else write '#undef emit' before this header"
#undef emit
#endif

#include <piko/bins.h>
#include <piko/math.h>
#include <piko/tunable.h>

#ifdef __PIKO__
#include <piko/compiled/piko.h>
#else
#include <piko/reference/pipe.h>
#endif

#endif // PIKO_H
