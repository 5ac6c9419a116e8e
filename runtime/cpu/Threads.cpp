// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Threads.cpp - How many threads there may be ------------------------===//

#include "cpu/Threads.h"

#include "Piko/Support/ThreadTrial.h"
#include "pikort/pikort.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <mutex>
#include <omp.h>
#include <sched.h>
#include <string_view>
#include <unistd.h>
#include <vector>

using namespace piko;
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
    auto [after, error] = std::from_chars(at, end, number);
    if (error != std::errc() || number < 1 || number > most)
      return false;
    at = after;
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
  auto [after, error] = std::from_chars(text.data(), end, first);
  if (error != std::errc())
    return false;
  while (after != end && *after == ' ')
    ++after;
  return std::from_chars(after, end, second).ec == std::errc();
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

/// Threads of the process in teams of the OpenMP library, which keeps those of
/// a team that is gone for the next one.
struct Teams {
  std::mutex mutex;
  int32_t taken = 0, made = 0;
  pid_t process = getpid();
};

/// The team of a thread that runs pipelines.
struct Team {
  int32_t tried = 1, given = 1;

  Team() = default;
  Team(const Team &) = delete;
  Team &operator=(const Team &) = delete;
  ~Team();
};

} // namespace

/// Never destroyed: threads may end later than the program's statics.
static Teams &teams() {
  static auto *all = new Teams;
  return *all;
}

Team::~Team() {
  std::lock_guard lock(teams().mutex);
  teams().taken -= given - 1;
}

/// Lets a team have up to `wanted` threads, its master among them.
static void enlarge(Team &team, int32_t wanted) {
  // What the library takes for each besides its stack.
  constexpr size_t more = size_t(256) << 10;
  Teams &all = teams();
  std::lock_guard lock(all.mutex);
  int32_t free = std::max(all.made - (all.taken - (team.given - 1)), 0);
  int32_t others = wanted - 1, missing = others - free;
  if (missing > 0) {
    auto got = static_cast<int32_t>(
        support::tryThreads(static_cast<size_t>(missing), stackSize() + more));
    // Near the limit something is left for what else needs it.
    if (got < missing)
      others = free + std::max(got - got / 8 - 1, 0);
  }
  all.taken += others - (team.given - 1);
  all.made = std::max(all.made, all.taken);
  team.tried = wanted;
  team.given = others + 1;
  // The library makes them now, before anything else takes what they need.
#pragma omp parallel num_threads(team.given)
  {
  }
}

int32_t piko::rt::availableThreads(int32_t wanted) {
  static thread_local Team team;
  beginOpenMP();
  if (teams().process != getpid()) { // a fork's child, in which there are none
    teams().taken = teams().made = 0;
    teams().process = getpid();
    team.tried = team.given = 1;
  }
  if (wanted > team.tried)
    enlarge(team, wanted);
  return std::min(wanted, team.given);
}
