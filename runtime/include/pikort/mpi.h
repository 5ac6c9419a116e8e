// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- mpi.h - Ranks that MPI runs ----------------------------------------===//
//
// Of libpikort-mpi, which is built where MPI is found. A host that has its own
// communicator passes it; one that has not, such as a tool that finds the
// library only when it runs, lets it start MPI.
//
// All calls are made by the thread that runs the pipeline: MPI_THREAD_FUNNELED
// suffices where that is the one that has started MPI.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_MPI_H
#define PIKORT_MPI_H

#include "pikort/ranks.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Fills `ranks` for a duplicate of a communicator; `communicator` points to an
/// MPI_Comm. An exchange that takes longer than `seconds` fails; 0: no limit.
/// 0, or a status. All ranks call it.
PIKORT_API int32_t pikort_make_mpi_ranks(const void *communicator,
                                         double seconds, pikort_ranks *ranks);
/// Frees the duplicate, if MPI still runs. All ranks call it.
PIKORT_API void pikort_free_mpi_ranks(pikort_ranks *ranks);

/// Starts MPI, and makes ranks of all its processes. 0, or a status.
PIKORT_API int32_t pikort_start_mpi(double seconds, pikort_ranks *ranks);
/// Ends MPI, when all have come so far: 0, or a status if some do not come in
/// time. With `fails` it ends all processes, as some may wait for this one.
PIKORT_API int32_t pikort_stop_mpi(pikort_ranks *ranks, int32_t fails);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_MPI_H
