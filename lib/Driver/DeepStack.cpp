// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stack enough for compilers, and hosts that live on where they fail.

#include "Piko/Driver/DeepStack.h"

#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/ThreadTrial.h"
#include "piko/arithmetic.h"

#include "llvm/Support/ErrorHandling.h"
#include "llvm/Support/Threading.h"
#include "llvm/Support/raw_ostream.h"

#include <cerrno>
#include <csetjmp>
#include <cstdlib>
#include <mutex>
#include <system_error>

#include <pthread.h>
#include <signal.h>

static constexpr size_t largestStack = size_t(1) << 30;
static constexpr size_t smallestStack = size_t(16) << 20;

static void *callOnThread(void *function) {
  piko::detail::ArithmeticScope arithmetic;
  (*static_cast<llvm::function_ref<void()> *>(function))();
  return nullptr;
}

/// Calls pthread_create so that signals are the other threads'.
static int createWithoutSignals(pthread_t &thread,
                                const pthread_attr_t &attributes,
                                llvm::function_ref<void()> &function) {
  sigset_t others, before;
  sigfillset(&others);
  for (int own : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS})
    sigdelset(&others, own);
  // A thread begins with the mask of the one that makes it.
  pthread_sigmask(SIG_BLOCK, &others, &before);
  int error = pthread_create(&thread, &attributes, callOnThread, &function);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return error;
}

/// Why the system gave no thread; 0 if it did, which has ended.
static int callWithStack(size_t size, llvm::function_ref<void()> function) {
  pthread_attr_t attributes;
  if (int error = pthread_attr_init(&attributes))
    return error;
  pthread_t thread;
  int error = pthread_attr_setstacksize(&attributes, size);
  if (!error)
    error = createWithoutSignals(thread, attributes, function);
  pthread_attr_destroy(&attributes);
  return error ? error : pthread_join(thread, nullptr);
}

/// With the deepest stack that there is.
static int callOnDeepStack(llvm::function_ref<void()> function) {
  int error = 0;
  for (size_t size = largestStack; size >= smallestStack; size /= 2)
    if (error = callWithStack(size, function); !error)
      break;
  return error;
}

void piko::runOnDeepStack(llvm::function_ref<void()> function) {
  if (callOnDeepStack(function) != 0)
    function();
}

static void endOutOfMemory(void *, const char *, bool) {
  piko::support::endOutOfMemory();
}

/// Whether the process is a program's, which ends where LLVM gets no memory.
static bool isProgram = false;

int piko::runMainOnDeepStack(llvm::function_ref<int()> main) {
  llvm::install_bad_alloc_error_handler(endOutOfMemory);
  isProgram = true;
  int status = 1;
  runOnDeepStack([&] { status = main(); });
  return status;
}

// --- Fatal errors -----------------------------------------------------------

namespace {

/// LLVM's fatal errors, as long as some call is contained.
class FatalErrors {
public:
  FatalErrors() {
    std::lock_guard lock(mutex);
    if (users++ != 0)
      return;
    llvm::install_fatal_error_handler(handle);
    if (!isProgram)
      llvm::install_bad_alloc_error_handler(handleBadAlloc);
  }
  FatalErrors(const FatalErrors &) = delete;
  FatalErrors &operator=(const FatalErrors &) = delete;
  ~FatalErrors() {
    std::lock_guard lock(mutex);
    if (--users != 0)
      return;
    llvm::remove_fatal_error_handler();
    if (!isProgram)
      llvm::remove_bad_alloc_error_handler();
  }

  /// Where `function` is left `why` says why.
  static void contain(llvm::function_ref<void()> function,
                      std::optional<std::string> &why) {
    jmp_buf back;
    reason = &why;
    here = &back;
    if (setjmp(back) == 0)
      function();
    here = nullptr;
  }

private:
  static void handle(void *, const char *text, bool) {
    if (!here) {
      llvm::errs() << "LLVM ERROR: " << text << "\n";
      return; // LLVM ends the process
    }
    *reason = text;
    longjmp(*here, 1);
  }

  /// As LLVM does it by itself, where no call is contained.
  static void handleBadAlloc(void *, const char *text, bool) {
    if (!here) {
      llvm::errs() << "LLVM ERROR: out of memory: " << text << "\n";
      std::abort();
    }
    *reason = "out of memory"; // so short a text needs none
    longjmp(*here, 1);
  }

  static std::mutex mutex;
  static int users;
  static thread_local std::optional<std::string> *reason;
  static thread_local jmp_buf *here;
};

std::mutex FatalErrors::mutex;
int FatalErrors::users = 0;
thread_local std::optional<std::string> *FatalErrors::reason = nullptr;
thread_local jmp_buf *FatalErrors::here = nullptr;

} // namespace

std::optional<std::string>
piko::runContained(llvm::function_ref<void()> function) {
  FatalErrors handler;
  std::optional<std::string> why;
  int refused = callOnDeepStack([&] { FatalErrors::contain(function, why); });
  if (refused)
    return "cannot make a thread to compile in: " +
           std::generic_category().message(refused);
  if (why)
    why = "the compiler failed: " + *why;
  return why;
}

// --- Threads ----------------------------------------------------------------

bool piko::canUseThreads() {
  unsigned wanted = llvm::hardware_concurrency().compute_thread_count();
  return support::tryThreads(wanted) == wanted;
}
