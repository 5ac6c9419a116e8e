// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- State.cpp - What the driver for tests holds ------------------------===//

#include "State.h"

#include "Counts.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

using namespace piko::testdriver;

static uint64_t numberFrom(const char *variable, uint64_t otherwise) {
  const char *text = std::getenv(variable);
  return text && *text ? std::strtoull(text, nullptr, 0) : otherwise;
}

/// function:n:error, and more after commas.
static std::vector<Failure> parseFailures(const char *text) {
  std::vector<Failure> failures;
  std::string_view rest = text ? text : "";
  while (!rest.empty()) {
    std::string one(rest.substr(0, rest.find(',')));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    size_t first = one.find(':'), second = one.find(':', first + 1);
    if (first == one.npos || second == one.npos) {
      std::fprintf(stderr,
                   "PIKO_TEST_DRIVER_FAIL: expected function:n:error, but got "
                   "'%s'\n",
                   one.c_str());
      continue;
    }
    Failure failure;
    failure.function = one.substr(0, first);
    failure.calls = std::strtoull(one.c_str() + first + 1, nullptr, 0);
    failure.error = static_cast<CUresult>(std::atoi(one.c_str() + second + 1));
    failures.push_back(failure);
  }
  return failures;
}

std::string piko::testdriver::parseModes(std::string_view names, Modes &modes) {
  modes = {};
  while (!names.empty()) {
    std::string_view name = names.substr(0, names.find(','));
    names.remove_prefix(std::min(names.size(), name.size() + 1));
    if (name != "apart" && name != "buffered" && name != "lazy")
      return "expected apart, buffered or lazy, but got '" + std::string(name) +
             "'";
    (name == "apart"      ? modes.apart
     : name == "buffered" ? modes.buffered
                          : modes.lazy) = true;
  }
  return {};
}

bool piko::testdriver::parseLatencies(
    std::string_view text, std::optional<ptx::Latencies> &latencies) {
  latencies.reset();
  if (text.empty())
    return true;
  ptx::Latencies read;
  const char *at = text.data(), *end = at + text.size();
  for (double *cycles :
       {&read.arithmetic, &read.shared, &read.hit, &read.miss}) {
    if (cycles != &read.arithmetic && (at == end || *at++ != ','))
      return false;
    auto [next, error] = std::from_chars(at, end, *cycles);
    if (error != std::errc() || !(*cycles > 0) || std::isinf(*cycles))
      return false;
    at = next;
  }
  if (at != end) {
    auto [next, error] = *at == ','
                             ? std::from_chars(at + 1, end, read.cacheBytes)
                             : std::from_chars_result{at, std::errc()};
    if (error != std::errc() || next != end || read.cacheBytes == 0)
      return false;
  }
  latencies = read;
  return true;
}

/// What the environment says cannot be taken: a test would not be what it says.
[[noreturn]] static void refuse(const char *variable, const std::string &why) {
  std::fprintf(stderr, "%s: %s\n", variable, why.c_str());
  std::exit(1);
}

State::State() {
  uint64_t count = numberFrom("PIKO_TEST_DRIVER_DEVICES", 1);
  for (uint64_t device = 0; device < count; ++device)
    devices.push_back(std::make_unique<Context>());
  capability = static_cast<int>(numberFrom("PIKO_TEST_DRIVER_SM", 90));
  multiprocessors =
      static_cast<int>(numberFrom("PIKO_TEST_DRIVER_MULTIPROCESSORS", 4));
  memoryLimit = numberFrom("PIKO_TEST_DRIVER_MEMORY", memoryLimit);
  seed = numberFrom("PIKO_TEST_DRIVER_SEED", 0);
  if (const char *counts = std::getenv("PIKO_TEST_DRIVER_COUNTS"))
    countsGoTo = counts == std::string_view("0") ? "" : counts;
  printsErrors = numberFrom("PIKO_TEST_DRIVER_ERRORS", 0) != 0;
  delays = numberFrom("PIKO_TEST_DRIVER_DELAY", 0) != 0;
  if (const char *names = std::getenv("PIKO_TEST_DRIVER_MODES"))
    if (std::string wrong = parseModes(names, modes); !wrong.empty())
      refuse("PIKO_TEST_DRIVER_MODES", wrong);
  if (const char *cycles = std::getenv("PIKO_TEST_DRIVER_LATENCIES"))
    if (!parseLatencies(cycles, latencies))
      refuse("PIKO_TEST_DRIVER_LATENCIES",
             "expected four numbers of cycles, and perhaps one of bytes, with "
             "commas between them, but got '" +
                 std::string(cycles) + "'");
  failures = parseFailures(std::getenv("PIKO_TEST_DRIVER_FAIL"));
}

State &piko::testdriver::state() {
  static State *const instance = new State;
  return *instance;
}

static void printHostCounts(const PikoTestDriverHostCounts &it) {
  auto number = [](uint64_t value) {
    return static_cast<unsigned long long>(value);
  };
  std::fprintf(
      stderr,
      "host: %llu launches of kernels, %llu of graphs with %llu "
      "kernels, %llu copies, %llu fills, %llu waits; %llu bytes to the "
      "device, %llu from it, %llu on it\n",
      number(it.launches), number(it.graphLaunches), number(it.graphKernels),
      number(it.copies), number(it.fills), number(it.waits),
      number(it.bytesToDevice), number(it.bytesFromDevice),
      number(it.bytesOnDevice));
}

/// {"kernels": {NAME: {COUNT: n, ..}, ..}, "host": {COUNT: n, ..},
/// "calls": {FUNCTION: n, ..}}
static void writeCounts(const State &at) {
  std::FILE *file = std::fopen(at.countsGoTo.c_str(), "w");
  if (!file) {
    std::fprintf(stderr, "PIKO_TEST_DRIVER_COUNTS: cannot write '%s'\n",
                 at.countsGoTo.c_str());
    return;
  }
  const char *separator = "\n";
  std::fputs("{\"kernels\": {", file);
  for (const auto &[kernel, counts] : at.counts) {
    std::fprintf(file, "%s\"%s\": %s", separator, kernel.c_str(),
                 toJSON(counts).c_str());
    separator = ",\n";
  }
  std::fprintf(file, "},\n\"host\": %s", toJSON(at.hostCounts).c_str());
  std::fputs(",\n\"calls\": {", file);
  separator = "";
  for (const auto &[function, count] : at.calls) {
    std::fprintf(file, "%s\"%s\": %llu", separator, function.c_str(),
                 static_cast<unsigned long long>(count));
    separator = ", ";
  }
  std::fputs("}}\n", file);
  std::fclose(file);
}

/// When the library is unloaded, after the program's own objects are destroyed.
[[gnu::destructor]] static void report() {
  const State &at = state();
  if (!at.leaks.empty())
    std::fprintf(stderr, "driver for tests: alive at the end of a context:\n%s",
                 at.leaks.c_str());
  if (at.countsGoTo == "1") {
    printHostCounts(at.hostCounts);
    for (const auto &[kernel, counts] : at.counts)
      std::fprintf(stderr, "%s: %s\n", kernel.c_str(),
                   describeCounts(counts).c_str());
  } else if (!at.countsGoTo.empty() && at.countsGoTo != "launches" &&
             at.countsGoTo != "lines") {
    writeCounts(at);
  }
}

CUcontext &piko::testdriver::currentContext() {
  thread_local CUcontext current = nullptr;
  return current;
}

Context *piko::testdriver::contextOf(CUcontext handle) {
  for (auto &device : state().devices)
    if (handle && device->handle == handle)
      return device.get();
  return nullptr;
}

static const char *kindOf(AllocationKind kind) {
  switch (kind) {
  case AllocationKind::Device:
    return "device memory";
  case AllocationKind::Managed:
    return "managed memory";
  case AllocationKind::Host:
    return "pinned memory of the host";
  case AllocationKind::Module:
    break;
  }
  return "memory of a module";
}

std::string Context::describe() const {
  std::string text;
  for (const auto &[address, it] : memory.all())
    if (it.kind != AllocationKind::Module)
      text += std::to_string(it.bytes) + " bytes of " + kindOf(it.kind) + "\n";
  for (const auto &[handle, module] : modules) {
    text += "module";
    for (const auto &function : module->syntax.functions)
      text += " " + function.name;
    text += "\n";
  }
  if (!streams.empty())
    text += std::to_string(streams.size()) + " streams\n";
  const auto whole =
      std::count_if(graphs.begin(), graphs.end(),
                    [](const auto &graph) { return !graph.second.isBody; });
  if (whole)
    text += std::to_string(whole) + " graphs\n";
  if (!executables.empty())
    text += std::to_string(executables.size()) + " executable graphs\n";
  if (!events.empty())
    text += std::to_string(events.size()) + " events\n";
  return text;
}

Call::Call(const char *function, Needs needs)
    : guard(state().lock), function(function) {
  ++state().calls[function];
  error = begin(needs);
}

CUresult Call::injected() {
  auto &failures = state().failures;
  CUresult found = CUDA_SUCCESS;
  for (size_t i = 0; i < failures.size();) {
    Failure &failure = failures[i];
    if (!failure.function.empty() && failure.function != function) {
      ++i;
    } else if (--failure.calls) {
      ++i;
    } else {
      found = failure.error;
      failures.erase(failures.begin() + static_cast<ptrdiff_t>(i));
    }
  }
  return found;
}

/// Errors of kernels, after which a context is of no use.
static bool isSticky(CUresult error) {
  return error == CUDA_ERROR_ILLEGAL_ADDRESS ||
         error == CUDA_ERROR_LAUNCH_TIMEOUT ||
         (error >= CUDA_ERROR_HARDWARE_STACK_ERROR &&
          error <= CUDA_ERROR_LAUNCH_FAILED);
}

CUresult Call::begin(Needs needs) {
  if (CUresult failure = injected()) {
    if (Context *of = contextOf(currentContext()); of && isSticky(failure))
      of->failed = failure;
    return fail(failure, "made to fail");
  }
  if (needs == Needs::Nothing)
    return CUDA_SUCCESS;
  if (!state().initialized)
    return fail(CUDA_ERROR_NOT_INITIALIZED, "cuInit was not called");
  if (needs == Needs::Initialization)
    return CUDA_SUCCESS;
  current = contextOf(currentContext());
  if (!current)
    return fail(CUDA_ERROR_INVALID_CONTEXT,
                currentContext() ? "the current context was released"
                                 : "no context is current");
  // Its text is that of the kernel.
  if (current->failed || needs == Needs::Context)
    return current->failed;
  return refuseCaptures(
      CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED, [](const Stream &stream) {
        return stream.capture->mode == CU_STREAM_CAPTURE_MODE_GLOBAL ||
               (stream.capture->mode == CU_STREAM_CAPTURE_MODE_THREAD_LOCAL &&
                stream.capture->thread == std::this_thread::get_id());
      });
}

CUresult Call::fail(CUresult result, const std::string &text) const {
  const char *name = nameOf(result);
  state().error = std::string(function) + ": " + (name ? name : "error") +
                  (text.empty() ? "" : ": " + text);
  if (state().printsErrors)
    std::fprintf(stderr, "%s\n", state().error.c_str());
  return result;
}
