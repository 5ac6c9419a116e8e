// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Units.cpp - Cuts positions into calls and units --------------------===//
//
// A unit is what one thread takes at a time: neighbouring buckets until there
// is enough work in them, or a part of a bucket that may be split. Where
// Process takes a list, calls take the place of buckets' positions. Schedules
// say who runs a unit: those of DirectMap have a home, a core that gets
// neighbours, as many primitives as the others; those of Serialize are the
// first core's. A core without work takes what others have not begun, so that
// nobody waits for a core whose primitives take longer. How units are cut, and
// who runs them, is never seen in a result.
//
//===----------------------------------------------------------------------===//

#include "common/JoinRules.h"
#include "cpu/Kernel.h"
#include "ranks/Ranks.h"

#include <algorithm>
#include <atomic>

#include <omp.h>

using namespace piko::rt;

namespace {

// Owners of units that have no home.
constexpr int64_t nobody = -1;    ///< Any thread takes the next one.
constexpr int64_t firstCore = -2; ///< The first thread runs it, and no other.
constexpr int64_t unmapped = 0;   ///< Gets a home when all are cut.

/// Positions in a unit: enough units to balance the threads, enough work in
/// each to be worth it, a multiple of any lanes.
int64_t unitSize(const pikort_pipeline &p, const Stage &stage,
                 const BinSchedule &schedule, int64_t positions) {
  if (schedule.tileSplit > 0 && !stage.sharesTile)
    return schedule.tileSplit;
  if (int64_t blocks = cpuOf(p).blocksAtOnce)
    return piko::join::blockUnitSize(0, positions, blocks);
  int64_t share = positions / (int64_t(p.threads) * 8);
  // One of a few primitives may have most of the domain's pixels.
  int64_t most = stage.selections.empty() ? 1024 : 64;
  return std::clamp<int64_t>((share + 15) / 16 * 16, 16, most);
}

/// Buckets or calls in a unit, at most `most`. A block takes one after the
/// other, so that few in each keep all multiprocessors busy.
int64_t mostTogether(const pikort_pipeline &p, int64_t count, int64_t most) {
  int64_t blocks = cpuOf(p).blocksAtOnce;
  return blocks == 0 ? most
                     : std::clamp<int64_t>(count / (4 * blocks), 1, most);
}

class Cutter {
public:
  Cutter(pikort_pipeline &p, const Stage &stage, Kernel &kernel)
      : p_(p), stage_(stage), kernel_(kernel), units_(kernel.units),
        offsets_(kernel.offsets.data()) {}

  void cutBuckets() {
    const BinSchedule &schedule = stage_.scheduleOf(0);
    if (!stage_.binSchedules && schedule.kind == PIKOIR_SERIALIZE &&
        !(p_.ranks && stage_.visitsAll))
      return add(0, stage_.buckets, 0, kernel_.positions, firstCore);
    int64_t chunk = sizeOf(schedule);
    // What waits for a bin may do much, whatever there is in it.
    int64_t most = mostTogether(p_, stage_.buckets, stage_.hosts ? 16 : 1024);
    int64_t first = 0; // of the group that is not yet added
    int64_t owner = nobody;
    auto flush = [&](int64_t bucket) {
      if (first < bucket)
        add(first, bucket, offsets_[first], offsets_[bucket], owner);
      first = bucket;
    };
    for (int64_t bucket = 0; bucket < stage_.buckets; ++bucket) {
      int64_t begin = offsets_[bucket], end = offsets_[bucket + 1];
      if (stage_.visitsAll && !owns(bucket / stage_.tiles)) {
        flush(bucket);
        first = bucket + 1;
        continue;
      }
      const BinSchedule &now = stage_.scheduleOf(bucket / stage_.tiles);
      int64_t nowOwner = ownerOf(now);
      if (owner != nowOwner)
        flush(bucket);
      owner = nowOwner;
      if (stage_.binSchedules)
        chunk = sizeOf(now);
      if (end - begin > chunk && splits(now)) {
        flush(bucket);
        for (int64_t i = begin; i < end; i += chunk)
          add(bucket, bucket + 1, i, std::min(end, i + chunk), owner);
        first = bucket + 1;
      } else if (now.kind != PIKOIR_SERIALIZE &&
                 (end - offsets_[first] >= chunk ||
                  bucket + 1 - first >= most)) {
        flush(bucket + 1);
      }
    }
    flush(stage_.buckets);
  }

  void cutCalls() {
    makeCalls();
    int64_t first = 0; // of the group that is not yet added
    int64_t owner = nobody;
    auto flush = [&](int64_t call) {
      if (first < call)
        add(first, call, kernel_.calls[first].begin,
            kernel_.calls[call - 1].end, owner, /*calls=*/true);
      first = call;
    };
    int64_t calls = kernel_.calls.size();
    const int64_t most = mostTogether(p_, calls, 16);
    for (int64_t call = 0; call < calls; ++call) {
      const pikoir_call &now = kernel_.calls[call];
      const BinSchedule &schedule = stage_.scheduleOf(now.bin);
      int64_t nowOwner = ownerOf(schedule);
      if (owner != nowOwner)
        flush(call);
      owner = nowOwner;
      if (schedule.kind == PIKOIR_SERIALIZE)
        continue;
      // A call may do much, whatever its list.
      bool enough = now.end - kernel_.calls[first].begin >= sizeOf(schedule) ||
                    call + 1 - first >= most;
      bool sameBin = call + 1 < calls && kernel_.calls[call + 1].bin == now.bin;
      if (enough && (!sameBin || stage_.splits()))
        flush(call + 1);
    }
    flush(calls);
  }

  /// Gives each core neighbouring units of those that are mapped, as many
  /// positions as the others. A bucket counts as well: there may be much to do
  /// where there is nothing in it.
  void mapUnits() {
    auto weigh = [](const pikoir_unit &unit) {
      return unit.end - unit.begin + unit.bucket_end - unit.bucket_begin;
    };
    int64_t all = 0, before = 0;
    for (const pikoir_unit &unit : units_)
      all += unit.owner == unmapped ? weigh(unit) : 0;
    for (pikoir_unit &unit : units_) {
      if (unit.owner != unmapped)
        continue;
      int64_t weight = weigh(unit);
      unit.owner = std::min<int64_t>(
          (before + weight / 2) * p_.threads / std::max<int64_t>(all, 1),
          p_.threads - 1); // one without weight may be the last
      before += weight;
    }
  }

private:
  /// Whether this rank runs a bin.
  bool owns(int64_t bin) const {
    return !p_.ranks || p_.ranks->owns(stage_, bin);
  }
  int64_t ownerOf(const BinSchedule &schedule) const {
    if (schedule.kind == PIKOIR_SERIALIZE)
      return firstCore;
    // A thread that selects takes ascending units, and so none of another's.
    return schedule.kind == PIKOIR_DIRECT_MAP && stage_.selections.empty()
               ? unmapped
               : nobody;
  }
  /// Whether threads may share one of its bins.
  bool splits(const BinSchedule &schedule) const {
    return stage_.splits() && schedule.kind != PIKOIR_SERIALIZE &&
           (schedule.kind != PIKOIR_DIRECT_MAP || stage_.bins() == 1);
  }
  int64_t sizeOf(const BinSchedule &schedule) const {
    return unitSize(p_, stage_, schedule, kernel_.positions);
  }
  void add(int64_t bucketBegin, int64_t bucketEnd, int64_t begin, int64_t end,
           int64_t owner, bool calls = false) {
    if (begin == end && !stage_.visitsAll && !calls)
      return;
    units_.push_back({bucketBegin, bucketEnd, begin, end, owner});
  }

  void makeCalls() {
    int64_t calls = 0;
    forBins([&](int64_t, int64_t count, int64_t batch) {
      calls += piko::join::callCount(count, batch, /*runsEmpty=*/true);
    });
    kernel_.calls = Array<pikoir_call>(p_.memory, calls);
    calls = 0;
    forBins([&](int64_t bin, int64_t count, int64_t batch) {
      int64_t begin = offsets_[bin], end = begin + count;
      do {
        int64_t next = end - begin > batch ? begin + batch : end;
        kernel_.calls[calls++] = {bin, begin, next};
        begin = next;
      } while (begin < end);
    });
  }

  /// Calls body(bin, positions, batch) for the bins that run.
  void forBins(auto &&body) {
    for (int64_t bin = 0; bin < stage_.bins(); ++bin) {
      const BinSchedule &schedule = stage_.scheduleOf(bin);
      int64_t count = offsets_[bin + 1] - offsets_[bin];
      if (count > 0 || (schedule.everyBin && kernel_.firstRound && owns(bin)))
        body(bin, count, piko::join::callSize(schedule.batch, count));
    }
  }

  pikort_pipeline &p_;
  const Stage &stage_;
  Kernel &kernel_;
  std::vector<pikoir_unit> &units_;
  const int64_t *offsets_;
};

} // namespace

void piko::rt::cutUnits(pikort_pipeline &p, const Stage &stage,
                        Kernel &kernel) {
  kernel.units.clear();
  Cutter cutter(p, stage, kernel);
  if (stage.takesList())
    cutter.cutCalls();
  else
    cutter.cutBuckets();
  cutter.mapUnits();
}

// --- Who runs a unit ---------------------------------------------------------

int64_t pikoir_thread(void) { return omp_get_thread_num(); }
int64_t pikoir_team(void) { return omp_get_num_threads(); }

/// Where the cursor of an owner is among all.
static int64_t indexOf(int64_t owner) {
  return owner == nobody      ? 1
         : owner == firstCore ? 2
                              : PIKOIR_CURSOR_HOMES + owner;
}

void UnitCursors::reset(const std::vector<pikoir_unit> &units, int64_t homes,
                        pikoir_input &input) {
  static_assert(sizeof(Line) == sizeof(pikoir_cursor));
  if (room_ < homes) {
    lines_ = std::make_unique<Line[]>(PIKOIR_CURSOR_HOMES + homes);
    room_ = homes;
  }
  for (int64_t i = 0; i < PIKOIR_CURSOR_HOMES + homes; ++i)
    lines_[i].cursor = {};
  lines_[0].cursor.end = static_cast<int64_t>(units.size());
  input.homes = 0;
  for (size_t unit = units.size(); unit-- > 0;) {
    pikoir_cursor &cursor = lines_[indexOf(units[unit].owner)].cursor;
    cursor.next = static_cast<int64_t>(unit);
    cursor.end = std::max(cursor.end, static_cast<int64_t>(unit + 1));
    if (units[unit].owner != nobody)
      input.homes = homes;
  }
  input.cursors = &lines_[0].cursor;
}

/// The next unit of an owner, or -1 at the end.
static int64_t take(const pikoir_input &input, int64_t owner) {
  pikoir_cursor &cursor = input.cursors[indexOf(owner)];
  std::atomic_ref<int64_t> next(cursor.next);
  while (next.load(std::memory_order_relaxed) < cursor.end) {
    int64_t unit = next.fetch_add(1, std::memory_order_relaxed);
    if (unit < cursor.end && input.units[unit].owner == owner)
      return unit;
  }
  return -1;
}

int64_t pikoir_next_unit(const pikoir_input *input) {
  if (!input->cursors)
    return -1; // there is nothing to do after an error
  int64_t unit = -1;
  auto takes = [&](int64_t owner) {
    unit = take(*input, owner);
    return unit >= 0;
  };
  if (input->homes == 0)
    return takes(nobody) ? unit : -1;
  int64_t thread = pikoir_thread(), team = pikoir_team();
  if (thread == 0 && takes(firstCore))
    return unit;
  // There may be fewer threads than homes.
  for (int64_t home = thread; home < input->homes; home += team)
    if (takes(home))
      return unit;
  if (takes(nobody))
    return unit;
  for (int64_t home = 0; home < input->homes; ++home)
    if (takes(home))
      return unit;
  return -1;
}

// --- Schedules that depend on the bin ---------------------------------------

/// The stage of a schedule, or null and an error.
static Stage *findScheduled(pikort_pipeline *p, int32_t stage) noexcept {
  if (Stage *found = p->findStage(stage))
    return found;
  guarded(p, "run", [&] {
    throw Failure{PIKORT_BAD_PROGRAM,
                  "expected the number of a stage, but got " +
                      std::to_string(stage)};
  });
  return nullptr;
}

extern "C" {

int64_t pikoir_begin_schedule(pikort_pipeline *p, int32_t stage) {
  Stage *found = findScheduled(p, stage);
  if (!found)
    return 0;
  int32_t code = guarded(p, "stage " + quoted(found->name), [&] {
    found->binSchedules = Array<BinSchedule>(p->memory, found->bins());
    for (int64_t bin = 0; bin < found->bins(); ++bin)
      found->binSchedules[bin] = found->schedule;
  });
  return code == PIKORT_OK ? found->bins() : 0;
}

void pikoir_schedule_bin(pikort_pipeline *p, int32_t stage, int64_t bin,
                         int32_t kind, int64_t tileSplit, int64_t batch,
                         int32_t everyBin) {
  Stage *found = findScheduled(p, stage);
  if (!found)
    return;
  guarded(p, "run", [&] {
    std::string who =
        "stage " + quoted(found->name) + ", bin " + std::to_string(bin) + ": ";
    if (bin < 0 || bin >= found->binSchedules.size() ||
        kind < PIKOIR_LOAD_BALANCE || kind > PIKOIR_ALL)
      throw Failure{PIKORT_BAD_PROGRAM,
                    who + "expected a bin and a kind of schedule that exist, "
                          "after pikoir_begin_schedule"};
    if (found->host >= 0 || found->hosts)
      throw Failure{PIKORT_BAD_PROGRAM,
                    who + "expected one schedule for all bins, because it is "
                          "at the end of a local edge"};
    if (tileSplit < 0)
      throw Failure{PIKORT_INVALID_ARGUMENT,
                    who + "expected a tile split of at least 0, but got " +
                        std::to_string(tileSplit)};
    bool batched = batch != PIKOIR_NO_BATCH;
    if (batched && batch < 1)
      throw Failure{PIKORT_INVALID_ARGUMENT,
                    who + "expected a batch of at least 1, but got " +
                        std::to_string(batch)};
    found->binSchedules[bin] = {kind, everyBin != 0, tileSplit,
                                batched ? batch : 0};
  });
}

} // extern "C"
