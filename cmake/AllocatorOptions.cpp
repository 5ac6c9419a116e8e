//===- AllocatorOptions.cpp - Defaults of the tools' allocator ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Linked into every tool that has mimalloc. A compiler allocates fast and ends
// soon: memory that goes back to the system only to be had again, and a page
// fault for every 4 KiB, are an eighth of what it takes to compile a pipeline.
// The environment (MIMALLOC_LARGE_OS_PAGES, ...) has the last word.
//
//===----------------------------------------------------------------------===//
#include <cerrno>
#include <mimalloc.h>
#include <new>

namespace {

/// What is thrown takes memory, too, and has some apart where there is none.
struct Throwing {
  Throwing() { now = true; }
  Throwing(const Throwing &) = delete;
  Throwing &operator=(const Throwing &) = delete;
  ~Throwing() { now = false; }
  static inline thread_local bool now = false;
};

/// The allocator's `operator new` would abort.
void refuse(int error, void *) {
  if (Throwing::now || (error != ENOMEM && error != EOVERFLOW))
    return;
  Throwing scope;
  throw std::bad_alloc();
}

void setOptions() {
  mi_register_error(refuse, nullptr);
#if MI_MALLOC_VERSION >= 210
  mi_option_set_default(mi_option_purge_delay, -1);
  mi_option_set_default(mi_option_allow_large_os_pages, 1);
#else
  mi_option_set_default(mi_option_allow_decommit, 0);
  mi_option_set_default(mi_option_large_os_pages, 1);
#endif
}

// The allocator looks at its options when it is loaded; this comes first.
[[gnu::section(".preinit_array"),
  gnu::used]] void (*const early)() = setOptions;

} // namespace
