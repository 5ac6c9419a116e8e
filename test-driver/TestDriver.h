// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- TestDriver.h - Control of the driver for tests ---------------------===//
//
// libpiko-test-driver.so has the symbols of NVIDIA's driver that
// cuda/DriverAPI.def names. It runs PTX on the CPU, and reports what a GPU may
// let pass: accesses outside of allocations, calls with handles that are not
// valid, leaks. Tests load it in place of libcuda.so.1.
//
// Streams run at once, in order, or else when the host waits for them. A kernel
// that fails does so as on a GPU: the launch succeeds, all later calls return
// the error until the context's last reference is released.
//
// What a stream that is captured is given becomes nodes of a graph, with its
// parameters as they were then. A call that a capture forbids makes it invalid.
// An executable graph is not updated to another function of a kernel, which
// drivers before 11.2 refuse and later ones take: callers need a way out. Nodes
// of a graph follow each other; one beside another is not supported.
//
// The blocks of a cooperative launch run in turns, which end at nanosleep or
// after some thousand instructions. Those of others take turns, too, as many as
// find room: one ends before an atomic addition to global memory whose
// result is used, if others are some hundred instructions after, and the next
// one is that of the block that has run the fewest. So blocks that take work
// from a counter get it in the order in which they ask. None of them can wait
// for another one.
// Where all blocks that run sleep again and again and no memory changes, the
// launch has timed out. A loop that does not sleep is not found out.
//
// Environment, read when the library is loaded:
//
//   PIKO_TEST_DRIVER_DEVICES   devices; 1
//   PIKO_TEST_DRIVER_SM        compute capability, 10 * major + minor; 90
//   PIKO_TEST_DRIVER_MULTIPROCESSORS
//                              that a device says to have; 4
//   PIKO_TEST_DRIVER_MEMORY    bytes that cuMemAlloc has; 16 GiB
//   PIKO_TEST_DRIVER_SEED      order of blocks, of warps and their turns, and
//                              of lanes in atomic operations, another one for
//                              each launch; 0: as numbered
//   PIKO_TEST_DRIVER_FAIL      function:n:error, as pikoTestDriverFail; more
//                              than one with commas
//   PIKO_TEST_DRIVER_DELAY     1: as pikoTestDriverDelay
//   PIKO_TEST_DRIVER_MODES     as pikoTestDriverModes
//   PIKO_TEST_DRIVER_LATENCIES as pikoTestDriverLatencies
//   PIKO_TEST_DRIVER_ERRORS    1: texts of errors to stderr as they come
//   PIKO_TEST_DRIVER_COUNTS    1: counts of all kernels, and what the host has
//                              asked for, to stderr at the end; launches: each
//                              launch to stderr as it ends; lines: also the
//                              lines of PTX that it has spent most in, by warp
//                              instructions; else the name of a file to write
//                              counts to, and the numbers of calls, as JSON
//
// The functions here may be called at any time, from any thread. Texts that
// they return live until the calling thread's next call of the same function.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_H
#define PIKO_TEST_DRIVER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// The \p n-th call from now, counted from 1, of a function such as cuMemAlloc
/// (without the symbol's suffix), or of any if it is null, does nothing and
/// returns \p error, a CUresult.
void pikoTestDriverFail(const char *function, uint64_t n, int error);

/// Calls of a function so far, or of all if it is null.
uint64_t pikoTestDriverCalls(const char *function);

/// What the last call that failed had to say; empty if none did.
const char *pikoTestDriverError(void);

/// What lived when contexts were released, a line each; empty if nothing. It is
/// written to stderr, too, when the process ends.
const char *pikoTestDriverLeaks(void);

/// What is alive now, in the same form.
const char *pikoTestDriverAlive(void);

/// What the launches of a kernel did. A warp instruction is one that a warp
/// runs for its active lanes, of which each is a lane instruction; lane
/// utilization is laneInstructions / (32 * warpInstructions).
struct PikoTestDriverCounts {
  uint64_t launches, blocks, threads, warps;
  uint64_t warpInstructions, laneInstructions;
  /// Of each launch, the most that one of its warps ran; summed.
  uint64_t longestWarps;
  /// Of each launch, the instructions that go by until its last block ends:
  /// each warp runs one at a time, and blocks wait for room; summed.
  uint64_t lastBlocks;
  /// The span of each launch, in cycles, summed; 0 without
  /// PIKO_TEST_DRIVER_LATENCIES. Each warp issues its instructions in order,
  /// one a cycle, as if it were alone, and waits for what they read; blocks
  /// wait for room. Loads of global memory find it in the first-level cache
  /// where the launch has touched it since their block's latest fence; or where
  /// their block has, unless what has the same place in its part of the cache
  /// came between.
  uint64_t leastSpan, mostSpan;
  // Warp instructions by class. Divisions are those that GPUs do by a sequence
  // of instructions, as are remainders and correctly rounded roots.
  uint64_t integer, integer64, float32, float64, special;
  uint64_t integerDivision, float32Division, float64Division;
  uint64_t convert, move, control;
  uint64_t loadGlobal, storeGlobal, loadShared, storeShared;
  uint64_t loadLocal, storeLocal, loadGeneric, storeGeneric;
  uint64_t parameter, atomic, barrier, warpOperation;
  /// Of global memory, atomic operations too: bytes that lanes ask for, and
  /// sectors of 32 bytes that warps touch.
  uint64_t globalBytes, globalSectors;
  /// Sectors that a launch touches at least once; summed.
  uint64_t distinctSectors;
};

/// Counts of a kernel, or of all if its name is null. Returns 0, or 1 if it was
/// never launched; \p counts are zeros then.
int pikoTestDriverCounts(const char *kernel,
                         struct PikoTestDriverCounts *counts);

/// What the host has asked of the device.
struct PikoTestDriverHostCounts {
  /// On streams that were not captured.
  uint64_t launches, copies, fills;
  uint64_t graphLaunches;
  uint64_t graphKernels; ///< That graphs have launched.
  uint64_t waits;        ///< For the context, a stream or an event.
  /// That copies had, on streams that were not captured.
  uint64_t bytesToDevice, bytesFromDevice, bytesOnDevice;
  /// Sectors of 32 bytes of global memory that the kernels of a graph touch at
  /// least once; summed over launches of graphs.
  uint64_t graphSectors;
};

void pikoTestDriverHostCounts(struct PikoTestDriverHostCounts *counts);

/// From here on a stream does what it is given when the host waits for it, for
/// an event in it, or for all; or, if \p on is 0, at once. What is not waited
/// for is so late as it may be on a GPU. Streams that were not made as
/// CU_STREAM_NON_BLOCKING count as one.
void pikoTestDriverDelay(int on);

/// What the device does from here on that devices may do and most do seldom, as
/// names with commas between them; returns 1 if one is unknown:
///
///   apart     independent thread scheduling: diverged lanes need not
///             reconverge until a warp operation or a barrier, and run in any
///             order, by the seed
///   buffered  store buffering: what a block stores to global memory other
///             blocks see at its next fence of the device's scope, and when it
///             ends; what an atomic operation or a strong store changes, at
///             once
///   lazy      lazy loading: a function whose handle alone is known is loaded
///             by its first launch, an error while the stream is captured
int pikoTestDriverModes(const char *names);

/// Lets spans be counted. Cycles from issue until a result is there, as
/// "arithmetic,shared,hit,miss": of an arithmetic instruction and of loads from
/// shared memory, from the first-level cache and from the second one; empty:
/// counts none. After them may come the bytes that a multiprocessor's
/// first-level cache and shared memory have together, of which blocks that are
/// there at the same time have equal parts; without, a block has 8 KB. Returns
/// 1 where that is no text of four positive numbers, or five.
int pikoTestDriverLatencies(const char *cycles);

/// The names of kernels that were launched, a line each, sorted.
const char *pikoTestDriverKernels(void);

/// Forgets failures that are still to come, numbers of calls, texts of errors
/// and of leaks, and counts. What is alive stays.
void pikoTestDriverReset(void);

#ifdef __cplusplus
}
#endif

#endif // PIKO_TEST_DRIVER_H
