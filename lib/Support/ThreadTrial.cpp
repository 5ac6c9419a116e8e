//===- ThreadTrial.cpp - How many threads the system gives ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Support/ThreadTrial.h"

#include <algorithm>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <unistd.h>

using namespace piko;

/// Addresses that glibc's allocator takes while it makes a heap for a thread
/// that allocates for the first time: twice what it keeps. Whether it gets
/// them near a limit is up to how they lie, so they are counted for each.
static constexpr size_t heapBytes = size_t(128) << 20;

/// The heaps that it makes at most; more threads share them.
static size_t mostHeaps() {
  long processors = sysconf(_SC_NPROCESSORS_ONLN);
  return 8 * static_cast<size_t>(processors > 0 ? processors : 1);
}

namespace {

/// Addresses that nothing else can have.
class Reserve {
public:
  explicit Reserve(size_t bytes)
      : bytes(bytes),
        memory(mmap(nullptr, bytes, PROT_NONE,
                    MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)) {}
  Reserve(Reserve &&other) noexcept
      : bytes(other.bytes), memory(std::exchange(other.memory, MAP_FAILED)) {}
  Reserve &operator=(Reserve &&) = delete;
  ~Reserve() {
    if (memory != MAP_FAILED)
      munmap(memory, bytes);
  }
  bool isHeld() const { return memory != MAP_FAILED; }

private:
  size_t bytes;
  void *memory;
};

/// Threads that wait until as many as there can be are there.
class Trial {
public:
  Trial() {
    sem_init(&began, 0, 0);
    gate.lock();
  }
  Trial(const Trial &) = delete;
  Trial &operator=(const Trial &) = delete;
  ~Trial() {
    gate.unlock();
    for (pthread_t thread : threads)
      pthread_join(thread, nullptr);
    sem_destroy(&began);
  }

  size_t begin(size_t wanted, const pthread_attr_t &attributes) {
    threads.reserve(wanted);
    heaps.reserve(std::min(wanted, mostHeaps()));
    for (pthread_t thread; threads.size() < wanted;) {
      if (heaps.size() < heaps.capacity() &&
          !heaps.emplace_back(heapBytes).isHeld())
        break;
      if (pthread_create(&thread, &attributes, wait, this) != 0)
        break;
      threads.push_back(thread);
      while (sem_wait(&began) != 0)
        ; // interrupted
    }
    return threads.size();
  }

private:
  static void *wait(void *self) {
    auto &trial = *static_cast<Trial *>(self);
    sem_post(&trial.began);
    std::lock_guard lock(trial.gate);
    return nullptr;
  }

  sem_t began;
  std::mutex gate;
  std::vector<pthread_t> threads;
  std::vector<Reserve> heaps;
};

} // namespace

size_t support::tryThreads(size_t wanted, size_t stackBytes) noexcept {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0)
    return 0;
  if (stackBytes > 0)
    pthread_attr_setstacksize(&attributes, stackBytes);
  size_t count = 0;
  try {
    count = Trial().begin(wanted, attributes);
  } catch (const std::bad_alloc &) {
  }
  pthread_attr_destroy(&attributes);
  return count;
}
