// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Emulator.cpp - A GPU that a thread of the CPU emulates
//----------------===//
//
// Blocks run one after the other. The threads of a block take turns, each on a
// stack of its own, and change at barriers and at operations of warps:
//
//   barrier     goes on when all threads of the block have come to it, and may
//               say whether a condition holds for one of them;
//   with mask   (shuffle, ballot) when all lanes of the mask have;
//   activemask  when no lane of the warp can go on: those that have come to the
//               same place are active together.
//
// Where nothing can go on and not all threads have ended, threads wait for
// each other: an error of the run.
//
//===----------------------------------------------------------------------===//

// longjmp goes to other stacks here.
#undef _FORTIFY_SOURCE

#include "common/Pipeline.h"
#include "pikort/grid.h"

#include <algorithm>
#include <csetjmp>
#include <numeric>
#include <string>
#include <sys/mman.h>
#include <ucontext.h>
#include <utility>

static constexpr int64_t warpSize = 32;
/// Only what is touched takes memory. No power of two: else the frames of all
/// threads, and what maps their pages, would be in the same few sets of the
/// caches.
static constexpr size_t stackSize =
    (size_t(64) << 20) + (size_t(32) << 10) + 832;

namespace {

enum class State { Ready, Barrier, Ballot, Shuffle, Active, Done };

struct Thread {
  State state = State::Ready;
  bool started = false;
  jmp_buf self;
  uint32_t mask = 0;      ///< Of a Ballot or a Shuffle.
  int32_t value = 0;      ///< What it gives, then what it gets.
  int32_t lane = 0;       ///< That a Shuffle asks.
  void *site = nullptr;   ///< Of an Active.
  bool condition = false; ///< That it brings to a Barrier.
};

/// Stacks of threads, kept from launch to launch: pages that are new cost more
/// than a short kernel does.
class Stacks {
public:
  Stacks() = default;
  Stacks(const Stacks &) = delete;
  Stacks &operator=(const Stacks &) = delete;
  ~Stacks() { release(); }
  /// For at least so many; false if there is no room.
  bool reserve(size_t threads) {
    if (threads <= count)
      return true;
    release();
    void *mapped = mmap(nullptr, threads * stackSize, PROT_READ | PROT_WRITE,
                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (mapped == MAP_FAILED)
      return false;
    memory = mapped;
    count = threads;
    return true;
  }
  void *at(size_t thread) {
    return static_cast<uint8_t *>(memory) + thread * stackSize;
  }

private:
  void release() {
    if (memory)
      munmap(memory, count * stackSize);
    memory = nullptr;
    count = 0;
  }

  void *memory = nullptr;
  size_t count = 0;
};

class EmulatedDevice {
public:
  EmulatedDevice(void (*code)(const void *), const void *arguments,
                 int64_t blocks, int64_t threads, Stacks &stacks)
      : threads(static_cast<size_t>(threads)), blocks(blocks), code(code),
        arguments(arguments), stacks(stacks) {}

  /// What is wrong; empty if nothing.
  std::string runBlock(int64_t number);
  /// Lets others run until the current thread can go on.
  void suspend(State state);

  std::vector<Thread> threads;
  int64_t blocks, block = 0;
  size_t current = 0;
  bool agreed = false; ///< At the last barrier: the condition of some thread.

private:
  static void enter();
  void resume(size_t thread);
  void passBarrier();
  bool resolveWarps();
  bool resolveMasked(size_t first, size_t end);
  bool resolveActive(size_t first, size_t end);
  std::string describe() const;

  void (*code)(const void *);
  const void *arguments;
  jmp_buf scheduler;
  Stacks &stacks;
};

thread_local EmulatedDevice *device = nullptr;

} // namespace

// Not inlined: a jump must not skip what a caller keeps in registers.
[[gnu::noinline]] void EmulatedDevice::enter() {
  device->code(device->arguments);
  device->threads[device->current].state = State::Done;
  _longjmp(device->scheduler, 1);
}

[[gnu::noinline]] void EmulatedDevice::resume(size_t number) {
  current = number;
  Thread &thread = threads[number];
  if (_setjmp(scheduler) != 0)
    return;
  if (thread.started)
    _longjmp(thread.self, 1);
  thread.started = true;
  ucontext_t context;
  getcontext(&context);
  context.uc_stack.ss_sp = stacks.at(number);
  context.uc_stack.ss_size = stackSize;
  context.uc_link = nullptr;
  makecontext(&context, &EmulatedDevice::enter, 0);
  setcontext(&context);
}

[[gnu::noinline]] void EmulatedDevice::suspend(State state) {
  Thread &thread = threads[current];
  thread.state = state;
  if (_setjmp(thread.self) == 0)
    _longjmp(scheduler, 1);
}

/// Operations whose mask says which lanes take part.
bool EmulatedDevice::resolveMasked(size_t first, size_t end) {
  bool any = false;
  for (size_t i = first; i < end; ++i) {
    State state = threads[i].state;
    uint32_t mask = threads[i].mask;
    if (state != State::Ballot && state != State::Shuffle)
      continue;
    bool isComplete = true;
    for (size_t j = first; j < first + warpSize; ++j)
      if (mask >> (j - first) & 1)
        isComplete &=
            j < end && threads[j].state == state && threads[j].mask == mask;
    if (!isComplete || !(mask >> (i - first) & 1))
      continue;
    std::array<int32_t, warpSize> results{};
    for (size_t j = first; j < end; ++j)
      if (mask >> (j - first) & 1) {
        size_t from = first + static_cast<size_t>(threads[j].lane & 31);
        if (state == State::Shuffle)
          results[j - first] =
              threads[from < end && (mask >> (from - first) & 1) ? from : j]
                  .value;
        else if (threads[j].value)
          for (size_t k = first; k < end; ++k)
            results[k - first] |= static_cast<int32_t>(1u << (j - first));
      }
    for (size_t j = first; j < end; ++j)
      if (mask >> (j - first) & 1) {
        threads[j].value = results[j - first];
        threads[j].state = State::Ready;
      }
    any = true;
  }
  return any;
}

bool EmulatedDevice::resolveActive(size_t first, size_t end) {
  auto lanes = [&](auto predicate) {
    return std::any_of(threads.begin() + static_cast<ptrdiff_t>(first),
                       threads.begin() + static_cast<ptrdiff_t>(end),
                       predicate);
  };
  if (lanes([](const Thread &t) { return t.state == State::Ready; }))
    return false;
  void *site = nullptr;
  uint32_t mask = 0;
  for (size_t i = first; i < end; ++i)
    if (threads[i].state == State::Active &&
        (!site || threads[i].site == site)) {
      site = threads[i].site;
      mask |= 1u << (i - first);
    }
  for (size_t i = first; i < end; ++i)
    if (mask >> (i - first) & 1) {
      threads[i].value = static_cast<int32_t>(mask);
      threads[i].state = State::Ready;
    }
  return mask != 0;
}

void EmulatedDevice::passBarrier() {
  agreed = false;
  for (Thread &thread : threads) {
    agreed |= std::exchange(thread.condition, false);
    thread.state = State::Ready;
  }
}

bool EmulatedDevice::resolveWarps() {
  bool any = false;
  for (size_t first = 0; first < threads.size(); first += warpSize) {
    size_t end = std::min(first + warpSize, threads.size());
    any |= resolveMasked(first, end) || resolveActive(first, end);
  }
  return any;
}

std::string EmulatedDevice::describe() const {
  size_t waiting = 0, ended = 0, other = 0;
  for (const Thread &thread : threads)
    ++(thread.state == State::Barrier ? waiting
       : thread.state == State::Done  ? ended
                                      : other);
  return "threads of block " + std::to_string(block) +
         " wait for each other: " + std::to_string(waiting) +
         " at a barrier, " + std::to_string(other) +
         " for lanes of their warps, " + std::to_string(ended) + " have ended";
}

std::string EmulatedDevice::runBlock(int64_t number) {
  block = number;
  for (Thread &thread : threads) {
    thread.state = State::Ready;
    thread.started = false;
  }
  while (true) {
    size_t waiting = 0, ended = 0;
    for (size_t i = 0; i < threads.size(); ++i) {
      if (threads[i].state == State::Ready)
        resume(i);
      waiting += threads[i].state == State::Barrier;
      ended += threads[i].state == State::Done;
    }
    if (ended == threads.size())
      return "";
    if (waiting == threads.size())
      passBarrier();
    else if (!resolveWarps())
      return describe();
  }
}

/// The blocks in the order in which they run.
static std::vector<int64_t> orderBlocks(int64_t blocks, int64_t seed) {
  std::vector<int64_t> order(static_cast<size_t>(blocks));
  std::iota(order.begin(), order.end(), 0);
  auto state = static_cast<uint64_t>(seed);
  for (size_t i = order.size(); seed != 0 && i > 1; --i) {
    state += 0x9e3779b97f4a7c15; // splitmix64
    uint64_t bits = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111eb;
    std::swap(order[i - 1], order[(bits ^ (bits >> 31)) % i]);
  }
  return order;
}

extern "C" {

void pikoir_grid_launch(pikort_pipeline *p, void (*thread)(const void *),
                        int64_t blocks, int64_t threads, const void *arguments,
                        int64_t seed) {
  if (p->status != PIKORT_OK)
    return;
  static std::mutex mutex; // the memory of blocks is the code's
  static Stacks stacks;
  std::lock_guard<std::mutex> lock(mutex);
  EmulatedDevice grid(thread, arguments, blocks, threads, stacks);
  if (!stacks.reserve(static_cast<size_t>(threads))) {
    pikoir_fail_text(p, PIKORT_OUT_OF_MEMORY, "no room for a block's threads");
    return;
  }
  device = &grid;
  std::string wrong;
  for (int64_t block : orderBlocks(blocks, seed))
    if (wrong = grid.runBlock(block); !wrong.empty())
      break;
  device = nullptr;
  if (!wrong.empty())
    pikoir_fail_text(p, PIKORT_BAD_PROGRAM, wrong.c_str());
}

int32_t pikoir_gpu_thread() { return static_cast<int32_t>(device->current); }
int32_t pikoir_gpu_block() { return static_cast<int32_t>(device->block); }
int32_t pikoir_gpu_threads() {
  return static_cast<int32_t>(device->threads.size());
}
int32_t pikoir_gpu_blocks() { return static_cast<int32_t>(device->blocks); }
int32_t pikoir_gpu_lane() { return pikoir_gpu_thread() & 31; }
int32_t pikoir_gpu_lanes_below() {
  return static_cast<int32_t>((1u << pikoir_gpu_lane()) - 1);
}

void pikoir_gpu_barrier() { device->suspend(State::Barrier); }

bool pikoir_gpu_barrier_or(int32_t, bool condition) {
  Thread &thread = device->threads[device->current];
  thread.condition = condition;
  device->suspend(State::Barrier);
  return device->agreed;
}

int32_t pikoir_gpu_activemask() {
  Thread &thread = device->threads[device->current];
  thread.site = __builtin_return_address(0);
  device->suspend(State::Active);
  return thread.value;
}

int32_t pikoir_gpu_ballot(int32_t mask, bool vote) {
  Thread &thread = device->threads[device->current];
  thread.mask = static_cast<uint32_t>(mask);
  thread.value = vote;
  device->suspend(State::Ballot);
  return thread.value;
}

int32_t pikoir_gpu_shuffle(int32_t mask, int32_t value, int32_t lane, int32_t) {
  Thread &thread = device->threads[device->current];
  thread.mask = static_cast<uint32_t>(mask);
  thread.value = value;
  thread.lane = lane;
  device->suspend(State::Shuffle);
  return thread.value;
}

} // extern "C"
