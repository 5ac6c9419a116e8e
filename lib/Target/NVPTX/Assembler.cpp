// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// ptxas, as a program that is run.

#include "Piko/Target/Assembler.h"

#include "llvm/ADT/Twine.h"
#include "llvm/Support/FileSystem.h"
#include "llvm/Support/MemoryBuffer.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/Program.h"
#include "llvm/Support/raw_ostream.h"

using namespace llvm;
using namespace piko;
namespace fs = llvm::sys::fs;

std::string piko::findAssembler() {
  constexpr StringLiteral name = "ptxas";
  if (auto found = sys::findProgramByName(name))
    return *found;
  const char *home = getenv("CUDA_HOME");
  for (StringRef folder :
       {StringRef(home ? home : ""), StringRef("/usr/local/cuda")}) {
    SmallString<128> bin(folder);
    sys::path::append(bin, "bin");
    if (auto found = sys::findProgramByName(name, {bin.str()});
        !folder.empty() && found)
      return *found;
  }
  return "";
}

std::string piko::getAssemblerIdentity(StringRef assembler) {
  fs::file_status status;
  if (fs::status(assembler, status))
    return "";
  auto time = status.getLastModificationTime().time_since_epoch().count();
  return (assembler + ":" + Twine(status.getSize()) + ":" + Twine(time)).str();
}

namespace {
/// A file that goes when this goes.
class TemporaryFile {
public:
  explicit TemporaryFile(StringRef suffix)
      : failed(fs::createTemporaryFile("piko", suffix, path)) {}
  TemporaryFile(const TemporaryFile &) = delete;
  TemporaryFile &operator=(const TemporaryFile &) = delete;
  ~TemporaryFile() {
    if (!failed)
      (void)fs::remove(path);
  }

  bool exists() const { return !failed; }
  StringRef getPath() const { return path; }
  std::string read() const {
    auto text = MemoryBuffer::getFile(path, /*IsText=*/false,
                                      /*RequiresNullTerminator=*/false);
    return text ? (*text)->getBuffer().str() : "";
  }
  /// False if the system does not take all of it.
  bool write(StringRef text) const {
    std::error_code wrong;
    raw_fd_ostream stream(path, wrong);
    stream << text;
    stream.close();
    bool isComplete = !wrong && !stream.has_error();
    stream.clear_error();
    return isComplete;
  }

private:
  SmallString<128> path;
  std::error_code failed;
};
} // namespace

Expected<Assembly> piko::assemble(StringRef assembler, StringRef ptx,
                                  StringRef chip,
                                  ArrayRef<std::string> kernels) {
  TemporaryFile input("ptx"), output("cubin"), printed("txt");
  if (!input.exists() || !output.exists() || !printed.exists())
    return createStringError("cannot make a temporary file");
  if (!input.write(ptx))
    return createStringError("cannot write '" + input.getPath() + "'");
  std::string architecture = ("-arch=" + chip).str(), failed;
  StringRef report = printed.getPath();
  SmallVector<StringRef> arguments = {
      assembler, "-v", architecture, "-o", output.getPath(), input.getPath()};
  for (const std::string &kernel : kernels)
    arguments.append({"-e", kernel});
  int result = sys::ExecuteAndWait(
      assembler, arguments, std::nullopt, {StringRef(), report, report},
      /*SecondsToWait=*/0, /*MemoryLimit=*/0, &failed);
  std::string text = printed.read();
  if (result != 0)
    return createStringError(
        assembler + " refuses the kernels: " +
        (failed.empty() ? StringRef(text).trim() : StringRef(failed)));
  return Assembly{output.read(), std::move(text)};
}

bool piko::knowsChip(StringRef assembler, StringRef chip) {
  std::string empty =
      (".version 6.0\n.target " + chip + "\n.address_size 64\n").str();
  Expected<Assembly> result = assemble(assembler, empty, chip);
  if (result)
    return true;
  consumeError(result.takeError());
  return false;
}
