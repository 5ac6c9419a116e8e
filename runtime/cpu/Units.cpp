// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Units.cpp - Cuts positions into calls and units --------------------===//
//
// A unit is what one thread takes at a time: neighbouring cells until there is
// enough work in them, or a part of a cell that may be split. Where Process
// takes a list, calls take the place of cells' positions. How units are cut is
// never seen in a result.
//
//===----------------------------------------------------------------------===//

#include "cpu/Kernel.h"

#include <algorithm>

using namespace piko::rt;

namespace {

/// Positions in a unit: enough units to balance the threads, enough work in
/// each to be worth it, a multiple of any lanes.
int64_t unitSize(const pikort_pipeline &p, const Stage &stage,
                 const BinSchedule &schedule, int64_t positions) {
  if (schedule.tileSplit > 0 && !stage.sharesTile)
    return schedule.tileSplit;
  int64_t share = positions / (int64_t(p.threads) * 8);
  return std::clamp<int64_t>((share + 15) / 16 * 16, 16, 1024);
}

class Cutter {
public:
  Cutter(pikort_pipeline &p, const Stage &stage, Kernel &kernel)
      : p_(p), stage_(stage), kernel_(kernel), units_(kernel.units),
        offsets_(kernel.offsets.data()) {}

  void cutCells() {
    if (!stage_.binSchedules && isSerial(0))
      return add(0, stage_.cells, 0, kernel_.positions);
    int64_t chunk = sizeOf(0);
    // What waits for a bin may do much, whatever there is in it.
    int64_t most = stage_.hosts ? 16 : 1024;
    int64_t first = 0; // of the group that is not yet added
    bool serial = false;
    auto flush = [&](int64_t cell) {
      if (first < cell)
        add(first, cell, offsets_[first], offsets_[cell]);
      first = cell;
    };
    for (int64_t cell = 0; cell < stage_.cells; ++cell) {
      int64_t begin = offsets_[cell], end = offsets_[cell + 1];
      if (stage_.binSchedules) {
        int64_t bin = cell / stage_.tiles;
        if (serial != isSerial(bin))
          flush(cell);
        serial = isSerial(bin);
        if (serial)
          continue;
        chunk = sizeOf(bin);
      }
      if (stage_.splits() && end - begin > chunk) {
        flush(cell);
        for (int64_t i = begin; i < end; i += chunk)
          add(cell, cell + 1, i, std::min(end, i + chunk));
        first = cell + 1;
      } else if (end - offsets_[first] >= chunk || cell + 1 - first >= most) {
        flush(cell + 1);
      }
    }
    flush(stage_.cells);
  }

  void cutCalls() {
    makeCalls();
    int64_t first = 0; // of the group that is not yet added
    bool serial = false;
    auto flush = [&](int64_t call) {
      if (first < call)
        units_.push_back({first, call, kernel_.calls[first].begin,
                          kernel_.calls[call - 1].end});
      first = call;
    };
    int64_t calls = kernel_.calls.size();
    for (int64_t call = 0; call < calls; ++call) {
      const pikoir_call &now = kernel_.calls[call];
      if (serial != isSerial(now.bin))
        flush(call);
      serial = isSerial(now.bin);
      if (serial)
        continue;
      // A call may do much, whatever its list.
      bool enough = now.end - kernel_.calls[first].begin >= sizeOf(now.bin) ||
                    call + 1 - first >= 16;
      bool sameBin = call + 1 < calls && kernel_.calls[call + 1].bin == now.bin;
      if (enough && (!sameBin || stage_.splits()))
        flush(call + 1);
    }
    flush(calls);
  }

private:
  bool isSerial(int64_t bin) const {
    return stage_.scheduleOf(bin).kind == PIKOIR_SERIALIZE;
  }
  int64_t sizeOf(int64_t bin) const {
    return unitSize(p_, stage_, stage_.scheduleOf(bin), kernel_.positions);
  }
  void add(int64_t cellBegin, int64_t cellEnd, int64_t begin, int64_t end) {
    if (begin < end || stage_.visitsAll)
      units_.push_back({cellBegin, cellEnd, begin, end});
  }

  void makeCalls() {
    int64_t calls = 0;
    forBins([&](int64_t, int64_t count, int64_t batch) {
      calls += std::max<int64_t>(1, (count + batch - 1) / batch);
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
      if (count > 0 || (schedule.everyBin && kernel_.firstRound)) {
        int64_t batch = schedule.batch ? schedule.batch : count;
        body(bin, count, std::clamp<int64_t>(batch, 1, UINT32_MAX));
      }
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
    cutter.cutCells();
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
