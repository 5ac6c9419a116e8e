// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Bind.cpp - The host API: state and sources -------------------------===//

#include "common/HostCalls.h"

#include <cstring>

using namespace piko::rt;

// --- Checks -----------------------------------------------------------------

static State &findState(pikort_pipeline &p, const char *name) {
  if (!name)
    invalid("expected the name of a state, but got null");
  for (State &state : p.states)
    if (state.name == name && !state.internal)
      return state;
  throw Failure{PIKORT_NOT_FOUND,
                "pipeline " + quoted(p.name) + " has no state " + quoted(name)};
}

static State &findState(pikort_pipeline &p, const char *name, int32_t kind) {
  static const char *const kinds[] = {"a constant", "a buffer", "an image"};
  State &state = findState(p, name);
  if (state.kind != kind)
    invalid("state " + quoted(state.name) + ": expected " + kinds[kind] +
            ", but it is " + kinds[state.kind]);
  return state;
}

static void checkSize(const pikort_pipeline &p, const std::string &who,
                      int32_t record, int64_t size) {
  const Record &wanted = p.records[record];
  if (wanted.size != size)
    throw Failure{PIKORT_SIZE_MISMATCH,
                  who + ": expected " + std::to_string(wanted.size) +
                      " bytes for a " + quoted(wanted.name) + ", but got " +
                      std::to_string(size)};
}

namespace {

/// What the host binds.
struct Bound {
  const void *data;
  int64_t count, size;
  bool onDevice;
};

} // namespace

/// Checks that it is where the host says.
static void checkPlace(const pikort_pipeline &p, const std::string &who,
                       const Bound &bound) {
  if (!p.accelerator && bound.onDevice)
    invalid(who + ": expected memory of the host, because the pipeline is on "
                  "the processor, but got memory of a device");
  if (!p.accelerator || bound.count == 0)
    return;
  checkAlive(p);
  if (bound.onDevice)
    p.accelerator->checkMemory(who, bound.data, bound.count * bound.size);
  else
    p.accelerator->checkHosts(who, bound.data);
}

/// Checks an array of records that the host owns.
static void checkArray(const pikort_pipeline &p, const std::string &who,
                       int32_t record, const Bound &bound) {
  auto [data, count, size, onDevice] = bound;
  checkSize(p, who, record, size);
  if (count < 0)
    invalid(who + ": expected a count of at least 0, but got " +
            std::to_string(count));
  if (count > 0 && !data)
    invalid(who + ": expected " + std::to_string(count) +
            " records, but got a null pointer");
  int64_t align = p.records[record].align;
  if (reinterpret_cast<uintptr_t>(data) % static_cast<uintptr_t>(align))
    invalid(who + ": expected a pointer aligned to " + std::to_string(align) +
            " bytes");
  if (count > INT64_MAX / size)
    invalid(who + ": expected an array that fits into memory, but got " +
            std::to_string(count) + " records");
  checkPlace(p, who, bound);
}

static uint8_t *pointerTo(uint64_t address) {
  return reinterpret_cast<uint8_t *>(address);
}

/// A buffer that the host may give elements.
static State &findBindable(pikort_pipeline &p, const char *name) {
  State &state = findState(p, name, PIKORT_BUFFER);
  if (state.perSource >= 0)
    invalid("buffer " + quoted(state.name) + " is allocated for source " +
            std::to_string(state.perSource) + " and cannot be bound");
  return state;
}

/// Gives a buffer memory of our own, with zeros.
static void allocateBuffer(pikort_pipeline &p, State &state, int64_t count) {
  int64_t bytes;
  if (__builtin_mul_overflow(state.roomFor(count), p.records[state.record].size,
                             &bytes))
    throw OutOfMemory{INT64_MAX};
  awaitRun(p);
  checkAlive(p);
  state.onDevice = state.bound = false;
  state.mirror = {};
  state.own({}); // before the new one, so that both need not fit
  state.own(Array<uint8_t>(p.memory, bytes, Use::State));
  std::memset(state.owned.data(), 0, static_cast<size_t>(bytes));
  state.view = {state.owned.data(), {count, 1, 1, 1}};
  state.bound = true;
  ++state.version;
}

static void bindBuffer(pikort_pipeline *p, const char *name,
                       const Bound &bound) {
  State &state = findBindable(*p, name);
  std::string who = "buffer " + quoted(state.name);
  checkArray(*p, who, state.record, bound);
  if (state.roomFor(bound.count) > bound.count)
    return allocateBuffer(*p, state, bound.count);
  change(p, [&state, bound] {
    ++state.version;
    state.own({});
    if (bound.onDevice)
      state.mirror = {}, state.twin = {};
    auto *data = static_cast<uint8_t *>(const_cast<void *>(bound.data));
    state.view = {data, {bound.count, 1, 1, 1}};
    state.onDevice = bound.onDevice;
    state.bound = true;
  });
}

static void bindSource(pikort_pipeline *p, int32_t index, const Bound &bound) {
  if (index < 0 || index >= static_cast<int32_t>(p->sources.size()))
    throw Failure{PIKORT_NOT_FOUND, "pipeline " + quoted(p->name) +
                                        " has no source " +
                                        std::to_string(index)};
  Source &source = p->sources[index];
  std::string who = "source " + std::to_string(index);
  checkArray(*p, who, p->hostRecord(source.stage), bound);
  if (bound.count > UINT32_MAX)
    throw Failure{PIKORT_TOO_MANY,
                  who + ": expected at most 4294967295 primitives, but got " +
                      std::to_string(bound.count)};
  change(p, [&source, bound] {
    ++source.version;
    if (bound.onDevice)
      source.mirror = {}, source.twin = {};
    source.data = static_cast<const uint8_t *>(bound.data);
    source.count = bound.count;
    source.twinIsCurrent = false;
    source.onDevice = bound.onDevice;
  });
}

static void checkExists(const State &state) {
  bool atRun = state.kind == PIKORT_IMAGE || state.perSource >= 0;
  if (atRun && !state.view.data)
    throw Failure{PIKORT_UNBOUND,
                  "state " + quoted(state.name) + " exists only after a run"};
  if (!atRun && !state.bound)
    throw Failure{PIKORT_UNBOUND,
                  "state " + quoted(state.name) + " is not bound"};
}

static pikort_view viewOf(const pikort_pipeline &p, const State &state) {
  const int64_t *extent = state.view.extent;
  return {state.view.data,
          {extent[0], extent[1], extent[2], extent[3]},
          p.records[state.record].size,
          state.rank,
          state.record};
}

/// The number of scalars that a record is made of, without gaps, if they are of
/// one type; else 0.
static int32_t countChannels(const Record &record) {
  static constexpr int64_t bytes[] = {4, 8, 1, 2, 4, 8};
  int64_t channels = 0;
  for (const Field &field : record.fields) {
    if (field.type != record.fields.front().type)
      return 0;
    channels += field.elements;
  }
  bool isFull = channels > 0 &&
                channels * bytes[record.fields.front().type] == record.size;
  return isFull ? static_cast<int32_t>(channels) : 0;
}

static void describe(const pikort_view &from, const Record &record,
                     pikort_device_view &to) {
  to = {};
  to.address = reinterpret_cast<uint64_t>(from.data);
  int64_t bytes = from.record_size;
  for (int32_t d = 0; d < 4; ++d) {
    to.extent[d] = from.extent[d];
    to.stride[d] = bytes;
    bytes *= from.extent[d];
  }
  to.record_size = from.record_size;
  to.rank = from.rank;
  to.record = from.record;
  to.channels = countChannels(record);
  to.type = to.channels > 0 ? record.fields.front().type : -1;
}

// --- The device's copies of our memory --------------------------------------

void piko::rt::bringToHost(pikort_pipeline &p, State &state) {
  if (state.hostIsCurrent)
    return;
  p.accelerator->download(state.owned.data(), state.twin.data(),
                          state.owned.size());
  p.accelerator->finishStream();
  state.hostIsCurrent = true;
}

void piko::rt::bringToDevice(pikort_pipeline &p, State &state) {
  if (state.twinIsCurrent)
    return;
  state.twin.resize(*p.accelerator, state.owned.size());
  if (state.owned.size() > 0)
    p.accelerator->upload(state.twin.data(), state.owned.data(),
                          state.owned.size());
  state.twinIsCurrent = true;
}

extern "C" {

// --- State and sources ------------------------------------------------------

int32_t pikort_bind_constant(pikort_pipeline *p, const char *name,
                             const void *data, int64_t size) {
  return call(p, [&] {
    State &state = findState(*p, name, PIKORT_CONSTANT);
    checkSize(*p, "constant " + quoted(state.name), state.record, size);
    if (!data)
      invalid("constant " + quoted(state.name) +
              ": expected its bytes, but got null");
    state.changed |=
        std::memcmp(state.bytes.data(), data, static_cast<size_t>(size)) != 0;
    std::memcpy(state.bytes.data(), data, static_cast<size_t>(size));
    state.bound = true;
  });
}

int32_t pikort_bind_buffer(pikort_pipeline *p, const char *name, void *data,
                           int64_t count, int64_t recordSize) {
  return call(p, [&] {
    bindBuffer(p, name, {data, count, recordSize, /*onDevice=*/false});
  });
}

int32_t pikort_bind_device_buffer(pikort_pipeline *p, const char *name,
                                  uint64_t address, int64_t count,
                                  int64_t recordSize) {
  return call(p, [&] {
    bindBuffer(p, name, {pointerTo(address), count, recordSize, true});
  });
}

int32_t pikort_allocate_buffer(pikort_pipeline *p, const char *name,
                               int64_t count) {
  return call(p, [&] {
    State &state = findBindable(*p, name);
    if (count < 0)
      invalid("buffer " + quoted(state.name) +
              ": expected a count of at least 0, but got " +
              std::to_string(count));
    allocateBuffer(*p, state, count);
  });
}

int32_t pikort_bind_source(pikort_pipeline *p, int32_t index, const void *data,
                           int64_t count, int64_t recordSize) {
  return call(p, [&] {
    bindSource(p, index, {data, count, recordSize, /*onDevice=*/false});
  });
}

int32_t pikort_bind_device_source(pikort_pipeline *p, int32_t index,
                                  uint64_t address, int64_t count,
                                  int64_t recordSize) {
  return call(p, [&] {
    bindSource(p, index, {pointerTo(address), count, recordSize, true});
  });
}

// --- Views ------------------------------------------------------------------

int32_t pikort_get_view(pikort_pipeline *p, const char *name,
                        pikort_view *view) {
  return call(p, [&] {
    State &state = findState(*p, name);
    if (!view)
      invalid("expected room for a view, but got null");
    awaitRun(*p);
    if (state.owned)
      checkAlive(*p);
    checkExists(state);
    if (state.onDevice)
      invalid("buffer " + quoted(state.name) +
              ": expected memory of the host, but what is bound is a device's, "
              "which pikort_read copies");
    if (state.owned) {
      bringToHost(*p, state);
      state.twinIsCurrent = false; // the host may write there
      ++state.version;
    }
    *view = viewOf(*p, state);
  });
}

int32_t pikort_get_device_view(pikort_pipeline *p, const char *name,
                               pikort_device_view *view) {
  return call(p, [&] {
    State &state = findState(*p, name);
    if (!view)
      invalid("expected room for a view, but got null");
    if (!p->accelerator)
      invalid("state " + quoted(state.name) +
              ": expected a pipeline on a "
              "device, but this one is on the processor");
    checkAlive(*p);
    checkExists(state);
    if (!state.owned && !state.onDevice)
      invalid("state " + quoted(state.name) +
              ": expected memory of the device, but it is the host's");
    pikort_view there = viewOf(*p, state);
    if (state.owned) {
      if (!state.hosts) { // no run is on its way
        bringToDevice(*p, state);
        p->accelerator->finishStream();
      }
      state.hostIsCurrent = false; // whoever has the view may write there
      ++state.version;
      there.data = state.twin.data();
    }
    describe(there, p->records[state.record], *view);
    view->device = p->accelerator->number();
  });
}

int32_t pikort_read(pikort_pipeline *p, const char *name, void *to,
                    int64_t count, int64_t recordSize) {
  return call(p, [&] {
    State &state = findState(*p, name);
    awaitRun(*p);
    checkExists(state);
    checkSize(*p, "state " + quoted(state.name), state.record, recordSize);
    pikort_view view = viewOf(*p, state);
    int64_t all = 1;
    for (int64_t extent : view.extent)
      all *= extent;
    if (count != all || (count > 0 && !to))
      invalid("state " + quoted(state.name) + ": expected room for " +
              std::to_string(all) + " records, but got " +
              (to || count == 0 ? "some for " + std::to_string(count)
                                : "a null pointer"));
    if (count == 0)
      return;
    if (state.owned)
      checkAlive(*p);
    const uint8_t *from = state.onDevice        ? state.view.data
                          : state.hostIsCurrent ? nullptr
                                                : state.twin.data();
    if (from) {
      checkAlive(*p);
      p->accelerator->download(static_cast<uint8_t *>(to), from,
                               count * recordSize);
      p->accelerator->finishStream();
    } else {
      std::memcpy(to, view.data, static_cast<size_t>(count * recordSize));
    }
  });
}

} // extern "C"
