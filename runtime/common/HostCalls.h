// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- HostCalls.h - What functions of the host API begin with ------------===//

#ifndef PIKO_RUNTIME_COMMON_HOSTCALLS_H
#define PIKO_RUNTIME_COMMON_HOSTCALLS_H

#include "common/Pipeline.h"
#include "piko/arithmetic.h"

#include <utility>

namespace piko::rt {

/// While a host's call lasts; then what is the thread's is as it was.
struct CallScope {
  detail::ArithmeticScope arithmetic;
  DeviceScope device;
};

/// Runs a host's call: `body` throws what is wrong with its arguments.
template <class Body> int32_t call(pikort_pipeline *p, Body &&body) noexcept {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  CallScope scope;
  p->clearStatus();
  if (!p->ready)
    return p->fail(PIKORT_BAD_PROGRAM, "the pipeline was not created");
  return guarded(p, "pipeline", body);
}

[[noreturn]] inline void invalid(const std::string &text) {
  throw Failure{PIKORT_INVALID_ARGUMENT, text};
}

/// Changes what runs use: now, or when the one that is on its way has ended.
/// `body` does not throw, and has its own copies of what it needs.
template <class Body> void change(pikort_pipeline *p, Body body) {
  if (p->pending)
    p->queuedChanges.emplace_back(std::move(body));
  else
    body();
}

/// Waits for the run that is on its way, if there is one. How it has ended is
/// for the next call that runs or waits to say.
void awaitRun(pikort_pipeline &p) noexcept;

/// Writes what a run would take to a file; throws.
void capture(pikort_pipeline &p, const std::string &path);
/// The same where $PIKO_CAPTURE names a folder, once.
void captureAsAsked(pikort_pipeline &p);

/// What lies on a device that is lost may be gone.
inline void checkAlive(const pikort_pipeline &p) {
  if (p.accelerator)
    p.accelerator->checkAlive();
}

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_HOSTCALLS_H
