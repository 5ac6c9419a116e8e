// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ranks.h - One pipeline in several processes ------------------------===//
//
// A program that pikoc --ranks has made may be run by several pipelines
// together, its ranks: each runs the bins that it owns, and what kernels emit
// for bins of others is exchanged. All ranks make the same calls with the same
// domain, constants, buffers and sources, and run together. The bits are those
// of one process. docs/Scale.md says what each rank holds.
//
// The runtime knows no network. A host gives it one function, by which all
// ranks exchange bytes; libpikort-mpi has one that MPI runs (pikort/mpi.h), and
// here is one for ranks in threads of one process.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_RANKS_H
#define PIKORT_RANKS_H

#include "pikort/pikort.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A status: ranks could not exchange what they had to.
#define PIKORT_RANK_FAILED 24
/// The most ranks of a run.
#define PIKORT_MAX_RANKS 65536

typedef struct pikort_ranks {
  int32_t rank; ///< From 0.
  int32_t size;
  void *context;
  /// Called by all ranks alike: sends `send_bytes[r]` bytes to each rank r, and
  /// receives as many as that one sends here; both are known. 0, or not if it
  /// failed; then the pipeline's runs fail from now on. What a rank has for
  /// itself is not in it: its bytes are 0.
  int32_t (*exchange)(void *context, const void *const *send,
                      const int64_t *send_bytes, void *const *receive,
                      const int64_t *receive_bytes);
  /// Why it failed.
  const char *(*message)(void *context);
} pikort_ranks;

/// Makes the pipeline one rank of several; null: a process of its own. What
/// `context` points to stays valid. PIKORT_INVALID_ARGUMENT where the program
/// is not compiled for ranks. Not while a run is pending.
PIKORT_API int32_t pikort_set_ranks(pikort_pipeline *pipeline,
                                    const pikort_ranks *ranks);

/// Makes one pipeline several ranks by itself, each in a thread of its own and
/// with what it writes apart: the first has the results, as without ranks. 0:
/// $PIKO_RANKS, or one. For tests, and to see what would be exchanged.
PIKORT_API int32_t pikort_set_thread_ranks(pikort_pipeline *pipeline,
                                           int32_t count);

/// Which bins belong to one rank.
enum pikort_owners {
  PIKORT_OWNERS_DEFAULT = 0, ///< As the program says of each stage.
  PIKORT_OWNERS_PATTERN = 1, ///< Neighbours have different owners.
  PIKORT_OWNERS_BLOCKS = 2,  ///< Neighbours have one owner, row by row.
  PIKORT_OWNERS_MORTON = 3,  ///< The same, along a Morton curve.
  /// The same, each with as many of the primitives of the run before.
  PIKORT_OWNERS_LOAD = 4
};
/// For later runs; all ranks say the same. No result depends on it.
PIKORT_API int32_t pikort_set_rank_owners(pikort_pipeline *pipeline,
                                          int32_t owners);

/// What a rank has sent to others, over all runs since the latest reset.
typedef struct pikort_rank_traffic {
  const char *from; ///< A stage; null: `to` is a piece of state.
  const char *to;   ///< The stage that takes it, or the state.
  int64_t records;  ///< Sent to other ranks.
  int64_t bytes;    ///< Of them, with their bins and keys.
  int64_t kept;     ///< Records whose owner was this rank.
} pikort_rank_traffic;

PIKORT_API int32_t pikort_rank_traffic_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_get_rank_traffic(pikort_pipeline *pipeline,
                                           int32_t index,
                                           pikort_rank_traffic *traffic);

/// What a rank has said at the end of the latest run that went well: bytes that
/// it has sent, since its latest reset, and the most that its bins and queues
/// have held at one time.
typedef struct pikort_rank_totals {
  int64_t bytes;
  int64_t peak;
} pikort_rank_totals;
/// 0 where the pipeline is a process of its own.
PIKORT_API int32_t pikort_rank_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_get_rank_totals(pikort_pipeline *pipeline,
                                          int32_t rank,
                                          pikort_rank_totals *totals);

/// Fills `ranks`, so many, for threads of this process: each rank is used by a
/// thread of its own. They go together, when no rank is used any more.
PIKORT_API int32_t pikort_make_thread_ranks(int32_t size, pikort_ranks *ranks);
PIKORT_API void pikort_free_thread_ranks(pikort_ranks *ranks);
/// Where a thread of these ends before its time: the others do not wait for it.
PIKORT_API void pikort_leave_thread_ranks(const pikort_ranks *rank);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_RANKS_H
