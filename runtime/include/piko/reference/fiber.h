//===- piko/reference/fiber.h - A function that can be suspended ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The iterations of a parallelFor that calls sync() take turns, each on a
// stack of its own.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_FIBER_H
#define PIKO_REFERENCE_FIBER_H

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
    swapcontext(&self, &resumer);
    if (cancelled)
      throw Cancelled();
  }

  bool isDone() const { return done; }

private:
  static constexpr size_t stackSize = 256 * 1024;
  struct Cancelled {};

  static Fiber *&starting() {
    static thread_local Fiber *fiber = nullptr;
    return fiber;
  }

  void switchTo() {
    if (!started)
      starting() = this;
    started = true;
    swapcontext(&resumer, &self);
  }

  static void enter() {
    Fiber *fiber = starting();
    fiber->runBody();
    swapcontext(&fiber->self, &fiber->resumer);
  }

  void runBody() {
    try {
      body();
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
