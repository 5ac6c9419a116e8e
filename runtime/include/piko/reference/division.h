//===- piko/reference/division.h - Divisions without a result -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where the machine traps an integer division that has no result, the trap
// becomes an exception. An exception cannot leave a signal handler, because the
// division is no call: the handler jumps to where the user's code was called,
// on the same stack, past the destructors in between.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_DIVISION_H
#define PIKO_REFERENCE_DIVISION_H

#include <mutex>
#include <setjmp.h>
#include <signal.h>
#include <utility>

namespace piko::reference {

/// An integer division by 0, or one whose quotient overflows.
struct NoQuotient {};

class DivisionTrap {
public:
  /// Calls f; throws NoQuotient if the machine traps a division in it.
  template <class F> static void guard(F &&f) {
    DivisionTrap trap;
    if (sigsetjmp(trap.back, /*savemask=*/0) == 0)
      f();
    else
      trap.trapped = true;
    if (trap.trapped)
      throw NoQuotient();
  }

  /// The innermost one of this thread, or of a fiber.
  static DivisionTrap *&current() {
    static thread_local DivisionTrap *trap = nullptr;
    return trap;
  }

  /// Takes the signal for as long as any pipeline runs.
  class Handler {
  public:
    Handler() {
      std::lock_guard<std::mutex> lock(mutex());
      if (users()++ > 0)
        return;
      struct sigaction action = {};
      action.sa_sigaction = &DivisionTrap::handle;
      action.sa_flags = SA_SIGINFO | SA_NODEFER;
      sigaction(SIGFPE, &action, &previous());
    }
    ~Handler() {
      std::lock_guard<std::mutex> lock(mutex());
      if (--users() == 0)
        sigaction(SIGFPE, &previous(), nullptr);
    }
    Handler(const Handler &) = delete;
    Handler &operator=(const Handler &) = delete;
  };

private:
  DivisionTrap() : outer(std::exchange(current(), this)) {}
  ~DivisionTrap() { current() = outer; }

  static void handle(int, siginfo_t *info, void *) {
    DivisionTrap *trap = current();
    if (trap && info->si_code == FPE_INTDIV) {
      // A sanitizer calls this from a handler of its own, which blocks it.
      sigset_t signal;
      sigemptyset(&signal);
      sigaddset(&signal, SIGFPE);
      pthread_sigmask(SIG_UNBLOCK, &signal, nullptr);
      siglongjmp(trap->back, 1);
    }
    // Not ours: the instruction runs again, and traps again.
    sigaction(SIGFPE, &previous(), nullptr);
  }

  static std::mutex &mutex() {
    static std::mutex mutex;
    return mutex;
  }
  static int &users() {
    static int users = 0;
    return users;
  }
  static struct sigaction &previous() {
    static struct sigaction previous = {};
    return previous;
  }

  sigjmp_buf back;
  volatile bool trapped = false;
  DivisionTrap *outer;
};

} // namespace piko::reference

#endif // PIKO_REFERENCE_DIVISION_H
