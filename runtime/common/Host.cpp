// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Host.cpp - The host API: life, binding, running --------------------===//

#include "common/Pipeline.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>

using namespace piko::rt;

pikort_pipeline::pikort_pipeline()
    : executor(makeExecutor(*this)), threads(executor->defaultThreads()) {}
pikort_pipeline::~pikort_pipeline() = default;

// --- Checks -----------------------------------------------------------------

/// Runs a host's call: `body` throws what is wrong with its arguments.
template <class Body>
static int32_t call(pikort_pipeline *p, Body &&body) noexcept {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  p->clearStatus();
  if (!p->ready)
    return p->fail(PIKORT_BAD_PROGRAM, "the pipeline was not created");
  return guarded(p, "pipeline", body);
}

[[noreturn]] static void invalid(const std::string &text) {
  throw Failure{PIKORT_INVALID_ARGUMENT, text};
}

static State &findState(pikort_pipeline &p, const char *name) {
  if (!name)
    invalid("expected the name of a state, but got null");
  for (State &state : p.states)
    if (state.name == name)
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

/// Checks an array of records that the host owns.
static void checkArray(const pikort_pipeline &p, const std::string &who,
                       int32_t record, const void *data, int64_t count,
                       int64_t size) {
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
}

/// What lies on a device that is lost may be gone.
static void checkAlive(const pikort_pipeline &p) {
  if (p.accelerator)
    p.accelerator->checkAlive();
}

extern "C" {

// --- Life -------------------------------------------------------------------

int32_t pikort_create(const pikort_program *program,
                      pikort_pipeline **pipeline) {
  return pikort_create_on(program, PIKORT_ANY_DEVICE, pipeline);
}

int32_t pikort_create_on(const pikort_program *program, int32_t device,
                         pikort_pipeline **pipeline) {
  if (!program || !pipeline)
    return PIKORT_INVALID_ARGUMENT;
  *pipeline = nullptr;
  pikort_pipeline *p;
  try {
    p = *pipeline = new pikort_pipeline;
  } catch (...) {
    return PIKORT_OUT_OF_MEMORY;
  }
  guarded(p, "pipeline", [&] {
    p->name = program->name ? program->name : "";
    if (device < PIKORT_PROCESSOR)
      invalid("pipeline " + quoted(p->name) +
              ": expected a device's number, but got " +
              std::to_string(device));
    p->device = device;
    if (program->abi_version != PIKORT_ABI_VERSION)
      throw Failure{PIKORT_VERSION,
                    "pipeline " + quoted(p->name) +
                        ": expected a program for runtime version " +
                        std::to_string(PIKORT_ABI_VERSION) + ", but got " +
                        std::to_string(program->abi_version)};
    if (!program->setup || !program->run)
      throw Failure{PIKORT_BAD_PROGRAM, "pipeline " + quoted(p->name) +
                                            ": expected a program with setup "
                                            "and run"};
    p->runProgram = program->run;
    program->setup(p);
    if (p->status != PIKORT_OK)
      return; // setup noted why
    p->finish();
    p->executor->prepare();
    p->ready = true;
  });
  return p->status.load();
}

void pikort_destroy(pikort_pipeline *pipeline) { delete pipeline; }

const char *pikort_message(const pikort_pipeline *pipeline) {
  return pipeline ? pipeline->message.c_str()
                  : "expected a pipeline, but got null";
}

const char *pikort_name(const pikort_pipeline *pipeline) {
  return pipeline ? pipeline->name.c_str() : "";
}

int32_t pikort_device(const pikort_pipeline *pipeline) {
  return pipeline && pipeline->accelerator ? pipeline->accelerator->number()
                                           : PIKORT_PROCESSOR;
}

// --- Options ----------------------------------------------------------------

int32_t pikort_set_domain(pikort_pipeline *p, int32_t rank,
                          const int64_t *extent) {
  return call(p, [&] {
    if (rank != p->rank)
      invalid("pipeline " + quoted(p->name) + ": expected a domain of rank " +
              std::to_string(p->rank) + ", but got " + std::to_string(rank));
    if (!extent)
      invalid("expected the domain's extents, but got null");
    for (int32_t d = 0; d < rank; ++d)
      if (extent[d] < 1 || extent[d] > PIKORT_MAX_EXTENT)
        invalid("expected domain extents in [1, " +
                std::to_string(PIKORT_MAX_EXTENT) + "], but got " +
                std::to_string(extent[d]));
    for (int32_t d = 0; d < 4; ++d)
      p->domain[d] = d < rank ? extent[d] : 1;
  });
}

int32_t pikort_set_threads(pikort_pipeline *p, int32_t threads) {
  return call(p, [&] {
    if (threads < 0 || threads > 10000)
      invalid("expected a number of threads in [0, 10000], but got " +
              std::to_string(threads));
    p->threads = threads ? threads : p->executor->defaultThreads();
  });
}

int32_t pikort_set_memory_limit(pikort_pipeline *p, int64_t bytes) {
  return call(p, [&] {
    if (bytes < 0)
      invalid("expected a memory limit of at least 0, but got " +
              std::to_string(bytes));
    p->memory.setLimit(bytes);
  });
}

int32_t pikort_set_memory_budget(pikort_pipeline *p, int64_t bytes) {
  return call(p, [&] {
    if (bytes < 0)
      invalid("expected a memory budget of at least 0, but got " +
              std::to_string(bytes));
    p->memory.setBudget(bytes);
  });
}

int32_t pikort_set_strip_size(pikort_pipeline *p, int64_t primitives) {
  return call(p, [&] {
    if (primitives < 0)
      invalid("expected a strip of at least 0 primitives, but got " +
              std::to_string(primitives));
    p->stripSize = primitives;
  });
}

int32_t pikort_set_unit_report(pikort_pipeline *p,
                               void (*report)(void *, const pikort_unit_run *),
                               void *data) {
  return call(p, [&] {
    p->unitReport = report;
    p->unitReportData = data;
  });
}

int32_t pikort_set_loop_limit(pikort_pipeline *p, int64_t limit) {
  return call(p, [&] {
    if (limit < 0)
      invalid("expected a loop limit of at least 0, but got " +
              std::to_string(limit));
    p->loopLimit = limit;
  });
}

// --- State and sources ------------------------------------------------------

int32_t pikort_bind_constant(pikort_pipeline *p, const char *name,
                             const void *data, int64_t size) {
  return call(p, [&] {
    State &state = findState(*p, name, PIKORT_CONSTANT);
    checkSize(*p, "constant " + quoted(state.name), state.record, size);
    if (!data)
      invalid("constant " + quoted(state.name) +
              ": expected its bytes, but got null");
    std::memcpy(state.bytes.data(), data, static_cast<size_t>(size));
    state.bound = true;
  });
}

int32_t pikort_bind_buffer(pikort_pipeline *p, const char *name, void *data,
                           int64_t count, int64_t recordSize) {
  return call(p, [&] {
    State &state = findState(*p, name, PIKORT_BUFFER);
    std::string who = "buffer " + quoted(state.name);
    if (state.perSource >= 0)
      invalid(who + " is allocated for source " +
              std::to_string(state.perSource) + " and cannot be bound");
    checkArray(*p, who, state.record, data, count, recordSize);
    state.owned = {};
    state.view = {static_cast<uint8_t *>(data), {count, 1, 1, 1}};
    state.bound = true;
  });
}

int32_t pikort_allocate_buffer(pikort_pipeline *p, const char *name,
                               int64_t count) {
  return call(p, [&] {
    State &state = findState(*p, name, PIKORT_BUFFER);
    std::string who = "buffer " + quoted(state.name);
    if (state.perSource >= 0)
      invalid(who + " is allocated for source " +
              std::to_string(state.perSource) + " and cannot be bound");
    if (count < 0)
      invalid(who + ": expected a count of at least 0, but got " +
              std::to_string(count));
    int64_t bytes;
    if (__builtin_mul_overflow(count, p->records[state.record].size, &bytes))
      throw OutOfMemory{INT64_MAX};
    checkAlive(*p);
    state.bound = false;
    state.owned = {};
    state.owned = Array<uint8_t>(p->memory, bytes, Use::State);
    std::memset(state.owned.data(), 0, static_cast<size_t>(bytes));
    state.view = {state.owned.data(), {count, 1, 1, 1}};
    state.bound = true;
  });
}

int32_t pikort_bind_source(pikort_pipeline *p, int32_t index, const void *data,
                           int64_t count, int64_t recordSize) {
  return call(p, [&] {
    if (index < 0 || index >= static_cast<int32_t>(p->sources.size()))
      throw Failure{PIKORT_NOT_FOUND, "pipeline " + quoted(p->name) +
                                          " has no source " +
                                          std::to_string(index)};
    Source &source = p->sources[index];
    std::string who = "source " + std::to_string(index);
    checkArray(*p, who, p->hostRecord(source.stage), data, count, recordSize);
    if (count > UINT32_MAX)
      throw Failure{PIKORT_TOO_MANY,
                    who + ": expected at most 4294967295 primitives, but got " +
                        std::to_string(count)};
    source.data = static_cast<const uint8_t *>(data);
    source.count = count;
  });
}

int32_t pikort_get_view(pikort_pipeline *p, const char *name,
                        pikort_view *view) {
  return call(p, [&] {
    State &state = findState(*p, name);
    if (!view)
      invalid("expected room for a view, but got null");
    if (state.owned)
      checkAlive(*p);
    bool atRun = state.kind == PIKORT_IMAGE || state.perSource >= 0;
    if (atRun && !state.view.data)
      throw Failure{PIKORT_UNBOUND,
                    "state " + quoted(state.name) + " exists only after a run"};
    if (!atRun && !state.bound)
      throw Failure{PIKORT_UNBOUND,
                    "state " + quoted(state.name) + " is not bound"};
    *view = {state.view.data,
             {state.view.extent[0], state.view.extent[1], state.view.extent[2],
              state.view.extent[3]},
             p->records[state.record].size,
             state.rank,
             state.record};
  });
}

// --- Running ----------------------------------------------------------------

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
  for (size_t s = 0; s < p.sources.size(); ++s)
    if (p.sources[s].count < 0)
      throw Failure{PIKORT_UNBOUND, "pipeline " + quoted(p.name) + ": source " +
                                        std::to_string(s) + " is not bound"};
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

int32_t pikort_run(pikort_pipeline *p) {
  if (p)
    p->profile.begin();
  int32_t code = call(p, [&] {
    checkAlive(*p);
    checkBound(*p);
    checkFixed(*p);
    checkApart(*p);
    p->computeGrids();
    p->executor->beginRun();
    if (p->status != PIKORT_OK)
      return;
    int32_t status = p->executor->runProgram();
    p->settle();
    if (status != PIKORT_OK && p->status == PIKORT_OK)
      throw Failure{PIKORT_BAD_PROGRAM, "pipeline " + quoted(p->name) +
                                            ": the program returned status " +
                                            std::to_string(status)};
  });
  if (!p || !p->ready)
    return code;
  p->executor->endRun();
  for (Stage &stage : p->stages)
    stage.binSchedules = {};
  p->memory.endFrame();
  ++p->runs;
  p->ticksPerMillisecond = p->profile.end();
  for (KernelStats &stats : p->kernelStats)
    stats.endRun(p->ticksPerMillisecond);
  return p->status.load();
}

} // extern "C"
