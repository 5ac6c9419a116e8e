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
#include <memory>
#include <ucontext.h>
#include <utility>

namespace piko::reference {

class Fiber {
public:
  explicit Fiber(std::function<void()> body)
      : body(std::move(body)), stack(new char[stackSize]) {
    getcontext(&self);
    self.uc_stack.ss_sp = stack.get();
    self.uc_stack.ss_size = stackSize;
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
  /// Only what is touched takes memory.
  static constexpr size_t stackSize = 1024 * 1024;
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

  std::function<void()> body;
  std::unique_ptr<char[]> stack;
  ucontext_t self, resumer;
  std::exception_ptr error;
  bool started = false, done = false, cancelled = false;
};

} // namespace piko::reference

#endif // PIKO_REFERENCE_FIBER_H
