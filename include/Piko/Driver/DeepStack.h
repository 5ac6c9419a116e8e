// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Compilers recurse as deep as a text nests or is long.

#ifndef PIKO_DRIVER_DEEPSTACK_H
#define PIKO_DRIVER_DEEPSTACK_H

#include "llvm/ADT/STLFunctionalExtras.h"

namespace piko {

/// Calls `function` on a stack of a gibibyte, of which only what is touched
/// takes memory, in a thread that takes no signals; returns when it has
/// returned. Where the system refuses that much the stack is smaller, and at
/// the least the caller's own. `function` must not throw.
void runOnDeepStack(llvm::function_ref<void()> function);

/// The same, for a program's whole work; returns its exit status.
inline int runMainOnDeepStack(llvm::function_ref<int()> main) {
  int status = 1;
  runOnDeepStack([&] { status = main(); });
  return status;
}

} // namespace piko

#endif // PIKO_DRIVER_DEEPSTACK_H
