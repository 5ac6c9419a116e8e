// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- State.cpp - Images and buffers of a run ----------------------------===//

#include "cpu/Kernel.h"
#include "cpu/Parallel.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

/// Fills `bytes` with copies of a record of `size` bytes, or with zeros.
static void fill(int32_t threads, uint8_t *to, int64_t bytes,
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

static void allocate(pikort_pipeline &p, State &state) {
  int64_t bytes = p.records[state.record].size;
  bool overflow = false;
  for (int64_t extent : state.view.extent)
    overflow |= __builtin_mul_overflow(bytes, extent, &bytes);
  if (overflow)
    throw OutOfMemory{INT64_MAX};
  if (!state.owned || state.owned.size() != bytes) {
    state.owned = {}; // before the new one, so that both need not fit
    state.owned = Array<uint8_t>(p.memory, bytes, Use::State);
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
  for (State &state : p.states)
    try {
      prepare(p, state);
    } catch (const OutOfMemory &refused) {
      throw Failure{PIKORT_OUT_OF_MEMORY,
                    outOfMemoryText(p, "state " + quoted(state.name), refused)};
    }
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
    fill(p->threads, state->owned.data(), state->owned.size(),
         state->kind == PIKORT_IMAGE ? state->clear : std::vector<uint8_t>());
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

const int64_t *pikoir_cell_grid(pikort_pipeline *p, int32_t stage) {
  return p->stages[stage].cellGrid.data();
}

int32_t pikoir_threads(pikort_pipeline *p) {
  return p->checker ? 1 : p->activeThreads;
}

} // extern "C"
