// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Precompiled headers on disk, as long as no file that is in them changes.

#ifndef PIKO_LIB_DRIVER_HEADERCACHE_H
#define PIKO_LIB_DRIVER_HEADERCACHE_H

#include "Cache/SourceCache.h"
#include "Piko/Frontend/Frontend.h"

namespace piko {

/// Whether Clang looks for headers in folders that depend on the one it runs
/// in.
bool hasRelativeFolders(llvm::ArrayRef<std::string> arguments);

class HeaderCache : public HeaderStore {
public:
  explicit HeaderCache(const CacheOptions &options) : cache(options) {}

  std::unique_ptr<llvm::MemoryBuffer> get(llvm::ArrayRef<std::string> arguments,
                                          const Files &files,
                                          Maker make) override;

private:
  SourceCache cache;
};

} // namespace piko

#endif // PIKO_LIB_DRIVER_HEADERCACHE_H
