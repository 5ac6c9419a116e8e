// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "OutputFiles.h"

#include "llvm/Support/raw_ostream.h"

using namespace llvm;
using namespace piko;
namespace fs = llvm::sys::fs;

static Error cannotWrite(StringRef path, std::error_code code) {
  return createStringError("cannot write '" + path + "': " + code.message());
}

static Error writeAll(StringRef path, int descriptor, StringRef text) {
  raw_fd_ostream stream(descriptor, /*shouldClose=*/false);
  stream << text;
  stream.flush();
  std::error_code code = stream.error();
  stream.clear_error();
  return code ? cannotWrite(path, code) : Error::success();
}

OutputFiles::~OutputFiles() {
  for (Pending &output : pending)
    consumeError(output.file.discard());
}

Error OutputFiles::add(StringRef path, StringRef text) {
  fs::file_status status;
  bool exists = path != "-" && !fs::status(path, status);
  if (exists && fs::is_directory(status))
    return cannotWrite(path, std::make_error_code(std::errc::is_a_directory));
  if (path == "-" || (exists && !fs::is_regular_file(status))) {
    direct.push_back({path.str(), text.str()});
    return Error::success();
  }
  auto file =
      fs::TempFile::create(path + ".%%%%%%%%", fs::all_read | fs::all_write);
  if (!file)
    return cannotWrite(path, errorToErrorCode(file.takeError()));
  pending.push_back({path.str(), std::move(*file)});
  return writeAll(path, pending.back().file.FD, text);
}

Error OutputFiles::keep() {
  for (const Direct &output : direct) {
    int descriptor = 1;
    if (output.path != "-")
      if (std::error_code code = fs::openFileForWrite(output.path, descriptor))
        return cannotWrite(output.path, code);
    if (Error error = writeAll(output.path, descriptor, output.text))
      return error;
  }
  while (!pending.empty()) {
    Pending output = std::move(pending.back());
    pending.pop_back();
    if (Error error = output.file.keep(output.path))
      return cannotWrite(output.path, errorToErrorCode(std::move(error)));
  }
  return Error::success();
}

/// A name as make and ninja read it.
static std::string quote(StringRef name) {
  std::string quoted;
  for (char c : name) {
    if (c == ' ' || c == '#')
      quoted += '\\';
    if (c == '$')
      quoted += '$';
    quoted += c;
  }
  return quoted;
}

std::string piko::writeDependencies(ArrayRef<std::string> targets,
                                    ArrayRef<std::string> files) {
  std::string text;
  for (const std::string &target : targets)
    text += (text.empty() ? "" : " ") + quote(target);
  text += ":";
  for (const std::string &file : files)
    text += " \\\n  " + quote(file);
  return text + "\n";
}
