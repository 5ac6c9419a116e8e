// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- abi_setup.h - How a program declares its pipeline ------------------===//
//
// What the `setup` of a program calls, once, when the host creates a pipeline.
// It declares all that `run` uses (abi.h), in any order but that records come
// before what is made of them.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_ABI_SETUP_H
#define PIKORT_ABI_SETUP_H

#include "pikort/pikort.h"

#ifdef __cplusplus
extern "C" {
#endif

// --- Versions ---------------------------------------------------------------

/// A program's functions, compiled for one processor.
typedef struct pikoir_version {
  const char *processor; ///< As pikoc was told.
  const char *needs;     ///< Features (processor.def), separated by commas.
  void (*setup)(pikort_pipeline *);
  int32_t (*run)(pikort_pipeline *);
} pikoir_version;

/// All that the `setup` of a program calls which has code for several
/// processors, or for one that not all are: runs the setup of the last version
/// whose features this processor has, and has its run take the place of the
/// program's. Of several versions $PIKO_CPU can name another one.
PIKORT_API void pikoir_setup_version(pikort_pipeline *p,
                                     const pikoir_version *versions,
                                     int32_t count);

// --- Declarations
// ------------------------------------------------------------------

/// Flags of a stage.
enum pikoir_stage_flags {
  PIKOIR_COLLECTS = 1,  ///< Emissions start a new lineage (bin, ordinal).
  PIKOIR_SPLIT = 2,     ///< A bin may be cut into chunks of primitives.
  PIKOIR_PLACED = 4,    ///< AssignBin places; else all are in bin 0, bucket 0.
  PIKOIR_UNORDERED = 8, ///< The order of its input and output is free.
  PIKOIR_LIST = 16,     ///< Process takes a list; it collects.
  PIKOIR_ORDERED = 32,  ///< The order of its calls in a bin can be seen, as by
                        ///< updates of pixels: one unit runs a bin's (with
                        ///< owner tiles, a tile's) positions in order.
  PIKOIR_WRITES = 64    ///< Process may write state.
};

enum pikoir_schedule {
  PIKOIR_LOAD_BALANCE = 0,
  PIKOIR_DIRECT_MAP = 1,
  PIKOIR_SERIALIZE = 2,
  PIKOIR_ALL = 3
};

PIKORT_API void pikoir_declare_pipeline(pikort_pipeline *p, const char *name,
                                        int32_t rank);
/// The most buckets that the domain may have in a dimension, if they are fewer
/// than PIKORT_MAX_EXTENT.
PIKORT_API void pikoir_declare_max_extent(pikort_pipeline *p, int64_t buckets);
PIKORT_API void pikoir_declare_record(pikort_pipeline *p, int32_t id,
                                      const char *name, int64_t size,
                                      int64_t align);
/// A leaf of a record; `type` is a pikort_field_type.
PIKORT_API void pikoir_declare_field(pikort_pipeline *p, int32_t record,
                                     const char *leaf, int32_t type,
                                     int64_t offset, int64_t elements,
                                     int64_t stride);
/// `kind` is a pikort_state_kind. `clear` is one record or null for zeros: what
/// an image is cleared to; the default value of a constant (null = none).
PIKORT_API void pikoir_declare_state(pikort_pipeline *p, int32_t id,
                                     const char *name, int32_t kind,
                                     int32_t record, int32_t rank,
                                     int32_t per_source, const void *clear);
/// The image is the kernels' own: the host does not see it. Its number is
/// after those of all state that the host sees.
PIKORT_API void pikoir_declare_internal(pikort_pipeline *p, int32_t id);
/// Kernels write the buffer: what the host binds to it must be apart from other
/// buffers and sources, as generated code takes for granted.
PIKORT_API void pikoir_declare_written(pikort_pipeline *p, int32_t id);
/// No kernel uses the buffer: the host need not bind it.
PIKORT_API void pikoir_declare_unused(pikort_pipeline *p, int32_t id);
/// `bin_size` has one entry for each dimension, 0 = the whole domain.
/// `tile_size` is the side of owner tiles in a bin, 0 = the bin is one bucket.
PIKORT_API void pikoir_declare_stage(pikort_pipeline *p, int32_t id,
                                     const char *name, int32_t record,
                                     const int64_t *bin_size, int32_t schedule,
                                     int64_t tile_split, int32_t flags,
                                     int64_t tile_size);
PIKORT_API void pikoir_declare_source(pikort_pipeline *p, int32_t index,
                                      int32_t stage);
PIKORT_API void pikoir_declare_edge(pikort_pipeline *p, int32_t producer,
                                    int32_t port, int32_t consumer);
/// The edge from a port is local: its consumer runs in the producer's kernel,
/// bin by bin. It collects, has the producer's bins, no other input and no
/// owner tiles; neither stage is SPLIT, on a cycle or in strips.
PIKORT_API void pikoir_declare_local(pikort_pipeline *p, int32_t producer,
                                     int32_t port);
/// Of a LIST stage: how many primitives a call gets, 0 = the whole list, and
/// whether bins without primitives are called too. Without this declaration: 0
/// and no.
PIKORT_API void pikoir_declare_schedule(pikort_pipeline *p, int32_t stage,
                                        int64_t batch, int32_t every_bin);
/// The first kernel of the stage in a run clears the image, for which there is
/// no pikoir_clear: the runtime in bins that no unit or call holds, the kernel
/// in all others, if pikoir_input.clears. Units are whole bins, and hold no bin
/// without positions that is not to be visited; the kernel passes over such
/// bins. The stage is on no cycle.
PIKORT_API void pikoir_declare_clears(pikort_pipeline *p, int32_t stage,
                                      int32_t state);
/// How what a port emits is gathered: PIKOIR_CONCATENATE where its order is
/// free, or its units are in the order of emission, or are so in each bin of
/// the consumer and nothing else shows; and how many 64-bit words the key has
/// that tells a primitive's lineage, 0 = none. Where several edges or sources
/// lead into a stage, or into a loop, all that come there have keys, and so has
/// what comes to the stages on the way; edges from one loop to one stage are
/// one. A source gives one word, a stage that collects two, and a hop adds one.
/// Without this declaration: PIKOIR_PERMUTE, 0.
enum pikoir_gather { PIKOIR_CONCATENATE = 0, PIKOIR_PERMUTE = 1 };
PIKORT_API void pikoir_declare_join(pikort_pipeline *p, int32_t producer,
                                    int32_t port, int32_t gather, int32_t keys);
/// How many words of its items' keys a stage keeps, because what it emits needs
/// them as well. Without this declaration: 0.
PIKORT_API void pikoir_declare_keys(pikort_pipeline *p, int32_t stage,
                                    int32_t keys);
/// The number, after those of sources, of the lineage that a stage begins
/// which collects. Stages of one cycle share it. Without this declaration: 0.
PIKORT_API void pikoir_declare_root(pikort_pipeline *p, int32_t stage,
                                    int32_t root);
/// Stages on a common cycle of edges; those that collect have their turns in
/// this order.
PIKORT_API void pikoir_declare_cycle(pikort_pipeline *p, int32_t id,
                                     const int32_t *stages, int32_t count);
/// A cycle of stages none of which collects: a declared one, or a part of it.
/// What comes in has keys of so many words.
PIKORT_API void pikoir_declare_loop(pikort_pipeline *p, int32_t id,
                                    const int32_t *stages, int32_t count,
                                    int32_t keys);
/// The kernel of a stage, or the AssignBin of a source, holds a loop as vectors
/// and as a scalar loop: number `number` of the kernel's, from 0, in order.
/// `within`: the loop, of a lower number, in whose scalar version it is; or -1.
/// `expected`: whether vectors are expected to be faster, which are expected to
/// take so many cycles, and the scalar loop so many. `loop` says what it is.
#define PIKOIR_MOST_MAPPINGS 16
PIKORT_API void pikoir_declare_mapping(pikort_pipeline *p, int32_t stage,
                                       int32_t source, int32_t number,
                                       const char *loop, int32_t within,
                                       int32_t expected, int64_t vectors,
                                       int64_t scalar);
/// Combines a field of each of so many records with what a private copy of them
/// holds, and leaves there what changes nothing.
typedef void (*pikoir_combine)(uint8_t *to, uint8_t *copy, int64_t records);
/// All that the kernel of a stage does to a field of a buffer or an image is
/// one kind of operation that commutes and associates: private copy number
/// `copy` of the stage's, from 0. `identity` is a record of a copy that changes
/// nothing. A byte stands for 1 << `run_shift` records, to say that the kernel
/// has changed some. `often`: a primitive changes many.
PIKORT_API void pikoir_declare_private(pikort_pipeline *p, int32_t stage,
                                       int32_t copy, int32_t state,
                                       const void *identity, int32_t run_shift,
                                       int32_t often, pikoir_combine combine);
/// Selects, for pixels [begin, end), between two threads' images, of which each
/// array has the first pixels, and after them those of the units (int32_t, -1
/// = none) that pixels are of: what comes first by the key, and of equal keys
/// by the unit, or last, is in `to` then.
typedef void (*pikoir_select)(uint8_t *const *to, uint8_t *const *from,
                              int64_t begin, int64_t end);
/// All that the kernel of a stage of one bin, ORDERED and SPLIT, does to so
/// many images is to select what their pixels keep, by a key in the first one:
/// selection number `selection` of the stage's, from 0. `often`: a primitive
/// changes many pixels.
PIKORT_API void pikoir_declare_selection(pikort_pipeline *p, int32_t stage,
                                         int32_t selection,
                                         const int32_t *images, int32_t count,
                                         int32_t often, pikoir_select select);
/// `stage` waits until `waits_for` is finished (endStage): for checking mode.
PIKORT_API void pikoir_declare_wait(pikort_pipeline *p, int32_t stage,
                                    int32_t waits_for);

/// Stages that run strip by strip, with consecutive primitives of a source: it
/// feeds one of them, and all else that comes into them is from the group. No
/// bin of theirs is collected, and what one of them writes no other reads or
/// writes; a cycle is in the group as a whole. Of a stage that waits, all is in
/// one bin, or nothing is emitted. `chunk` is how many primitives a strip has
/// at most; 0 = as many as the runtime finds good.
PIKORT_API void pikoir_declare_strips(pikort_pipeline *p, int32_t id,
                                      int32_t source, int64_t chunk,
                                      const int32_t *stages, int32_t count);

// --- specialization ----------------------------------------------------------

/// The code takes `size` bytes of a constant, from an offset on, to be the
/// least of `bits`, or with size 0 a buffer to have `bits` elements. A run with
/// others is an error.
PIKORT_API void pikoir_declare_fixed(pikort_pipeline *p, int32_t state,
                                     const char *field, int64_t offset,
                                     int64_t size, int64_t bits);

// --- contracts
// ----------------------------------------------------------------

/// The code takes all integers of a field, of `type`, a pikort_field_type, to
/// be at least 0 and below the number of elements of the buffer `target`, or,
/// if that is -1, below a number. The field is of the primitives of a source,
/// or if `source` is -1 of the elements of a buffer, `state`. Buffers and
/// sources are declared before. A run with others is an error.
PIKORT_API void pikoir_declare_contract(pikort_pipeline *p, int32_t source,
                                        int32_t state, const char *field,
                                        int32_t type, int32_t is_unsigned,
                                        int64_t offset, int64_t elements,
                                        int64_t stride, int32_t target,
                                        int64_t below);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_ABI_SETUP_H
