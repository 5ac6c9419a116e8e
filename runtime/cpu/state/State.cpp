// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- State.cpp - Images and buffers of a run ----------------------------===//

#include "cpu/Kernel.h"
#include "cpu/Parallel.h"
#include "ranks/Ranks.h"

#include <algorithm>
#include <cstring>
#include <numeric>

using namespace piko::rt;

void piko::rt::fill(int32_t threads, uint8_t *to, int64_t bytes,
                    const std::vector<uint8_t> &record) {
  bool zero = std::all_of(record.begin(), record.end(),
                          [](uint8_t byte) { return byte == 0; });
  auto size = zero ? 1 : static_cast<int64_t>(record.size());
  // Chunks of whole records; in each, a first piece that stays in the L1 cache
  // is built by doubling and then copied on.
  int64_t chunk = std::max<int64_t>(1, (int64_t(256) << 10) / size) * size;
  parallelChunks(threads, bytes, chunk, [&](int64_t begin, int64_t end) {
    uint8_t *first = to + begin;
    int64_t length = end - begin;
    if (zero) {
      std::memset(first, 0, static_cast<size_t>(length));
      return;
    }
    std::memcpy(first, record.data(), record.size());
    int64_t piece = std::max<int64_t>(1, 4096 / size) * size;
    for (int64_t done = size; done < length;) {
      int64_t now = std::min({done, piece, length - done});
      std::memcpy(first + done, first, static_cast<size_t>(now));
      done += now;
    }
  });
}

static void fill(pikort_pipeline &p, State &state) {
  fill(p.threads, state.owned.data(), state.owned.size(),
       state.kind == PIKORT_IMAGE ? state.clear : std::vector<uint8_t>());
}

static void allocate(pikort_pipeline &p, State &state) {
  int64_t bytes = p.records[state.record].size;
  bool overflow = false;
  for (int64_t extent : state.view.extent)
    overflow |= __builtin_mul_overflow(bytes, state.roomFor(extent), &bytes);
  if (overflow)
    throw OutOfMemory{INT64_MAX};
  if (uint8_t *common = p.ranks ? p.ranks->commonMemory(state) : nullptr) {
    if (state.owned.data() != common)
      state.own(Array<uint8_t>::borrow(common, bytes));
  } else if (!state.owned || state.owned.size() != bytes ||
             state.owned.isBorrowed()) {
    state.own({}); // before the new one, so that both need not fit
    state.own(Array<uint8_t>(p.memory, bytes, Use::State));
  }
  state.view.data = state.owned.data();
}

static void prepare(pikort_pipeline &p, State &state) {
  if (state.kind == PIKORT_IMAGE) {
    for (int32_t d = 0; d < 4; ++d)
      state.view.extent[d] = d < state.rank ? p.domain[d] : 1;
    state.view.data = nullptr;
    allocate(p, state);
  } else if (state.kind == PIKORT_BUFFER && state.perSource >= 0) {
    state.view = {nullptr, {p.sources[state.perSource].count, 1, 1, 1}};
    allocate(p, state);
  }
}

void piko::rt::prepareState(pikort_pipeline &p) {
  cpuOf(p).cleared.assign(p.stages.size(), false);
  if (p.ranks)
    p.ranks->prepareRun();
  for (State &state : p.states)
    try {
      prepare(p, state);
    } catch (const OutOfMemory &refused) {
      throw Failure{PIKORT_OUT_OF_MEMORY,
                    outOfMemoryText(p, "state " + quoted(state.name), refused)};
    }
}

// --- Images that kernels clear ----------------------------------------------

/// The bins that no unit or call of a kernel is for.
static std::vector<int64_t> findLeftBins(const pikort_pipeline &p,
                                         const Stage &stage,
                                         const Kernel &kernel) {
  std::vector<int64_t> left;
  if (stage.visitsAll && !stage.takesList()) {
    for (int64_t bin = 0; p.ranks && bin < stage.bins(); ++bin)
      if (!p.ranks->owns(stage, bin))
        left.push_back(bin);
    return left;
  }
  std::vector<bool> called(stage.takesList() ? stage.bins() : 0);
  for (int64_t call = 0; call < kernel.calls.size(); ++call)
    called[kernel.calls[call].bin] = true;
  for (int64_t bin = 0; bin < stage.bins(); ++bin)
    if (stage.takesList() ? !called[bin]
                          : kernel.offsets[bin] == kernel.offsets[bin + 1])
      left.push_back(bin);
  return left;
}

/// Consecutive bins of a row of bins.
struct BinRun {
  int64_t first, count;
};

/// As few runs as possible: long rows of pixels are filled faster.
static std::vector<BinRun> findRuns(const Stage &stage,
                                    const std::vector<int64_t> &bins) {
  std::vector<BinRun> runs;
  for (int64_t bin : bins) {
    bool continues = !runs.empty() && bin % stage.grid[0] != 0 &&
                     runs.back().first + runs.back().count == bin;
    if (continues)
      ++runs.back().count;
    else
      runs.push_back({bin, 1});
  }
  return runs;
}

/// Calls body(first, cells) for each row of cells of a run of bins.
static void forRows(const pikort_pipeline &p, const Stage &stage,
                    const BinRun &run, auto &&body) {
  int64_t lo[4], hi[4], bin = run.first;
  for (int32_t d = 0; d < 4; ++d) {
    int64_t size = d < p.rank ? stage.binSize[d] : 0;
    int64_t domain = d < p.rank ? p.domain[d] : 1;
    int64_t bins = d == 0 ? run.count : 1;
    lo[d] = size ? bin % stage.grid[d] * size : 0;
    hi[d] = size ? std::min(lo[d] + bins * size, domain) : domain;
    bin /= stage.grid[d];
  }
  const auto &extent = p.domain;
  for (int64_t w = lo[3]; w < hi[3]; ++w)
    for (int64_t z = lo[2]; z < hi[2]; ++z)
      for (int64_t y = lo[1]; y < hi[1]; ++y)
        body(((w * extent[2] + z) * extent[1] + y) * extent[0] + lo[0],
             hi[0] - lo[0]);
}

/// Clears an image in some bins of a stage.
static void fillBins(pikort_pipeline &p, const Stage &stage, State &state,
                     const std::vector<BinRun> &runs) {
  int64_t size = p.records[state.record].size;
  std::vector<uint8_t> row(static_cast<size_t>(p.domain[0] * size));
  fill(1, row.data(), p.domain[0] * size, state.clear);
  uint8_t *pixels = state.owned.data();
  parallelFor(p.threads, static_cast<int64_t>(runs.size()), [&](int64_t run) {
    forRows(p, stage, runs[run], [&](int64_t at, int64_t cells) {
      std::memcpy(pixels + at * size, row.data(),
                  static_cast<size_t>(cells * size));
    });
  });
}

/// Those of some bins that this rank owns.
static std::vector<int64_t> findOwned(const pikort_pipeline &p,
                                      const Stage &stage,
                                      std::vector<int64_t> bins) {
  std::erase_if(bins, [&](int64_t bin) { return !p.ranks->owns(stage, bin); });
  return bins;
}

void piko::rt::beginClears(pikort_pipeline &p, Kernel &kernel) {
  const Stage &stage = p.stages[kernel.stage];
  if (stage.clears.empty() || cpuOf(p).cleared[kernel.stage])
    return;
  Part before = p.profile.part();
  p.profile.enter(Part::State);
  std::vector<int64_t> left = findLeftBins(p, stage, kernel);
  for (int32_t id : stage.clears)
    if (p.ranks && p.ranks->clearsOwnedOnly(stage, id))
      fillBins(p, stage, p.states[id],
               findRuns(stage, findOwned(p, stage, left)));
    else if (static_cast<int64_t>(left.size()) == stage.bins())
      fill(p, p.states[id]);
    else
      fillBins(p, stage, p.states[id], findRuns(stage, left));
  cpuOf(p).cleared[kernel.stage] = true;
  kernel.input.clears = 1;
  p.profile.enter(before);
}

/// When a run begins.
static void clear(pikort_pipeline &p, int32_t id) {
  State &state = p.states[id];
  const Stage *stage =
      state.commonStage < 0 ? nullptr : &p.stages[state.commonStage];
  if (!p.ranks || !stage || !p.ranks->clearsOwnedOnly(*stage, id))
    return fill(p, state);
  std::vector<int64_t> bins(static_cast<size_t>(stage->bins()));
  std::iota(bins.begin(), bins.end(), 0);
  fillBins(p, *stage, state, findRuns(*stage, findOwned(p, *stage, bins)));
}

void piko::rt::endClears(pikort_pipeline &p) {
  std::vector<bool> &cleared = cpuOf(p).cleared;
  for (size_t s = 0; s < cleared.size(); ++s)
    for (int32_t id : p.stages[s].clears)
      if (!cleared[s] && p.states[id].owned)
        fill(p, p.states[id]);
  cleared.clear();
}

extern "C" {

void pikoir_clear(pikort_pipeline *p, int32_t id) {
  guarded(p, "run", [&] {
    State *state =
        static_cast<size_t>(id) < p->states.size() ? &p->states[id] : nullptr;
    if (!state || (state->kind != PIKORT_IMAGE && state->perSource < 0))
      throw Failure{PIKORT_BAD_PROGRAM,
                    "expected an image, or a buffer that is sized by a source, "
                    "to clear, but got state " +
                        std::to_string(id)};
    Part before = p->profile.part();
    p->profile.enter(Part::State);
    clear(*p, id);
    p->profile.enter(before);
  });
}

const pikoir_state *pikoir_get_state(pikort_pipeline *p, int32_t id) {
  return &p->states[id].view;
}

const int64_t *pikoir_domain(pikort_pipeline *p) { return p->domain.data(); }

const int64_t *pikoir_grid(pikort_pipeline *p, int32_t stage) {
  return p->stages[stage].grid.data();
}

const int64_t *pikoir_tile_grid(pikort_pipeline *p, int32_t stage) {
  return p->stages[stage].tileGrid.data();
}

int32_t pikoir_threads(pikort_pipeline *p) {
  return checkerOf(*p) ? 1 : cpuOf(*p).activeThreads;
}

} // extern "C"
