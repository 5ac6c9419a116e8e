// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Emission.cpp - What code for a CPU has inline ----------------------===//
//
// The compiler has this file as bitcode. The runtime has it, too, for LLVM IR
// that was made by other tools, which call it.
//
//===----------------------------------------------------------------------===//

#include "pikort/abi.h"

extern "C" {
// Hardly ever called, though there is a call for each primitive: LLVM moves out
// of the way what leads to it.
[[gnu::cold]] uint8_t *pikoir_append(pikoir_writer *, int32_t);
[[gnu::cold]] void pikoir_place(pikoir_writer *, int32_t, int64_t);
[[gnu::cold]] void pikoir_next(pikoir_writer *);
}

#define PIKORT_INLINE PIKORT_API
#include "pikort/emission.h"
