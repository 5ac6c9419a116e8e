//===- OutputFile.cpp - Files and results that are written ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Support/OutputFile.h"

#include "Piko/Support/HeldSignals.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

using namespace piko;
using namespace piko::support;
namespace fs = std::filesystem;

/// Why a system call failed; 0 when none did.
using Errno = int;

HeldSignals::HeldSignals() {
  sigset_t held;
  sigemptyset(&held);
  for (int number : {SIGINT, SIGTERM, SIGHUP, SIGXFSZ, SIGPIPE})
    sigaddset(&held, number);
  pthread_sigmask(SIG_BLOCK, &held, &before);
  sigpending(&pendingBefore);
}

HeldSignals::~HeldSignals() {
  drop(SIGXFSZ);
  drop(SIGPIPE);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void HeldSignals::drop(int number) {
  if (sigismember(&pendingBefore, number))
    return;
  sigset_t one;
  sigemptyset(&one);
  sigaddset(&one, number);
  timespec none = {};
  sigtimedwait(&one, nullptr, &none);
}

namespace {

/// A descriptor that closes, once.
struct OpenFile {
  int descriptor = -1;
  OpenFile(const std::string &path, int flags)
      : descriptor(open(path.c_str(), flags | O_WRONLY | O_CLOEXEC, 0666)) {}
  OpenFile(const OpenFile &) = delete;
  OpenFile &operator=(const OpenFile &) = delete;
  ~OpenFile() { close(); }

  Errno close() {
    int closed = descriptor < 0 ? 0 : ::close(descriptor);
    descriptor = -1;
    return closed == 0 ? 0 : errno;
  }

  Errno write(std::string_view content) {
    while (!content.empty()) {
      ssize_t count = ::write(descriptor, content.data(), content.size());
      if (count < 0 && errno == EINTR)
        continue;
      if (count <= 0)
        return count < 0 ? errno : EIO;
      content.remove_prefix(size_t(count));
    }
    return 0;
  }
};

Errno writeDirectly(const std::string &path, std::string_view content) {
  OpenFile file(path, O_TRUNC);
  if (file.descriptor < 0)
    return errno;
  Errno problem = file.write(content);
  Errno closing = file.close();
  return problem ? problem : closing;
}

Errno writeInPlace(const std::string &path, std::string_view content) {
  std::ifstream old(path, std::ios::binary);
  if (!old)
    return EACCES; // it could not be restored
  std::string held{std::istreambuf_iterator<char>(old), {}};
  if (old.bad())
    return EIO;
  Errno problem = writeDirectly(path, content);
  if (problem)
    writeDirectly(path, held);
  return problem;
}

/// As the old file's, where there is one. Who may not give files away keeps
/// them.
Errno setPermissions(int descriptor, const struct stat *old) {
  if (!old)
    return 0;
  if (fchown(descriptor, old->st_uid, old->st_gid) != 0 && errno != EPERM)
    return errno;
  return fchmod(descriptor, old->st_mode & 07777) == 0 ? 0 : errno;
}

/// Short, for the target's own name may be as long as names can be.
std::string nameBeside(const fs::path &target) {
  static int count = 0;
  return (target.parent_path() /
          (".piko-" + std::to_string(getpid()) + "-" +
           std::to_string(__atomic_fetch_add(&count, 1, __ATOMIC_RELAXED))))
      .string();
}

/// A new file that appears at its place when it is complete.
class NewFile {
public:
  explicit NewFile(const std::string &target)
      : target(target), name(nameBeside(target)),
        file(folderOf(target), O_TMPFILE) {}
  NewFile(const NewFile &) = delete;
  NewFile &operator=(const NewFile &) = delete;
  ~NewFile() {
    if (isNamed)
      unlink(name.c_str());
  }

  Errno create() {
    if (file.descriptor >= 0)
      return 0;
    // Not all file systems know files without names, and kernels that know
    // none take the flag for O_DIRECTORY.
    file.descriptor =
        open(name.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    isNamed = file.descriptor >= 0;
    return isNamed ? 0 : errno;
  }

  Errno write(std::string_view content, const struct stat *old) {
    if (Errno problem = file.write(content))
      return problem;
    return setPermissions(file.descriptor, old);
  }

  Errno appear() {
    if (!isNamed) {
      std::string link = "/proc/self/fd/" + std::to_string(file.descriptor);
      if (linkat(AT_FDCWD, link.c_str(), AT_FDCWD, name.c_str(),
                 AT_SYMLINK_FOLLOW) != 0)
        return errno;
      isNamed = true;
    }
    if (Errno problem = file.close())
      return problem;
    if (rename(name.c_str(), target.c_str()) != 0)
      return errno;
    isNamed = false;
    return 0;
  }

private:
  static std::string folderOf(const fs::path &path) {
    return path.has_parent_path() ? path.parent_path().string() : ".";
  }

  std::string target;
  std::string name;
  OpenFile file;
  bool isNamed = false;
};

/// Where a chain of symbolic links ends, whether or not there is a file.
std::string followLinks(fs::path path) {
  constexpr int mostLinks = 40; // as Linux follows
  std::error_code problem;
  for (int i = 0; i < mostLinks && fs::is_symlink(path, problem); ++i)
    path = path.parent_path() / fs::read_symlink(path, problem);
  return path.string();
}

Errno writeStandardOutput(std::string_view content) {
  if (std::fwrite(content.data(), 1, content.size(), stdout) !=
          content.size() ||
      std::fflush(stdout) != 0)
    return errno ? errno : EIO;
  return 0;
}

} // namespace

/// Where one of the files goes, and how.
class support::OutputPlace {
public:
  explicit OutputPlace(const std::string &path) : path(path) {}

  const std::string &name() const { return path; }
  /// Whether others appear after it, for it cannot be taken back.
  bool isDirect() const { return !file; }

  Errno write(std::string_view text) {
    struct stat old;
    bool exists = path != "-" && stat(path.c_str(), &old) == 0;
    if (path != "-" && !exists && errno != ENOENT)
      return errno;
    if (exists && S_ISDIR(old.st_mode))
      return EISDIR;
    if (path == "-" || (exists && !S_ISREG(old.st_mode)))
      return keepText(text);
    auto made = std::make_unique<NewFile>(followLinks(path));
    Errno problem = made->create();
    bool mayNot = problem == EACCES || problem == EPERM || problem == EROFS;
    if (exists && mayNot) {
      isInPlace = true;
      return keepText(text);
    }
    if (problem)
      return problem;
    file = std::move(made);
    return file->write(text, exists ? &old : nullptr);
  }

  Errno appear() {
    if (file)
      return file->appear();
    if (path == "-")
      return writeStandardOutput(content);
    return isInPlace ? writeInPlace(path, content)
                     : writeDirectly(path, content);
  }

private:
  Errno keepText(std::string_view text) {
    content = text;
    return 0;
  }

  std::string path;
  std::unique_ptr<NewFile> file;
  bool isInPlace = false;
  std::string content; ///< Of what is written directly.
};

OutputFiles::OutputFiles() = default;
OutputFiles::~OutputFiles() {
  places.clear(); // before signals come
}

static Error cannotWrite(const std::string &path, Errno problem) {
  std::string name = path == "-" ? "the standard output" : "'" + path + "'";
  return Error{"cannot write " + name + ": " +
               std::generic_category().message(problem)};
}

Result<Done> OutputFiles::add(const std::string &path,
                              std::string_view content) {
  if (!held)
    held = std::make_unique<HeldSignals>();
  places.push_back(std::make_unique<OutputPlace>(path));
  if (Errno problem = places.back()->write(content))
    return cannotWrite(path, problem);
  return Done{};
}

Result<Done> OutputFiles::keep() {
  std::stable_partition(places.begin(), places.end(),
                        [](const std::unique_ptr<OutputPlace> &place) {
                          return place->isDirect();
                        });
  for (const std::unique_ptr<OutputPlace> &place : places)
    if (Errno problem = place->appear())
      return cannotWrite(place->name(), problem);
  places.clear();
  held.reset();
  return Done{};
}

Result<Done> support::writeFile(const std::string &path,
                                std::string_view content) {
  OutputFiles files;
  if (auto ok = files.add(path, content); !ok)
    return ok;
  return files.keep();
}

Result<Done> support::replaceFile(const std::string &path,
                                  std::string_view content) {
  HeldSignals held;
  OutputPlace place(path);
  Errno problem = place.write(content);
  if (!problem)
    problem = place.appear();
  if (problem)
    return Error{std::generic_category().message(problem)};
  return Done{};
}

Result<Done> support::checkWritable(const std::string &path) {
  OutputFiles files; // none of which is kept
  return files.add(path, "");
}

Result<Done> support::finishOutput() {
  errno = 0;
  // A write that failed before left its mark, but no reason.
  if (std::fflush(stdout) == 0 && !std::ferror(stdout))
    return Done{};
  return Error{
      "cannot write the standard output" +
      (errno ? ": " + std::generic_category().message(errno) : std::string())};
}
