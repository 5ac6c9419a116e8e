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

#include "pikort/abi_layout.h"
#include "pikort/grid.h"

namespace piko::cuda {

constexpr int32_t joinThreads = 256;
constexpr int32_t mostJoinBlocks = 1024;
constexpr int32_t mostMerged = 8; ///< Streams, at a time.
constexpr int32_t mostScans = 4;  ///< At a time.

struct KernelState;

/// Elements that lie after what a grid is told: as many as it says.
template <class T, class Args> const T *after(const Args *args) {
  return reinterpret_cast<const T *>(args + 1);
}

/// What all grids of a frame share.
struct FrameState {
  /// Memory is taken in address order, and given back between strips alone;
  /// until there is a latest kernel, from this cursor on.
  pikoir_log log;
  int64_t highest;     ///< Where the memory of strips ended that is free again.
  int64_t mostAlone;   ///< Up to how much work one block does by itself.
  KernelState *latest; ///< The kernel that ran last; null before the first of
                       ///< the frame, or of a strip.
  /// The host's: the grid that runs, as a number in the order of launches.
  volatile int64_t *progress;
  /// Of each scan, what blocks have; nobody makes it zero.
  uint64_t (*blockSums)[mostJoinBlocks];
  int32_t failed; ///< Memory or a count did not suffice, or a kernel failed.
  /// Blocks at barriers, over all of them; in 32 bits a frame of many waves
  /// would come to the end.
  uint64_t arrived;
};
using BlockSums = uint64_t[mostScans][mostJoinBlocks];

/// Lineage keys: see rt::Keys.
struct KeyWords {
  const uint64_t *words; ///< Null: base + item.
  uint64_t base;
  int32_t width; ///< 0: there are none.

  uint64_t word(int64_t item, int32_t w) const {
    if (w >= width)
      return 0;
    return words ? words[item * width + w] : base + static_cast<uint64_t>(item);
  }
};

/// Primitives in an order.
struct Stream {
  const uint8_t *items;
  int64_t count, pairCount;
  const uint32_t *pairs;      ///< Buckets, the first of each item marked.
  const uint32_t *pairStarts; ///< The first pair of each item, and the end.
  KeyWords keys;
};

/// Where the primitives of a wave stand in the lineage order of all that a loop
/// holds. What a wave has emitted: the parent's place, and which child it is.
struct Lineage {
  uint32_t *places; ///< Null of what came in first: the items' numbers.
  uint32_t *children;
  uint32_t *entries; ///< Which of the primitives that came in it comes from.
};

/// What a launch has put into a queue.
struct Chunk {
  Stream stream;
  Lineage lineage; ///< Within a loop.
};

/// Primitives that wait for a stage, where their producer runs several times.
struct QueueState {
  Chunk *chunks; ///< In the order in which they came, which is lineage's.
  int64_t count, capacity;
  int64_t items; ///< In all chunks.
  int64_t ready; ///< Within a loop: chunks of the wave before.
};

/// A primitive that has left a loop.
struct Exit {
  const uint8_t *item;
  const uint32_t *pairs;
  uint32_t pairCount;
  uint32_t group; ///< To which stage.
  uint32_t place, child, entry;
};

/// A loop that runs in waves. Its places are numbers, below `places`, of what
/// has left it and of the primitives of this wave, in lineage order.
struct LoopState {
  int32_t again; ///< Whether another wave follows.
  int64_t hops;  ///< Waves before this one; EnterArgs begin with 1.
  int64_t places;
  uint32_t *childCounts; ///< Of each place, in this wave.
  KeyWords entryKeys;
  Exit *exits;
  int64_t exitCount, exitCapacity;
  int64_t exitsBefore; ///< This wave.
};

/// On the stack of a loop.
struct Waiting {
  const uint8_t *item;
  const uint32_t *pairs; ///< Of the buckets that it has still to go to.
  uint32_t pairCount;
  uint32_t entry; ///< What came in that it comes from.
  int32_t member; ///< Of the loop, that takes it; -1: it leaves, ...
  int32_t group;  ///< ... to this stage; -1: to none.
  int64_t hops;
};

/// Of a loop that runs one position at a time.
struct StackState {
  Waiting *waiting; ///< The last one is next, and then `entries`.
  int64_t count, capacity;
  const Waiting *entries;
  int64_t entryCount, nextEntry;
  int32_t running; ///< The member whose kernel has a position; -1: none.
  uint32_t entry;  ///< Of that, ...
  int64_t hops;    ///< ... and these.
  pikoir_unit unit;
  pikoir_unit_log unitLog;
  uint32_t *numbers; ///< Room for those of a step.
  int64_t found, foundLeft;
  uint32_t children, buckets;
};

/// Rounds of a cycle whose stages collect.
struct CycleState {
  int32_t again; ///< Whether another round follows.
  int64_t rounds;
  int64_t launches; ///< Of stages that collect.
};

/// The strip that runs, of a source that a group of stages takes strip by
/// strip.
struct StripState {
  int32_t again;  ///< Whether another one follows.
  int64_t number; ///< Strips before it.
  int64_t begin, count;
  int64_t size, all; ///< Primitives of a strip, and of the source.
  int64_t memory;    ///< Where that begins that strips take again.
};

/// What the device knows of a kernel, from its begin until the frame ends, or
/// until it begins again.
struct KernelState {
  pikoir_input input;
  pikoir_log log;
  int64_t logBegin; ///< Where its log's cursor began.
  int64_t buckets;
  const uint32_t *rank; ///< Position to place in emission order; null = same.
  int64_t rankSize;
  KeyWords keys; ///< Of items.
  const uint32_t *pairStarts;
  int64_t items;
  Lineage lineage;    ///< Of items, within a loop.
  uint64_t launch;    ///< Of a stage that collects, in its cycle or by strips.
  int64_t strip;      ///< The latest.
  int64_t runs;       ///< Before this one.
  int64_t in, placed; ///< Counted for the host's statistics.
};

/// What streams of a stage's primitives have in common.
struct Shape {
  int64_t recordSize, buckets;
  int32_t placed;
  int32_t keyWidth; ///< Of the stage's items; 0: none are needed.
};

/// What comes into a stage: a source, or what a kernel left for a port.
struct JoinInput {
  KernelState *producer; ///< Of a source: its AssignBin's, if it is placed.
  const uint8_t *items;  ///< Of a source: primitives and their number.
  int64_t count;
  uint64_t keyBase;
  const StripState *strip; ///< Of a source: the part that is taken; null: all.
  QueueState *queue; ///< What comes through one has nothing else said here.
  int32_t isSource;
  int32_t isInLoop;    ///< Of a queue: both ends are in one loop.
  int32_t stage, port; ///< Those of the log's entries.
  int32_t keyWidth;    ///< 64-bit words of its primitives' keys; 0: none.
  int32_t permute;     ///< Emission order may differ from that of positions.
  int32_t collects;    ///< The producer takes lists or all of a bin.
  uint32_t root;       ///< Of the lineage that the producer starts then.
  /// Counts its primitives, with what was placed nowhere: for the host's
  /// statistics.
  uint64_t *received;
};

struct JoinClear {
  uint8_t *pixels;
  const uint8_t *record;
  int64_t size; ///< Of the record.
};

/// How the positions of a stage become units.
enum Cutting : int32_t {
  CutBuckets, ///< Each bucket by itself, ...
  CutBins,    ///< ... as its bin says.
  CutNone     ///< All are one unit.
};

/// What a schedule says of a bin.
struct BinCut {
  int32_t splits, everyBin;
  int64_t tileSplit, batch;
};

struct JoinArgs {
  FrameState *frame;
  KernelState *kernel;
  LoopState *loop;         ///< The stage's, or null.
  CycleState *cycle;       ///< The stage's, or null.
  const StripState *strip; ///< That the stage takes; null: all at a time.
  int64_t number;          ///< Of the join, in the order of launches.
  int32_t inputCount, clearCount;
  Shape shape;
  int64_t tiles;
  int32_t takesList, collects, splits, visitsAll, everyBin;
  Cutting cutting;
  int32_t ranked;      ///< Some edge needs the order of emission.
  int64_t tileSplit;   ///< Positions of a unit; 0: as the device likes.
  int64_t batch;       ///< Positions of a call; 0: all of the bin.
  const BinCut *cuts;  ///< Of each bin, in place of these two and of `splits`.
  int64_t unitsAtOnce; ///< Blocks that fill the device.
  int32_t rank;        ///< Of the domain; four entries each, unused = 1 or 0.
  int64_t domain[4], binSize[4], grid[4];

  const JoinInput *inputs() const { return after<JoinInput>(this); }
  const JoinClear *clears() const {
    return reinterpret_cast<const JoinClear *>(inputs() + inputCount);
  }
};

/// A stage at which primitives come into a loop.
struct LoopEntry {
  KernelState *kernel; ///< The stage's.
  QueueState *queue;   ///< Where they wait for it.
  Shape shape;
  const StripState *strip; ///< As in JoinArgs.
  int32_t firstInput, inputCount;
  int32_t member; ///< Among the loop's stages.
};

struct StackArgs;

/// Before a loop that is entered at several stages, or has a stack.
struct EnterArgs {
  FrameState *frame;
  LoopState *loop;
  const StackArgs *stack; ///< Null: it runs in waves.
  int64_t number;
  int32_t keyWidth; ///< Of what comes in.
  int32_t entryCount, inputCount;

  const LoopEntry *entries() const { return after<LoopEntry>(this); }
  const JoinInput *inputs() const {
    return reinterpret_cast<const JoinInput *>(entries() + entryCount);
  }
};

/// A port of a kernel whose primitives go through a queue.
struct QueuePort {
  JoinInput input; ///< Whose producer is the kernel.
  Shape shape;     ///< Of the consumer's primitives.
  QueueState *queue;
  int32_t group;  ///< Of what leaves a loop; -1: nothing does.
  int32_t member; ///< Of the loop, that it leads to; -1: none.
};

/// A stage of a loop that runs one position at a time.
struct StackMember {
  KernelState *kernel;
  Shape shape;
  int64_t tiles;
  int32_t firstPort, portCount;
};

/// After each position of such a loop.
struct StackArgs {
  FrameState *frame;
  LoopState *loop;
  StackState *stack;
  int64_t number;
  int64_t limit; ///< Of hops.
  int32_t memberCount, portCount;

  const StackMember *members() const { return after<StackMember>(this); }
  const QueuePort *ports() const {
    return reinterpret_cast<const QueuePort *>(members() + memberCount);
  }
};

/// After a kernel that may run several times: what it has emitted is to wait.
struct QueueArgs {
  FrameState *frame;
  KernelState *kernel;
  LoopState *loop; ///< The kernel's, or null.
  int64_t number;
  int32_t portCount;

  const QueuePort *ports() const { return after<QueuePort>(this); }
};

/// After each wave of a loop, or each round of a cycle.
struct StepArgs {
  FrameState *frame;
  LoopState *loop;   ///< Of a wave.
  CycleState *cycle; ///< Of a round.
  int64_t number;
  int64_t limit; ///< Of waves or rounds after the first.
  int32_t queueCount;

  /// What waits for the next one.
  QueueState *const *queues() const { return after<QueueState *>(this); }
};

/// All that has left a loop to one stage.
struct ExitGroup {
  QueueState *queue;
  Shape shape;
  int32_t keyWidth; ///< Of the edge; 0: it needs none.
};

/// After a loop.
struct LeaveArgs {
  FrameState *frame;
  LoopState *loop;
  int64_t number;
  int32_t keyWidth; ///< Of what comes in.
  int32_t groupCount;

  const ExitGroup *groups() const { return after<ExitGroup>(this); }
};

/// A queue of what leaves the strips.
struct StripQueue {
  QueueState *queue;
  int64_t recordSize;
};

/// After a strip.
struct StripArgs {
  FrameState *frame;
  StripState *strip;
  int64_t number;
  int32_t leavingCount, insideCount, cycleCount;

  const StripQueue *leaving() const { return after<StripQueue>(this); }
  /// Empty when a strip ends.
  QueueState *const *inside() const {
    return reinterpret_cast<QueueState *const *>(leaving() + leavingCount);
  }
  CycleState *const *cycles() const {
    return reinterpret_cast<CycleState *const *>(inside() + insideCount);
  }
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_JOINS_H
