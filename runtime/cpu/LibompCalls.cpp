// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- LibompCalls.cpp - What pipelines call of LLVM's OpenMP runtime -----===//
//
// Generated code starts its threads by functions of libomp. Where the runtime
// is built with another one, as by GCC with libgomp, these are here, and
// pipelines run on the same threads as the runtime's own loops.
//
//===----------------------------------------------------------------------===//

#include <cstdarg>
#include <cstdint>
#include <omp.h>

/// Where the call stands in the program; nobody looks.
struct ident_t;

/// Of the next team that this thread starts; 0 = as many as OpenMP chooses.
static thread_local int32_t nextThreads = 0;

#pragma GCC visibility push(default)
extern "C" {

int32_t __kmpc_global_thread_num(ident_t *) { return omp_get_thread_num(); }

void __kmpc_push_num_threads(ident_t *, int32_t, int32_t threads) {
  nextThreads = threads;
}

/// What threads share is behind one pointer, or there is nothing.
void __kmpc_fork_call(ident_t *, int32_t count,
                      void (*body)(int32_t *, int32_t *, void *), ...) {
  va_list arguments;
  va_start(arguments, body);
  void *shared = count > 0 ? va_arg(arguments, void *) : nullptr;
  va_end(arguments);
  int threads = nextThreads > 0 ? nextThreads : omp_get_max_threads();
  nextThreads = 0;
#pragma omp parallel num_threads(threads)
  {
    int32_t thread = omp_get_thread_num(), bound = 0;
    body(&thread, &bound, shared);
  }
}

} // extern "C"
#pragma GCC visibility pop
