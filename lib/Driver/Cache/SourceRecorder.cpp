// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a compilation asked the file system.

#include "Cache/SourceRecorder.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/BLAKE3.h"

#include <set>

using namespace llvm;
using namespace piko;

static constexpr StringLiteral missing = "-", present = "+";

static std::string hash(StringRef text) {
  return toHex(BLAKE3::hash(arrayRefFromStringRef(text)));
}

std::string piko::answer(vfs::FileSystem &files, const SourceQuery &query) {
  if (!query.isRead)
    return (files.exists(query.path) ? present : missing).str();
  auto file = files.openFileForRead(query.path);
  if (!file)
    return missing.str();
  auto buffer = (*file)->getBuffer(query.path, /*FileSize=*/-1,
                                   /*RequiresNullTerminator=*/false);
  return buffer ? hash((*buffer)->getBuffer()) : missing.str();
}

namespace {

/// Notes a file's text when it is read.
class RecordedFile : public vfs::File {
public:
  RecordedFile(SourceRecorder &recorder, std::string path,
               std::unique_ptr<vfs::File> file)
      : recorder(recorder), path(std::move(path)), file(std::move(file)) {}

  ErrorOr<vfs::Status> status() override { return file->status(); }
  ErrorOr<std::string> getName() override { return file->getName(); }
  std::error_code close() override { return file->close(); }
  ErrorOr<std::unique_ptr<MemoryBuffer>> getBuffer(const Twine &name,
                                                   int64_t size, bool needsNull,
                                                   bool isVolatile) override {
    auto buffer = file->getBuffer(name, size, needsNull, isVolatile);
    if (buffer)
      recorder.note(path, /*isRead=*/true, hash((*buffer)->getBuffer()));
    return buffer;
  }

private:
  SourceRecorder &recorder;
  std::string path;
  std::unique_ptr<vfs::File> file;
};

} // namespace

/// What was read says more than that something is there.
void SourceRecorder::note(const std::string &path, bool isRead,
                          std::string text) {
  Answer &known = answers.try_emplace(path, Answer{false, text}).first->second;
  if (isRead && !known.isRead)
    known = {true, std::move(text)};
}

ErrorOr<vfs::Status> SourceRecorder::status(const Twine &path) {
  auto result = ProxyFileSystem::status(path);
  note(path.str(), /*isRead=*/false, (result ? present : missing).str());
  return result;
}

bool SourceRecorder::exists(const Twine &path) {
  return static_cast<bool>(status(path));
}

ErrorOr<std::unique_ptr<vfs::File>>
SourceRecorder::openFileForRead(const Twine &path) {
  auto result = ProxyFileSystem::openFileForRead(path);
  note(path.str(), /*isRead=*/false, (result ? present : missing).str());
  if (!result)
    return result;
  return std::make_unique<RecordedFile>(*this, path.str(), std::move(*result));
}

std::vector<std::string> SourceRecorder::getFiles() {
  std::set<std::string> files;
  for (const auto &[path, answer] : answers) {
    if (!answer.isRead)
      continue;
    // Tools that shorten `a/../b` do not ask where `a` leads.
    SmallString<256> real;
    bool isLong = StringRef(path).contains("/../") && !getRealPath(path, real);
    files.insert(isLong ? std::string(real) : path);
  }
  return {files.begin(), files.end()};
}
