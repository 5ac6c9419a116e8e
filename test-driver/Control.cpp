// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Control.cpp - Control of the driver for tests ----------------------===//

#include "Counts.h"
#include "State.h"

using namespace piko::testdriver;
using piko::cuda::CUresult;

namespace {

using Lock = std::lock_guard<std::recursive_mutex>;

} // namespace

extern "C" {

[[gnu::visibility("default")]] void pikoTestDriverFail(const char *function,
                                                       uint64_t n, int error) {
  Lock lock(state().lock);
  state().failures.push_back(
      {function ? function : "", n ? n : 1, static_cast<CUresult>(error)});
}

[[gnu::visibility("default")]] uint64_t
pikoTestDriverCalls(const char *function) {
  Lock lock(state().lock);
  uint64_t sum = 0;
  for (const auto &[name, calls] : state().calls)
    if (!function || name == function)
      sum += calls;
  return sum;
}

[[gnu::visibility("default")]] const char *pikoTestDriverError(void) {
  thread_local std::string text;
  Lock lock(state().lock);
  text = state().error;
  return text.c_str();
}

[[gnu::visibility("default")]] const char *pikoTestDriverLeaks(void) {
  thread_local std::string text;
  Lock lock(state().lock);
  text = state().leaks;
  return text.c_str();
}

[[gnu::visibility("default")]] const char *pikoTestDriverAlive(void) {
  thread_local std::string text;
  Lock lock(state().lock);
  text.clear();
  for (const auto &device : state().devices)
    text += device->describe();
  return text.c_str();
}

[[gnu::visibility("default")]] int
pikoTestDriverCounts(const char *kernel, struct PikoTestDriverCounts *counts) {
  Lock lock(state().lock);
  *counts = {};
  for (const auto &[name, of] : state().counts)
    if (!kernel || name == kernel)
      addCounts(of, *counts);
  return counts->launches == 0;
}

[[gnu::visibility("default")]] void
pikoTestDriverHostCounts(struct PikoTestDriverHostCounts *counts) {
  Lock lock(state().lock);
  *counts = state().hostCounts;
}

[[gnu::visibility("default")]] void pikoTestDriverDelay(int on) {
  Lock lock(state().lock);
  state().delays = on != 0;
}

[[gnu::visibility("default")]] int pikoTestDriverLatencies(const char *cycles) {
  Lock lock(state().lock);
  return parseLatencies(cycles ? cycles : "", state().latencies) ? 0 : 1;
}

[[gnu::visibility("default")]] int pikoTestDriverModes(const char *names) {
  Lock lock(state().lock);
  return !parseModes(names, state().modes).empty();
}

[[gnu::visibility("default")]] const char *pikoTestDriverKernels(void) {
  thread_local std::string text;
  Lock lock(state().lock);
  text.clear();
  for (const auto &[name, counts] : state().counts)
    text += name + "\n";
  return text.c_str();
}

[[gnu::visibility("default")]] void pikoTestDriverReset(void) {
  Lock lock(state().lock);
  state().failures.clear();
  state().calls.clear();
  state().error.clear();
  state().leaks.clear();
  state().counts.clear();
  state().hostCounts = {};
}

} // extern "C"
