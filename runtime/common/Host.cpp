// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Host.cpp - The host API: life and options --------------------------===//

#include "common/HostCalls.h"
#include "ranks/Ranks.h"
#include "ranks/Siblings.h"

#include <algorithm>

using namespace piko::rt;

pikort_pipeline::pikort_pipeline()
    : executor(makeExecutor(*this)), wantedThreads(executor->defaultThreads()),
      threads(wantedThreads) {}
pikort_pipeline::~pikort_pipeline() = default;

extern "C" {

// --- Life -------------------------------------------------------------------

int32_t pikort_create(const pikort_program *program,
                      pikort_pipeline **pipeline) {
  return pikort_create_on(program, PIKORT_ANY_DEVICE, pipeline);
}

} // extern "C"

/// Makes a pipeline where the host says; null if there is no memory for one.
static pikort_pipeline *create(const pikort_program &program,
                               int32_t device) noexcept {
  pikort_pipeline *p;
  try {
    p = new pikort_pipeline;
  } catch (...) {
    return nullptr;
  }
  guarded(p, "pipeline", [&] {
    p->name = program.name ? program.name : "";
    if (device < PIKORT_PROCESSOR)
      invalid("pipeline " + quoted(p->name) +
              ": expected a device's number, but got " +
              std::to_string(device));
    p->device = device;
    if (program.abi_version != PIKORT_ABI_VERSION)
      throw Failure{PIKORT_VERSION,
                    "pipeline " + quoted(p->name) +
                        ": expected a program for runtime version " +
                        std::to_string(PIKORT_ABI_VERSION) + ", but got " +
                        std::to_string(program.abi_version)};
    if (!program.setup || !program.run)
      throw Failure{PIKORT_BAD_PROGRAM, "pipeline " + quoted(p->name) +
                                            ": expected a program with setup "
                                            "and run"};
    p->runProgram = program.run;
    p->program = program;
    program.setup(p);
    if (p->status != PIKORT_OK)
      return; // setup noted why
    p->finish();
    p->executor->prepare();
    // What may be elsewhere has to know now.
    if (p->accelerator && device == PIKORT_ANY_DEVICE)
      p->accelerator->loadKernels();
    p->readMappingSetting();
    p->ready = true;
  });
  return p;
}

extern "C" {

int32_t pikort_create_on(const pikort_program *program, int32_t device,
                         pikort_pipeline **pipeline) {
  if (!program || !pipeline)
    return PIKORT_INVALID_ARGUMENT;
  CallScope scope;
  *pipeline = create(*program, device);
  if (!*pipeline)
    return PIKORT_OUT_OF_MEMORY;
  bool mayBeElsewhere = device == PIKORT_ANY_DEVICE &&
                        (*pipeline)->status == PIKORT_DEVICE_FAILED;
  if (!mayBeElsewhere)
    return (*pipeline)->status;
  // Of a program for a device alone the first error is the one to know.
  pikort_pipeline *other = create(*program, PIKORT_PROCESSOR);
  if (!other || other->status != PIKORT_OK) {
    delete other;
    return (*pipeline)->status;
  }
  std::swap(other->deviceRefusal, (*pipeline)->message);
  delete std::exchange(*pipeline, other);
  return PIKORT_OK;
}

void pikort_destroy(pikort_pipeline *pipeline) {
  CallScope scope;
  // What a run has on its way may use what goes now.
  if (pipeline && pipeline->pending)
    pipeline->accelerator->endStream();
  delete pipeline;
}

const char *pikort_message(const pikort_pipeline *pipeline) {
  return pipeline ? pipeline->message.c_str()
                  : "expected a pipeline, but got null";
}

const char *pikort_name(const pikort_pipeline *pipeline) {
  return pipeline ? pipeline->name.c_str() : "";
}

const char *pikort_device_refusal(const pikort_pipeline *pipeline) {
  return pipeline ? pipeline->deviceRefusal.c_str() : "";
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
        invalid("pipeline " + quoted(p->name) +
                ": expected domain extents in [1, " +
                std::to_string(PIKORT_MAX_EXTENT) + "], but got " +
                std::to_string(extent[d]) + " in dimension " +
                std::to_string(d));
    std::array<int64_t, 4> domain{1, 1, 1, 1};
    std::copy_n(extent, rank, domain.begin());
    change(p, [=] { p->domain = domain; });
  });
}

int32_t pikort_set_threads(pikort_pipeline *p, int32_t threads) {
  return call(p, [&] {
    if (threads < 0 || threads > PIKORT_MAX_THREADS)
      invalid("expected a number of threads in [0, " +
              std::to_string(PIKORT_MAX_THREADS) + "], but got " +
              std::to_string(threads));
    int32_t wanted = threads ? threads : p->executor->defaultThreads();
    change(p, [=] { p->wantedThreads = p->threads = wanted; });
  });
}

int32_t pikort_threads(const pikort_pipeline *p) { return p ? p->threads : 0; }

int32_t pikort_set_memory_limit(pikort_pipeline *p, int64_t bytes) {
  return call(p, [&] {
    if (bytes < 0)
      invalid("expected a memory limit of at least 0, but got " +
              std::to_string(bytes));
    change(p, [=] { p->memory.setLimit(bytes); });
  });
}

int32_t pikort_set_memory_budget(pikort_pipeline *p, int64_t bytes) {
  return call(p, [&] {
    if (bytes < 0)
      invalid("expected a memory budget of at least 0, but got " +
              std::to_string(bytes));
    change(p, [=] { p->memory.setBudget(bytes); });
  });
}

int32_t pikort_set_strip_size(pikort_pipeline *p, int64_t primitives) {
  return call(p, [&] {
    if (primitives < 0)
      invalid("expected a strip of at least 0 primitives, but got " +
              std::to_string(primitives));
    change(p, [=] { p->stripSize = primitives; });
  });
}

int32_t pikort_set_static_input(pikort_pipeline *p, int32_t on) {
  return call(p, [&] {
    change(p, [=] {
      if (p->hasStaticInput != (on != 0))
        p->contracts.forget();
      p->hasStaticInput = on != 0;
    });
  });
}

int32_t pikort_set_kernel_times(pikort_pipeline *p, int32_t on) {
  return call(p, [&] { change(p, [=] { p->timesKernels = on != 0; }); });
}

int32_t pikort_set_unit_report(pikort_pipeline *p,
                               void (*report)(void *, const pikort_unit_run *),
                               void *data) {
  return call(p, [&] {
    change(p, [=] {
      p->unitReport = report;
      p->unitReportData = data;
    });
  });
}

int32_t pikort_set_loop_limit(pikort_pipeline *p, int64_t limit) {
  return call(p, [&] {
    if (limit < 0)
      invalid("expected a loop limit of at least 0, but got " +
              std::to_string(limit));
    change(p, [=] { p->loopLimit = limit; });
  });
}

} // extern "C"
