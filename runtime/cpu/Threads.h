// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Threads.h - How many threads there may be --------------------------===//

#ifndef PIKO_RUNTIME_CPU_THREADS_H
#define PIKO_RUNTIME_CPU_THREADS_H

#include <cstdint>
#include <string>

namespace piko::rt {

/// The number of threads where nobody says: what OMP_NUM_THREADS or
/// omp_set_num_threads has, or else the processors that the process may use.
int32_t defaultThreads();

/// `wanted`, or fewer, where the system refuses this thread a team of so many:
/// OpenMP would end the process. Tried once for a number, and not for threads
/// that OpenMP has left from teams that are gone; 1 at the least.
int32_t availableThreads(int32_t wanted);

/// The processors' worth of time that a process's control groups leave it,
/// rounded up; INT32_MAX where they set no quota. `groups` is what
/// /proc/self/cgroup has, `mount` where the groups' files are.
int32_t processorsOfQuota(const std::string &groups, const std::string &mount);

/// Whether OpenMP's library of LLVM reads a setting, as `environ` has it,
/// without ending the process.
bool isSoundSetting(const char *setting);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_THREADS_H
