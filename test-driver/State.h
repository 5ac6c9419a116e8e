// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- State.h - What the driver for tests holds --------------------------===//
//
// One state for the process, after one lock, which a call holds from its begin
// to its end. Handles are numbers that are never given twice, so that those of
// what has been destroyed are found out.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_STATE_H
#define PIKO_TEST_DRIVER_STATE_H

#include "Symbols.h"
#include "TestDriver.h"
#include "Work.h"
#include "ptx/Machine.h"

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace piko::testdriver {

using namespace piko::cuda;

enum class AllocationKind : uint8_t { Device, Managed, Host, Module };

/// Memory that kernels may access.
struct Allocation {
  AllocationKind kind = AllocationKind::Device;
  uint64_t begin = 0, bytes = 0; ///< As the program knows them.
  uint64_t mapped = 0;           ///< Bytes, in whole pages.
  /// Where the memory is in the host: at `begin` if not of the device alone,
  /// whose addresses the host cannot use.
  uint8_t *memory = nullptr;
};

/// Allocations by their addresses.
class MemoryTable : public ptx::Memory {
public:
  MemoryTable() = default;
  MemoryTable(const MemoryTable &) = delete;
  MemoryTable &operator=(const MemoryTable &) = delete;
  ~MemoryTable() override { clear(); }

  /// Null if the system has no more.
  const Allocation *allocate(AllocationKind kind, uint64_t bytes);
  /// \p address must be the begin of one.
  void release(uint64_t address);
  void clear();

  /// The allocation that an address lies in; null if there is none.
  const Allocation *at(uint64_t address) const;
  Range find(uint64_t address) const override;
  std::string describe(uint64_t address) const override;

  const std::map<uint64_t, Allocation> &all() const { return allocations; }
  uint64_t deviceBytes() const { return used; }

private:
  std::map<uint64_t, Allocation> allocations;
  std::vector<Allocation> released; ///< The last ones, for messages.
  uint64_t used = 0;                ///< Of the device.
};

struct Module;

struct Function {
  Module *module = nullptr;
  ptx::Program program;
  bool loaded = false; ///< By what asked for more than its handle.
};

struct Module : ptx::Symbols {
  std::string source; ///< That `syntax` points into.
  ptx::ModuleSyntax syntax;
  std::map<std::string, uint64_t, std::less<>> variables; ///< Addresses.
  std::map<std::string, CUfunction, std::less<>> functions;
  uint64_t constantBytes = 0;

  uint64_t addressOf(std::string_view name) const override {
    auto found = variables.find(name);
    return found == variables.end() ? 0 : found->second;
  }
};

/// Blocks that run at the same time on a multiprocessor. A program declares
/// more registers than it needs: a thread has 64, if it does not say how many.
int residentBlocks(const ptx::Program &program, int threads,
                   size_t dynamicSharedBytes);

/// Of a stream whose work becomes nodes.
struct Capture {
  CUstreamCaptureMode mode = CU_STREAM_CAPTURE_MODE_GLOBAL;
  std::thread::id thread; ///< That began it.
  bool valid = true;
  CUgraph graph = nullptr;
  bool isOwner = true;        ///< Of the graph: it made it.
  CUgraphNode last = nullptr; ///< That the next node follows.
};

struct Graph {
  Nodes nodes;
  bool isBody = false; ///< Of a node, which destroys it.

  CUgraphNode last() const {
    return nodes.empty() ? CUgraphNode() : nodes.back().handle;
  }
  CUgraphNode add(Work work);
};

struct Executable {
  CUgraph graph = nullptr; ///< That it was made of.
  Nodes nodes;
};

/// What conditional nodes ask, by its handle.
struct Condition {
  CUgraph graph = nullptr;
  uint32_t initial = 0, value = 0;
  bool isAssigned = false; ///< Its initial value, at each launch.
  bool isUsed = false;     ///< By a node.
};

class Call;

/// What a stream has still to do.
using Later = std::deque<std::function<void(const Call &)>>;

struct Stream {
  unsigned flags = 0;
  std::optional<Capture> capture;
  Later later;
};

struct Event {
  bool recorded = false, isTimed = true;
  Later *waiting = nullptr;    ///< In that it is still to happen.
  uint64_t records = 0;        ///< How often it was recorded.
  CUstream captured = nullptr; ///< In a capture of it, if it was the last.
  std::chrono::steady_clock::time_point time;
};

/// A device's primary context, and what was made in it.
struct Context {
  int references = 0;
  CUcontext handle = nullptr;
  CUresult failed = CUDA_SUCCESS; ///< Of a kernel; all calls return it.
  MemoryTable memory;
  std::map<CUmodule, std::unique_ptr<Module>> modules;
  std::map<CUfunction, Function> functions;
  std::map<CUstream, Stream> streams;
  std::map<CUevent, Event> events;
  std::map<CUgraph, Graph> graphs;
  std::map<CUgraphExec, Executable> executables;
  std::map<CUgraphConditionalHandle, Condition> conditions;
  Later later; ///< Of streams that wait for each other.

  /// What a live stream, or one that is not created, has still to do.
  Later &laterOf(CUstream stream);
  /// Null if the stream is not captured.
  Capture *captureOf(CUstream stream);
  /// With the bodies of its nodes.
  void destroyGraph(CUgraph graph);
  /// What is alive, a line each.
  std::string describe() const;
};

struct Failure {
  std::string function; ///< Any if empty.
  uint64_t calls;       ///< Until it happens.
  CUresult error;
};

/// In what a device may differ from what is usual.
struct Modes {
  bool apart = false, buffered = false, lazy = false;
};

/// Sets latencies as the text says; false if it is none.
bool parseLatencies(std::string_view text,
                    std::optional<ptx::Latencies> &latencies);
/// Reads names with commas between them; what is wrong, or nothing.
std::string parseModes(std::string_view names, Modes &modes);

struct State {
  State();
  State(const State &) = delete;
  State &operator=(const State &) = delete;

  std::recursive_mutex lock;
  bool initialized = false;
  std::vector<std::unique_ptr<Context>> devices;
  int capability = 90;     ///< 10 * major + minor.
  int multiprocessors = 4; ///< That a device says to have.
  uint64_t memoryLimit = uint64_t(16) << 30;
  uint64_t seed = 0;
  uint64_t launches = 0; ///< Of which each has a seed of its own.
  Modes modes;
  std::optional<ptx::Latencies> latencies; ///< Where spans are counted.
  std::string countsGoTo; ///< As the environment says; empty: nowhere.
  bool printsErrors = false;
  bool delays =
      false; ///< Streams do what they have to when they are waited for.

  std::vector<Failure> failures;
  std::map<std::string, uint64_t, std::less<>> calls;
  std::string error, leaks;
  std::map<std::string, PikoTestDriverCounts, std::less<>> counts;
  PikoTestDriverHostCounts hostCounts{};
  /// Of the graph that runs, or null.
  ptx::Footprint *graphFootprint = nullptr;

  template <typename Handle> Handle newHandle() {
    return reinterpret_cast<Handle>(nextHandle += 16);
  }

private:
  uintptr_t nextHandle = 0x1000;
};

/// Made by the first call, and never destroyed: objects of the program may call
/// the driver until it ends.
State &state();

/// What a call needs.
enum class Needs : uint8_t {
  Nothing,
  Initialization,
  Context,
  /// A context, and no capture that forbids what may wait for the device.
  NoCapture
};

/// A call of the driver: counted, made to fail, and locked.
class Call {
public:
  Call(const char *function, Needs needs);
  Call(const Call &) = delete;
  Call &operator=(const Call &) = delete;

  /// What to return at once; CUDA_SUCCESS if the call may go on.
  CUresult refused() const { return error; }
  /// The calling thread's.
  Context &context() const { return *current; }
  /// Keeps the text; returns \p result.
  CUresult fail(CUresult result, const std::string &text) const;
  /// Whether a stream may be used: null, or a live one of the context, whose
  /// capture is valid if there is one.
  CUresult checkStream(CUstream stream) const;
  /// Waits for a stream, if the host may; counts that it does.
  CUresult waitFor(CUstream stream) const;
  /// Lets streams do all that they have to, or what leads to an event; the
  /// error of a kernel.
  CUresult finish(Later &later, const Event *upTo = nullptr) const;
  CUresult finishAll() const;
  /// Makes captures invalid that hold for \p which; says so if there are any.
  template <typename F> CUresult refuseCaptures(CUresult error, F which) const {
    bool found = false;
    for (auto &[handle, stream] : current->streams)
      if (stream.capture && which(stream)) {
        stream.capture->valid = false;
        found = true;
      }
    return found ? fail(error, "a stream is captured") : CUDA_SUCCESS;
  }

private:
  CUresult begin(Needs needs);
  CUresult injected();

  std::unique_lock<std::recursive_mutex> guard;
  const char *function;
  Context *current = nullptr;
  CUresult error = CUDA_SUCCESS;
};

/// Whether it is none that the host creates.
inline bool isDefault(CUstream stream) {
  return !stream || stream == CU_STREAM_LEGACY ||
         stream == CU_STREAM_PER_THREAD;
}

/// The calling thread's current context.
CUcontext &currentContext();
/// Null if it is no live context.
Context *contextOf(CUcontext handle);

/// Names and texts of errors; null for none of them.
const char *nameOf(CUresult error);
const char *textOf(CUresult error);

} // namespace piko::testdriver

#endif // PIKO_TEST_DRIVER_STATE_H
