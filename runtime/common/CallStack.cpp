// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CallStack.cpp - Stack enough for a run -----------------------------===//

#include "common/CallStack.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <pthread.h>
#include <sys/mman.h>
#include <ucontext.h>
#include <unistd.h>
#include <utility>
#include <vector>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#include <sanitizer/common_interface_defs.h>
#define PIKO_ADDRESS_SANITIZER
#endif
#endif

using namespace piko::rt;

namespace {

constexpr size_t fewestBytes = size_t(1) << 20;

/// Memory that a stack grows down in.
struct Bounds {
  uintptr_t low = 0, high = 0;
  /// What is left below `address`; 0 if that is of another stack.
  size_t left(uintptr_t address) const {
    return address >= low && address < high ? address - low : 0;
  }
};

/// Only what is touched takes memory; to grow beyond it is a fault.
class Stack {
public:
  static constexpr size_t bytes = size_t(8) << 20;

  Stack()
      : memory(mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                    MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1,
                    0)) {
    if (!isMade())
      return;
    madvise(memory, bytes, MADV_NOHUGEPAGE);
    mprotect(memory, guardBytes(), PROT_NONE);
  }
  Stack(const Stack &) = delete;
  Stack &operator=(const Stack &) = delete;
  ~Stack() {
    if (isMade())
      munmap(memory, bytes);
  }

  bool isMade() const { return memory != MAP_FAILED; }
  Bounds bounds() const {
    auto start = reinterpret_cast<uintptr_t>(memory);
    return {start + guardBytes(), start + bytes};
  }

private:
  static size_t guardBytes() {
    return static_cast<size_t>(sysconf(_SC_PAGESIZE));
  }

  void *memory;
};

/// What a thread has; a fiber's host may be in several calls at a time.
struct ThreadStacks {
  Bounds own = find();
  Bounds current; ///< Of the innermost call that runs on one of ours.
  std::vector<std::unique_ptr<Stack>> kept;

  std::unique_ptr<Stack> take() {
    if (kept.empty())
      return std::make_unique<Stack>();
    std::unique_ptr<Stack> stack = std::move(kept.back());
    kept.pop_back();
    return stack;
  }

private:
  static Bounds find() {
    pthread_attr_t attributes;
    if (pthread_getattr_np(pthread_self(), &attributes) != 0)
      return {};
    void *low = nullptr;
    size_t size = 0, guard = 0;
    pthread_attr_getstack(&attributes, &low, &size);
    pthread_attr_getguardsize(&attributes, &guard);
    pthread_attr_destroy(&attributes);
    auto start = reinterpret_cast<uintptr_t>(low);
    return {start + guard, start + size};
  }
};

/// A call that has changed the stack.
struct Call {
  void (*body)(void *);
  void *data;
  Bounds bounds;
  ucontext_t host{}, self{};

  void begin() {
#ifdef PIKO_ADDRESS_SANITIZER
    void *fake = nullptr;
    __sanitizer_start_switch_fiber(&fake, reinterpret_cast<void *>(bounds.low),
                                   bounds.high - bounds.low);
    swapcontext(&host, &self);
    __sanitizer_finish_switch_fiber(fake, nullptr, nullptr);
#else
    swapcontext(&host, &self);
#endif
  }

  void run() {
#ifdef PIKO_ADDRESS_SANITIZER
    const void *low = nullptr;
    size_t size = 0;
    __sanitizer_finish_switch_fiber(nullptr, &low, &size);
    body(data);
    __sanitizer_start_switch_fiber(nullptr, low, size);
#else
    body(data);
#endif
  }
};

thread_local Call *starting = nullptr;

} // namespace

static ThreadStacks &threadStacks() {
  static thread_local ThreadStacks stacks;
  return stacks;
}

/// Where a new stack begins; after it `uc_link` is gone on with.
static void enter() { starting->run(); }

static void callOn(const Bounds &bounds, void (*body)(void *), void *data) {
  Call call{body, data, bounds};
  getcontext(&call.self);
  call.self.uc_stack.ss_sp = reinterpret_cast<void *>(bounds.low);
  call.self.uc_stack.ss_size = bounds.high - bounds.low;
  call.self.uc_link = &call.host;
  makecontext(&call.self, enter, 0);
  starting = &call;
  call.begin();
}

bool piko::rt::callWithStack(void (*body)(void *), void *data) noexcept {
  auto here = reinterpret_cast<uintptr_t>(__builtin_frame_address(0));
  try {
    ThreadStacks &stacks = threadStacks();
    if (std::max(stacks.own.left(here), stacks.current.left(here)) >=
        fewestBytes) {
      body(data);
      return true;
    }
    std::unique_ptr<Stack> stack = stacks.take();
    if (!stack->isMade())
      return false;
    stacks.kept.reserve(stacks.kept.size() + 1);
    Bounds before = std::exchange(stacks.current, stack->bounds());
    callOn(stack->bounds(), body, data);
    stacks.current = before;
    stacks.kept.push_back(std::move(stack));
    return true;
  } catch (...) {
    return false;
  }
}
