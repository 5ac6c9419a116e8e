// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Precompiled headers on disk.

#include "Cache/HeaderCache.h"

#include "Piko/Driver/Compiler.h"

#include "llvm/Support/Path.h"
#include "llvm/Support/Process.h"

using namespace piko;

std::shared_ptr<HeaderStore>
piko::makeHeaderStore(const CacheOptions &options) {
  return std::make_shared<HeaderCache>(options);
}

bool piko::hasRelativeFolders(llvm::ArrayRef<std::string> arguments) {
  auto isRelative = [](llvm::StringRef path) {
    return llvm::sys::path::is_relative(path);
  };
  for (size_t i = 0; i < arguments.size(); ++i) {
    llvm::StringRef argument = arguments[i];
    if (argument.consume_front("-I") && isRelative(argument))
      return true;
    if ((argument == "-isystem" || argument == "-resource-dir") &&
        i + 1 < arguments.size() && isRelative(arguments[i + 1]))
      return true;
  }
  for (const char *name : {"CPATH", "CPLUS_INCLUDE_PATH"}) {
    llvm::SmallVector<llvm::StringRef> folders;
    std::string value = llvm::sys::Process::GetEnv(name).value_or("");
    llvm::StringRef(value).split(folders, ':');
    if (!value.empty() && llvm::any_of(folders, isRelative))
      return true;
  }
  return false;
}

/// What the header asks of `files` is asked, too, where it is found: a recorder
/// there then knows it.
std::unique_ptr<llvm::MemoryBuffer>
HeaderCache::get(llvm::ArrayRef<std::string> arguments, const Files &files,
                 Maker make) {
  if (!cache.isEnabled())
    return nullptr;
  KeyBuilder key;
  key.add("header");
  addSurroundings(key, CompilerPart::Clang);
  // Else one header serves all folders.
  if (hasRelativeFolders(arguments))
    addFolder(key, *files);
  for (const std::string &argument : arguments)
    key.add(argument);
  std::string request = key.finish();
  if (auto header = cache.lookUp(request, *files))
    return header;
  auto recorder = llvm::makeIntrusiveRefCnt<SourceRecorder>(files);
  std::optional<std::string> header = make(recorder);
  // Where it cannot be kept it is made again.
  if (!header)
    return nullptr;
  llvm::consumeError(cache.keep(request, *recorder, *header));
  return llvm::MemoryBuffer::getMemBufferCopy(*header);
}
