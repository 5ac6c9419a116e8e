// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Client.cpp - Stands for a tool that a fork server runs -------------===//
//
// Under a tool's name it asks for that tool with its own arguments, environment,
// files, limits and place, and ends as the tool does. As `--serve FOLDER` it is
// the launcher, which lasts as long as its standard input.

#include "Messages.h"

#include <algorithm>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <initializer_list>

#include <dirent.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace piko::forks;

[[noreturn]] static void fail(const char *what) {
  std::fprintf(stderr, "fork server: %s: %s\n", what, std::strerror(errno));
  std::exit(125);
}

static sockaddr_un addressIn(const char *folder) {
  sockaddr_un address{AF_UNIX, {}};
  std::snprintf(address.sun_path, sizeof address.sun_path, "%s/%s", folder,
                socketName);
  return address;
}

// --- Launcher ---------------------------------------------------------------

namespace {

/// A tool that waits where its main begins.
struct Server {
  char name[longestName];
  int socket;
};

} // namespace

/// Starts a tool with the server before its libraries.
static int startServer(const char *folder, const char *name,
                       const char *library) {
  char tool[PATH_MAX], preload[PATH_MAX];
  std::snprintf(tool, sizeof tool, "%s/%s/%s", folder, toolsName, name);
  std::snprintf(preload, sizeof preload, "LD_PRELOAD=%s", library);
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
    fail("socketpair");
  if (fork() == 0) {
    int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    for (int file = 0; file < 3; ++file)
      dup2(nothing, file);
    dup2(ends[1], launcherFile);
    close_range(launcherFile + 1, ~0U, 0);
    setpgid(0, 0); // no one else's signals
    const char *arguments[] = {name, nullptr};
    const char *environment[] = {preload, nullptr};
    execve(tool, const_cast<char **>(arguments),
           const_cast<char **>(environment));
    _exit(125);
  }
  close(ends[1]);
  return ends[0];
}

/// Hands a client on to the tool that it names.
static void dispatch(int client, const char *folder, const char *library) {
  static Server servers[32];
  static size_t count = 0;
  char name[longestName] = {};
  if (recv(client, name, sizeof name - 1, MSG_PEEK) <= 0)
    return;
  Server *server = nullptr;
  for (size_t i = 0; i < count && !server; ++i)
    if (std::strcmp(servers[i].name, name) == 0)
      server = &servers[i];
  if (!server) {
    if (count == sizeof servers / sizeof *servers)
      return;
    server = &servers[count++];
    std::memcpy(server->name, name, sizeof name);
    server->socket = startServer(folder, name, library);
  }
  send(server->socket, "", 1, &client, 1);
}

static int launch(const char *folder) {
  char library[PATH_MAX];
  ssize_t size = readlink("/proc/self/exe", library, sizeof library - 4);
  if (size < 0)
    fail("/proc/self/exe");
  std::memcpy(library + size, ".so", 4);
  int socket = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  sockaddr_un address = addressIn(folder);
  if (bind(socket, reinterpret_cast<sockaddr *>(&address), sizeof address) ||
      listen(socket, 64) != 0)
    fail(address.sun_path);
  std::puts("ready");
  std::fflush(stdout);
  pollfd events[] = {{socket, POLLIN, 0}, {STDIN_FILENO, 0, 0}};
  while (!events[1].revents) {
    if (poll(events, 2, -1) < 0 || !events[0].revents)
      continue;
    int client = accept4(socket, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0)
      continue;
    dispatch(client, folder, library);
    close(client);
  }
  unlink(address.sun_path);
  close_range(STDERR_FILENO + 1, ~0U, 0); // which ends the servers
  while (wait(nullptr) > 0)
    ;
  return 0;
}

// --- Client -----------------------------------------------------------------

/// Negative where no launcher is.
static int connectTo(const char *folder) {
  sockaddr_un address = addressIn(folder);
  int socket = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (socket < 0 || connect(socket, reinterpret_cast<sockaddr *>(&address),
                            sizeof address) == 0)
    return socket;
  close(socket);
  return -1;
}

static void append(int file, const void *bytes, size_t size) {
  const char *at = static_cast<const char *>(bytes);
  while (size > 0) {
    ssize_t done = write(file, at, size);
    if (done < 0)
      fail("memfd");
    at += done;
    size -= static_cast<size_t>(done);
  }
}

/// Those that are open, before the client opens its own; false if too many.
static bool listFiles(Request &request) {
  DIR *directory = opendir("/proc/self/fd");
  if (!directory)
    fail("/proc/self/fd");
  bool hasRoom = true;
  while (const dirent *entry = readdir(directory)) {
    int file = std::atoi(entry->d_name);
    if (entry->d_name[0] == '.' || file == dirfd(directory))
      continue;
    hasRoom = static_cast<size_t>(request.files) < mostFiles;
    if (!hasRoom)
      break;
    request.numbers[request.files++] = file;
  }
  closedir(directory);
  return hasRoom;
}

static void describeSignals(Request &request) {
  sigset_t blocked;
  sigprocmask(SIG_SETMASK, nullptr, &blocked);
  for (int number = 1; number < 64; ++number) {
    uint64_t bit = uint64_t(1) << number;
    struct sigaction action{};
    if (sigaction(number, nullptr, &action) == 0 &&
        action.sa_handler == SIG_IGN)
      request.ignoredSignals |= bit;
    if (sigismember(&blocked, number) > 0)
      request.blockedSignals |= bit;
  }
}

/// Sends the request for the tool of a name.
static void ask(int socket, const char *name, Request &request,
                char **arguments, char **variables) {
  int files[mostFiles + 2];
  std::copy_n(request.numbers, request.files, files + 2);
  files[0] = memfd_create("request", MFD_CLOEXEC);
  files[1] = open(".", O_PATH | O_CLOEXEC);
  if (files[0] < 0 || files[1] < 0)
    fail("request");
  request.group = getpgrp();
  request.mask = static_cast<int32_t>(umask(0));
  describeSignals(request);
  for (int i = 0; i < RLIM_NLIMITS; ++i)
    getrlimit(static_cast<__rlimit_resource_t>(i), &request.limits[i]);
  for (char **it = arguments; *it; ++it)
    ++request.arguments;
  for (char **it = variables; *it; ++it)
    ++request.variables;
  append(files[0], &request, sizeof request);
  for (char **list : {arguments, variables})
    for (char **it = list; *it; ++it)
      append(files[0], *it, std::strlen(*it) + 1);
  if (!send(socket, name, std::strlen(name), files,
            static_cast<size_t>(request.files) + 2))
    fail("send");
}

/// As the process did, of which `status` is what waitpid says.
[[noreturn]] static void endAs(int status) {
  if (WIFEXITED(status))
    _exit(WEXITSTATUS(status));
  int number = WTERMSIG(status);
  rlimit none{};
  setrlimit(RLIMIT_CORE, &none);
  std::signal(number, SIG_DFL);
  sigset_t all;
  sigfillset(&all);
  sigprocmask(SIG_UNBLOCK, &all, nullptr);
  raise(number);
  _exit(128 + number);
}

/// Hands signals on until the process has ended.
[[noreturn]] static void follow(int socket) {
  sigset_t handed;
  sigfillset(&handed);
  for (int kept : {SIGCHLD, SIGTSTP, SIGCONT, SIGTTIN, SIGTTOU, SIGPIPE})
    sigdelset(&handed, kept);
  sigprocmask(SIG_BLOCK, &handed, nullptr);
  for (int number = 1; number < 64; ++number) // one that is ignored is lost
    if (sigismember(&handed, number) > 0)
      std::signal(number, SIG_DFL);
  int signals = signalfd(-1, &handed, SFD_CLOEXEC);
  int process = 0, status = 0;
  if (read(socket, &process, sizeof process) != sizeof process)
    fail("the tool did not begin");
  pollfd events[] = {{socket, POLLIN, 0}, {signals, POLLIN, 0}};
  while (!events[0].revents) {
    signalfd_siginfo signal{};
    if (poll(events, 2, -1) > 0 && events[1].revents &&
        read(signals, &signal, sizeof signal) == sizeof signal)
      kill(process, static_cast<int>(signal.ssi_signo));
  }
  if (read(socket, &status, sizeof status) != sizeof status)
    fail("the server ended");
  endAs(status);
}

/// Whether the loader or a library would have read one of them before main.
static bool isReadAtStart(char **variables) {
  for (; *variables; ++variables)
    for (const char *prefix : {"LD_", "GLIBC_", "MALLOC_", "MIMALLOC_", "KMP_"})
      if (std::strncmp(*variables, prefix, std::strlen(prefix)) == 0)
        return true;
  return false;
}

/// Whether a file of the request's size could not be written.
static bool areFilesLimited() {
  rlimit limit;
  return getrlimit(RLIMIT_FSIZE, &limit) == 0 &&
         limit.rlim_cur != RLIM_INFINITY;
}

int main(int count, char **arguments, char **variables) {
  if (count == 3 && std::strcmp(arguments[1], "--serve") == 0)
    return launch(arguments[2]);
  const char *folder = std::getenv(folderVariable);
  if (!folder) {
    errno = ENOENT;
    fail(folderVariable);
  }
  const char *slash = std::strrchr(arguments[0], '/');
  const char *name = slash ? slash + 1 : arguments[0];
  Request request{};
  if (listFiles(request) && !isReadAtStart(variables) && !areFilesLimited())
    if (int socket = connectTo(folder); socket >= 0) {
      ask(socket, name, request, arguments, variables);
      follow(socket);
    }
  char tool[PATH_MAX];
  std::snprintf(tool, sizeof tool, "%s/%s/%s", folder, toolsName, name);
  execv(tool, arguments);
  fail(tool);
}
