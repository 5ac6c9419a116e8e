// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- pikort.h - The host's view of the runtime --------------------------===//
//
// What an application needs to run a compiled pipeline: create it from the
// program that the compiler made, bind its state and sources by name, run it,
// read its images and statistics.
//
// Every function that can fail returns a status: PIKORT_OK or one of
// pikort_status, with a text in pikort_message. Nothing here exits or throws.
// A pipeline is used by one thread at a time; different pipelines are
// independent. Pointers that the host binds must stay valid while they are
// bound; they are not copied, except for constants.
//
// Where kernels run on a CUDA device, the host may bind memory of the device,
// run in a stream of its own, and use results where they are. Pipelines are in
// the device's primary context, as is what the CUDA runtime API makes; each
// call leaves the calling thread with the context that it had before.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_PIKORT_H
#define PIKORT_PIKORT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Changes whenever generated code and runtime would no longer fit together.
#define PIKORT_ABI_VERSION 14u
/// The most cells that a domain may have in a dimension, so that sums of
/// coordinates and small numbers do not wrap around.
#define PIKORT_MAX_EXTENT 1073741824
/// The most threads that a host may ask for.
#define PIKORT_MAX_THREADS 10000

#if defined(_WIN32)
#define PIKORT_API
#else
#define PIKORT_API __attribute__((visibility("default")))
#endif

typedef struct pikort_pipeline pikort_pipeline;

/// What the compiler makes of one pipeline.
typedef struct pikort_program {
  uint32_t abi_version; ///< PIKORT_ABI_VERSION of the compiler's runtime.
  const char *name;     ///< The pipeline's C++ name.
  void (*setup)(pikort_pipeline *);  ///< Declares records, state and stages.
  int32_t (*run)(pikort_pipeline *); ///< Runs the kernels once, in order.
} pikort_program;

enum pikort_status {
  PIKORT_OK = 0,
  PIKORT_INVALID_ARGUMENT = 1, ///< A null pointer, a negative count, ...
  PIKORT_NOT_FOUND = 2,        ///< No state, source, ... of that name.
  PIKORT_SIZE_MISMATCH = 3,    ///< The record's size is not the one declared.
  PIKORT_UNBOUND = 4,          ///< Something was not bound before run.
  PIKORT_OUT_OF_MEMORY = 5,    ///< The system or the limit refused memory.
  PIKORT_TOO_MANY = 6,         ///< More primitives or bins than 32 bits count.
  PIKORT_BAD_PROGRAM = 7,      ///< The program's declarations make no sense.
  PIKORT_VERSION = 8,          ///< Made for another version of the runtime.
  PIKORT_WRONG_PROCESSOR = 9,  ///< No code that this processor can run.
  PIKORT_NO_DEVICE = 10,       ///< No device of the kind that it is for.
  PIKORT_DEVICE_FAILED = 11,   ///< The device, or its driver, failed.
  PIKORT_REPEATED = 12,        ///< A run was, after what followed it in its
                               ///< stream: see pikort_run_async.
  PIKORT_NOT_WRITTEN = 13,     ///< A file could not be written.
  PIKORT_INTERRUPTED = 14,     ///< pikort_interrupt has ended the run.
  PIKORT_BIN_OUTSIDE = 16,     ///< AssignBin named a bin outside the grid.
  PIKORT_UPDATE_OUTSIDE = 17,  ///< An update outside of the call's own bin.
  PIKORT_INDEX_OUTSIDE = 18,   ///< An element outside a buffer or an image.
  PIKORT_ENDLESS = 19,         ///< A loop that does not end.
  PIKORT_NOT_A_NUMBER = 20,    ///< A NaN where a position is needed.
  PIKORT_NOT_UNIFORM = 21,     ///< Iterations that do not meet at a barrier.
  PIKORT_RULE_BROKEN = 22,     ///< A finding of checking mode.
  PIKORT_NO_QUOTIENT = 23      ///< An integer division that has no result.
};

// --- Life -------------------------------------------------------------------

/// Makes a pipeline. On an error *pipeline may still be set: it then serves
/// only pikort_message and pikort_destroy.
PIKORT_API int32_t pikort_create(const pikort_program *program,
                                 pikort_pipeline **pipeline);
/// Which device runs the grids of a program that has code for one: its number,
/// from 0, or one of these.
enum {
  PIKORT_ANY_DEVICE = -1, ///< $PIKO_CUDA_DEVICE or 0; the processor, if the
                          ///< program has code for it and there is no device,
                          ///< or that one cannot take the kernels.
  PIKORT_PROCESSOR = -2   ///< None: the program's code for the processor.
};
/// The same on a device. It is no error if the program has code for the
/// processor alone, and one if there is no such device.
PIKORT_API int32_t pikort_create_on(const pikort_program *program,
                                    int32_t device, pikort_pipeline **pipeline);
/// Frees a pipeline and all its memory; null is allowed.
PIKORT_API void pikort_destroy(pikort_pipeline *pipeline);
/// What the latest failed call had to say; "" if none failed. Valid until the
/// next call with this pipeline.
PIKORT_API const char *pikort_message(const pikort_pipeline *pipeline);
PIKORT_API const char *pikort_name(const pikort_pipeline *pipeline);
/// The processor that the code is for which the pipeline runs, by the name that
/// pikoc was given; "" where the program does not say.
PIKORT_API const char *pikort_processor(const pikort_pipeline *pipeline);
/// The number of the device that runs the pipeline's grids, or
/// PIKORT_PROCESSOR.
PIKORT_API int32_t pikort_device(const pikort_pipeline *pipeline);

/// Why a pipeline that might be on any device is on the processor although
/// there is one: what the device's driver said of the kernels, for example that
/// their PTX is newer than it knows. "" otherwise.
PIKORT_API const char *pikort_device_refusal(const pikort_pipeline *pipeline);

// --- Devices ----------------------------------------------------------------

typedef struct pikort_device_info {
  char name[64];
  int32_t capability; ///< Of compute, 10 * major + minor.
  int32_t usable;     ///< 1 if pipelines can be on it.
  int64_t memory;     ///< In bytes.
} pikort_device_info;

/// The CUDA devices of this machine; 0 if it has no driver for them.
PIKORT_API int32_t pikort_device_count(void);
/// PIKORT_NOT_FOUND if there is none of this number.
PIKORT_API int32_t pikort_get_device(int32_t device, pikort_device_info *info);

// --- Options ----------------------------------------------------------------

/// Sets the domain (the screen or the volume, in cells). `rank` is the
/// pipeline's; each extent is in [1, PIKORT_MAX_EXTENT], x first.
PIKORT_API int32_t pikort_set_domain(pikort_pipeline *pipeline, int32_t rank,
                                     const int64_t *extent);
/// Sets the number of threads, in [0, PIKORT_MAX_THREADS]; 0 = what
/// OMP_NUM_THREADS says, or else the processors that the process may use
/// (affinity, quotas of its control groups). A run has fewer where the system
/// refuses them. The results do not depend on it.
PIKORT_API int32_t pikort_set_threads(pikort_pipeline *pipeline,
                                      int32_t threads);
/// The number of threads that the latest run could use, or, before one, that
/// were set.
PIKORT_API int32_t pikort_threads(const pikort_pipeline *pipeline);
/// Limits all memory of the pipeline, in bytes; 0 = no limit. A run that needs
/// more ends with PIKORT_OUT_OF_MEMORY.
PIKORT_API int32_t pikort_set_memory_limit(pikort_pipeline *pipeline,
                                           int64_t bytes);
/// Sets how many bytes bins and queues should use at most; 0 = no budget. Where
/// the program allows, sources then run in strips that fit; all else that needs
/// more ends with PIKORT_OUT_OF_MEMORY. It may be exceeded only by a strip
/// whose later stages make more of what earlier ones left than they did before.
/// No result depends on it.
PIKORT_API int32_t pikort_set_memory_budget(pikort_pipeline *pipeline,
                                            int64_t bytes);
/// Sets how many primitives of a source a strip has; 0 = what the memory budget
/// or the program says, else all. No result depends on it.
PIKORT_API int32_t pikort_set_strip_size(pikort_pipeline *pipeline,
                                         int64_t primitives);
/// Limits how many hops a primitive makes on a cycle of stages, and how many
/// rounds a cycle runs; at least 0. A run that needs more ends with
/// PIKORT_ENDLESS. Not called: 2^20.
PIKORT_API int32_t pikort_set_loop_limit(pikort_pipeline *pipeline,
                                         int64_t limit);

// --- State and sources ------------------------------------------------------

/// Copies the bytes of a constant. `size` must be its record's.
PIKORT_API int32_t pikort_bind_constant(pikort_pipeline *pipeline,
                                        const char *name, const void *data,
                                        int64_t size);
/// Binds a host's array of `count` records of `record_size` bytes to a buffer.
PIKORT_API int32_t pikort_bind_buffer(pikort_pipeline *pipeline,
                                      const char *name, void *data,
                                      int64_t count, int64_t record_size);
/// Gives a buffer `count` zeroed records that the pipeline owns.
PIKORT_API int32_t pikort_allocate_buffer(pikort_pipeline *pipeline,
                                          const char *name, int64_t count);
/// Binds the primitives of a source; they are read in place. A source that is
/// not bound has none.
PIKORT_API int32_t pikort_bind_source(pikort_pipeline *pipeline, int32_t source,
                                      const void *data, int64_t count,
                                      int64_t record_size);

/// The same in memory of the device that the pipeline is on: an address as
/// cuMemAlloc or cudaMalloc gives it. Kernels read and write it in place;
/// nothing is copied where no run has to be taken step by step by the host. The
/// records must all lie in memory of this device (managed memory does), of its
/// primary context, at a multiple of the record's alignment:
/// PIKORT_INVALID_ARGUMENT otherwise, and where the pipeline is on the
/// processor. What the device is to read must be there, in the order of the
/// run's stream, when the run begins.
PIKORT_API int32_t pikort_bind_device_source(pikort_pipeline *pipeline,
                                             int32_t source, uint64_t address,
                                             int64_t count,
                                             int64_t record_size);
PIKORT_API int32_t pikort_bind_device_buffer(pikort_pipeline *pipeline,
                                             const char *name, uint64_t address,
                                             int64_t count,
                                             int64_t record_size);

/// The memory of a piece of state.
typedef struct pikort_view {
  void *data;
  int64_t extent[4];   ///< Elements in each dimension, x first; unused = 1.
  int64_t record_size; ///< Bytes of an element; elements are contiguous.
  int32_t rank;        ///< 0 constant, 1 buffer, 1 to 4 image.
  int32_t record;      ///< Index for pikort_get_record.
} pikort_view;

/// Where a constant, buffer or image lies. Images and buffers sized by a
/// source exist after the first run and until the next. Waits for a run that is
/// on its way. On a device it is a copy of what the run has left there, and the
/// next run sees what the host has changed of it. A buffer that is memory of
/// the device has no view.
PIKORT_API int32_t pikort_get_view(pikort_pipeline *pipeline, const char *name,
                                   pikort_view *view);

/// Whether what is bound as the host's memory, sources and buffers, stays as it
/// is from one run to the next, until it is bound again. Then a device gets it
/// once; otherwise each run sees what is there then, and copies it (0). Of no
/// effect on the processor, and on runs that need the host between kernels.
PIKORT_API int32_t pikort_set_static_input(pikort_pipeline *pipeline,
                                           int32_t on);

/// The memory of a piece of state on a device.
typedef struct pikort_device_view {
  uint64_t address;    ///< A CUdeviceptr.
  int64_t extent[4];   ///< Elements in each dimension, x first; unused = 1.
  int64_t stride[4];   ///< Bytes from one to the next: [1] is a row's pitch.
  int64_t record_size; ///< Bytes of an element.
  int32_t rank;        ///< 1 buffer, 1 to 4 image.
  int32_t record;      ///< Index for pikort_get_record.
  int32_t channels; ///< Scalars of an element, if all have one type and there
                    ///< is nothing between them; 0 otherwise.
  int32_t type;     ///< pikort_field_type of these; -1.
  int32_t device;   ///< As pikort_device says.
} pikort_device_view;

/// Where an image or a buffer lies on the device that the pipeline is on, for
/// kernels and copies of the host's. Nothing is copied, and nothing waited for:
/// what is there is what the run has left for those after it in its stream.
/// The address stays until a run with another domain, or with another number of
/// primitives where a source sizes the buffer, until it is bound or allocated
/// anew, and until the pipeline goes; the contents until the next run. Images
/// and buffers sized by a source exist from the first run on (PIKORT_UNBOUND).
/// An error for constants, memory of the host, and on the processor.
PIKORT_API int32_t pikort_get_device_view(pikort_pipeline *pipeline,
                                          const char *name,
                                          pikort_device_view *view);
/// Copies all elements to the host, wherever they are; `count` is their number.
/// Waits for a run that is on its way.
PIKORT_API int32_t pikort_read(pikort_pipeline *pipeline, const char *name,
                               void *to, int64_t count, int64_t record_size);

// --- Running ----------------------------------------------------------------

/// Clears images, zeroes buffers sized by a source, and runs all kernels.
PIKORT_API int32_t pikort_run(pikort_pipeline *pipeline);

/// The pipeline's own stream.
#define PIKORT_OWN_STREAM ((void *)-1)

/// The same in the order of a stream, a CUstream or cudaStream_t of the
/// device's primary context, also 0, or PIKORT_OWN_STREAM: the run begins when
/// what the stream has been given before has ended, and what it is given later
/// begins when the run has ended. Returns when the stream has been given the
/// run. A run that needs the host between its kernels (docs/GPU.md lists them)
/// waits for the stream, and has ended when this returns; so has one on the
/// processor, which takes PIKORT_OWN_STREAM only. A stream that is captured is
/// refused.
///
/// Until pikort_wait the run owns what is bound: memory of the host may be
/// neither changed nor freed, and what the run writes to it is there after
/// pikort_wait. Meanwhile the host may set constants and options and bind for
/// the next run. Calls that need the end of the run wait for it: those that
/// run, pikort_get_view, pikort_read, pikort_allocate_buffer. How it has ended
/// is said by pikort_wait, or else by the next call that is to run, which does
/// nothing else then.
///
/// If the device finds an error, or its memory does not suffice, the rest of
/// the run does nothing, and the wait repeats it step by step: the status is
/// that of the repetition, or PIKORT_REPEATED if that went well. What followed
/// in the stream has seen incomplete results by then.
PIKORT_API int32_t pikort_run_async(pikort_pipeline *pipeline, void *stream);
/// Waits for the end of the run, not for what followed in its stream; its
/// status. PIKORT_OK where there is nothing to wait for, or to say.
PIKORT_API int32_t pikort_wait(pikort_pipeline *pipeline);
/// 1 if pikort_wait would not wait, or has an error of the device to report.
PIKORT_API int32_t pikort_is_done(const pikort_pipeline *pipeline);

/// From any thread, or in a signal's handler: no kernel begins any more, so
/// that runs end with PIKORT_INTERRUPTED, the one that goes on and later ones,
/// until the host says 0. Their results are incomplete. A kernel that has begun
/// is not stopped; nor is a run that a device has all of, nor one of the
/// reference executor.
PIKORT_API void pikort_interrupt(pikort_pipeline *pipeline, int32_t on);

/// Writes what a run would take now to a file: the domain, the options that
/// decide how it is divided, constants, buffers, and the sources' primitives.
/// pikort/capture.h binds it to another pipeline, and piko-render takes it in
/// the place of a scene. With $PIKO_CAPTURE, a folder, each pipeline's first
/// run, or that of the number $PIKO_CAPTURE_RUN, writes FOLDER/NAME.capture.
PIKORT_API int32_t pikort_capture(pikort_pipeline *pipeline, const char *path);

// --- Reflection -------------------------------------------------------------

enum pikort_state_kind {
  PIKORT_CONSTANT = 0,
  PIKORT_BUFFER = 1,
  PIKORT_IMAGE = 2
};

enum pikort_field_type {
  PIKORT_F32 = 0,
  PIKORT_F64 = 1,
  PIKORT_I8 = 2,
  PIKORT_I16 = 3,
  PIKORT_I32 = 4,
  PIKORT_I64 = 5
};

typedef struct pikort_record_info {
  const char *name;
  int64_t size;
  int64_t align;
  int32_t field_count;
} pikort_record_info;

/// A leaf of a record: `elements` scalars of `type`, `stride` bytes apart.
typedef struct pikort_field_info {
  const char *name;
  int64_t offset;
  int64_t elements;
  int64_t stride;
  int32_t type; ///< pikort_field_type
} pikort_field_info;

typedef struct pikort_state_info {
  const char *name;
  int32_t kind; ///< pikort_state_kind
  int32_t record;
  int32_t rank;
  int32_t per_source; ///< The source that sizes a buffer, or -1.
  int32_t bound;      ///< 1 if nothing is left to bind.
} pikort_state_info;

typedef struct pikort_stage_info {
  const char *name;
  int64_t bin_size[4]; ///< Cells, 0 = the whole domain; unused = 0.
  int64_t tile_split;
  int64_t tile_size;
  int32_t record;   ///< Of the primitives that come in.
  int32_t schedule; ///< As in pikoir_declare_stage.
  int32_t flags;    ///< As in pikoir_declare_stage.
  int32_t port_count;
} pikort_stage_info;

typedef struct pikort_source_info {
  int32_t stage;
  int32_t record;
  int64_t count; ///< Primitives bound.
} pikort_source_info;

PIKORT_API int32_t pikort_rank(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_record_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_state_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_stage_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_source_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_get_record(pikort_pipeline *pipeline, int32_t index,
                                     pikort_record_info *info);
PIKORT_API int32_t pikort_get_field(pikort_pipeline *pipeline, int32_t record,
                                    int32_t index, pikort_field_info *info);
PIKORT_API int32_t pikort_get_state_info(pikort_pipeline *pipeline,
                                         int32_t index,
                                         pikort_state_info *info);
PIKORT_API int32_t pikort_get_stage_info(pikort_pipeline *pipeline,
                                         int32_t index,
                                         pikort_stage_info *info);
PIKORT_API int32_t pikort_get_source_info(pikort_pipeline *pipeline,
                                          int32_t index,
                                          pikort_source_info *info);

// --- Statistics -------------------------------------------------------------

/// A kernel: a stage's Process, or "<stage>.assign<n>" for the AssignBin of
/// source n. Sums since the latest reset; divide by pikort_stats_runs. Of runs
/// that a device has all of they are zeros, unless pikort_set_kernel_times asks
/// for them.
typedef struct pikort_kernel_stats {
  const char *name;
  double milliseconds;      ///< From begin to end.
  double join_milliseconds; ///< Of these, ordering and binning.
  double wait_milliseconds; ///< Of these, threads without work, on average.
  int64_t launches;
  int64_t parallel_launches; ///< Of these, on several threads.
} pikort_kernel_stats;

/// Where the time of runs went, in milliseconds since the latest reset, as the
/// thread sees it that called pikort_run. The parts sum to the runs' time.
typedef struct pikort_time_stats {
  double kernels;    ///< Units of work.
  double waiting;    ///< Threads of a kernel without work, on average.
  double joins;      ///< Ordering and binning what kernels take.
  double cycles;     ///< The same in cycles, and what runs next.
  double clears;     ///< Allocating and clearing images and buffers.
  double allocation; ///< Mapping memory, in whatever part.
  double program;    ///< All else: the program between kernels, strips.
  double device;     ///< Waiting for runs that a device had all of: for their
                     ///< kernels, and what orders and bins between them.
} pikort_time_stats;

/// On a device: measures kernels of runs that it has all of, or, with 0, no
/// more. Such runs are slower, because kernels are launched one by one, with
/// events between them; the times are the device's.
PIKORT_API int32_t pikort_set_kernel_times(pikort_pipeline *pipeline,
                                           int32_t on);

/// A unit of work: what one thread ran at a time.
typedef struct pikort_unit_run {
  const char *stage;
  int64_t bin_begin, bin_end; ///< The bins that it is of, half open.
  int64_t primitives;         ///< Pairs of primitive and bin.
  int32_t thread;             ///< From 0.
  double begin, end;          ///< Milliseconds since the run began.
} pikort_unit_run;

/// Has `report` called after each unit, from the thread that ran it, several
/// at the same time; null = no more. Launches of a cycle that are too small for
/// threads have no units. The run is slower for it. Times are exact from the
/// second run on.
PIKORT_API int32_t pikort_set_unit_report(
    pikort_pipeline *pipeline,
    void (*report)(void *data, const pikort_unit_run *unit), void *data);

/// A loop that the code of a kernel holds in two versions: its turns as the
/// lanes of vectors, or one after the other. Both give the same bits. The
/// runtime measures both on the first units of work, and again for units of
/// another size, and keeps the faster one; see pikort_set_mappings.
typedef struct pikort_mapping_info {
  const char *kernel;    ///< As in pikort_kernel_stats.
  int32_t number;        ///< Of the loops of the kernel, from 0.
  int32_t within;        ///< The one in whose scalar version it is; -1 = none.
  const char *loop;      ///< What it is over, and its place in the text.
  int32_t vectors;       ///< What runs now: 1 = vectors, 0 = one at a time.
  int32_t expected;      ///< The same, of what was expected to be faster.
  int32_t state;         ///< A pikort_mapping_state.
  double expected_ratio; ///< Vectors' time over that of one at a time.
  double measured_ratio; ///< The same, as measured; 0 = not yet.
} pikort_mapping_info;

enum pikort_mapping_state {
  PIKORT_MAPPING_EXPECTED = 0, ///< Nothing has been measured.
  PIKORT_MAPPING_TRIED = 1,    ///< Is being measured.
  PIKORT_MAPPING_MEASURED = 2, ///< The faster one.
  PIKORT_MAPPING_FIXED = 3     ///< As the host has said.
};

PIKORT_API int32_t pikort_mapping_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_get_mapping(pikort_pipeline *pipeline, int32_t index,
                                      pikort_mapping_info *info);
/// Says which version of its loops a pipeline runs: "measured" (the default),
/// "expected", "vectors" or "scalar", for all of them or, as in
/// "expected,Shade:0=vectors", for one loop of a kernel, by its number. Where
/// the host says nothing, $PIKO_MAPPINGS does. The results do not depend on it.
PIKORT_API int32_t pikort_set_mappings(pikort_pipeline *pipeline,
                                       const char *setting);

/// A stage's primitives. Sums since the latest reset.
typedef struct pikort_stage_stats {
  const char *name;
  int64_t in;     ///< Primitives that came in.
  int64_t placed; ///< Pairs of primitive and cell that were processed.
  int64_t out;    ///< Primitives emitted, over all ports.
} pikort_stage_stats;

// The first eleven are of the text, counted without any fusion, the others of
// the code that runs.
enum pikort_counter_kind {
  PIKORT_CALLS = 0,      ///< Of Process.
  PIKORT_ITERATIONS = 1, ///< Of a parallel loop.
  PIKORT_TRIPS = 2,      ///< Iterations of any other loop.
  PIKORT_EMISSIONS = 3,  ///< Out of a port.
  PIKORT_READS = 4,      ///< Of fields of a piece of state.
  PIKORT_STORES = 5,     ///< The same, written.
  PIKORT_UPDATES = 6,    ///< Of pixels.
  PIKORT_ATOMICS = 7,
  PIKORT_FLOATS = 8,       ///< Operations of f32 and f64.
  PIKORT_INTEGERS = 9,     ///< Operations of integers.
  PIKORT_EFFECTS = 10,     ///< Emissions, updates and atomics right in a loop.
  PIKORT_SCALARS = 11,     ///< Operations that are no vectors'.
  PIKORT_VECTORS = 12,     ///< Operations on vectors.
  PIKORT_LANES = 13,       ///< Of these, lanes, ...
  PIKORT_ACTIVE_LANES = 14 ///< ... and those of them that do something.
};

/// What a program that was compiled for counting has counted since the latest
/// reset.
typedef struct pikort_counter {
  const char *stage;
  const char *state;    ///< That is accessed, or null.
  const char *consumer; ///< The stage that emissions go to, or null.
  const char *place;    ///< "file:line", or null.
  int32_t kind;         ///< pikort_counter_kind
  int32_t port;         ///< Of emissions, otherwise -1.
  int32_t around;       ///< The counter of the loop or calls around, or -1.
  int64_t count;
  int64_t bytes;          ///< Emitted or accessed.
  int64_t distinct;       ///< Elements accessed, each once.
  int64_t distinct_bytes; ///< Of these, bytes accessed, each once.
} pikort_counter;

/// 0 where the program was not compiled for counting.
PIKORT_API int32_t pikort_counter_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_get_counter(pikort_pipeline *pipeline, int32_t index,
                                      pikort_counter *counter);

PIKORT_API int64_t pikort_stats_runs(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_kernel_count(const pikort_pipeline *pipeline);
PIKORT_API int32_t pikort_get_kernel_stats(pikort_pipeline *pipeline,
                                           int32_t index,
                                           pikort_kernel_stats *stats);
PIKORT_API int32_t pikort_get_time_stats(pikort_pipeline *pipeline,
                                         pikort_time_stats *stats);
PIKORT_API int32_t pikort_get_stage_stats(pikort_pipeline *pipeline,
                                          int32_t stage,
                                          pikort_stage_stats *stats);
/// The most bytes that bins and queues held at one time since the reset.
PIKORT_API int64_t pikort_peak_bytes(const pikort_pipeline *pipeline);
/// All bytes that the pipeline holds now, with those kept for later frames.
PIKORT_API int64_t pikort_reserved_bytes(const pikort_pipeline *pipeline);
PIKORT_API void pikort_reset_stats(pikort_pipeline *pipeline);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_PIKORT_H
