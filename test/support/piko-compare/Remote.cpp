// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Remote.h"

#include "Piko/Replay/OutcomeText.h"

#include "llvm/Support/FileSystem.h"
#include "llvm/Support/MemoryBuffer.h"
#include "llvm/Support/Program.h"

#include <fstream>
#include <stdexcept>

using namespace piko;
using replay::Outcome;

WorkFolder::WorkFolder() {
  llvm::SmallString<128> made;
  if (std::error_code error =
          llvm::sys::fs::createUniqueDirectory("piko-compare", made))
    throw std::runtime_error("cannot make a folder: " + error.message());
  path = made.str();
}

WorkFolder::~WorkFolder() { llvm::sys::fs::remove_directories(path); }

static std::string readFile(const std::string &path) {
  auto file = llvm::MemoryBuffer::getFile(path);
  return file ? (*file)->getBuffer().str() : "";
}

/// Runs a command with its output in a file. Throws with what it says of errors.
static void call(const std::vector<std::string> &words,
                 const std::string &output, const std::string &errors) {
  llvm::ErrorOr<std::string> program =
      llvm::sys::findProgramByName(words.front());
  if (!program)
    throw std::runtime_error("cannot find '" + words.front() + "'");
  llvm::SmallVector<llvm::StringRef> arguments(words.begin(), words.end());
  std::optional<llvm::StringRef> redirects[] = {
      std::nullopt, llvm::StringRef(output), llvm::StringRef(errors)};
  std::string why;
  int status = llvm::sys::ExecuteAndWait(*program, arguments, std::nullopt,
                                         redirects, 0, 0, &why);
  if (status != 0)
    throw std::runtime_error("'" + words.front() + "' ended with status " +
                             std::to_string(status) + ": " + why +
                             readFile(errors));
}

std::vector<Outcome> runRemotely(const std::vector<std::string> &runner,
                                 const std::string &code,
                                 const std::string &pipe,
                                 const std::string &capture,
                                 const std::vector<int> &threads) {
  WorkFolder folder;
  std::string object = folder / "pipeline.o", library = folder / "pipeline.so",
              output = folder / "outcomes", errors = folder / "errors";
  std::ofstream(object, std::ios::binary) << code;
  // What it calls is in the program that loads it.
  call({PIKO_LLVM_PREFIX "/bin/ld.lld", "-shared", object, "-o", library},
       output, errors);
  std::vector<std::string> words = runner;
  words.insert(words.end(), {library, pipe, capture});
  for (int count : threads)
    words.push_back(std::to_string(count));
  call(words, output, errors);
  auto outcomes = replay::readOutcomes(readFile(output));
  if (!outcomes || outcomes->size() != threads.size())
    throw std::runtime_error("expected what " + std::to_string(threads.size()) +
                             " runs left from '" + runner.back() + "'");
  return std::move(*outcomes);
}
