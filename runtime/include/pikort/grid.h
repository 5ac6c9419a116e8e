/* SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
 *
 * What the host's code of a kernel for a GPU calls, and what a grid leaves.
 *
 *   blocks = pikoir_blocks(p, stage, 0, threads); // none: nothing to do
 *   pikoir_log *log = pikoir_log_open(p, stage, 0);
 *   pikoir_log_place(p, log, i, ...); // for each place that can fail
 *   ... launch: block b of n runs the units b, b + n, .., or those that it
 *   takes from a counter of the log; blocks take memory of the log ...
 *   pikoir_log_close(p, log);
 *
 * Memory is taken by adding to `cursor`, in pieces that begin with their
 * length. Threads put entries into pieces of their own, their buffers; now and
 * then a block says in a directory what its threads have there, in their order.
 * So what a unit has emitted is in the order of its directories, and of the
 * entries in each. Where there is no room, a thread writes to `spare`, and the
 * run ends with an error.
 */
#ifndef PIKORT_GRID_H
#define PIKORT_GRID_H

#include "pikort/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  PIKOIR_ENTRY_RECORD = 0, ///< Of port `number`: the record.
  PIKOIR_ENTRY_BUCKET = 1, ///< Of port `number`: int64_t bucket.
  PIKOIR_ENTRY_NEXT = 2,
  PIKOIR_ENTRY_ERROR = 3, ///< At place `number`: int64_t bin, a, b, position.
  PIKOIR_ENTRY_LINK = 4, ///< It goes on at the address in `number` and `stage`.
  PIKOIR_ENTRY_KEPT = 5  ///< A record of a local edge that was placed.
};

/// Entries are aligned to 16 bytes; what they are about follows.
typedef struct pikoir_entry {
  int32_t bytes; ///< With the header.
  int32_t kind;
  int32_t number;
  int32_t stage; ///< That emits it; -1 is the kernel's, or the source.
} pikoir_entry;

enum { PIKOIR_PIECE_MEMORY = 0, PIKOIR_PIECE_DIRECTORY = 1 };

/// Pieces are aligned to 64 bytes; those of a directory are followed by spans.
typedef struct pikoir_piece {
  int64_t bytes; ///< With the header.
  int64_t kind;
  int64_t unit, spans;
  int64_t next; ///< The unit's directory after this one: its address, or 0.
  int64_t reserved[3];
} pikoir_piece;

/// Entries of a thread, from an address to another.
typedef struct pikoir_span {
  int64_t begin, end;
} pikoir_span;

/// Of a unit: its directories, addresses or 0; and the position from which on a
/// second launch is to go on, and one, or 0.
typedef struct pikoir_unit_log {
  int64_t first, last;
  int64_t rest;
} pikoir_unit_log;

/// What a thread has of an append buffer, in words of eight bytes.
enum {
  PIKOIR_APPEND_BEGIN = 0, ///< Addresses; where it has none yet, 0.
  PIKOIR_APPEND_CURSOR = 1,
  PIKOIR_APPEND_LIMIT = 2, ///< After it there is room for a link.
  PIKOIR_APPEND_BYTES = 3, ///< Half of what it takes next, if that is 512.
  PIKOIR_APPEND_LAST = 4,  ///< The last record.
  PIKOIR_APPEND_KEPT = 5,  ///< How many were placed.
  /// Of the primitive that errors are about, where a thread does not take them
  /// in order; in the first append buffer.
  PIKOIR_APPEND_POSITION = 6,
  PIKOIR_APPEND_WORDS = 7
};
/// Words of a block that a flush needs: one for each warp, and one.
#define PIKOIR_FLUSH_WORDS 33

/// What a block has of a local edge.
enum {
  PIKOIR_LOCAL_RECORDS = 0, ///< Their address.
  PIKOIR_LOCAL_COUNT = 1,
  PIKOIR_LOCAL_ROOM = 2, ///< In bytes.
  PIKOIR_LOCAL_WORDS = 4
};

/// What threads see of a log.
typedef struct pikoir_log {
  int64_t cursor; ///< An address.
  int64_t limit;
  int64_t spare;
  int64_t units;  ///< The address of a pikoir_unit_log for each unit.
  int64_t errors; ///< Not 0: there are entries that are errors.
  /// How many units blocks have taken, by the kernel's first launch and by its
  /// second one; may be more than there are.
  int64_t taken[2];
} pikoir_log;

/// How many blocks of so many threads run the units of a stage's kernel, or,
/// with PIKOIR_LOG_SOURCE, of a source's: between its begin and its end.
PIKORT_API int64_t pikoir_blocks(pikort_pipeline *p, int32_t number,
                                 int32_t flags, int64_t threads);

/// The log of a stage's kernel, or, with PIKOIR_LOG_SOURCE, of a source's; null
/// if the run has failed, and then so does its launch.
PIKORT_API pikoir_log *pikoir_log_open(pikort_pipeline *p, int32_t number,
                                       int32_t flags);
#define PIKOIR_LOG_SOURCE 1

/// What an error at a place is: a call of `function` with these arguments.
enum {
  PIKOIR_PLACE_FAIL = 0,
  PIKOIR_PLACE_INDEX = 1,
  PIKOIR_PLACE_BARRIER = 2
};
PIKORT_API void pikoir_log_place(pikort_pipeline *p, pikoir_log *log,
                                 int32_t place, int32_t function, int32_t stage,
                                 const char *name, int32_t code);
/// Gives all entries to the runtime in order, as units would; frees the log.
PIKORT_API void pikoir_log_close(pikort_pipeline *p, pikoir_log *log);

/// Runs `thread(arguments)` for all threads of all blocks, on a device that the
/// calling thread emulates. Not 0: `seed` permutes the blocks.
PIKORT_API void pikoir_grid_launch(pikort_pipeline *p,
                                   void (*thread)(const void *), int64_t blocks,
                                   int64_t threads, const void *arguments,
                                   int64_t seed);

/// What a CUDA device may load: PTX, text that ends with a zero byte, or a
/// cubin.
typedef struct pikoir_cuda_image {
  int32_t chip;     ///< Of a cubin, 10 * major + minor; of PTX, 0.
  int32_t is_exact; ///< A cubin for devices of just this number.
  const void *data; ///< Null after the last one.
} pikoir_cuda_image;

/// In a program's setup: its grids run on a CUDA device, which loads one of
/// `images`: the latest cubin that fits it, or else the PTX. They live as long
/// as the program.
PIKORT_API void pikoir_cuda_module(pikort_pipeline *p,
                                   const pikoir_cuda_image *images);
/// After it, for messages: the stage of a kernel, and where that stands, as
/// "file:line" or "".
PIKORT_API void pikoir_cuda_kernel(pikort_pipeline *p, const char *kernel,
                                   const char *stage, const char *place);
/// A grid of a kernel, for a device that runs the program by itself.
typedef struct pikoir_cuda_grid {
  const char *kernel; ///< Null after the last one of a kernel of the pipeline.
  int64_t threads;    ///< Of a block.
  int64_t count;      ///< Of arguments, words of eight bytes.
  /// Writes them, for an input and a log that only the device reads.
  void (*arguments)(pikort_pipeline *p, const pikoir_input *input,
                    pikoir_log *log, int64_t *words);
} pikoir_cuda_grid;

/// The steps of a program: what NAME.run does, led once through all that it
/// repeats.
enum {
  PIKOIR_STEP_CLEAR = 0,  ///< State `number` is set to its clear value.
  PIKOIR_STEP_SOURCE = 1, ///< The AssignBin of source `number` runs,
  PIKOIR_STEP_STAGE = 2,  ///< or the kernel of stage `number`, by `grids`.
  /// Then what it has emitted on edge `number` waits in a queue. It leads to
  /// stage number `member` of its loop, or leaves it by exit `exit`; or -1.
  PIKOIR_STEP_QUEUE = 3,
  PIKOIR_STEP_STRIPS = 4, ///< What group `number` of strips repeats.
  PIKOIR_STEP_END_STRIPS = 5,
  /// What loop `number` repeats while primitives are on their way: the kernels
  /// of its stages. After it, before them: where primitives come in, if that
  /// is at several stages or one at a time, and where they leave.
  PIKOIR_STEP_WAVES = 6,
  PIKOIR_STEP_ENTRY = 7, ///< At stage `number`, which is number `member`.
  PIKOIR_STEP_EXIT = 8,  ///< By exit `exit`, which edge `number` describes.
  PIKOIR_STEP_END_WAVES = 9,
  /// What cycle `number` repeats while its collecting stages have primitives.
  PIKOIR_STEP_ROUNDS = 10,
  PIKOIR_STEP_END_ROUNDS = 11,
  /// Before the device begins, the host calls `host`, which decides how the
  /// bins of a stage run; not 0: the run fails. `number` is 0.
  PIKOIR_STEP_HOST = 12
};
typedef struct pikoir_cuda_step {
  int32_t kind;
  int32_t number;
  int32_t member, exit;
  const pikoir_cuda_grid *grids;
  int32_t (*host)(pikort_pipeline *p);
} pikoir_cuda_step;

/// In a program's setup: what a device can run of it at once. Without, the host
/// waits for each grid. Lives as long as the program.
PIKORT_API void pikoir_cuda_program(pikort_pipeline *p,
                                    const pikoir_cuda_step *steps,
                                    int64_t count);

/// Runs a grid there and waits for it; `arguments` are `count` words of eight
/// bytes.
PIKORT_API void pikoir_cuda_launch(pikort_pipeline *p, const char *kernel,
                                   int64_t blocks, int64_t threads,
                                   const void *arguments, int64_t count);

/// Intrinsics of threads, only inside of an emulator's launch.
PIKORT_API int32_t pikoir_gpu_thread(void);
PIKORT_API int32_t pikoir_gpu_block(void);
PIKORT_API int32_t pikoir_gpu_threads(void);
PIKORT_API int32_t pikoir_gpu_blocks(void);
PIKORT_API int32_t pikoir_gpu_lane(void);
PIKORT_API int32_t pikoir_gpu_lanes_below(void);
PIKORT_API void pikoir_gpu_barrier(void);
/// A barrier that says whether the condition holds for a thread of the block.
PIKORT_API bool pikoir_gpu_barrier_or(int32_t barrier, bool condition);
PIKORT_API int32_t pikoir_gpu_activemask(void);
PIKORT_API int32_t pikoir_gpu_ballot(int32_t mask, bool vote);
PIKORT_API int32_t pikoir_gpu_shuffle(int32_t mask, int32_t value, int32_t lane,
                                      int32_t clamp);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_GRID_H
