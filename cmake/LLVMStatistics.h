//===- LLVMStatistics.h - The layout that the libraries have --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Included first where assertions are on: NDEBUG changes the layout of
// llvm::Statistic, whose constructor for passes is in libMLIR, which Debian
// builds with NDEBUG.
//
//===----------------------------------------------------------------------===//
#ifndef NDEBUG
#define NDEBUG
#include "llvm/ADT/Statistic.h"
#undef NDEBUG
#include <cassert>
#endif
