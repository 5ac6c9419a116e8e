/* SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
 *
 * What the host's code of a kernel for a GPU calls, and what a grid leaves.
 *
 *   pikoir_log *log = pikoir_log_open(p, stage);
 *   pikoir_log_place(log, i, ...);               // for each place that can
 * fail
 *   ... launch a block for each unit; threads add entries to the log ...
 *   pikoir_log_close(log);
 *
 * An entry is a header and what it is about. Threads reserve room by adding to
 * `cursor`; the order of entries is in their headers. Where there is no room,
 * a thread writes to `spare`, and the run ends with an error.
 */
#ifndef PIKORT_GRID_H
#define PIKORT_GRID_H

#include "pikort/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  PIKOIR_ENTRY_RECORD = 0, ///< Of port `number`: the record.
  PIKOIR_ENTRY_CELL = 1,   ///< Of port `number`: int64_t cell.
  PIKOIR_ENTRY_NEXT = 2,
  PIKOIR_ENTRY_ERROR = 3, ///< At place `number`: int64_t bin, a, b.
  PIKOIR_ENTRY_MEMORY = 4 ///< Of a block.
};

/// Entries are aligned to 64 bytes; what they are about follows.
typedef struct pikoir_entry {
  int64_t bytes; ///< With the header.
  int64_t kind;  ///< And the number, from bit 32 on.
  int64_t unit;
  int64_t order[4]; ///< Step, iteration, piece, ordinal.
  int64_t reserved;
} pikoir_entry;

/// What threads see of a log.
typedef struct pikoir_log {
  int64_t cursor; ///< An address.
  int64_t limit;
  int64_t spare;
} pikoir_log;

/// The log of a stage's kernel, or, with PIKOIR_LOG_SOURCE, of a source's.
PIKORT_API pikoir_log *pikoir_log_open(pikort_pipeline *p, int32_t number,
                                       int32_t flags, int64_t units);
#define PIKOIR_LOG_SOURCE 1

/// What an error at a place is: a call of `function` with these arguments.
enum {
  PIKOIR_PLACE_FAIL = 0,
  PIKOIR_PLACE_INDEX = 1,
  PIKOIR_PLACE_BARRIER = 2
};
PIKORT_API void pikoir_log_place(pikoir_log *log, int32_t place,
                                 int32_t function, int32_t stage,
                                 const char *name, int32_t code);
/// Gives all entries to the runtime in order, as units would; frees the log.
PIKORT_API void pikoir_log_close(pikoir_log *log);

/// Runs `thread(arguments)` for all threads of all blocks, on a device that the
/// calling thread plays. Not 0: `seed` permutes the blocks.
PIKORT_API void pikoir_grid_launch(pikort_pipeline *p,
                                   void (*thread)(const void *), int64_t blocks,
                                   int64_t threads, const void *arguments,
                                   int64_t seed);

/// Intrinsics of threads, only inside of a launch.
PIKORT_API int32_t pikoir_gpu_thread(void);
PIKORT_API int32_t pikoir_gpu_block(void);
PIKORT_API int32_t pikoir_gpu_threads(void);
PIKORT_API int32_t pikoir_gpu_blocks(void);
PIKORT_API int32_t pikoir_gpu_lane(void);
PIKORT_API int32_t pikoir_gpu_lanes_below(void);
PIKORT_API void pikoir_gpu_barrier(void);
PIKORT_API int32_t pikoir_gpu_activemask(void);
PIKORT_API int32_t pikoir_gpu_ballot(int32_t mask, bool vote);
PIKORT_API int32_t pikoir_gpu_shuffle(int32_t mask, int32_t value, int32_t lane,
                                      int32_t clamp);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_GRID_H
