// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Server.cpp - A tool that forks instead of beginning anew -----------===//
//
// Loaded before a tool's libraries, it waits where the tool's main would be
// called, and forks for each request: what the loader did, most of a short run's
// time with LLVM's libraries, is done once. Only what can be seen before main
// differs from a process of its own.

#include "Messages.h"

#include <cerrno>
#include <csignal>
#include <initializer_list>

#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace piko::forks;

using Main = int(int, char **, char **);
using StartMain = int(Main *, int, char **, void (*)(), void (*)(), void (*)(),
                      void *);

namespace {

/// A request's parts, in the memory of the process that it is for.
struct Job {
  const Request *request = nullptr;
  /// The arguments, a null, the variables, a null: as the kernel lays them.
  char **arguments = nullptr;
};

} // namespace

/// Ends a process for which there cannot be what was asked for.
[[noreturn]] static void refuse() { _exit(125); }

static Job readJob(int file) {
  struct stat status{};
  if (fstat(file, &status) != 0)
    refuse();
  void *memory = mmap(nullptr, static_cast<size_t>(status.st_size),
                      PROT_READ | PROT_WRITE, MAP_PRIVATE, file, 0);
  if (memory == MAP_FAILED)
    refuse();
  Job job{static_cast<const Request *>(memory)};
  auto count = static_cast<size_t>(job.request->arguments) +
               static_cast<size_t>(job.request->variables) + 2;
  job.arguments = static_cast<char **>(std::calloc(count, sizeof(char *)));
  if (!job.arguments)
    refuse();
  char *text = static_cast<char *>(memory) + sizeof(Request);
  char **to = job.arguments;
  for (int32_t part : {job.request->arguments, job.request->variables}) {
    for (int32_t i = 0; i < part; ++i) {
      *to++ = text;
      while (*text++)
        ;
    }
    ++to;
  }
  return job;
}

/// The client's files get their numbers; nothing else is open.
static void takeFiles(const Request &request, int *files) {
  constexpr int aside = 512;
  for (int32_t i = 0; i < request.files; ++i) {
    files[i] = fcntl(files[i], F_DUPFD_CLOEXEC, aside);
    if (files[i] < 0)
      refuse();
  }
  close_range(0, aside - 1, 0);
  for (int32_t i = 0; i < request.files; ++i)
    dup2(files[i], request.numbers[i]);
  close_range(aside, ~0U, 0);
}

/// Makes of the process the one that the client would be.
static void takePlace(const Request &request, int folder, int *files) {
  if (fchdir(folder) != 0)
    refuse();
  takeFiles(request, files);
  umask(static_cast<mode_t>(request.mask));
  setpgid(0, request.group);
  sigset_t blocked;
  sigemptyset(&blocked);
  for (int number = 1; number < 64; ++number) {
    uint64_t bit = uint64_t(1) << number;
    if (request.blockedSignals & bit)
      sigaddset(&blocked, number);
    std::signal(number, request.ignoredSignals & bit ? SIG_IGN : SIG_DFL);
  }
  sigprocmask(SIG_SETMASK, &blocked, nullptr);
  for (int i = 0; i < RLIM_NLIMITS; ++i)
    setrlimit(static_cast<__rlimit_resource_t>(i), &request.limits[i]);
}

/// Says how the process ended; where nobody listens any more it is ended.
static void watch(int client, pid_t process) {
  int end = static_cast<int>(syscall(SYS_pidfd_open, process, 0));
  pollfd events[] = {{end, POLLIN, 0}, {client, POLLIN, 0}};
  while (poll(events, 2, -1) < 0 && errno == EINTR)
    ;
  if (!events[0].revents)
    kill(process, SIGKILL);
  int status = 0;
  waitpid(process, &status, 0);
  if (write(client, &status, sizeof status) < 0)
    _exit(1);
}

/// Returns in the process that is to be the tool's, and nowhere else.
static Job serve() {
  int client = -1;
  while (true) {
    bool isAsked = receive(launcherFile, &client, 1) == 1;
    // Who has been waited for counts in the processors' time of the tests.
    while (waitpid(-1, nullptr, isAsked ? WNOHANG : 0) > 0)
      ;
    if (!isAsked)
      _exit(0); // the launcher has ended
    if (fork() == 0)
      break;
    close(client);
  }
  int files[mostFiles + 2];
  if (receive(client, files, mostFiles + 2) < 2)
    refuse();
  Job job = readJob(files[0]);
  pid_t process = fork();
  if (process == 0) {
    takePlace(*job.request, files[1], files + 2);
    return job;
  }
  if (process < 0)
    refuse();
  close_range(0, 2, 0);
  for (int i = 0; i < job.request->files + 2; ++i)
    close(files[i]);
  if (write(client, &process, sizeof process) < 0)
    kill(process, SIGKILL);
  watch(client, process);
  _exit(0);
}

/// What every program begins with, in place of the C library's.
extern "C" int __libc_start_main(Main *main, int, char **, void (*begin)(),
                                 void (*end)(), void (*unload)(), void *stack) {
  auto *start =
      reinterpret_cast<StartMain *>(dlsym(RTLD_NEXT, "__libc_start_main"));
  Job job = serve();
  // The C library has had both from the loader.
  environ = job.arguments + job.request->arguments + 1;
  program_invocation_name = job.arguments[0];
  return start(main, job.request->arguments, job.arguments, begin, end, unload,
               stack);
}
