// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- abi_ranks.h - What a program of several ranks calls ----------------===//
//
// In a process of its own (pikort_set_ranks was not called) exchanges, keeps
// and shares do nothing.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_ABI_RANKS_H
#define PIKORT_ABI_RANKS_H

#include "pikort/abi_setup.h"

#ifdef __cplusplus
extern "C" {
#endif

enum pikoir_partition {
  PIKOIR_FIRST_RANK = 0, ///< The first rank alone runs the stage.
  PIKOIR_PARTS = 1, ///< Each rank runs what it is fed, or has emitted itself.
  PIKOIR_BINS = 2,  ///< Each rank runs the bins that it owns.
  PIKOIR_EACH_RANK = 3 ///< Each rank runs all of the stage.
};

/// In the setup, of all stages, in the order in which their kernels run.
PIKORT_API void pikoir_declare_partition(pikort_pipeline *p, int32_t stage,
                                         int32_t how);
/// Which bins belong to one rank: a pikort_owners that is not the default.
PIKORT_API void pikoir_declare_owners(pikort_pipeline *p, int32_t stage,
                                      int32_t owners);
/// No rank uses pixels of this image but those of the bins of a stage that it
/// owns.
PIKORT_API void pikoir_declare_common(pikort_pipeline *p, int32_t state,
                                      int32_t stage);
/// What a port emits is exchanged before its consumer takes it.
PIKORT_API void pikoir_declare_exchange(pikort_pipeline *p, int32_t producer,
                                        int32_t port);
/// Each rank finds the bins of a part of a source, if that is worth it.
PIKORT_API void pikoir_declare_exchange_source(pikort_pipeline *p,
                                               int32_t source);

/// Brings what a port has emitted to the ranks that run it; a status.
PIKORT_API int32_t pikoir_exchange(pikort_pipeline *p, int32_t producer,
                                   int32_t port);
/// Brings the bins of a source's primitives to who owns them; a status.
PIKORT_API int32_t pikoir_exchange_source(pikort_pipeline *p, int32_t source);

enum pikoir_share_flags {
  PIKOIR_SHARE_FROM_FIRST = 1, ///< The first rank has written it.
  PIKOIR_SHARE_TO_FIRST = 2,   ///< Others need not see it.
  PIKOIR_SHARE_TO_OWNERS = 4   ///< Of the stage's bins: nor need those.
};
/// The numbers of the dialect's atomic operations on integers.
enum pikoir_share_kind {
  PIKOIR_SHARE_ADD = 0,
  PIKOIR_SHARE_MIN = 1,
  PIKOIR_SHARE_MAX = 2,
  PIKOIR_SHARE_UMIN = 3,
  PIKOIR_SHARE_UMAX = 4,
  PIKOIR_SHARE_AND = 5,
  PIKOIR_SHARE_OR = 6,
  PIKOIR_SHARE_XOR = 7
};
/// Remembers a piece of state; a status.
PIKORT_API int32_t pikoir_keep(pikort_pipeline *p, int32_t state);
/// The same of what is as the begin of a run has left it.
PIKORT_API int32_t pikoir_keep_cleared(pikort_pipeline *p, int32_t state);
/// Of the next share: several ranks change this field by one operation.
PIKORT_API void pikoir_share_field(pikort_pipeline *p, int32_t state,
                                   int64_t offset, int64_t elements,
                                   int64_t stride, int64_t bytes, int32_t kind);
/// Brings together what ranks have written: in the bins of a stage, or, with
/// -1 or to owners, what has changed since it was kept; a status.
PIKORT_API int32_t pikoir_share(pikort_pipeline *p, int32_t state,
                                int32_t stage, int32_t flags);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_ABI_RANKS_H
