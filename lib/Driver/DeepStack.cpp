// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Driver/DeepStack.h"

#include <pthread.h>
#include <signal.h>

static constexpr size_t largestStack = size_t(1) << 30;
static constexpr size_t smallestStack = size_t(16) << 20;

static void *callOnThread(void *function) {
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

/// Whether the system gave a thread, which has ended.
static bool callWithStack(size_t size, llvm::function_ref<void()> function) {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0)
    return false;
  pthread_t thread;
  bool made = pthread_attr_setstacksize(&attributes, size) == 0 &&
              createWithoutSignals(thread, attributes, function) == 0;
  pthread_attr_destroy(&attributes);
  return made && pthread_join(thread, nullptr) == 0;
}

void piko::runOnDeepStack(llvm::function_ref<void()> function) {
  for (size_t size = largestStack; size >= smallestStack; size /= 2)
    if (callWithStack(size, function))
      return;
  function();
}
