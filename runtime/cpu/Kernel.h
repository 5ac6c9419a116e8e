// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Kernel.h - A stage as it runs --------------------------------------===//
//
// What a stage (or the AssignBin of a source) holds between begin and end, and
// from its end until its consumers have gathered what it emitted.
//
//   begin:  gather each input edge into a Stream, merge them (Join.cpp),
//           bin the items (Buckets.cpp), cut the positions into units.
//   loop:   each open unit has a lane, which logs records and buckets
//           (Writer.cpp).
//   end:    the input goes; logs and lineage stay until they are gathered.
//
// An *item* is a primitive of the stage's input, in lineage order. A *pair* is
// an item in one of its buckets, numbered in (item, bucket) order. A *position*
// is a pair, numbered in (bucket, item) order: the order of processing. A
// *slot* is what lies between two calls of pikoir_next: a position, or, where
// Process takes a list, a call.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_KERNEL_H
#define PIKO_RUNTIME_CPU_KERNEL_H

#include "cpu/Autotuner.h"
#include "cpu/CPUExecutor.h"

#include <atomic>
#include <deque>

namespace piko::rt {

// --- What a kernel emits ----------------------------------------------------

/// Consecutive bytes that one unit logged.
struct Segment {
  int64_t unit;
  const uint8_t *data;
  int64_t bytes;
};

/// Bytes in blocks that grow; a segment of each unit in each block.
struct Log {
  std::vector<Array<uint8_t>> blocks;
  std::vector<Segment> segments;
  uint8_t *start = nullptr; ///< Of the segment that is being written.
  bool failed = false;      ///< Out of memory: writes go to a scratch.

  void clear() {
    blocks.clear();
    segments.clear();
    start = nullptr;
    failed = false;
  }
};

/// What a port of a local edge has kept for one bin, as its consumer sees it.
struct LocalBin {
  pikoir_input input{};
  pikoir_unit unit{};
  int64_t offsets[2] = {0, 0};
  Array<pikoir_call> calls;
  int64_t received = 0; ///< Over all bins of this run.
};

/// The three logs of a port. Buckets are uint32, the first of each record with
/// PIKOIR_FIRST_BUCKET; ordinals are uint32, one for each kept record.
struct PortLogs {
  Log records, buckets, ordinals;
  std::vector<uint8_t> scratch;
  uint8_t *scratchRecord = nullptr; ///< In it, aligned: room for records.
  uint32_t *countsEnd = nullptr;
  bool padded = false; ///< Records have padding, which must be zero.
  int32_t consumer = 0;
  std::unique_ptr<LocalBin> local; ///< If its edge is local.

  void clear() {
    records.clear();
    buckets.clear();
    ordinals.clear();
  }
};

/// In a source's log: the primitive has no bucket.
constexpr uint32_t noBucket = 0xffffffffu;

struct Reordered; // Reorder.cpp

/// Memory of a call of Process: last in, first out. A mark is the number of
/// bytes below it, over all blocks.
struct ScratchStack {
  std::vector<Array<uint8_t>> blocks;
  size_t block = 0;  ///< That is in use.
  int64_t below = 0; ///< Bytes in the blocks before it.
  int64_t used = 0;  ///< In it.
};

/// A copy of a bin's pixels, which a kernel changes in place of the image.
struct PixelTile : pikoir_tile {
  Array<uint8_t> memory;
  int32_t image = -1;
  bool isOpen = false;
  int64_t first = 0;           ///< Bytes from the image's pixel 0 to the bin's.
  int64_t rows = 0, bytes = 0; ///< Of a row.
};

/// A writer and its logs: used by one thread at a time, for many units. No two
/// share a line of the cache.
struct alignas(64) Lane : pikoir_writer {
  Lane();
  ~Lane();
  pikort_pipeline *pipeline = nullptr;
  Kernel *kernel = nullptr;
  std::atomic_flag taken; ///< By a thread that has opened a unit.
  std::vector<pikoir_port> portStorage;
  std::vector<PortLogs> logs;
  int64_t emitted = 0; ///< Over all units of this run.
  int64_t opened = 0;  ///< The unit, in ticks.
  int64_t busy = 0;    ///< Ticks of all units of this run.
  /// In a serial launch: where the number of what was emitted goes at the end
  /// of the next slot, and after the unit's last.
  uint32_t *slotEnd = nullptr, *slotLimit = nullptr;
  ScratchStack scratch;
  std::deque<PixelTile> tiles; ///< Of the images of which a run has any.
  pikoir_tile untiled{};       ///< The image, if memory is refused.
  std::unique_ptr<Reordered> reordered; ///< If there were any.
  std::vector<pikoir_private> privates; ///< For each reduction of the stage.
  AutotunerThread tuning;               ///< Of the open unit.
  bool reduces = false;                 ///< Some unit of this launch asked.
  bool selects = false;                 ///< The same, of private images.

  /// Frees what a run holds.
  void clear();
};

// --- What a kernel reads ----------------------------------------------------

/// Lineage keys: `width` words for each item, compared lexicographically, or
/// none at all, or, for the primitives of a source, base + index.
struct Keys {
  int32_t width = 0;
  uint64_t base = 0;
  Array<uint64_t> words;

  uint64_t word(int64_t item, int32_t w) const {
    if (w >= width)
      return 0;
    return words ? words[item * width + w] : base + static_cast<uint64_t>(item);
  }
};

/// Items in lineage order, with the buckets of each.
struct Items {
  const uint8_t *items = nullptr;
  int64_t count = 0;
  const uint32_t *pairs = nullptr; ///< If the consumer is placed.
  int64_t pairCount = 0;
  /// Where each item lies, in records from `items`; null = they follow each
  /// other.
  const uint32_t *index = nullptr;
  int64_t extent = 0; ///< If there is an index: all its entries are below.

  bool onePairEach() const { return pairCount == count; }
  const uint8_t *item(int64_t i, int64_t size) const {
    return items + (index ? index[i] : i) * size;
  }
  /// Records from `items` up to the last.
  int64_t reach() const { return index ? extent : count; }
};

/// The same, with keys.
struct Stream : Items {
  Keys keys;
  // What the pointers point to, if it is ours:
  Array<uint8_t> itemStorage;
  Array<uint32_t> pairStorage, indexStorage;
  std::vector<Array<uint8_t>> blocks;
};

/// What the executor has of a kernel's input where kernels cannot read ours.
struct InputMirror {
  virtual ~InputMirror() = default;
  /// Frees what a run holds.
  virtual void clear() = 0;
};

/// How far the units of each owner have been given to threads.
class UnitCursors {
public:
  /// Begins for units that belong to so many homes, or to nobody (Units.cpp).
  void reset(const std::vector<pikoir_unit> &units, int64_t homes,
             pikoir_input &input);

private:
  struct alignas(64) Line {
    pikoir_cursor cursor;
  };
  std::unique_ptr<Line[]> lines_;
  int64_t room_ = 0;
};

class Serial;         // Serial.h
struct PrivateCopies; // PrivateCopies.h
struct PrivateImages; // PrivateImages.h

struct Kernel {
  Kernel();
  ~Kernel();
  int32_t stage = 0;
  int32_t source = -1; ///< This is the AssignBin of a source.
  size_t statsIndex = 0;
  // In ticks: when begin was called, when it and the units had ended.
  int64_t started = 0, begun = 0, ended = 0;

  // From begin to end.
  Stream stream;
  pikoir_input input{};
  std::unique_ptr<InputMirror> mirror; ///< Null: generated code sees `input`.

  // From begin until all outputs are gathered.
  Array<int64_t> offsets;
  /// Position to item; none = identity, or that nobody asks.
  Array<uint32_t> order;
  /// Position to where the item lies, if it is not the item's number.
  Array<uint32_t> places;
  Array<pikoir_call> calls; ///< If Process takes a list.
  std::vector<pikoir_unit> units;
  UnitCursors cursors;
  int64_t positions = 0;
  /// Position to its place in emission order; none = identity.
  Array<uint32_t> rank;
  int64_t rankSize = 0; ///< Ranks are below.
  Keys keys;            ///< Of the items.
  /// For each port, records kept in each slot; none = not needed.
  std::vector<Array<uint32_t>> counts;
  int32_t pendingOutputs = 0;
  bool open = false;
  /// Of a stage that collects and that ranks share: of each slot its bin, or
  /// the rank, and its number there.
  Array<uint64_t> slotNames;

  std::vector<std::unique_ptr<Lane>> lanes;
  size_t activeLanes = 0; ///< The first ones, which threads of this run take.
  /// Of each reduction of the stage; they stay from run to run.
  std::vector<std::unique_ptr<PrivateCopies>> copies;
  /// Of each selection of the stage; they stay from run to run.
  std::vector<std::unique_ptr<PrivateImages>> images;
  int32_t mostThreads = INT32_MAX; ///< That may run this launch.
  /// If it holds loops in two versions; it stays from run to run.
  std::unique_ptr<Autotuner> tuner;

  // On a cycle.
  bool firstRound = true;
  uint32_t launch = 0;            ///< Of the stages of the cycle that collect.
  std::shared_ptr<Serial> serial; ///< Warm, if such launches have been.
  bool runsSerially = false;      ///< This launch is one.
  bool isMeasured = false;        ///< If it is small: by the profile.
  double positionTicks = 0;       ///< What a position takes in them, about.

  /// Slots of unit u are [slotBegin(u), slotBegin(u + 1)).
  int64_t slotBegin(int64_t unit) const {
    if (units.empty())
      return 0;
    if (unit == static_cast<int64_t>(units.size()))
      return calls ? units.back().bucket_end : units.back().end;
    return calls ? units[unit].bucket_begin : units[unit].begin;
  }
  int64_t slots() const {
    return slotBegin(static_cast<int64_t>(units.size()));
  }

  /// Frees what a run holds; lanes stay.
  void clear();
};

// --- Writer.cpp -------------------------------------------------------------

/// Makes sure that there is a lane for each thread that can open a unit.
void prepareLanes(pikort_pipeline &p, Kernel &kernel);
/// The lane of serial launches, ready for the first one.
Lane &prepareSerialLane(pikort_pipeline &p, Kernel &kernel);
/// Reports a mistake of generated code.
void badCall(const Lane &lane, BadCall which);
/// Reports that `bytes` were refused, to the lane's stage or to another one.
void outOfMemory(const Lane &lane, int64_t bytes, int32_t stage = -1);

// --- Reorder.cpp
// --------------------------------------------------------------

/// What pikoir_append and pikoir_place do in iterations.
uint8_t *reorderAppend(Lane &lane, int32_t port);
void reorderPlace(Lane &lane, int32_t port, int64_t bucket);

// --- Local.cpp --------------------------------------------------------------

/// Opens, and ends, the kernels of the stages that run in this one.
void beginLocals(pikort_pipeline &p, Kernel &host);
void endLocals(pikort_pipeline &p, Kernel &host, int32_t status);
/// Makes room for so many more records of a local edge. False if memory is
/// refused.
bool growLocal(Lane &lane, int32_t port, int64_t count);

// --- Join.cpp ---------------------------------------------------------------

/// Throws unless `count` primitives, or pairs, can be numbered.
[[noreturn]] void failCount(const Stage &stage, int64_t count);
inline void checkCount(const Stage &stage, int64_t count) {
  if (count > UINT32_MAX) [[unlikely]]
    failCount(stage, count);
}
/// The first pair of each item of a stream that has pairs, and the end.
Array<uint32_t> pairStarts(Memory &memory, const Items &items);
/// True if the producer must note what each of its slots emits.
bool needsCounts(const pikort_pipeline &p, const Edge &edge);
/// What a kernel emitted, in lineage order; frees it there.
Stream gatherEdge(pikort_pipeline &p, const Edge &edge);

/// The same for an edge from a stage of a loop, in the order of emission, with
/// how many records each slot emitted and, if there are several ports, their
/// ordinals.
struct PortRecords {
  Stream stream;
  Array<uint32_t> counts, ordinals;
};
PortRecords takePort(pikort_pipeline &p, const Edge &edge);

/// What has come into a stage, in lineage order; inside a cycle only what the
/// cycle has emitted, unless `fromOutside`.
Stream gatherInputs(pikort_pipeline &p, const Stage &stage, bool fromOutside);
// --- Merge.cpp --------------------------------------------------------------

/// The input of a stage from several streams, in the order of their keys; takes
/// what they hold.
Stream mergeStreams(pikort_pipeline &p, std::vector<Stream> &streams,
                    const Stage &stage);
/// For each stream, the place of each item in the order of all.
using Places = std::vector<Array<uint32_t>>;
/// That is, of all their keys.
Places mergePlaces(pikort_pipeline &p, std::vector<Stream> &streams);
/// The same as mergeStreams, without keys, where each item's place is known.
Stream placeStreams(pikort_pipeline &p, std::vector<Stream> &streams,
                    Places places, const Stage &stage);

// --- Buckets.cpp
// --------------------------------------------------------------

/// The buckets that the AssignBin of a source has found; throws.
Stream gatherBuckets(pikort_pipeline &p, int32_t source);

/// Sets the kernel's positions, order and offsets, and rank if `rankNeeded`.
void binItems(pikort_pipeline &p, const Stage &stage, Kernel &kernel,
              bool rankNeeded);

// --- Units.cpp --------------------------------------------------------------

/// Cuts the positions into calls, if Process takes a list, and units.
void cutUnits(pikort_pipeline &p, const Stage &stage, Kernel &kernel);

// --- State.cpp --------------------------------------------------------------

/// Fills `bytes` with copies of a record, or with zeros.
void fill(int32_t threads, uint8_t *to, int64_t bytes,
          const std::vector<uint8_t> &record);
/// Allocates images and buffers sized by sources; throws.
void prepareState(pikort_pipeline &p);
/// Of a stage that clears images: clears what its first kernel will not.
void beginClears(pikort_pipeline &p, Kernel &kernel);
/// Clears the images of stages that had no kernel, as after an error.
void endClears(pikort_pipeline &p);

// --- Run.cpp ----------------------------------------------------------------

/// Makes room for what will be gathered from a kernel, once it has units.
void prepareOutputs(pikort_pipeline &p, const Stage &stage, Kernel &kernel);
/// Gives the slots of a stage that collects names that all ranks know.
void nameSlots(pikort_pipeline &p, const Stage &stage, Kernel &kernel);
/// The same of a stage that runs in the kernel of another one, by that one's
/// bins.
void nameLocalSlots(pikort_pipeline &p, const Kernel &host, Kernel &kernel,
                    int64_t slots);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_KERNEL_H
