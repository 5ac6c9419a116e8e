// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is made of text, on disk. There are two kinds of entries: a request (all
// that decides what is made, but for files) leads to the list of what was asked
// of the file system when it was last made; the request with the present
// answers to these questions leads to what was made. So nothing is made to find
// that nothing has changed, and it is found again when a file is changed back.

#ifndef PIKO_LIB_DRIVER_SOURCECACHE_H
#define PIKO_LIB_DRIVER_SOURCECACHE_H

#include "Cache/CompilerIdentity.h"
#include "Cache/DiskCache.h"
#include "Cache/SourceRecorder.h"

namespace piko {

/// Strings, each after its length.
class StringWriter {
public:
  StringWriter &add(llvm::StringRef string);
  std::string bytes;
};

/// Takes them apart again; empty where bytes are missing.
class StringReader {
public:
  explicit StringReader(llvm::StringRef bytes) : bytes(bytes) {}
  bool atEnd() const { return bytes.empty(); }
  std::string next();

private:
  llvm::StringRef bytes;
};

/// Adds what decides, besides its options, the files that it reads and the
/// folder that it runs in, what a part of the compiler makes: which one it is,
/// and its environment.
void addSurroundings(KeyBuilder &key, CompilerPart part);
/// Adds the folder from which relative paths begin.
void addFolder(KeyBuilder &key, llvm::vfs::FileSystem &files);

class SourceCache {
public:
  explicit SourceCache(const CacheOptions &options) : disk(options) {}

  bool isEnabled() const { return disk.isEnabled(); }
  const std::string &getDirectory() const { return disk.getDirectory(); }

  /// What was made of a request and of files with the text that they have now;
  /// null if nothing.
  std::unique_ptr<llvm::MemoryBuffer>
  lookUp(llvm::StringRef request, llvm::vfs::FileSystem &files) const;
  /// Keeps what was made while the recorder listened.
  llvm::Error keep(llvm::StringRef request, const SourceRecorder &recorder,
                   llvm::StringRef bytes) const;

private:
  DiskCache disk;
};

} // namespace piko

#endif // PIKO_LIB_DRIVER_SOURCECACHE_H
