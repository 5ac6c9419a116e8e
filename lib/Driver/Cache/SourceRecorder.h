// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a compilation asked the file system. As long as all answers are the
// same, so is what is compiled; that a header was not found counts as well,
// because it may turn up in a folder that is searched first.

#ifndef PIKO_LIB_DRIVER_SOURCERECORDER_H
#define PIKO_LIB_DRIVER_SOURCERECORDER_H

#include "llvm/Support/VirtualFileSystem.h"

#include <map>
#include <string>
#include <vector>

namespace piko {

/// A question, and its answer: a hash of what the file holds, whether there is
/// one, or that there is none.
struct SourceQuery {
  std::string path;
  bool isRead; ///< Or else it matters only whether it is there.
};

/// The answer that a file system gives now.
std::string answer(llvm::vfs::FileSystem &files, const SourceQuery &query);

/// Hands everything on to another file system and takes notes.
class SourceRecorder : public llvm::vfs::ProxyFileSystem {
public:
  using ProxyFileSystem::ProxyFileSystem;

  llvm::ErrorOr<llvm::vfs::Status> status(const llvm::Twine &path) override;
  bool exists(const llvm::Twine &path) override;
  llvm::ErrorOr<std::unique_ptr<llvm::vfs::File>>
  openFileForRead(const llvm::Twine &path) override;

  struct Answer {
    bool isRead;
    std::string text;
  };
  /// By path, in order.
  const std::map<std::string, Answer> &getAnswers() const { return answers; }
  /// The files that were read, sorted.
  std::vector<std::string> getFiles();

  void note(const std::string &path, bool isRead, std::string text);

private:
  std::map<std::string, Answer> answers;
};

} // namespace piko

#endif // PIKO_LIB_DRIVER_SOURCERECORDER_H
