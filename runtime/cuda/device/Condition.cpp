// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Condition.cpp - Sets the condition of a graph's node ---------------===//
//
// In a module of its own, for drivers that know what it calls.
//
//===----------------------------------------------------------------------===//

using uint32_t = unsigned;
using int32_t = int;

/// The driver's.
extern "C" void cudaGraphSetConditional(unsigned long long handle,
                                        uint32_t value);

extern "C" [[clang::nvptx_kernel]] void
piko_condition(unsigned long long handle, const int32_t *again) {
  cudaGraphSetConditional(handle, *again != 0);
}
