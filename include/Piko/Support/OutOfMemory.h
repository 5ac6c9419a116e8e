//===- OutOfMemory.h - What memory there is, and none -----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SUPPORT_OUTOFMEMORY_H
#define PIKO_SUPPORT_OUTOFMEMORY_H

#include <cstdint>

namespace piko::support {

/// For a program of one's own, not for a library: where nobody catches
/// std::bad_alloc the process ends as endOutOfMemory does.
void reportOutOfMemory(const char *tool);

/// Ends the process with "TOOL: error: out of memory" and exit status 1.
[[noreturn]] void endOutOfMemory();

/// What the machine has, in bytes: the system gives more than that, and ends
/// the process when it is used.
uint64_t memoryOfMachine();

} // namespace piko::support

#endif // PIKO_SUPPORT_OUTOFMEMORY_H
