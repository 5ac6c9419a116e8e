// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Threads.cpp - How many threads there may be ------------------------===//

#include "cpu/Threads.h"

#include "pikort/pikort.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <mutex>
#include <omp.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <string_view>
#include <unistd.h>
#include <vector>

using namespace piko::rt;

// --- Settings ---------------------------------------------------------------

/// Whether it is a list of integers of [1, most].
static bool isNumberList(std::string_view text, int64_t most) {
  const char *at = text.data(), *end = at + text.size();
  auto skipSpace = [&] {
    while (at != end && (*at == ' ' || *at == '\t'))
      ++at;
  };
  while (true) {
    skipSpace();
    int64_t number = 0;
    auto [behind, error] = std::from_chars(at, end, number);
    if (error != std::errc() || number < 1 || number > most)
      return false;
    at = behind;
    skipSpace();
    if (at == end)
      return true;
    if (*at++ != ',')
      return false;
  }
}

bool piko::rt::isSoundSetting(const char *setting) {
  std::string_view text = setting;
  size_t equals = text.find('=');
  std::string_view name = text.substr(0, equals);
  std::string_view value =
      equals == text.npos ? std::string_view() : text.substr(equals + 1);
  if (!name.starts_with("OMP_") && !name.starts_with("KMP_"))
    return true;
  if (name == "OMP_NUM_THREADS")
    return isNumberList(value, std::numeric_limits<int32_t>::max());
  if (name.starts_with("KMP_") && name.ends_with("_BARRIER"))
    return isNumberList(value, 32);
  return name != "KMP_INHERIT_FP_CONTROL" && !value.empty();
}

namespace {

/// While the OpenMP library reads its settings the process has none that end
/// it, or that keep the caller's floating-point environment from its threads.
class SoundSettings {
public:
  SoundSettings() {
    for (char **setting = environ; setting && *setting; ++setting)
      if (isSoundSetting(*setting))
        kept().push_back(*setting);
      else
        hides = true;
    kept().push_back(nullptr);
    if (hides)
      environ = kept().data();
  }
  SoundSettings(const SoundSettings &) = delete;
  SoundSettings &operator=(const SoundSettings &) = delete;
  ~SoundSettings() {
    if (hides && environ == kept().data())
      environ = before;
  }

private:
  /// Never freed: another thread may be reading it.
  static std::vector<char *> &kept() {
    static auto *settings = new std::vector<char *>;
    return *settings;
  }

  char **before = environ;
  bool hides = false;
};

} // namespace

/// What the library's threads have at least, whatever `ulimit -s` says.
static constexpr size_t smallestStack = size_t(1) << 20;

/// Lets the OpenMP library begin.
static void beginOpenMP() {
  static std::once_flag once;
  std::call_once(once, [] {
    {
      SoundSettings scope;
      omp_get_max_threads(); // reads them
    }
#ifdef KMP_VERSION_MAJOR
    if (kmp_get_stacksize_s() < smallestStack)
      kmp_set_stacksize_s(smallestStack);
#endif
  });
}

static size_t stackSize() {
#ifdef KMP_VERSION_MAJOR
  return kmp_get_stacksize_s();
#else
  return size_t(8) << 20;
#endif
}

// --- Processors -------------------------------------------------------------

static std::string readText(const std::string &path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Two numbers with a space between; false where the first is not one.
static bool readPair(std::string_view text, int64_t &first, int64_t &second) {
  const char *end = text.data() + text.size();
  auto [behind, error] = std::from_chars(text.data(), end, first);
  if (error != std::errc())
    return false;
  while (behind != end && *behind == ' ')
    ++behind;
  return std::from_chars(behind, end, second).ec == std::errc();
}

/// Processors of a group itself, or INT32_MAX.
static int32_t quotaOf(const std::string &folder, bool isUnified) {
  std::string text = isUnified ? readText(folder + "/cpu.max")
                               : readText(folder + "/cpu.cfs_quota_us") + " " +
                                     readText(folder + "/cpu.cfs_period_us");
  std::replace(text.begin(), text.end(), '\n', ' ');
  int64_t quota = 0, period = 0;
  if (!readPair(text, quota, period) || quota <= 0 || period <= 0)
    return std::numeric_limits<int32_t>::max();
  return static_cast<int32_t>(std::clamp<int64_t>(
      (quota - 1) / period + 1, 1, std::numeric_limits<int32_t>::max()));
}

/// Of a group and all that it is in.
static int32_t quotaAlong(const std::string &root, std::string path,
                          bool isUnified) {
  int32_t least = quotaOf(root, isUnified);
  while (path.size() > 1) {
    least = std::min(least, quotaOf(root + path, isUnified));
    path.erase(path.rfind('/'));
  }
  return least;
}

static bool hasName(std::string_view list, std::string_view name) {
  while (true) {
    size_t comma = list.find(',');
    if (list.substr(0, comma) == name)
      return true;
    if (comma == list.npos)
      return false;
    list.remove_prefix(comma + 1);
  }
}

int32_t piko::rt::processorsOfQuota(const std::string &groups,
                                    const std::string &mount) {
  int32_t least = std::numeric_limits<int32_t>::max();
  // Of each hierarchy: its number, its controllers, and the group's path.
  for (size_t at = 0; at < groups.size();) {
    size_t end = std::min(groups.find('\n', at), groups.size());
    std::string_view line(groups.data() + at, end - at);
    at = end + 1;
    size_t first = line.find(':');
    size_t second = first == line.npos ? first : line.find(':', first + 1);
    if (second == line.npos || line.substr(second + 1).find('/') != 0)
      continue;
    std::string_view controllers = line.substr(first + 1, second - first - 1);
    std::string path(line.substr(second + 1));
    if (controllers.empty())
      least = std::min(least, quotaAlong(mount, path, /*isUnified=*/true));
    else if (hasName(controllers, "cpu"))
      least = std::min(least,
                       quotaAlong(mount + "/" + std::string(controllers), path,
                                  /*isUnified=*/false));
  }
  return least;
}

/// Those of the affinity mask.
static int32_t processorsOfMask() {
  // The kernel refuses a set that is smaller than its own.
  for (int most = 1024; most <= 1 << 20; most *= 4) {
    cpu_set_t *set = CPU_ALLOC(static_cast<size_t>(most));
    if (!set)
      break;
    size_t size = CPU_ALLOC_SIZE(static_cast<size_t>(most));
    int count =
        sched_getaffinity(0, size, set) == 0 ? CPU_COUNT_S(size, set) : 0;
    CPU_FREE(set);
    if (count > 0)
      return count;
  }
  return std::numeric_limits<int32_t>::max();
}

int32_t piko::rt::defaultThreads() {
  beginOpenMP();
  int32_t openMP = std::clamp(omp_get_max_threads(), 1, PIKORT_MAX_THREADS);
  const char *said = std::getenv("OMP_NUM_THREADS");
  bool isSaid =
      (said && isNumberList(said, std::numeric_limits<int32_t>::max())) ||
      openMP != omp_get_num_procs();
  if (isSaid)
    return openMP;
  return std::min(
      {openMP, processorsOfMask(),
       processorsOfQuota(readText("/proc/self/cgroup"), "/sys/fs/cgroup")});
}

// --- Threads that the system gives ------------------------------------------

namespace {

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

  int32_t begin(int32_t wanted, const pthread_attr_t &attributes) {
    threads.reserve(static_cast<size_t>(wanted));
    for (pthread_t thread;
         threads.size() < static_cast<size_t>(wanted) &&
         pthread_create(&thread, &attributes, wait, this) == 0;) {
      threads.push_back(thread);
      while (sem_wait(&began) != 0)
        ; // interrupted
    }
    return static_cast<int32_t>(threads.size());
  }

private:
  static void *wait(void *self) {
    auto &trial = *static_cast<Trial *>(self);
    // The first allocation of a thread takes addresses, too, which the
    // allocator keeps for threads that follow.
    void *volatile memory = std::malloc(1);
    std::free(memory);
    sem_post(&trial.began);
    std::lock_guard lock(trial.gate);
    return nullptr;
  }

  sem_t began;
  std::mutex gate;
  std::vector<pthread_t> threads;
};

} // namespace

/// How many threads, up to `wanted`, there can be besides those that are.
static int32_t tryThreads(int32_t wanted) {
  // What the library takes for each besides its stack.
  constexpr size_t more = size_t(256) << 10;
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0)
    return 0;
  pthread_attr_setstacksize(&attributes, stackSize() + more);
  int32_t count = Trial().begin(wanted, attributes);
  pthread_attr_destroy(&attributes);
  return count;
}

int32_t piko::rt::availableThreads(int32_t wanted) {
  // Of teams of this thread, which the library keeps.
  static thread_local int32_t tried = 1, given = 1;
  beginOpenMP();
  if (wanted > tried) {
    tried = wanted;
    int32_t others = tryThreads(wanted - 1);
    // Near the limit something is left for what else needs it.
    given = others == wanted - 1 ? wanted : others - others / 8;
    given = std::max(given, 1);
    // The library makes them now, before anything else takes what they need.
#pragma omp parallel num_threads(given)
    {
    }
  }
  return std::min(wanted, given);
}
