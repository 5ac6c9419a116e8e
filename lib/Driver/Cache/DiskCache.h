// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bytes on disk by key, shared by processes. A reader finds a whole entry or
// none: entries are renamed into place and have a checksum. Nothing here is an
// error for whoever compiles; the worst is that nothing is kept.

#ifndef PIKO_LIB_DRIVER_DISKCACHE_H
#define PIKO_LIB_DRIVER_DISKCACHE_H

#include "Piko/Driver/Options.h"

#include "llvm/ADT/StringRef.h"
#include "llvm/Support/BLAKE3.h"
#include "llvm/Support/Error.h"
#include "llvm/Support/MemoryBuffer.h"

#include <string>

namespace piko {

/// A hash of strings one after the other, in which their boundaries count.
class KeyBuilder {
public:
  KeyBuilder &add(llvm::StringRef string);
  /// In hexadecimal digits.
  std::string finish();

private:
  llvm::BLAKE3 hasher;
};

class DiskCache {
public:
  /// Finds the folder; without one, or where the user wants none, nothing is
  /// found and nothing is kept.
  explicit DiskCache(const CacheOptions &options);

  bool isEnabled() const { return !directory.empty(); }
  const std::string &getDirectory() const { return directory; }

  /// The entry, or null if there is none that is whole. A zero follows it.
  std::unique_ptr<llvm::MemoryBuffer> read(llvm::StringRef key) const;
  llvm::Error write(llvm::StringRef key, llvm::StringRef bytes) const;
  /// Removes the entries that were not read for longest, down to the size that
  /// is allowed.
  void prune() const;

private:
  std::string getPath(llvm::StringRef key) const;

  std::string directory;
  uint64_t maxBytes;
};

} // namespace piko

#endif // PIKO_LIB_DRIVER_DISKCACHE_H
