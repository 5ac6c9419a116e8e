// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Authored pipelines on disk.

#include "Cache/AuthoredCache.h"

#include "Cache/HeaderCache.h"
#include "Piko/Driver/Compiler.h"

#include "mlir/Bytecode/BytecodeWriter.h"
#include "mlir/IR/Diagnostics.h"
#include "mlir/Parser/Parser.h"
#include "llvm/Support/Path.h"

using namespace mlir;
using namespace piko;

/// Whether relative paths lead to what is read.
static bool dependsOnFolder(const CompileOptions &options) {
  std::vector<std::string> arguments;
  for (const std::string &folder : options.includeDirs)
    arguments.push_back("-I" + folder);
  return llvm::sys::path::is_relative(options.file) ||
         hasRelativeFolders(arguments);
}

/// All that decides what is read, but for the files.
static std::string makeRequest(const CompileOptions &options,
                               llvm::vfs::FileSystem &files) {
  KeyBuilder key;
  key.add("authored");
  addSurroundings(key, CompilerPart::Frontend);
  if (dependsOnFolder(options))
    addFolder(key, files);
  key.add(options.file).add(options.pipeName).add(getRuntimeIncludeDir());
  for (const auto *list : {&options.includeDirs, &options.defines}) {
    key.add(std::to_string(list->size()));
    for (const std::string &item : *list)
      key.add(item);
  }
  for (const auto &[name, value] : options.tunables)
    key.add(name).add(value);
  key.add(options.check.enabled ? "checked" : "");
  return key.finish();
}

static std::string write(ModuleOp module) {
  std::string bytes;
  llvm::raw_string_ostream stream(bytes);
  // Writing to a string fails only for versions that we do not ask for.
  (void)writeBytecodeToFile(module, stream);
  return bytes;
}

static OwningOpRef<ModuleOp> read(StringRef bytes, MLIRContext &context) {
  return parseSourceString<ModuleOp>(bytes, &context);
}

OwningOpRef<ModuleOp>
piko::findAuthored(const CompileOptions &options, MLIRContext &context,
                   llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files,
                   AuthoredMaker make) {
  SourceCache cache(options.cache);
  if (!cache.isEnabled() || !options.reusesAuthored)
    return make(files);
  std::string request = makeRequest(options, *files);
  if (std::unique_ptr<llvm::MemoryBuffer> found = cache.lookUp(request, *files))
    return read(found->getBuffer(), context);
  auto recorder = llvm::makeIntrusiveRefCnt<SourceRecorder>(files);
  bool isSilent = true;
  OwningOpRef<ModuleOp> module;
  {
    ScopedDiagnosticHandler handler(&context, [&](Diagnostic &) {
      isSilent = false;
      return failure();
    });
    module = make(recorder);
  }
  if (!module || !isSilent)
    return module;
  std::string bytes = write(*module);
  // Where it cannot be kept it is made again.
  llvm::consumeError(cache.keep(request, *recorder, bytes));
  // What is found later is what is read of it now.
  return read(bytes, context);
}
