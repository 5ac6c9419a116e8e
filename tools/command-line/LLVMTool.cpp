//===- LLVMTool.cpp - Files and options of LLVM's kind --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/LLVMTool.h"

#include "Piko/CommandLine/Messages.h"
#include "Piko/Support/OutputFile.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/MemoryBuffer.h"
#include "llvm/Support/raw_ostream.h"

#include <sys/mman.h>
#include <unistd.h>

using namespace piko;

/// What a function writes to the standard error, where parts of LLVM write
/// directly.
static std::string captureErrors(llvm::function_ref<void()> function) {
  int file = memfd_create("errors", MFD_CLOEXEC), before = dup(STDERR_FILENO);
  bool isCaught = file >= 0 && before >= 0 && dup2(file, STDERR_FILENO) >= 0;
  function();
  std::string said;
  if (isCaught) {
    dup2(before, STDERR_FILENO);
    lseek(file, 0, SEEK_SET);
    char chunk[4096];
    for (ssize_t count; (count = read(file, chunk, sizeof chunk)) > 0;)
      said.append(chunk, size_t(count));
  }
  for (int descriptor : {file, before})
    if (descriptor >= 0)
      close(descriptor);
  return said;
}

bool LLVMTool::parseOptions(int argc, const char *const *argv,
                            llvm::StringRef overview) const {
  bool isRight = false;
  std::string said = captureErrors([&] {
    isRight =
        llvm::cl::ParseCommandLineOptions(argc, argv, overview, &llvm::errs());
  });
  if (isRight)
    return true;
  std::vector<std::string> options;
  for (const auto &entry : llvm::cl::getRegisteredOptions())
    options.push_back("--" + entry.first.str());
  // A word that it does not know LLVM may take for several of one letter each.
  for (llvm::StringRef word : llvm::ArrayRef(argv + 1, size_t(argc) - 1))
    if (word.starts_with("--") &&
        !llvm::is_contained(options, word.split('=').first))
      return fail(rewordProblem(
          name, "Unknown command line argument '" + word.str() + "'.",
          options));
  return fail(rewordProblem(name, said, options));
}

std::unique_ptr<llvm::MemoryBuffer>
LLVMTool::open(const std::string &path) const {
  auto file = llvm::MemoryBuffer::getFileOrSTDIN(path);
  if (file)
    return std::move(*file);
  fail("cannot open input file '" + path + "': " + file.getError().message());
  return nullptr;
}

bool LLVMTool::write(const std::string &path, llvm::StringRef content) const {
  auto done = support::writeFile(path, content);
  return done || fail(done.error().message);
}

bool LLVMTool::fail(llvm::StringRef message) const {
  llvm::errs() << name << ": error: " << message << "\n";
  return false;
}
