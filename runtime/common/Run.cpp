// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Run.cpp - The host API: runs ---------------------------------------===//
//
// A run that is all a device's may go on while the host does something else:
// then it is pending until the next call that needs its end. One at a time:
// what has failed is repeated before anything else changes.
//
//===----------------------------------------------------------------------===//

#include "common/CallStack.h"
#include "common/HostCalls.h"
#include "ranks/Ranks.h"
#include "ranks/Siblings.h"

#include <cmath>
#include <cstdio>
#include <cstring>

using namespace piko::rt;

// --- What must hold ---------------------------------------------------------

static void checkBound(const pikort_pipeline &p) {
  if (p.domain[0] == 0)
    throw Failure{PIKORT_UNBOUND,
                  "pipeline " + quoted(p.name) + ": the domain is not set"};
  for (const State &state : p.states)
    if (state.kind != PIKORT_IMAGE && state.perSource < 0 && !state.bound &&
        !state.unused)
      throw Failure{
          PIKORT_UNBOUND,
          "pipeline " + quoted(p.name) + ": " +
              (state.kind == PIKORT_BUFFER ? "buffer " : "constant ") +
              quoted(state.name) + " is not bound"};
}

/// A number of a field's type, of which bytes are given.
static std::string numberText(int32_t type, const void *bytes) {
  auto read = [&](auto number) {
    std::memcpy(&number, bytes, sizeof(number));
    return number;
  };
  char text[32];
  if (type == PIKORT_F32)
    std::snprintf(text, sizeof(text), "%.9g", double(read(0.0f)));
  else if (type == PIKORT_F64)
    std::snprintf(text, sizeof(text), "%.17g", read(0.0));
  else
    std::snprintf(text, sizeof(text), "%lld",
                  type == PIKORT_I8    ? static_cast<long long>(read(int8_t()))
                  : type == PIKORT_I16 ? static_cast<long long>(read(int16_t()))
                  : type == PIKORT_I32
                      ? static_cast<long long>(read(int32_t()))
                      : static_cast<long long>(read(int64_t())));
  return text;
}

/// The error where the code was specialized for something else than the host
/// has bound.
static Failure otherThanFixed(const pikort_pipeline &p, const Fixed &fixed,
                              int64_t elements) {
  const State &state = p.states[fixed.state];
  std::string who = "pipeline " + quoted(p.name) + ": ";
  std::string expected = std::to_string(fixed.bits),
              got = std::to_string(elements);
  if (fixed.size == 0) {
    who += "buffer " + quoted(state.name) + ", size";
  } else {
    who += "constant " + quoted(state.name);
    if (fixed.field != "value")
      who += ", field " + quoted(fixed.field);
    for (const Field &field : p.records[state.record].fields)
      if (field.name == fixed.field) {
        expected = numberText(field.type, &fixed.bits);
        got = numberText(field.type, state.bytes.data() + fixed.offset);
      }
  }
  return {PIKORT_INVALID_ARGUMENT, who + ": expected " + expected +
                                       ", which the pipeline was compiled for, "
                                       "but got " +
                                       got};
}

/// Whether both are of a float's type and not numbers: which ones they are is
/// nothing that a pipeline can tell.
static bool areNaN(const pikort_pipeline &p, const Fixed &fixed) {
  const State &state = p.states[fixed.state];
  for (const Field &field : p.records[state.record].fields)
    if (field.name == fixed.field &&
        (field.type == PIKORT_F32 || field.type == PIKORT_F64)) {
      auto isNaN = [&](const void *bytes) {
        float single = 0;
        double wide = 0;
        std::memcpy(&single, bytes, sizeof(single));
        if (field.type == PIKORT_F64)
          std::memcpy(&wide, bytes, sizeof(wide));
        return field.type == PIKORT_F64 ? std::isnan(wide) : std::isnan(single);
      };
      return isNaN(&fixed.bits) && isNaN(state.bytes.data() + fixed.offset);
    }
  return false;
}

static void checkFixed(const pikort_pipeline &p) {
  for (const Fixed &fixed : p.fixed) {
    const State &state = p.states[fixed.state];
    int64_t elements = state.perSource < 0 ? state.view.extent[0]
                                           : p.sources[state.perSource].count;
    bool holds =
        fixed.size == 0
            ? elements == fixed.bits
            : std::memcmp(state.bytes.data() + fixed.offset, &fixed.bits,
                          static_cast<size_t>(fixed.size)) == 0 ||
                  areNaN(p, fixed);
    if (!holds)
      throw otherThanFixed(p, fixed, elements);
  }
}

/// Bytes of the host's, from `data` on.
struct HostMemory {
  const uint8_t *data;
  int64_t size;
};

static HostMemory memoryOf(const pikort_pipeline &p, const State &state) {
  bool isHosts = state.kind == PIKORT_BUFFER && state.perSource < 0;
  return isHosts ? HostMemory{state.view.data, state.view.extent[0] *
                                                   p.records[state.record].size}
                 : HostMemory{nullptr, 0};
}

static bool overlap(HostMemory a, HostMemory b) {
  std::less<> isBefore; // of unrelated pointers, too
  return a.size > 0 && b.size > 0 && isBefore(a.data, b.data + b.size) &&
         isBefore(b.data, a.data + a.size);
}

/// Generated code takes what it writes to be apart from what else it reads.
static void checkApart(const pikort_pipeline &p) {
  auto fail = [&](const State &written, const std::string &other) {
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  "pipeline " + quoted(p.name) + ": expected buffer " +
                      quoted(written.name) +
                      ", which is written, to be apart from " + other +
                      ", but they share memory"};
  };
  for (const State &written : p.states) {
    if (!written.written)
      continue;
    HostMemory memory = memoryOf(p, written);
    for (const State &state : p.states)
      if (&state != &written && overlap(memory, memoryOf(p, state)))
        fail(written, "buffer " + quoted(state.name));
    for (size_t s = 0; s < p.sources.size(); ++s) {
      const Source &source = p.sources[s];
      // In checking mode a stage's record is longer than the host's.
      int64_t size = p.records[p.hostRecord(source.stage)].size;
      if (overlap(memory, {source.data, source.count * size}))
        fail(written, "source " + std::to_string(s));
    }
  }
}

// --- Runs -------------------------------------------------------------------

/// Runs kernels where the host's stack may be a small one.
template <class Body>
static void guardedWithStack(pikort_pipeline &p, Body body) {
  if (!callWithStack([&] { guarded(&p, "pipeline", body); }))
    p.fail(PIKORT_OUT_OF_MEMORY,
           "pipeline " + quoted(p.name) + ": out of memory for a stack");
}

/// The thread's part of a run, or all of it; throws.
static void begin(pikort_pipeline &p, void *stream, bool waits) {
  p.runningKernel = 0;
  checkAlive(p);
  checkBound(p);
  checkFixed(p);
  checkApart(p);
  if (!p.ranks || p.ranks->rank() == 0)
    captureAsAsked(p);
  p.computeGrids();
  p.threads = p.executor->availableThreads(p.wantedThreads);
  if (p.accelerator)
    p.accelerator->useStream(stream, waits);
  else if (stream != PIKORT_OWN_STREAM)
    invalid("pipeline " + quoted(p.name) +
            ": expected a run without a stream, because the pipeline is on the "
            "processor");
  // What has waited for the stream has left it.
  if (p.contracts.check(p) && p.accelerator)
    p.accelerator->useStream(stream, waits);
  p.executor->beginRun();
  if (p.status != PIKORT_OK)
    return;
  int32_t status = p.executor->runProgram();
  if (p.executor->isPending() && waits)
    status = p.executor->awaitProgram();
  p.settle();
  if (status != PIKORT_OK && p.status == PIKORT_OK)
    throw Failure{PIKORT_BAD_PROGRAM, "pipeline " + quoted(p.name) +
                                          ": the program returned status " +
                                          std::to_string(status)};
}

static int32_t end(pikort_pipeline &p) {
  if (p.ranks)
    p.ranks->finish();
  p.executor->endRun();
  for (Stage &stage : p.stages)
    stage.binSchedules = {};
  p.memory.endFrame();
  ++p.runs;
  p.ticksPerMillisecond = p.profile.end();
  for (KernelStats &stats : p.kernelStats)
    stats.endRun(p.ticksPerMillisecond);
  return p.status.load();
}

/// The end of a run that was pending; throws.
static void awaitPending(pikort_pipeline &p) {
  int32_t status = p.executor->awaitProgram();
  p.settle();
  if (status == PIKORT_OK && p.status == PIKORT_OK && p.executor->wasRepeated())
    throw Failure{
        PIKORT_REPEATED,
        "pipeline " + quoted(p.name) +
            ": the host has repeated the run, out of the order of its "
            "stream: the results are right now, but what followed in "
            "the stream may have used others"};
}

void piko::rt::awaitRun(pikort_pipeline &p) noexcept {
  if (!p.pending)
    return;
  p.clearStatus();
  p.profile.resume();
  guardedWithStack(p, [&] { awaitPending(p); });
  int32_t code = end(p);
  p.pending = false;
  for (const std::function<void()> &change : std::exchange(p.queuedChanges, {}))
    change();
  if (code != PIKORT_OK)
    p.unsaid = {code, std::move(p.message)};
  p.clearStatus();
}

/// Waits for the run before, and throws what nobody has said of it yet.
static void finishRunBefore(pikort_pipeline &p) {
  awaitRun(p);
  if (p.unsaid.code != PIKORT_OK)
    throw std::exchange(p.unsaid, {});
}

static int32_t run(pikort_pipeline *p, void *stream, bool waits) {
  CallScope scope;
  if (int32_t code = call(p, [&] { finishRunBefore(*p); }))
    return code;
  if (int32_t code = call(p, [&] {
        prepareSiblings(*p);
        if (p->siblings)
          p->siblings->begin();
      }))
    return code;
  p->profile.begin();
  guardedWithStack(*p, [&] { begin(*p, stream, waits); });
  if (!p->executor->isPending()) {
    int32_t status = end(*p);
    if (p->siblings)
      p->siblings->end();
    return status;
  }
  p->profile.enter(Part::Program);
  p->pending = true;
  return PIKORT_OK;
}

extern "C" {

int32_t pikort_run(pikort_pipeline *p) {
  return run(p, PIKORT_OWN_STREAM, /*waits=*/true);
}

int32_t pikort_run_async(pikort_pipeline *p, void *stream) {
  return run(p, stream, /*waits=*/false);
}

void pikort_interrupt(pikort_pipeline *p, int32_t on) {
  if (p)
    p->interrupted = on != 0;
}

int32_t pikort_capture(pikort_pipeline *p, const char *path) {
  return call(p, [&] {
    if (!path)
      invalid("expected a file's name, but got null");
    finishRunBefore(*p);
    checkAlive(*p);
    checkBound(*p);
    capture(*p, path);
  });
}

int32_t pikort_wait(pikort_pipeline *p) {
  return call(p, [&] { finishRunBefore(*p); });
}

int32_t pikort_is_done(const pikort_pipeline *p) {
  if (!p || !p->pending)
    return 1;
  CallScope scope;
  try {
    return p->executor->isDone();
  } catch (...) {
    return 1; // pikort_wait says why
  }
}

} // extern "C"
