// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Compilers recurse as deep as a text nests or is long, and end the process
// where they cannot go on; a host's stacks may be small, and it lives on.

#ifndef PIKO_DRIVER_DEEPSTACK_H
#define PIKO_DRIVER_DEEPSTACK_H

#include "llvm/ADT/STLFunctionalExtras.h"

#include <optional>
#include <string>

namespace piko {

/// Calls `function` on a stack of a gibibyte, of which only what is touched
/// takes memory, in a thread that takes no signals and has the default
/// floating-point environment; returns when it has returned. Where the system
/// refuses that much the stack is smaller, and at the least the caller's own.
/// `function` must not throw.
void runOnDeepStack(llvm::function_ref<void()> function);

/// The same, for a program's whole work; returns its exit status. Where LLVM
/// gets no memory the process ends with a line that says so.
int runMainOnDeepStack(llvm::function_ref<int()> main);

/// The same, for a library that must not end its host's process: where LLVM
/// meets a fatal error, or the system refuses a thread with 16 MiB of stack,
/// returns why. What `function` holds is then lost. Meanwhile fatal errors of
/// LLVM's in other threads are the process's end, as they were.
std::optional<std::string> runContained(llvm::function_ref<void()> function);

/// Whether the system gives a thread for each processor, as MLIR's contexts
/// want them: they end the process otherwise.
bool canUseThreads();

} // namespace piko

#endif // PIKO_DRIVER_DEEPSTACK_H
