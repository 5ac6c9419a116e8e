// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bytes on disk by key, shared by processes.

#include "Cache/DiskCache.h"

#include "Piko/Frontend/BufferTail.h"
#include "Piko/Support/OutputFile.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/CachePruning.h"
#include "llvm/Support/FileSystem.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/Process.h"

#include <sys/mman.h>

using namespace llvm;
using namespace piko;
namespace fs = llvm::sys::fs;

static constexpr StringLiteral magic = "piko cache 1\n";
static constexpr uint64_t defaultMaxBytes = uint64_t(512) << 20;

KeyBuilder &KeyBuilder::add(StringRef string) {
  hasher.update(std::to_string(string.size()) + ":");
  hasher.update(string);
  return *this;
}

std::string KeyBuilder::finish() {
  return toHex(hasher.final(), /*LowerCase=*/true);
}

static std::string getEnvironment(const char *name) {
  return sys::Process::GetEnv(name).value_or("");
}

static std::string findDirectory(const CacheOptions &options) {
  if (!options.enabled)
    return "";
  if (!options.directory.empty())
    return options.directory;
  if (std::string own = getEnvironment("PIKO_CACHE_DIR"); !own.empty())
    return own;
  SmallString<128> path;
  if (std::string shared = getEnvironment("XDG_CACHE_HOME");
      sys::path::is_absolute(shared))
    sys::path::append(path, shared, "piko");
  else if (std::string home = getEnvironment("HOME"); !home.empty())
    sys::path::append(path, home, ".cache", "piko");
  return std::string(path);
}

static uint64_t findMaxBytes(const CacheOptions &options) {
  if (options.maxBytes)
    return options.maxBytes;
  uint64_t bytes;
  if (to_integer(getEnvironment("PIKO_CACHE_SIZE"), bytes) && bytes)
    return bytes;
  return defaultMaxBytes;
}

DiskCache::DiskCache(const CacheOptions &options)
    : directory(findDirectory(options)), maxBytes(findMaxBytes(options)) {}

std::string DiskCache::getPath(StringRef key) const {
  SmallString<128> path(directory);
  // LLVM prunes only files whose names begin so.
  sys::path::append(path, "llvmcache-" + key);
  return std::string(path);
}

namespace {

/// A file in memory of its own: a mapped one could change, or end, while it is
/// read. The pages are had at once, as a fault for each of a precompiled
/// header's would take a tenth of a small pipeline's time.
class FileCopy : public MemoryBuffer {
public:
  explicit FileCopy(fs::file_t file, size_t size)
      : reserved(size + 1), // and a zero
        memory(
            static_cast<char *>(mmap(nullptr, reserved, PROT_READ | PROT_WRITE,
                                     MAP_PRIVATE | MAP_ANONYMOUS, -1, 0))) {
    if (memory == MAP_FAILED) {
      StringRef none("");
      init(none.begin(), none.end(), /*RequiresNullTerminator=*/true);
      return;
    }
    madvise(memory, reserved, MADV_HUGEPAGE);
    madvise(memory, reserved, MADV_POPULATE_WRITE);
    size_t done = readWhole(file, size);
    init(memory, memory + done, /*RequiresNullTerminator=*/true);
  }
  FileCopy(const FileCopy &) = delete;
  FileCopy &operator=(const FileCopy &) = delete;
  ~FileCopy() override {
    if (memory != MAP_FAILED)
      munmap(memory, reserved);
  }

  BufferKind getBufferKind() const override { return MemoryBuffer_Malloc; }

private:
  /// Up to its end, if that comes first.
  size_t readWhole(fs::file_t file, size_t size) {
    size_t done = 0;
    while (done < size) {
      Expected<size_t> read = fs::readNativeFile(
          file, MutableArrayRef<char>(memory + done, size - done));
      if (!read)
        consumeError(read.takeError());
      if (!read || *read == 0)
        break;
      done += *read;
    }
    return done;
  }

  size_t reserved;
  char *memory;
};

} // namespace

std::unique_ptr<MemoryBuffer> DiskCache::read(StringRef key) const {
  if (!isEnabled())
    return nullptr;
  Expected<fs::file_t> file = fs::openNativeFileForRead(getPath(key));
  if (!file) {
    consumeError(file.takeError());
    return nullptr;
  }
  std::unique_ptr<MemoryBuffer> buffer;
  fs::file_status status;
  if (!fs::status(*file, status))
    buffer = std::make_unique<FileCopy>(*file, status.getSize());
  // Where it is not ours to touch, it only seems older than it is.
  (void)fs::setLastAccessAndModificationTime(*file,
                                             std::chrono::system_clock::now());
  (void)fs::closeFile(*file);
  if (!buffer)
    return nullptr;
  StringRef bytes = buffer->getBuffer();
  if (!bytes.consume_front(magic) || bytes.size() < 32)
    return nullptr;
  StringRef sum = bytes.take_front(32);
  bytes = bytes.drop_front(32);
  if (toStringRef(BLAKE3::hash(arrayRefFromStringRef(bytes))) != sum)
    return nullptr;
  return dropFront(std::move(buffer), magic.size() + sum.size());
}

Error DiskCache::write(StringRef key, StringRef bytes) const {
  if (!isEnabled())
    return Error::success();
  if (std::error_code code = fs::create_directories(directory))
    return errorCodeToError(code);
  // LLVM's temporary files would take over the signals of the host.
  std::string content = magic.str();
  content += toStringRef(BLAKE3::hash(arrayRefFromStringRef(bytes)));
  content += bytes;
  if (auto done = support::replaceFile(getPath(key), content); !done)
    return createStringError(done.error().message);
  return Error::success();
}

void DiskCache::prune() const {
  if (!isEnabled())
    return;
  CachePruningPolicy policy;
  policy.Interval = std::chrono::seconds(0);   // look now
  policy.Expiration = std::chrono::seconds(0); // age alone is no reason
  policy.MaxSizePercentageOfAvailableSpace = 100;
  policy.MaxSizeBytes = maxBytes;
  pruneCache(directory, policy);
}
