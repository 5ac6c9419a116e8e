// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Mirrors.cpp - What a device sees of the host's memory --------------===//

#include "gpu/Mirrors.h"
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

/// What a mirror is of.
struct Original {
  const uint8_t *data;
  int64_t bytes;
  bool onDevice;
};

} // namespace

/// Makes `mirror` the same.
static void fillMirror(pikort_pipeline &p, Array<uint8_t> &mirror,
                       const Original &from) {
  if (!mirror || mirror.size() != from.bytes) {
    mirror = {};
    mirror = Array<uint8_t>(p.memory, from.bytes, Use::State);
  }
  if (from.bytes == 0)
    return;
  if (from.onDevice)
    p.accelerator->copy(mirror.data(), from.data, from.bytes);
  else
    copy(p, mirror.data(), from.data, from.bytes);
}

/// Current if it was so, and has as many bytes.
static void makeTwin(pikort_pipeline &p, DeviceBytes &twin, bool &isCurrent,
                     int64_t bytes) {
  isCurrent &= !twin.resize(*p.accelerator, bytes);
}

static void fillTwin(pikort_pipeline &p, DeviceBytes &twin, bool &isCurrent,
                     const uint8_t *from) {
  if (!isCurrent && twin.size() > 0)
    p.accelerator->upload(twin.data(), from, twin.size());
  isCurrent = true;
}

static int64_t bytesOf(const pikort_pipeline &p, const State &state) {
  return p.records[state.record].size * state.view.extent[0];
}

static Original originalOf(const pikort_pipeline &p, const State &state) {
  return {state.view.data, bytesOf(p, state), state.onDevice};
}

// --- Frames: kernels see twins ----------------------------------------------

/// The program reads constants itself: what takes their place is a mirror, and
/// the frame gives kernels its twin.
static void showConstant(pikort_pipeline &p, State &state) {
  state.twinIsCurrent &= state.mirror && !state.changed;
  if (!state.twinIsCurrent)
    fillMirror(p, state.mirror, originalOf(p, state));
  makeTwin(p, state.twin, state.twinIsCurrent, bytesOf(p, state));
  fillTwin(p, state.twin, state.twinIsCurrent, state.mirror.data());
  state.changed = false;
  state.hosts = std::exchange(state.view.data, state.mirror.data());
}

/// What is our own the frame brings to the device, unless it clears it.
static void showState(pikort_pipeline &p, State &state) {
  if (state.kind == PIKORT_CONSTANT)
    return showConstant(p, state);
  state.twinIsCurrent &= state.owned || p.hasStaticInput;
  makeTwin(p, state.twin, state.twinIsCurrent,
           state.owned ? state.owned.size() : bytesOf(p, state));
  if (!state.owned)
    fillTwin(p, state.twin, state.twinIsCurrent, state.view.data);
  state.hosts = std::exchange(state.view.data, state.twin.data());
}

static void showSource(pikort_pipeline &p, Source &source) {
  source.twinIsCurrent &= p.hasStaticInput;
  makeTwin(p, source.twin, source.twinIsCurrent,
           source.count * p.records[p.stages[source.stage].record].size);
  fillTwin(p, source.twin, source.twinIsCurrent, source.data);
  source.hosts = std::exchange(source.data, source.twin.data());
}

static void beginFrame(pikort_pipeline &p) {
  for (State &state : p.states)
    if (state.view.data && !state.onDevice && (state.owned || !state.unused))
      showState(p, state);
  for (Source &source : p.sources)
    if (source.data && !source.onDevice)
      showSource(p, source);
}

// --- The host's way: host and kernels see mirrors ---------------------------

static void beginMirror(pikort_pipeline &p, State &state) {
  if (state.owned) {
    bringToHost(p, state);
    state.twinIsCurrent = false;
    return;
  }
  fillMirror(p, state.mirror, originalOf(p, state));
  state.twinIsCurrent = false; // kernels write to the mirror
  state.hosts = std::exchange(state.view.data, state.mirror.data());
}

static void beginMirror(pikort_pipeline &p, Source &source) {
  int64_t size = p.records[p.stages[source.stage].record].size;
  fillMirror(p, source.mirror,
             {source.data, source.count * size, source.onDevice});
  source.hosts = std::exchange(source.data, source.mirror.data());
}

void piko::rt::beginMirrors(pikort_pipeline &p, bool isFrame) {
  if (isFrame)
    return beginFrame(p);
  // What the host copies is what the stream has left there.
  p.accelerator->finishStream();
  for (State &state : p.states)
    if (state.view.data && !state.hosts && (state.owned || !state.unused))
      beginMirror(p, state);
  for (Source &source : p.sources)
    if (source.data)
      beginMirror(p, source);
  p.accelerator->finishStream();
}

/// Constants stay as the frame had them: the host may have bound others since.
void piko::rt::refillMirrors(pikort_pipeline &p) {
  for (State &state : p.states)
    if (state.hosts && state.kind != PIKORT_CONSTANT)
      state.view.data = std::exchange(state.hosts, nullptr);
  for (Source &source : p.sources)
    if (source.hosts)
      source.data = std::exchange(source.hosts, nullptr);
  beginMirrors(p, /*isFrame=*/false);
}

// --- After a run -----------------------------------------------------------

/// What kernels have written, to what was bound, goes there. A device that
/// failed may have taken its memory along.
static void takeBack(pikort_pipeline &p, State &state, const uint8_t *from) {
  int64_t bytes = bytesOf(p, state);
  if (!state.written || bytes == 0 || p.status == PIKORT_DEVICE_FAILED)
    return;
  guarded(&p, "run", [&] {
    if (!state.onDevice)
      return p.accelerator->download(state.view.data, from, bytes);
    p.accelerator->copy(state.view.data, from, bytes);
  });
}

static void endMirror(pikort_pipeline &p, State &state) {
  const uint8_t *from =
      std::exchange(state.view.data, std::exchange(state.hosts, nullptr));
  if (!state.owned)
    return takeBack(p, state, from);
  state.twinIsCurrent = true;
  bool isCleared = state.kind == PIKORT_IMAGE || state.perSource >= 0;
  if (isCleared || state.written)
    state.hostIsCurrent = false;
}

void piko::rt::endMirrors(pikort_pipeline &p) {
  for (State &state : p.states)
    if (state.hosts)
      endMirror(p, state);
  if (p.status != PIKORT_DEVICE_FAILED)
    guarded(&p, "run", [&] { p.accelerator->finishStream(); });
  for (Source &source : p.sources)
    if (source.hosts)
      source.data = std::exchange(source.hosts, nullptr);
}

// --- Input of kernels -------------------------------------------------------

namespace {

/// Of an input that lies elsewhere.
struct InputCopies final : InputMirror {
  Array<uint8_t> items;
  Array<uint32_t> order;
  Array<pikoir_unit> units;
  Array<pikoir_call> calls;
  Array<pikoir_input> input; ///< What generated code sees, from run to run.

  void clear() override {
    items = {};
    order = {};
    units = {};
    calls = {};
  }
};

} // namespace

static InputCopies &copiesOf(Kernel &kernel) {
  if (!kernel.mirror)
    kernel.mirror = std::make_unique<InputCopies>();
  return static_cast<InputCopies &>(*kernel.mirror);
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

void piko::rt::shareInput(pikort_pipeline &p, Kernel &kernel,
                          const Items &from) {
  pikoir_input &input = kernel.input;
  InputCopies &copies = copiesOf(kernel);
  // What has an index lies in blocks of the pipeline's memory, which may be far
  // from each other.
  if (!from.index)
    share(p, copies.items, input.items,
          from.count * p.records[p.stages[kernel.stage].record].size);
  share(p, copies.order, input.order, input.count);
  share(p, copies.calls, input.calls, input.call_count);
}

const pikoir_input *piko::rt::shareKernel(pikort_pipeline &p, Kernel &kernel) {
  InputCopies &copies = copiesOf(kernel);
  share(p, copies.units, kernel.input.units, kernel.input.unit_count);
  if (!copies.input)
    copies.input = Array<pikoir_input>(p.memory, 1, Use::State);
  copies.input[0] = kernel.input;
  return copies.input.data();
}
