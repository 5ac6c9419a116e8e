// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Pipeline.h - What a pipeline declared, and its status --------------===//
//
// The runtime's own form of a pipeline: the program's declarations, checked
// and completed once by finish(), what the host bound, and the status of the
// run. How kernels run is the executor's matter.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_PIPELINE_H
#define PIKO_RUNTIME_COMMON_PIPELINE_H

#include "common/Accelerator.h"
#include "common/Contracts.h"
#include "common/Counters.h"
#include "common/Executor.h"
#include "common/Profile.h"
#include "pikort/abi_layout.h"

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace piko::rt {

/// An error, thrown inside the runtime and caught at its boundary.
struct Failure {
  int32_t code;
  std::string message;
};

struct Field {
  std::string name;
  int32_t type;
  int64_t offset, elements, stride;
};

struct Record {
  bool declared = false;
  std::string name;
  int64_t size = 0, align = 1;
  std::vector<Field> fields;
  bool padded = true; ///< Some bytes belong to no field.
  // In checking mode: the record without the lineage, which the host knows.
  int32_t host = -1;
  int64_t lineageOffset = 0;
};

struct State {
  bool declared = false;
  std::string name;
  int32_t kind = 0, record = 0, rank = 0, perSource = -1;
  bool bound = false;
  bool written = false;  ///< A buffer that kernels change.
  bool unused = false;   ///< A buffer that no kernel uses.
  bool indexed = false;  ///< A buffer that contracts are about.
  bool internal = false; ///< An image that the host does not see.
  /// The stage in whose bins ranks use pixels that they own, and no others.
  int32_t commonStage = -1;
  bool onDevice = false;      ///< What is bound is a device's memory.
  std::vector<uint8_t> clear; ///< One record, or empty.
  std::vector<uint8_t> bytes; ///< A constant's, ...
  bool changed = true;        ///< ... since a frame of a device took them.
  Array<uint8_t> owned;       ///< An image's, or of a buffer that we allocate.
  Array<uint8_t> mirror;      ///< What a device sees of the host's own memory.
  /// What frames of a device use in place of `owned` or of the host's memory.
  DeviceBytes twin;
  bool twinIsCurrent = false; ///< It has what the state should have, ...
  bool hostIsCurrent = true;  ///< ... which `owned` does, too.
  uint8_t *hosts = nullptr;   ///< The host's memory, while another is used.
  pikoir_state view{};
  int64_t version = 0; ///< How often the host may have changed a buffer.

  /// For how many elements there is memory: kernels may read the first one
  /// where an index is wrong (piko.contract).
  int64_t roomFor(int64_t count) const {
    return count == 0 && indexed ? 1 : count;
  }

  /// Memory of our own, or none, of which a device has nothing yet.
  void own(Array<uint8_t> memory) {
    owned = std::move(memory);
    twinIsCurrent = false;
    hostIsCurrent = true;
  }
};

/// Where `owned`, or its twin, is older than the other one, makes it the same,
/// in the order of the pipeline's stream; the first waits. Throw.
void bringToHost(pikort_pipeline &p, State &state);
void bringToDevice(pikort_pipeline &p, State &state);

struct Edge {
  int32_t producer = 0, port = 0, consumer = 0;
  int32_t gather = PIKOIR_PERMUTE;
  int32_t keyWidth = 0;      ///< 64-bit words of its primitives' keys.
  bool insideLoop = false;   ///< Both ends are in one loop.
  bool leavesStrips = false; ///< Only the producer is in a group of strips.
  bool local = false;        ///< The consumer runs in the producer's kernel.
  bool exchanged = false;    ///< Between ranks, if there are several.
  bool keyed() const { return keyWidth > 0; }
};

/// Stages on a common cycle of edges.
struct CycleShape {
  bool declared = false;
  std::vector<int32_t> stages; ///< Those that collect in the order of turns.
};

/// A cycle of stages that do not collect.
struct LoopShape {
  bool declared = false;
  std::vector<int32_t> stages;
  int32_t keyWidth = 0; ///< Of what comes in; 0 = it has no keys.
  int32_t cycle = -1;   ///< That it is, or is a part of.
  bool ordered = false; ///< The order across its hops can be seen.
};

/// Stages that take the primitives of a source strip by strip.
struct StripGroup {
  bool declared = false;
  int32_t source = 0;
  int64_t chunk = 0; ///< Most primitives in a strip; 0 = as memory allows.
  std::vector<int32_t> stages;
  bool writes = false; ///< Some stage writes state.
};

/// What the code takes for granted of a constant, or of a buffer's size.
struct Fixed {
  int32_t state;
  std::string field;
  int64_t offset, size; ///< In bytes; size 0 = the number of elements.
  int64_t bits;
};

/// How a stage, or one of its bins, runs.
struct BinSchedule {
  int32_t kind = PIKOIR_LOAD_BALANCE;
  bool everyBin = false;
  int64_t tileSplit = 0;
  int64_t batch = 0; ///< 0 = the whole list.
};

struct Wait {
  int32_t stage, waitsFor;
};

/// What is said of a port whose edge may be declared later.
struct PortJoin {
  int32_t producer, port;
  bool local;
  int32_t gather = PIKOIR_PERMUTE, keyWidth = 0;
};

struct Source {
  bool declared = false;
  int32_t stage = 0;
  const uint8_t *data = nullptr;
  int64_t count = 0;     ///< 0 until the host binds some
  int64_t version = 0;   ///< How often it has
  bool onDevice = false; ///< What is bound is a device's memory.
  Array<uint8_t> mirror; ///< What a device sees of the host's own memory, ...
  DeviceBytes twin;      ///< ... and what frames of it see, ...
  bool twinIsCurrent = false;           ///< ... if it is what was bound.
  const uint8_t *hosts = nullptr;       ///< That memory meanwhile.
  int64_t stripBegin = 0, stripEnd = 0; ///< The strip that runs, or all, ...
  int64_t begin = 0, end = 0;           ///< ... and what of it this rank has.
  bool exchanged = false;               ///< Between ranks: its bins.
  void takeStrip(int64_t first, int64_t last) {
    stripBegin = begin = first;
    stripEnd = end = last;
  }
};

/// What a kernel does to a field of a piece of state: see PrivateCopies.h.
struct Reduction {
  bool declared = false;
  int32_t state = 0;
  std::vector<uint8_t> identity; ///< One record.
  int32_t runShift = 0;
  bool often = false;
  pikoir_combine combine = nullptr;
};

/// What a kernel selects pixels of: see PrivateImages.h.
struct Selection {
  bool declared = false;
  std::vector<int32_t> images; ///< States; the first one has the key.
  bool often = false;
  pikoir_select select = nullptr;
};

struct Stage {
  bool declared = false;
  std::string name;
  int32_t record = 0, flags = 0;
  int64_t tileSize = 0;
  BinSchedule schedule; ///< Of all bins.
  std::array<int64_t, 4> binSize{};
  int32_t root = 0;        ///< Of the lineage that it starts.
  int32_t keyWidth = 0;    ///< 64-bit words of its items' keys, 0 = none.
  int32_t partition = 0;   ///< Which ranks run it: a pikoir_partition.
  int32_t owners = 0;      ///< Of bins: a pikort_owners, or 0.
  int32_t launchOrder = 0; ///< Of programs for ranks: when its kernel runs.
  std::vector<Reduction> reductions; ///< Of its kernel, by private copy.
  std::vector<Selection> selections; ///< Of its kernel.
  // Completed by finish():
  std::vector<int32_t> sources; ///< That feed it, ascending.
  std::vector<int32_t> inputs;  ///< Edges that end here, as declared.
  std::vector<int32_t> outputs; ///< The edge of each port, or -1.
  int32_t cycle = -1;
  int32_t loop = -1;
  int32_t stripGroup = -1;
  bool sharesTile = false;     ///< A strip is a tile: threads share it.
  int32_t host = -1;           ///< In whose kernel it runs, after local edges.
  int32_t depth = 0;           ///< How many local edges lie before it.
  bool hosts = false;          ///< Other stages run in its kernel, ...
  bool visitsAll = false;      ///< ... some of them for empty bins, too.
  std::vector<int32_t> clears; ///< Images that its first kernel clears.
  // Completed by each run:
  std::array<int64_t, 4> grid{}, tileGrid{};
  int64_t tiles = 1, buckets = 1;
  Array<BinSchedule> binSchedules; ///< If they depend on the bin.

  int64_t bins() const { return buckets / tiles; }
  const BinSchedule &scheduleOf(int64_t bin) const {
    return binSchedules ? binSchedules[bin] : schedule;
  }
  bool takesList() const { return flags & PIKOIR_LIST; }
  bool collects() const { return flags & (PIKOIR_COLLECTS | PIKOIR_LIST); }
  bool ordered() const { return flags & PIKOIR_ORDERED && !unordered(); }
  /// Positions of a bucket may be in several units.
  bool splits() const {
    return flags & PIKOIR_SPLIT && (!ordered() || !selections.empty());
  }
  bool placed() const { return flags & PIKOIR_PLACED; }
  bool writes() const { return flags & PIKOIR_WRITES; }
  bool unordered() const { return flags & PIKOIR_UNORDERED; }
};

/// What the host says of a mapping.
enum class MappingChoice { Measured, Expected, Vectors, Scalar };

/// A loop that a kernel holds in two versions.
struct Mapping {
  int32_t stage = 0, source = -1; ///< Whose kernel, as in pikoir_begin.
  int32_t number = 0;             ///< Of the kernel's.
  size_t kernel = 0;              ///< Of those that have statistics.
  int32_t within = -1; ///< Another one of it, in whose scalar version it is.
  std::string loop;
  bool expected = false;           ///< Vectors are.
  int64_t vectors = 0, scalar = 0; ///< Cycles, as estimated.
  MappingChoice choice = MappingChoice::Measured;
  // What the kernel's Autotuner has found:
  int32_t state = PIKORT_MAPPING_EXPECTED;
  bool chosen = false;
  double ratio = 0; ///< Vectors' time over that of one at a time.
};

struct KernelStats {
  std::string name;
  double milliseconds = 0, joinMilliseconds = 0, waitMilliseconds = 0;
  int64_t launches = 0, parallelLaunches = 0;
  /// Of this run, not yet in the sums.
  int64_t ticks = 0, joinTicks = 0, waitTicks = 0;

  void endRun(double ticksPerMillisecond);
  void reset();
};

struct StageStats {
  int64_t in = 0, placed = 0, out = 0;
};

/// What generated code did wrong between open and close; `a` of the error.
enum class BadCall : int64_t {
  PlaceFirst,    ///< A place before its record.
  Next,          ///< Not one pikoir_next for each position.
  Nested,        ///< pikoir_reorder_begin twice.
  NotReordering, ///< reorder_iteration or reorder_end outside.
  Iteration,     ///< Outside of the range that reorder_begin gave.
  StillReordering
};

/// An error that a kernel found. Kernels are parallel: the one that the
/// sequential program would meet first is kept, whoever reports it first.
struct KernelError {
  int64_t unit;
  int32_t code, stage;
  int64_t a, b;
  /// Of the stage that ran: all of one comes before all after a local edge.
  int32_t depth = 0;
  int64_t bin = -1;           ///< Of the call of Process; -1 = none.
  std::string_view name = {}; ///< Of the stage, if it is part of another.
  int32_t state = -1;         ///< That an index is outside of.
  std::string_view barrier = {};
};

/// Where a run has failed, in the order of the sequential program: the kernel,
/// and what report() compares.
struct ErrorPlace {
  int64_t kernel = 0, depth = 0, unit = -1, stage = 0, bin = 0, state = 0,
          a = 0, b = 0;
};

class Ranks;    // Ranks.h
class Siblings; // Siblings.h

} // namespace piko::rt

struct pikort_pipeline {
  pikort_pipeline();
  ~pikort_pipeline();

  int32_t device = PIKORT_ANY_DEVICE;                 ///< As the host chose.
  std::unique_ptr<piko::rt::Accelerator> accelerator; ///< None = the CPU.
  piko::rt::Memory memory; // next: the arrays below go back to it
  std::string name;
  std::string processor; ///< That the code is for; "" = not said.
  int32_t rank = 0;
  std::vector<piko::rt::Record> records;
  std::vector<piko::rt::State> states;
  std::vector<piko::rt::Stage> stages;
  std::vector<piko::rt::Source> sources;
  std::vector<piko::rt::Edge> edges;
  std::vector<piko::rt::Wait> waits;
  std::vector<piko::rt::PortJoin> joins;
  std::vector<piko::rt::StripGroup> stripGroups;
  std::vector<piko::rt::CycleShape> cycles;
  std::vector<piko::rt::LoopShape> loops;
  int32_t (*runProgram)(pikort_pipeline *) = nullptr;
  std::unique_ptr<piko::rt::Executor> executor;

  bool ready = false; ///< finish() succeeded.
  std::array<int64_t, 4> domain{0, 1, 1, 1};
  int64_t maxExtent = PIKORT_MAX_EXTENT; ///< of the domain in a dimension
  int32_t wantedThreads = 1;             ///< As the host has it.
  int32_t threads = 1; ///< Of a run, as the system gives them.
  double ticksPerMillisecond =
      piko::rt::defaultTickRate;        ///< As the latest run had it.
  int64_t loopLimit = int64_t(1) << 20; ///< Of hops and of rounds.
  int64_t stripSize = 0;                ///< Of all strips; 0 = not said.

  bool timesKernels = false;   ///< Of frames of a device.
  bool hasStaticInput = false; ///< The host's memory stays from run to run.
  void (*unitReport)(void *, const pikort_unit_run *) = nullptr;
  void *unitReportData = nullptr;

  std::vector<piko::rt::Mapping> mappings; ///< By kernel and number.
  std::vector<piko::rt::Fixed> fixed;
  piko::rt::Contracts contracts;
  std::vector<std::unique_ptr<piko::rt::Counter>> counters;
  piko::rt::Profile profile{memory};
  std::vector<piko::rt::KernelStats> kernelStats;
  std::vector<piko::rt::StageStats> stageStats;
  int64_t runs = 0;
  int64_t captureRuns = 0; ///< That began while $PIKO_CAPTURE was set.

  std::string deviceRefusal; ///< Why it is on the processor, if that is news.
  std::string message;
  std::atomic<int32_t> status{0};
  std::atomic<int32_t> reported{0};     ///< Some error that report() noted.
  std::atomic<bool> interrupted{false}; ///< No kernel shall begin.

  // Of a program for ranks:
  int32_t partitionedStages = 0;
  std::unique_ptr<piko::rt::Ranks> ranks; ///< None: a process of its own.
  pikort_program program{};               ///< That made it, but for its name.
  int32_t threadRanks = 0;                ///< In this process; 0 = not said.
  int32_t rankOwners = 0; ///< A pikort_owners, as the host has it.
  std::unique_ptr<piko::rt::Siblings> siblings; ///< These, but for the first.
  int32_t runningKernel = 0; ///< Launch order of the kernel that began last.
  piko::rt::ErrorPlace errorPlace;
  std::string errorName, errorBarrier;

  // Of a run that the host has not waited for:
  bool pending = false;
  /// What it changes for later runs meanwhile.
  std::vector<std::function<void()>> queuedChanges;
  /// How it has ended, where no call has said so yet.
  piko::rt::Failure unsaid{};

  /// In the setup: what runs the grids.
  void useAccelerator(std::unique_ptr<piko::rt::Accelerator> device) {
    accelerator = std::move(device);
    memory.setAccelerator(accelerator.get());
  }

  /// Checks and completes the declarations; throws Failure.
  void finish();
  /// What $PIKO_MAPPINGS says; throws Failure.
  void readMappingSetting();
  /// Computes grids from the domain; throws Failure.
  void computeGrids();

  /// Keeps the first status of a run and its text. Not from a kernel's loop.
  int32_t fail(int32_t code, const std::string &text) noexcept;
  /// Notes an error in a kernel's loop; thread safe.
  void report(const piko::rt::KernelError &error) noexcept;
  /// Turns what was reported into the status; returns the status.
  int32_t settle() noexcept {
    if (reported.load(std::memory_order_relaxed) != PIKORT_OK) [[unlikely]]
      settleReported();
    return status.load(std::memory_order_relaxed);
  }
  /// Forgets the status and the message.
  void clearStatus() noexcept;

  /// Those of the states that the host sees, which come first.
  std::span<const piko::rt::State> hostStates() const {
    size_t count = states.size();
    while (count > 0 && states[count - 1].internal)
      --count;
    return std::span(states).first(count);
  }
  /// The number of a stage's record as the host knows it.
  int32_t hostRecord(int32_t stage) const {
    int32_t record = stages[stage].record, host = records[record].host;
    return host < 0 ? record : host;
  }
  piko::rt::Stage *findStage(int32_t id) {
    return id >= 0 && id < static_cast<int32_t>(stages.size()) ? &stages[id]
                                                               : nullptr;
  }

private:
  std::mutex errorMutex;
  bool hasError = false;
  piko::rt::KernelError error{};

  void settleReported() noexcept;
  void checkDeclared();
  void connect();
  void findJoins();
  void findCycles();
  void findStrips();
  void findLocals();
};

namespace piko::rt {

/// What memory was refused for, if the host said so.
inline std::string memoryLimitText(const pikort_pipeline &p) {
  int64_t limit = p.memory.limit(), budget = p.memory.budget();
  if (budget > 0 && (limit == 0 || budget < limit))
    return ", but the budget is " + std::to_string(budget);
  return limit > 0 ? ", but the limit is " + std::to_string(limit) : "";
}

inline std::string outOfMemoryText(const pikort_pipeline &p,
                                   const std::string &who,
                                   const OutOfMemory &refused) {
  std::string text = who + ": out of memory";
  if (refused.bytes != INT64_MAX)
    text += ": expected " + std::to_string(refused.bytes) + " more bytes";
  return text + memoryLimitText(p);
}

/// Runs `body`, which may throw, and turns what it throws into a status. `who`
/// is a text, or a function that makes one.
template <class Who, class Body>
int32_t guarded(pikort_pipeline *p, const Who &who, Body &&body) noexcept {
  try {
    body();
    return PIKORT_OK;
  } catch (const Failure &failure) {
    return p->fail(failure.code, failure.message);
  } catch (const OutOfMemory &refused) {
    try {
      if constexpr (std::is_invocable_v<const Who &>)
        return p->fail(PIKORT_OUT_OF_MEMORY,
                       outOfMemoryText(*p, who(), refused));
      else
        return p->fail(PIKORT_OUT_OF_MEMORY, outOfMemoryText(*p, who, refused));
    } catch (...) {
      return p->fail(PIKORT_OUT_OF_MEMORY, {});
    }
  } catch (...) {
    return p->fail(PIKORT_OUT_OF_MEMORY, {});
  }
}

/// Before a run, when all state has its size; throws.
void startCounters(pikort_pipeline &p);

/// 'name', for messages.
inline std::string quoted(const std::string &name) { return "'" + name + "'"; }

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_PIPELINE_H
