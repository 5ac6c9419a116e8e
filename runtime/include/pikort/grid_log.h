/* SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
 *
 * What kernels for a GPU have inline: how threads and blocks leave in the log
 * what they emit. The compiler has runtime/inline/GridLog.cpp as bitcode, and
 * links and inlines what a kernel uses.
 *
 * `buffers` are the append buffers of a thread, PIKOIR_APPEND_WORDS each, with
 * `stride` words from one to the next: that of the log, and one for each port
 * of a local edge. Where they are `apart`, the log's is in the log itself, from
 * the thread's first error on.
 */
#ifndef PIKORT_GRID_LOG_H
#define PIKORT_GRID_LOG_H

#include "pikort/grid.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Adds an entry of so many bytes to an append buffer: where they go.
void *pikoir_grid_append(pikoir_log *log, int64_t *buffers, int64_t stride,
                         int64_t buffer, int32_t kind, int32_t number,
                         int32_t stage, int64_t bytes);
/// The last record of a local edge was placed.
void pikoir_grid_keep(int64_t *buffers, int64_t stride, int64_t buffer);
/// An error at a place of the grid, about a bin and two numbers.
void pikoir_grid_fail(pikoir_log *log, int64_t *buffers, int64_t stride,
                      int32_t apart, int32_t place, int64_t bin, int64_t a,
                      int64_t b);

/// Puts what the threads of the block have emitted in the unit after what it
/// has in the log, in the order of threads. All of them come here. `words` are
/// PIKOIR_FLUSH_WORDS of the block.
void pikoir_grid_flush(pikoir_log *log, int64_t *buffers, int64_t stride,
                       int32_t apart, int64_t unit, int64_t *words,
                       int32_t threads);
/// Copies records of `size` bytes that were placed on a local edge after those
/// that the block has, which `kept` (PIKOIR_LOCAL_WORDS) says. All come here.
void pikoir_grid_flush_local(pikoir_log *log, int64_t *buffers, int64_t stride,
                             int64_t buffer, int64_t *kept, int64_t size,
                             int64_t *words, int32_t threads);

/// Memory for a block: its address, or 0.
int64_t pikoir_grid_allocate(pikoir_log *log, int64_t size);
/// The first of so many units, which the block takes of a launch, 0 or 1.
int64_t pikoir_grid_take_units(pikoir_log *log, int32_t launch, int64_t count);
/// The position from which on a second launch goes on with a unit, and one; 0
/// if there is none.
int64_t pikoir_grid_rest(pikoir_log *log, int64_t unit);
void pikoir_grid_leave_rest(pikoir_log *log, int64_t unit, int64_t position);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_GRID_LOG_H
