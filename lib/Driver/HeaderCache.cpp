// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Precompiled headers on disk.

#include "HeaderCache.h"

#include "Piko/Driver/Compiler.h"

using namespace piko;

std::shared_ptr<HeaderStore>
piko::makeHeaderStore(const CacheOptions &options) {
  return std::make_shared<HeaderCache>(options);
}

/// What the header asks of `files` is asked, too, where it is found: a recorder
/// there then knows it.
std::optional<std::string>
HeaderCache::get(llvm::ArrayRef<std::string> arguments, const Files &files,
                 Maker make) {
  if (!cache.isEnabled())
    return std::nullopt;
  KeyBuilder key;
  key.add("header");
  addSurroundings(key, *files);
  for (const std::string &argument : arguments)
    key.add(argument);
  std::string request = key.finish();
  if (std::optional<std::string> header = cache.lookUp(request, *files))
    return header;
  auto recorder = llvm::makeIntrusiveRefCnt<SourceRecorder>(files);
  std::optional<std::string> header = make(recorder);
  // Where it cannot be kept it is made again.
  if (header)
    llvm::consumeError(cache.keep(request, *recorder, *header));
  return header;
}
