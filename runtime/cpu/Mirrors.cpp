// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Mirrors.cpp - What a device sees of the host's memory --------------===//

#include "cpu/Mirrors.h"
#include "cpu/Parallel.h"

using namespace piko::rt;

static void copy(const pikort_pipeline &p, uint8_t *to, const uint8_t *from,
                 int64_t bytes) {
  parallelChunks(
      p.threads, bytes, int64_t(1) << 20, [&](int64_t begin, int64_t end) {
        std::memcpy(to + begin, from + begin, static_cast<size_t>(end - begin));
      });
}

namespace {

/// What has a mirror, kept from run to run.
struct Original {
  const uint8_t *data;
  int64_t bytes;
  bool onDevice;
};

} // namespace

/// Makes `mirror` the same.
static void fillMirror(pikort_pipeline &p, Array<uint8_t> &mirror,
                       const Original &from, bool isFrame) {
  if (!mirror || mirror.size() != from.bytes) {
    mirror = {};
    mirror = Array<uint8_t>(p.memory, from.bytes, Use::State);
  }
  if (from.bytes == 0)
    return;
  if (from.onDevice)
    p.accelerator->copy(mirror.data(), from.data, from.bytes);
  else if (isFrame)
    p.accelerator->upload(mirror.data(), from.data, from.bytes);
  else
    copy(p, mirror.data(), from.data, from.bytes);
}

static int64_t bytesOf(const pikort_pipeline &p, const State &state) {
  return p.records[state.record].size * state.view.extent[0];
}

static void beginMirror(pikort_pipeline &p, State &state, bool isFrame) {
  bool isThere = isFrame && state.kind == PIKORT_CONSTANT && state.mirror &&
                 !state.changed;
  if (!isThere)
    fillMirror(p, state.mirror,
               {state.view.data, bytesOf(p, state), state.onDevice}, isFrame);
  state.changed = false;
  state.hosts = std::exchange(state.view.data, state.mirror.data());
}

static void beginMirror(pikort_pipeline &p, Source &source, bool isFrame) {
  int64_t size = p.records[p.stages[source.stage].record].size;
  fillMirror(p, source.mirror,
             {source.data, source.count * size, source.onDevice}, isFrame);
  source.hosts = std::exchange(source.data, source.mirror.data());
}

void piko::rt::beginMirrors(pikort_pipeline &p, bool isFrame) {
  if (!p.accelerator)
    return;
  if (!isFrame) // what the host copies is what the stream has left there
    p.accelerator->finishStream();
  for (State &state : p.states)
    if (!state.owned && state.view.data && !(isFrame && state.onDevice))
      beginMirror(p, state, isFrame);
  for (Source &source : p.sources)
    if (source.data && !(isFrame && source.onDevice))
      beginMirror(p, source, isFrame);
  if (!isFrame)
    p.accelerator->finishStream();
}

// An upload that is still on its way brings the same.
void piko::rt::showConstants(const pikort_pipeline &p) {
  for (const State &state : p.states)
    if (state.kind == PIKORT_CONSTANT && state.hosts)
      std::memcpy(state.mirror.data(), state.hosts,
                  static_cast<size_t>(bytesOf(p, state)));
}

void piko::rt::refillMirrors(pikort_pipeline &p) {
  for (State &state : p.states)
    if (state.hosts && state.written)
      copy(p, state.mirror.data(), state.hosts, bytesOf(p, state));
    else if (!state.hosts && state.onDevice && state.view.data)
      beginMirror(p, state, false);
  for (Source &source : p.sources)
    if (!source.hosts && source.onDevice && source.data)
      beginMirror(p, source, false);
  p.accelerator->finishStream();
}

/// What kernels have written goes to where it was bound. A device that failed
/// may have taken its memory along.
static void takeBack(pikort_pipeline &p, State &state) {
  int64_t bytes = bytesOf(p, state);
  if (!state.written || bytes == 0 || p.status == PIKORT_DEVICE_FAILED)
    return;
  guarded(&p, "run", [&] {
    if (!state.onDevice)
      return p.accelerator->download(state.view.data, state.mirror.data(),
                                     bytes);
    p.accelerator->copy(state.view.data, state.mirror.data(), bytes);
  });
}

void piko::rt::endMirrors(pikort_pipeline &p) {
  for (State &state : p.states)
    if (state.hosts) {
      state.view.data = std::exchange(state.hosts, nullptr);
      takeBack(p, state);
    }
  if (p.accelerator && p.status != PIKORT_DEVICE_FAILED)
    guarded(&p, "run", [&] { p.accelerator->finishStream(); });
  for (Source &source : p.sources)
    if (source.hosts)
      source.data = std::exchange(source.hosts, nullptr);
}

/// Lets `data` point to a copy of its elements.
template <class T>
static void share(pikort_pipeline &p, Array<T> &mirror, const T *&data,
                  int64_t count) {
  mirror = {};
  if (!data || count == 0)
    return;
  mirror = Array<T>(p.memory, count);
  std::copy_n(data, count, mirror.data());
  data = mirror.data();
}

void piko::rt::shareUnits(pikort_pipeline &p, Kernel &kernel) {
  pikoir_input &input = kernel.input;
  if (p.accelerator)
    share(p, kernel.mirrors.units, input.units, input.unit_count);
}

void piko::rt::shareHeader(pikort_pipeline &p, Kernel &kernel) {
  if (!p.accelerator)
    return;
  Array<pikoir_input> &shared = kernel.mirrors.input;
  if (!shared)
    shared = Array<pikoir_input>(p.memory, 1, Use::State);
  shared[0] = kernel.input;
}

void piko::rt::shareInput(pikort_pipeline &p, Kernel &kernel,
                          const Items &from) {
  if (!p.accelerator)
    return;
  pikoir_input &input = kernel.input;
  InputMirrors &mirrors = kernel.mirrors;
  shareUnits(p, kernel);
  // What has an index lies in blocks of the pipeline's memory, which may be far
  // from each other.
  if (!from.index)
    share(p, mirrors.items, input.items,
          from.count * p.records[p.stages[kernel.stage].record].size);
  share(p, mirrors.order, input.order, input.count);
  share(p, mirrors.calls, input.calls, input.call_count);
}
