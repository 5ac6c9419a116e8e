// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Cache/KnownFiles.h"

#include "llvm/Support/MemoryBuffer.h"

#include <chrono>
#include <map>
#include <mutex>
#include <tuple>

using namespace llvm;
using namespace piko;

namespace {

struct KnownFile {
  std::string realName;
  std::unique_ptr<MemoryBuffer> text; ///< Ends with a zero byte.
};

/// Those of the process; none is ever dropped.
class Table {
public:
  using Key =
      std::tuple<std::string, uint64_t, uint64_t, uint64_t, sys::TimePoint<>>;

  static Key keyOf(const Twine &path, const vfs::Status &status) {
    return {path.str(), status.getUniqueID().getDevice(),
            status.getUniqueID().getFile(), status.getSize(),
            status.getLastModificationTime()};
  }
  /// A file that was written just now may be written again without another
  /// time. There is room for some thousand headers.
  bool mayKeep(const vfs::Status &status) const {
    constexpr std::chrono::seconds clock(2); // the coarsest, FAT's
    constexpr uint64_t mostOfFile = 1 << 20;
    return status.isRegularFile() && status.getSize() <= mostOfFile &&
           std::chrono::system_clock::now() >
               status.getLastModificationTime() + clock;
  }
  const KnownFile *find(const Key &key) {
    std::lock_guard lock(mutex);
    auto known = files.find(key);
    return known == files.end() ? nullptr : &known->second;
  }
  bool hasRoom() {
    constexpr uint64_t most = 32 << 20;
    std::lock_guard lock(mutex);
    return bytes < most;
  }
  const KnownFile *keep(const Key &key, KnownFile file) {
    std::lock_guard lock(mutex);
    auto [kept, isNew] = files.try_emplace(key, std::move(file));
    if (isNew)
      bytes += kept->second.text->getBufferSize();
    return &kept->second;
  }

private:
  std::mutex mutex;
  std::map<Key, KnownFile> files;
  uint64_t bytes = 0;
};

class OpenedFile : public vfs::File {
public:
  OpenedFile(vfs::Status status, const KnownFile &file)
      : statusOfPath(std::move(status)), file(file) {}

  ErrorOr<vfs::Status> status() override { return statusOfPath; }
  ErrorOr<std::string> getName() override { return file.realName; }
  std::error_code close() override { return {}; }
  ErrorOr<std::unique_ptr<MemoryBuffer>>
  getBuffer(const Twine &name, int64_t, bool needsNull, bool) override {
    SmallString<256> storage;
    return MemoryBuffer::getMemBuffer(file.text->getBuffer(),
                                      name.toStringRef(storage), needsNull);
  }

private:
  vfs::Status statusOfPath;
  const KnownFile &file;
};

} // namespace

ErrorOr<std::unique_ptr<vfs::File>>
KnownFiles::openFileForRead(const Twine &path) {
  static Table &table = *new Table; // beyond what is destroyed at exit
  auto status = ProxyFileSystem::status(path);
  if (!status || !table.mayKeep(*status))
    return ProxyFileSystem::openFileForRead(path);
  Table::Key key = Table::keyOf(path, *status);
  if (const KnownFile *known = table.find(key))
    return std::make_unique<OpenedFile>(*status, *known);
  if (!table.hasRoom())
    return ProxyFileSystem::openFileForRead(path);
  auto opened = ProxyFileSystem::openFileForRead(path);
  if (!opened)
    return opened;
  auto now = (*opened)->status();
  auto realName = (*opened)->getName();
  // Not mapped: others may cut it.
  auto text = (*opened)->getBuffer(path, /*FileSize=*/-1,
                                   /*RequiresNullTerminator=*/true,
                                   /*IsVolatile=*/true);
  if (now && realName && text && Table::keyOf(path, *now) == key &&
      (*text)->getBufferSize() == status->getSize())
    return std::make_unique<OpenedFile>(
        *status, *table.keep(key, {std::move(*realName), std::move(*text)}));
  return ProxyFileSystem::openFileForRead(path);
}
