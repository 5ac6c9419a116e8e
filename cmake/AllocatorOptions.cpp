//===- AllocatorOptions.cpp - The tools' allocator ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Linked into every tool that has mimalloc. A compiler allocates fast and ends
// soon: memory that goes back to the system only to be had again, and a page
// fault for every 4 KiB, are an eighth of what it takes to compile a pipeline.
// The environment (MIMALLOC_LARGE_OS_PAGES, ...) has the last word. Where there
// is no memory `operator new` throws; what does not throw, or frees, is
// mimalloc's.
//
//===----------------------------------------------------------------------===//
#include <mimalloc.h>
#include <new>

namespace {

/// As C++ wants it, where mimalloc's own `operator new` would abort.
void *orThrow(void *memory) {
  if (!memory) [[unlikely]]
    throw std::bad_alloc();
  return memory;
}

void setOptions() {
#if MI_MALLOC_VERSION < 300
  mi_option_set_default(mi_option_eager_commit_delay, 0);
#endif
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

void *operator new(std::size_t size) { return orThrow(mi_malloc(size)); }
void *operator new[](std::size_t size) { return orThrow(mi_malloc(size)); }
void *operator new(std::size_t size, std::align_val_t alignment) {
  return orThrow(mi_malloc_aligned(size, std::size_t(alignment)));
}
void *operator new[](std::size_t size, std::align_val_t alignment) {
  return orThrow(mi_malloc_aligned(size, std::size_t(alignment)));
}
