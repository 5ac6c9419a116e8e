// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- abi.h - The generated code's view of the runtime -------------------===//
//
// A program is two functions. `setup` declares records, state, stages, sources
// and edges, in any order. `run` calls the kernels in stage order, each one
//
//   pikoir_begin -> parallel loop over units -> pikoir_end
//
// and returns the first status that is not zero. Inside the loop, for a unit:
//
//   pikoir_writer *w = pikoir_open(p, stage, u);
//   for each position:  Process: { pikoir_append, leaves, pikoir_place* }*
//                       pikoir_next(w);
//   pikoir_close(w);
//
// Where Process takes a list (PIKOIR_LIST), the unit's calls take the place of
// its positions. A loop is a cycle of stages none of which collects: the
// runtime says which of them has something to do.
//
//   while ((s = pikoir_loop_step(p, loop)) >= 0)
//     if (int32_t status = kernel[s](p)) return status;
//
// Another cycle repeats its loops, and the stages between them, producers
// first,
//
//   if (pikoir_cycle_takes(p, stage))
//     if (int32_t status = kernel[stage](p)) return status;
//
// and then the kernel of a stage that collects, until there is none:
//
//   if ((s = pikoir_cycle_turn(p, cycle)) >= 0)
//     if (int32_t status = kernel[s](p)) return status;
//
// Kernels of a group that takes a source in strips run once for each strip:
//
//   while (pikoir_strips_next(p, group))
//     kernel[a](p) || kernel[b](p);
//   if (int32_t status = pikoir_status(p)) return status;
//
// A stage of a local edge runs in the kernel of its producer: for a unit its
// writer is opened as well, and after the positions of a bin
//
//   const pikoir_input *in = pikoir_begin_local(w, port);
//   for each position, or call, of in:  Process, with the stage's own writer
//   pikoir_next(own);
//   pikoir_end_local(w, port);
//
// Every unit is opened exactly once, by any thread; a writer stays on the
// thread that opened it. The runtime restores lineage order at the join, so
// that no result depends on the number of threads or on how units are cut.
// docs/RuntimeABI.md has the rationale.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_ABI_H
#define PIKORT_ABI_H

#include "pikort/abi_setup.h"

#ifdef __cplusplus
extern "C" {
#endif

// --- queries ----------------------------------------------------------------

typedef struct pikoir_state {
  uint8_t *data;     ///< Constant: its bytes. Buffer, image: element 0.
  int64_t extent[4]; ///< Elements in each dimension, x first; unused = 1.
} pikoir_state;

PIKORT_API const pikoir_state *pikoir_get_state(pikort_pipeline *p, int32_t id);
/// Sets an image to its declared record, or a buffer that is sized by a source
/// to zeros: before any kernel that uses it, as it may hold what the run before
/// left. On one that is neither, a status.
PIKORT_API void pikoir_clear(pikort_pipeline *p, int32_t id);
/// Four entries each, x first, unused = 1. A grid counts the stage's bins; a
/// bucket grid the owner tiles of one bin. bucket = bin * tiles + tile, both
/// row-major with x fastest.
PIKORT_API const int64_t *pikoir_domain(pikort_pipeline *p);
PIKORT_API const int64_t *pikoir_grid(pikort_pipeline *p, int32_t stage);
PIKORT_API const int64_t *pikoir_tile_grid(pikort_pipeline *p, int32_t stage);
/// How many threads should run a kernel's units; asked after its begin.
PIKORT_API int32_t pikoir_threads(pikort_pipeline *p);
/// The calling thread's number in its parallel region, and how many there are.
PIKORT_API int64_t pikoir_thread(void);
PIKORT_API int64_t pikoir_team(void);
/// The status of the run so far; thread safe.
PIKORT_API int32_t pikoir_status(pikort_pipeline *p);

// --- kernels ----------------------------------------------------------------

/// Positions [begin, end), which lie in buckets [bucket_begin, bucket_end). A
/// unit has several buckets only if it has them whole; units partition the
/// positions in order. In a LIST stage bucket_begin and bucket_end are indices
/// of calls, and units partition the calls; those of one bin are in one unit
/// unless it is SPLIT. `owner` is the thread that has its home, modulo the size
/// of the team, for bins of DIRECT_MAP and parts of the only one: ascending,
/// and as many positions for each; -1 if any thread may run it, -2 if the first
/// one must, as for bins of SERIALIZE.
typedef struct pikoir_unit {
  int64_t bucket_begin;
  int64_t bucket_end;
  int64_t begin;
  int64_t end;
  int64_t owner;
} pikoir_unit;

/// A call of a Process that takes a list: positions [begin, end), which are in
/// `bin`; none for a bin that is called though it is empty.
typedef struct pikoir_call {
  int64_t bin;
  int64_t begin;
  int64_t end;
} pikoir_call;

/// How far units have been taken: by atomic additions to `next`, which may go
/// beyond `end`. On a cache line of its own.
typedef struct pikoir_cursor {
  int64_t next;
  int64_t end; ///< After the last one.
  int64_t unused[6];
} pikoir_cursor;

/// The first cursor is of all units, whoever is to run them: a kernel takes
/// them by it alone, or asks pikoir_next_unit. The next ones are of units that
/// any thread may run, and of those that only the first one does; then come
/// those that have their home with a core, at PIKOIR_CURSOR_HOMES + core. Among
/// [next, end) of an owner's there may be units of others, which a thread that
/// takes one leaves to these.
#define PIKOIR_CURSOR_HOMES 3

/// A stage's input: valid until pikoir_end.
typedef struct pikoir_input {
  const uint8_t *items;  ///< Where records lie.
  int64_t count;         ///< Positions: pairs of item and bucket.
  const uint32_t *order; ///< Position to the record's place; null = identity.
  const int64_t
      *offsets; ///< First position of each bucket, buckets + 1 entries.
  const pikoir_unit *units;
  int64_t unit_count;
  int64_t tiles; ///< Buckets in a bin.
  /// Of a LIST stage, in order of bin and batch; null and 0 for all others.
  const pikoir_call *calls;
  int64_t call_count;
  int64_t clears;         ///< Tiles begin with their clear value: 0 or 1.
  pikoir_cursor *cursors; ///< Null after an error.
  int64_t homes;          ///< Cores that have units of their own.
} pikoir_input;

/// One port of a writer. The fields up to `buckets` are the fast path's: see
/// the inline functions below, which generated code repeats.
typedef struct pikoir_port {
  uint8_t *cursor;         ///< Where the next record goes.
  uint8_t *limit;          ///< There is room if cursor <= limit.
  int64_t size;            ///< Bytes of a record.
  int64_t emitted;         ///< Records appended, with those in no bucket.
  int64_t kept;            ///< Placed ports: records that have a bucket.
  uint32_t *bucket_cursor; ///< Where the next bucket of a record is noted.
  uint32_t *bucket_end;    ///< There is room if bucket_cursor < bucket_end.
  int64_t last_bucket;     ///< Of the latest record; -1 = it has none yet.
  int64_t buckets; ///< Buckets of the consumer; 0 = a port without places.
  // What follows belongs to the runtime.
  uint32_t *ordinal_cursor;
  uint32_t *ordinal_end;
  uint32_t *counts;
  uint32_t *run;
  int64_t mark;
  uint32_t ordinal;
  int32_t flags;
} pikoir_port;

enum pikoir_port_flags {
  PIKOIR_PORT_ORDINALS = 1, ///< Each kept record notes its ordinal.
  PIKOIR_PORT_COUNTS = 2,   ///< Each position notes its number of records.
  PIKOIR_PORT_SOURCE = 4,   ///< Buckets of a source's primitives, no records.
  PIKOIR_PORT_DEFERRED = 8, ///< Between pikoir_reorder_begin and _end.
  PIKOIR_PORT_LOCAL = 16,   ///< Its edge is local.
  PIKOIR_PORT_SERIAL = 32   ///< Of a writer: its launch is serial.
};

typedef struct pikoir_writer {
  int64_t unit;
  uint32_t ordinal; ///< Emissions so far at this position, over all ports.
  int32_t flags;    ///< Union of the ports'; 0 = pikoir_next does nothing.
  int32_t port_count;
  int32_t stage;
  pikoir_port *ports;
  /// Bit n: the unit runs loop n of the kernel (pikoir_declare_mapping) as
  /// vectors.
  int64_t mappings;
} pikoir_writer;

/// The first entry that a record notes in its list of buckets has this bit.
#define PIKOIR_FIRST_BUCKET 0x80000000u

/// How many records are written at once, at most.
#define PIKOIR_MOST_RESERVED 64

/// Orders and bins what the stage's producers emitted. Null on an error.
PIKORT_API const pikoir_input *pikoir_begin(pikort_pipeline *p, int32_t stage);
PIKORT_API pikoir_writer *pikoir_open(pikort_pipeline *p, int32_t stage,
                                      int64_t unit);
/// The unit that the calling thread should run next: first its own, in order,
/// then the next of those that are nobody's, then those of others that they
/// have not begun; -1 if there is none.
PIKORT_API int64_t pikoir_next_unit(const pikoir_input *input);
/// Room for the next record of a port, never null. The caller writes all
/// leaves; padding is zero. A record that is placed in no bucket is dropped:
/// its room is the next record's.
PIKORT_API uint8_t *pikoir_append(pikoir_writer *writer, int32_t port);
/// Puts the port's latest record in a bucket of the consumer. A bucket named
/// twice counts once. A bucket outside the grid is a PIKORT_BIN_OUTSIDE error.
PIKORT_API void pikoir_place(pikoir_writer *writer, int32_t port,
                             int64_t bucket);
/// Sees to it that so many more records of a port, at most
/// PIKOIR_MOST_RESERVED, have room one after the other from its cursor on. The
/// writer has no flags.
PIKORT_API void pikoir_reserve(pikoir_writer *writer, int32_t port,
                               int64_t count);
/// Ends a position; in a LIST stage, a call.
PIKORT_API void pikoir_next(pikoir_writer *writer);
PIKORT_API void pikoir_close(pikoir_writer *writer);
/// Ends the kernel: 0, or the status of the first error in it.
PIKORT_API int32_t pikoir_end(pikort_pipeline *p, int32_t stage);

/// What a port of a local edge has emitted since the last time, as one unit of
/// one bucket; of a LIST stage, one unit of all calls. Valid until end_local,
/// which forgets it: no append to the port lies between. Never null.
PIKORT_API const pikoir_input *pikoir_begin_local(pikoir_writer *writer,
                                                  int32_t port);
PIKORT_API void pikoir_end_local(pikoir_writer *writer, int32_t port);

/// Emissions of iterations that meet barriers. From reorder_begin to
/// reorder_end, appends and places belong to the iteration that was named last,
/// in [0, iterations), and an iteration may be named many times, in any order.
/// At the end all are emitted in order of iteration, and within one in the
/// order of the calls. They do not nest.
PIKORT_API void pikoir_reorder_begin(pikoir_writer *writer, int64_t iterations);
PIKORT_API void pikoir_reorder_iteration(pikoir_writer *writer,
                                         int64_t iteration);
PIKORT_API void pikoir_reorder_end(pikoir_writer *writer);

/// `bytes` of memory for a call of Process, aligned to 64 bytes and not
/// initialised; never null for 0 bytes. Null if memory is refused, or if the
/// size is negative or too large: that is reported, as by pikoir_fail, and the
/// call must go on without. Memory is freed last in, first out: release frees
/// what was taken since the mark. What is left is freed by pikoir_close.
PIKORT_API void *pikoir_scratch(pikoir_writer *writer, int64_t bytes);
PIKORT_API int64_t pikoir_scratch_mark(pikoir_writer *writer);
PIKORT_API void pikoir_scratch_release(pikoir_writer *writer, int64_t mark);

/// What a unit changes in place of state, without locks, if `data` is not null;
/// else the state itself, by atomic operations. Valid until pikoir_close.
typedef struct pikoir_private {
  uint8_t *data;  ///< Element 0.
  uint8_t *dirty; ///< Of each run of records: 1 if the unit has changed one.
} pikoir_private;

PIKORT_API const pikoir_private *pikoir_get_private(pikoir_writer *writer,
                                                    int32_t copy);

/// The images of a selection that a unit changes in place of the state, as
/// pikoir_select takes them. Without a place for units one thread runs the bin,
/// and changes the state itself. Valid until pikoir_close.
PIKORT_API uint8_t *const *pikoir_get_images(pikoir_writer *writer,
                                             int32_t selection);

/// Where a call finds the pixels of an image. The address is that of pixel (0,
/// 0), which need not be in memory.
typedef struct pikoir_tile {
  uint8_t *data;
  int64_t pitch; ///< Pixels from one row to the next.
} pikoir_tile;

/// How many primitives a bin of a stage must have that copies of its pixels
/// pay; INT64_MAX: none pay, as the rows of a bin do not compete for the same
/// sets of the cache.
PIKORT_API int64_t pikoir_tile_least(pikort_pipeline *p, int32_t stage,
                                     int32_t image);
/// Copies the pixels of a bin to memory of the thread's. Until it is closed,
/// the unit has no other access to them, nor has any other thread. If memory is
/// refused it is the image itself.
PIKORT_API const pikoir_tile *pikoir_open_tile(pikoir_writer *writer,
                                               int32_t image, int64_t bin);
/// Writes them back.
PIKORT_API void pikoir_close_tile(pikoir_writer *writer, int32_t image);

/// The AssignBin kernel of a source whose consumer is PLACED. The primitives
/// stay where the host has them. There is one pikoir_next for each.
PIKORT_API const pikoir_input *pikoir_begin_source(pikort_pipeline *p,
                                                   int32_t source);
PIKORT_API pikoir_writer *pikoir_open_source(pikort_pipeline *p, int32_t source,
                                             int64_t unit);
PIKORT_API void pikoir_place_source(pikoir_writer *writer, int64_t bucket);
PIKORT_API int32_t pikoir_end_source(pikort_pipeline *p, int32_t source);

/// Schedules that depend on the bin: before any kernel, begin_schedule, which
/// returns the stage's number of bins, then schedule_bin for each of them, from
/// one thread. `batch` is as declared, or PIKOIR_NO_BATCH; any other below 1,
/// and a negative tile_split, is an error of the run. Bins that are not named
/// keep what the stage declares.
#define PIKOIR_NO_BATCH INT64_MIN
PIKORT_API int64_t pikoir_begin_schedule(pikort_pipeline *p, int32_t stage);
PIKORT_API void pikoir_schedule_bin(pikort_pipeline *p, int32_t stage,
                                    int64_t bin, int32_t kind,
                                    int64_t tile_split, int64_t batch,
                                    int32_t every_bin);

/// The stage of a loop whose kernel is to run next, or -1 when the loop has
/// come to rest, or on an error (pikoir_status). The AssignBin kernels of
/// sources that feed a cycle run before.
PIKORT_API int32_t pikoir_loop_step(pikort_pipeline *p, int32_t loop);
/// Whether the kernel of a stage of a cycle, which does not collect and is in
/// no loop, is to run.
PIKORT_API int32_t pikoir_cycle_takes(pikort_pipeline *p, int32_t stage);
/// The stage that collects whose kernel is to run, or -1 when the cycle has
/// come to its end, or on an error.
PIKORT_API int32_t pikoir_cycle_turn(pikort_pipeline *p, int32_t cycle);

/// Begins the next strip of a group of stages, the first one to begin with: 1,
/// and the group's kernels are to run, in stage order, but no more of them once
/// one has failed; or 0, at the end and on an error (pikoir_status). A strip
/// for which memory was refused may begin anew, smaller and with a status of 0.
PIKORT_API int32_t pikoir_strips_next(pikort_pipeline *p, int32_t id);

/// The bin of a bounding box of NaN, for pikoir_place and
/// pikoir_place_source, times the tiles: PIKORT_NOT_A_NUMBER.
#define PIKOIR_NAN_BOX (-(INT64_C(1) << 40))

/// Reports an error of generated code in a call for `bin`, or -1; thread safe,
/// and does not return a value: the kernel goes on and pikoir_end returns
/// `code`, a pikort_status. `name`, a constant, is that of the stage to name,
/// where the phase of one is part of another's; or null.
///   PIKORT_BIN_OUTSIDE     a = bin
///   PIKORT_UPDATE_OUTSIDE  a = x + (y << 32), b = z + (w << 32), 32 bits each
///   PIKORT_INDEX_OUTSIDE   a = index, b = elements: of a list
///   PIKORT_ENDLESS         a = iterations
///   PIKORT_NO_QUOTIENT
PIKORT_API void pikoir_fail(pikort_pipeline *p, int32_t stage, const char *name,
                            int64_t bin, int32_t code, int64_t a, int64_t b);
/// The same for an index outside a buffer or an image.
PIKORT_API void pikoir_fail_index(pikort_pipeline *p, int32_t stage,
                                  const char *name, int64_t bin, int32_t state,
                                  int64_t index, int64_t elements);
/// The same for an iteration that does not call `barrier`, a constant such as
/// "sync", as often as iteration 0.
PIKORT_API void pikoir_fail_barrier(pikort_pipeline *p, int32_t stage,
                                    const char *barrier, int64_t bin,
                                    int64_t iteration);

// --- checking mode ----------------------------------------------------------
//
// A program that declares a checked record runs on one thread, and says what it
// does before it does it. The rules and the texts of findings are in
// docs/Diagnostics.md. A place is a constant "file:line", or null.

/// Primitives of `record` are the host's `host` with the number of their
/// lineage, 64 bits, at an offset after it. The host binds `host`.
PIKORT_API void pikoir_declare_checked_record(pikort_pipeline *p,
                                              int32_t record, int32_t host,
                                              int64_t lineage_offset);
/// Of the host's record: a field, or the begin of the names of several, of
/// which no primitive that is fed may hold a NaN.
PIKORT_API void pikoir_declare_number(pikort_pipeline *p, int32_t record,
                                      const char *field);

/// A call of Process begins. `lineage` is its primitive's, or
/// PIKOIR_NO_LINEAGE where it takes a list.
#define PIKOIR_NO_LINEAGE INT64_MIN
PIKORT_API void pikoir_check_call(pikort_pipeline *p, int32_t stage,
                                  int64_t bin, int64_t lineage);
/// An AssignBin for a primitive begins, or with PIKOIR_NO_LINEAGE ends.
PIKORT_API void pikoir_check_assign(pikort_pipeline *p, int32_t stage,
                                    int64_t lineage);
/// The lineage of what the call emits next.
PIKORT_API int64_t pikoir_check_emit(pikort_pipeline *p);
/// What follows is at this place.
PIKORT_API void pikoir_check_place(pikort_pipeline *p, const char *place);

enum pikoir_check_access {
  PIKOIR_CHECK_READ = 0,
  PIKOIR_CHECK_STORE = 1,
  PIKOIR_CHECK_UPDATE = 2,
  PIKOIR_CHECK_ATOMIC = 3,
  /// Added to a kind: the stage updates this image.
  PIKOIR_CHECK_UPDATES = 4
};
/// An element of a buffer or an image; unused indices are 0.
PIKORT_API void pikoir_check_access(pikort_pipeline *p, int32_t state,
                                    int32_t kind, int64_t x, int64_t y,
                                    int64_t z, int64_t w, const char *place);

enum pikoir_check_loop {
  PIKOIR_CHECK_BEGIN = 0,
  PIKOIR_CHECK_ITERATION = 1, ///< Its accesses follow.
  PIKOIR_CHECK_BARRIER = 2,   ///< The same, after one more barrier.
  PIKOIR_CHECK_END = 3
};
PIKORT_API void pikoir_check_loop(pikort_pipeline *p, int32_t event,
                                  int64_t iteration);

enum pikoir_check_value { PIKOIR_CHECK_NAN = 0, PIKOIR_CHECK_UNWRITTEN = 1 };
/// A field of the host's record is wrong if `flag` is not 0.
PIKORT_API void pikoir_check_value(pikort_pipeline *p, int32_t flag,
                                   int32_t kind, int32_t record,
                                   const char *field, const char *place);

/// An index into an array of a call's own, or of a field; outside, an error and
/// 0 instead.
PIKORT_API int64_t pikoir_check_index(pikort_pipeline *p, int64_t index,
                                      int64_t size, const char *place);
/// A loop of the call goes round; 0 if it must not, because the call's loops
/// have done so PIKOIR_MOST_TRIPS times, which is an error, or had another.
#define PIKOIR_MOST_TRIPS (INT64_C(1) << 28)
PIKORT_API int32_t pikoir_check_trip(pikort_pipeline *p, const char *place);

// --- counting ---------------------------------------------------------------
//
// Any thread adds to any counter.

/// `stage` may be no stage of its own any more. `part` is the port of
/// emissions, the number of a piece of state that is accessed, otherwise -1;
/// `around` the counter of what it lies in, or -1. A place is a constant
/// "file:line", or null.
PIKORT_API void pikoir_declare_counter(pikort_pipeline *p, int32_t counter,
                                       int32_t kind, const char *stage,
                                       int32_t part, int32_t around,
                                       const char *place);
PIKORT_API void pikoir_count(pikort_pipeline *p, int32_t counter,
                             int64_t amount);
/// An access to bytes of an element; unused indices are 0.
PIKORT_API void pikoir_count_element(pikort_pipeline *p, int32_t counter,
                                     int64_t x, int64_t y, int64_t z, int64_t w,
                                     int64_t bytes, int64_t offset);

// --- programs that run a pipeline by themselves, as the reference does ------

/// What the host bound to a source; `count` gets the number of primitives.
PIKORT_API const void *pikoir_get_source(pikort_pipeline *p, int32_t source,
                                         int64_t *count);
/// The host's limit of hops and rounds.
PIKORT_API int64_t pikoir_loop_limit(pikort_pipeline *p);
/// Ends the run with an error in the program's own words; returns the status.
/// Not from a kernel's loop.
PIKORT_API int32_t pikoir_fail_text(pikort_pipeline *p, int32_t code,
                                    const char *text);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_ABI_H
