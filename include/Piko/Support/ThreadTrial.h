//===- ThreadTrial.h - How many threads the system gives --------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SUPPORT_THREADTRIAL_H
#define PIKO_SUPPORT_THREADTRIAL_H

#include <cstddef>

namespace piko::support {

/// How many threads, up to `wanted`, there can be at a time besides those that
/// there are, each with a stack of so many bytes (0 = as usual). They have
/// ended on return. For libraries that end the process when they get none.
size_t tryThreads(size_t wanted, size_t stackBytes = 0) noexcept;

} // namespace piko::support

#endif // PIKO_SUPPORT_THREADTRIAL_H
