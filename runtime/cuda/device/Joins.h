// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Joins.h - What host and device say to each other about joins -------===//
//
// A join puts what the producers of a stage have left in their logs into
// lineage order, bins it, and cuts it into units, on the device: the host knows
// no number of it. The runtime's host code fills in JoinArgs for each kernel of
// the program; device/Joins.cpp does the work, in a grid whose blocks wait for
// each other.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_JOINS_H
#define PIKO_RUNTIME_CUDA_DEVICE_JOINS_H

#include "pikort/abi.h"
#include "pikort/grid.h"

namespace piko::cuda {

constexpr int32_t joinThreads = 256;
constexpr int32_t mostJoinBlocks = 1024;
constexpr int32_t mostJoinInputs = 8;
constexpr int32_t mostJoinClears = 8;

/// What all grids of a frame share.
struct FrameState {
  pikoir_log log; ///< Memory is taken in address order, and never given back.
  /// The host's: the grid that runs, as a number in the order of launches.
  volatile int64_t *progress;
  int32_t failed;   ///< Memory or a count did not suffice, or a kernel failed.
  uint32_t arrived; ///< Blocks at barriers, over all of them.
  uint64_t blockSums[mostJoinBlocks];
};

/// Lineage keys: see rt::Keys.
struct KeyWords {
  const uint64_t *words; ///< Null: base + item.
  uint64_t base;
  int32_t width; ///< 0: there are none.
};

/// What the device knows of a kernel, from its begin until the frame ends.
struct KernelState {
  pikoir_input input;
  pikoir_log log;
  int64_t cells;
  const uint32_t *rank; ///< Position to place in emission order; null = same.
  int64_t rankSize;
  KeyWords keys; ///< Of items.
  // Counted for the host's statistics.
  int64_t in, placed;
  uint64_t received[mostJoinInputs]; ///< With what was placed nowhere.
};

/// What comes into a stage: a source, or what a kernel left for a port.
struct JoinInput {
  KernelState *producer; ///< Of a source: its AssignBin's, if it is placed.
  const uint8_t *items;  ///< Of a source: primitives and their number.
  int64_t count;
  uint64_t keyBase;
  int32_t isSource;
  int32_t stage, port; ///< Those of the log's entries.
  int32_t keyed;       ///< Its primitives have lineage keys.
  int32_t permute;     ///< Emission order may differ from that of positions.
  int32_t collects;    ///< The producer takes lists or all of a bin.
  uint32_t root;       ///< Of the lineage that the producer starts then.
};

struct JoinClear {
  uint8_t *pixels;
  const uint8_t *record;
  int64_t size; ///< Of the record.
};

struct JoinArgs {
  FrameState *frame;
  KernelState *kernel;
  const KernelState *previous; ///< The kernel that ran before, or null.
  int64_t number;              ///< Of the join, in the order of launches.
  int32_t inputCount, clearCount;
  JoinInput inputs[mostJoinInputs];
  JoinClear clears[mostJoinClears];
  int64_t recordSize, cells, tiles;
  int32_t placed, takesList, collects, splits, visitsAll, everyBin, serialize;
  int32_t ranked;      ///< Some edge needs the order of emission.
  int32_t keyWidth;    ///< Of the stage's items; 0: none are needed.
  int64_t tileSplit;   ///< Positions of a unit; 0: as the device likes.
  int64_t batch;       ///< Positions of a call; 0: all of the bin.
  int64_t unitsAtOnce; ///< Blocks that fill the device.
  int32_t rank;        ///< Of the domain; four entries each, unused = 1 or 0.
  int64_t domain[4], binSize[4], grid[4];
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_JOINS_H
