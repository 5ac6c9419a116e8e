//===- piko/reference/fiber.h - A function that can be suspended ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The iterations of a parallelFor that calls sync() take turns, each on a
// stack of its own.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_FIBER_H
#define PIKO_REFERENCE_FIBER_H

#include <piko/reference/division.h>

#include <exception>
#include <functional>
#include <new>
#include <sys/mman.h>
#include <ucontext.h>
#include <utility>

namespace piko::reference {

/// Stacks of fibers. Only what is touched takes memory: they come from the
/// system by themselves, since an allocator may have large pages. They are kept
/// for the next fibers, each with the address of another one at its end.
class StackPool {
public:
  static constexpr size_t stackSize = 1024 * 1024;

  void *take() {
    if (!kept)
      return map();
    void *stack = kept;
    kept = next(stack);
    return stack;
  }
  void give(void *stack) {
    next(stack) = kept;
    kept = stack;
  }

  StackPool() = default;
  StackPool(const StackPool &) = delete;
  StackPool &operator=(const StackPool &) = delete;
  ~StackPool() {
    while (kept)
      munmap(take(), stackSize);
  }

private:
  static void *map() {
    void *stack =
        mmap(nullptr, stackSize, PROT_READ | PROT_WRITE,
             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
    if (stack == MAP_FAILED)
      throw std::bad_alloc();
    madvise(stack, stackSize, MADV_NOHUGEPAGE);
    return stack;
  }
  /// Where stacks begin, so that it takes no page more.
  static void *&next(void *stack) {
    return *(static_cast<void **>(stack) + stackSize / sizeof(void *) - 1);
  }

  void *kept = nullptr;
};

class Fiber {
public:
  Fiber(StackPool &stacks, std::function<void()> body)
      : stacks(stacks), body(std::move(body)), stack(stacks.take()) {
    getcontext(&self);
    self.uc_stack.ss_sp = stack;
    self.uc_stack.ss_size = StackPool::stackSize;
    self.uc_link = nullptr;
    makecontext(&self, &Fiber::enter, 0);
  }
  Fiber(const Fiber &) = delete;
  Fiber &operator=(const Fiber &) = delete;
  ~Fiber() {
    if (started && !done) { // unwind its stack
      cancelled = true;
      switchTo();
    }
    stacks.give(stack);
  }

  /// Runs the fiber until it suspends or ends; throws what it threw.
  void resume() {
    switchTo();
    if (error)
      std::rethrow_exception(std::exchange(error, nullptr));
  }

  /// Called in the fiber: returns to resume() until the next resume().
  void suspend() {
    DivisionTrap *trap = DivisionTrap::current();
    swapcontext(&self, &resumer);
    DivisionTrap::current() = trap;
    if (cancelled)
      throw Cancelled();
  }

  bool isDone() const { return done; }

private:
  struct Cancelled {};

  static Fiber *&starting() {
    static thread_local Fiber *fiber = nullptr;
    return fiber;
  }

  void switchTo() {
    if (!started)
      starting() = this;
    started = true;
    DivisionTrap *trap = DivisionTrap::current();
    swapcontext(&resumer, &self);
    DivisionTrap::current() = trap;
  }

  static void enter() {
    Fiber *fiber = starting();
    fiber->runBody();
    swapcontext(&fiber->self, &fiber->resumer);
  }

  void runBody() {
    try {
      DivisionTrap::guard(body);
    } catch (const Cancelled &) {
    } catch (...) {
      error = std::current_exception();
    }
    done = true;
  }

  StackPool &stacks;
  std::function<void()> body;
  void *stack;
  ucontext_t self, resumer;
  std::exception_ptr error;
  bool started = false, done = false, cancelled = false;
};

} // namespace piko::reference

#endif // PIKO_REFERENCE_FIBER_H
