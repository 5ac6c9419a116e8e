//===- ImportProcess.cpp - Scenes that another process reads --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ImportProcess.h"

#include "MeshReaders.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace piko;
using namespace piko::render;
namespace fs = std::filesystem;

static constexpr const char *programName = "piko-import";

static Error failToStart(int problem) {
  return Error{
      std::string("cannot start '") + programName +
      "', which reads formats other than PLY, OBJ, STL, glTF and bpt: " +
      std::generic_category().message(problem)};
}

/// What $PIKO_IMPORTER says; or beside the program that runs, if it is there;
/// else a name to look up in PATH.
static std::string findProgram() {
  if (const char *named = std::getenv("PIKO_IMPORTER"))
    return named;
  std::error_code problem;
  fs::path self = fs::read_symlink("/proc/self/exe", problem);
  fs::path beside = self.parent_path() / programName;
  return !problem && fs::exists(beside, problem) ? beside.string()
                                                 : programName;
}

namespace {

/// The program's standard output, what it says is wrong, and its end.
class ImportProcess {
public:
  ImportProcess() = default;
  ImportProcess(const ImportProcess &) = delete;
  ImportProcess &operator=(const ImportProcess &) = delete;
  ~ImportProcess() {
    for (int end : {ends[0], ends[1], messages})
      if (end >= 0)
        close(end);
  }

  /// An error number, or 0.
  int start(const std::string &scene) {
    messages = memfd_create(programName, MFD_CLOEXEC);
    if (messages < 0 || pipe2(ends, O_CLOEXEC) != 0)
      return errno;
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files, ends[1], 1);
    // A file in memory: nobody need read it meanwhile.
    posix_spawn_file_actions_adddup2(&files, messages, 2);
    // Not the host's: what it blocks and ignores would let the program live on.
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    std::string program = findProgram();
    char *arguments[] = {program.data(), const_cast<char *>(scene.c_str()),
                         nullptr};
    int problem = posix_spawnp(&child, program.c_str(), &files, &attributes,
                               arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    close(ends[1]);
    ends[1] = -1;
    return problem;
  }

  std::string readOutput() { return readAll(ends[0]); }

  /// After its end.
  std::string readMessages() {
    lseek(messages, 0, SEEK_SET);
    return readAll(messages);
  }
  /// How it ended; none where the host has asked for that before.
  std::optional<int> wait() {
    int status;
    while (waitpid(child, &status, 0) < 0)
      if (errno != EINTR)
        return std::nullopt;
    return status;
  }

private:
  static std::string readAll(int from) {
    std::string content;
    char chunk[1 << 16];
    for (;;) {
      ssize_t count = read(from, chunk, sizeof chunk);
      if (count < 0 && errno == EINTR)
        continue;
      if (count <= 0)
        return content;
      content.append(chunk, size_t(count));
    }
  }

  int ends[2] = {-1, -1}, messages = -1;
  pid_t child = -1;
};

} // namespace

/// Why it has failed, as it says or as its end does.
static std::string describeEnd(int status, const std::string &messages,
                               const std::string &scene) {
  const std::string ours = std::string(programName) + ": error: ",
                    place = describeLoad(scene);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    return "it takes longer than " + std::to_string(importSeconds) +
           " s to read";
  if (WIFSIGNALED(status))
    return std::string("what reads it ended by signal ") +
           std::to_string(WTERMSIG(status)) + " (" +
           strsignal(WTERMSIG(status)) + ")";
  if (size_t at = messages.rfind(ours); at != std::string::npos) {
    std::string said = messages.substr(at + ours.size());
    said.resize(std::min(said.find('\n'), said.size()));
    return said.starts_with(place) ? said.substr(place.size()) : said;
  }
  return "what reads it ended with status " +
         std::to_string(WEXITSTATUS(status));
}

std::string render::describeLoad(const std::string &path) {
  return "cannot load scene '" + path + "': ";
}

Result<Mesh> render::importMesh(const std::string &path) {
  ImportProcess process;
  // A name that begins with a dash is no option.
  std::string scene = fs::absolute(path).string();
  if (int problem = process.start(scene))
    return failToStart(problem);
  std::string content = process.readOutput();
  std::optional<int> status = process.wait();
  if (status && *status != 0) {
    if (WIFEXITED(*status) && WEXITSTATUS(*status) == 127) // of the spawn
      return failToStart(ENOENT);
    return Error{describeEnd(*status, process.readMessages(), scene)};
  }
  return readPly(content);
}
